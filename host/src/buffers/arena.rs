//! The attribute arena, word by word as in [`restir_shared::layout`].

use super::{environment::EnvironmentMap, lights::LightTables, lit, texels::Texels};
use crate::scene::{AlphaMode, Filter, Light, LightKind, Material, Scene, TextureUse, UvSet, Volume, Wrap};
use glam::{DVec3, Vec3};
use restir_shared::layout::{
    ALIAS_WORDS, ENVIRONMENT_WORDS, INTERIOR_WORDS, LIGHT_WORDS, MATERIAL_TWO_SIDED_EMISSION, MATERIAL_VOLUME,
    MATERIAL_WORDS, NONE, PUNCTUAL_DIRECTIONAL, PUNCTUAL_POINT, PUNCTUAL_WORDS, SLOT_BASE_COLOR, SLOT_EMISSION,
    SLOT_SCATTERING_COLOR, SLOT_SPECULAR_COLOR, SceneHeader, TEXTURE_FINE, TEXTURE_MIRROR_U, TEXTURE_MIRROR_V,
    TEXTURE_NEAREST, TEXTURE_REPEAT_U, TEXTURE_REPEAT_V, TEXTURE_SECOND_UVS, TEXTURE_SRGB,
};
use restir_shared::medium::Medium;
use restir_shared::num::flush;
use restir_shared::sampling::henyey_greenstein_scale;

/// Smallest difference of cosines over which a spot light's edge falls off, as glTF has it.
const MIN_FALLOFF: f64 = 0.001;

/// The attribute arena.
pub(super) struct Attributes {
    pub(super) words: Vec<u32>,
    /// Where its tables begin; nothing else is set.
    pub(super) header: SceneHeader,
}

/// Magnitudes below 2^-100 are zero in the arenas, see DETERMINISM.md.
pub(super) fn float_word(v: Vec3, w: u32) -> [u32; 4] {
    let bits = |x| flush(x).to_bits();
    [bits(v.x), bits(v.y), bits(v.z), w]
}

fn rgb_word(rgb: [f32; 3], w: f32) -> [u32; 4] {
    float_word(Vec3::from_array(rgb), flush(w).to_bits())
}

impl Attributes {
    pub(super) fn new(
        scene: &Scene,
        tables: &LightTables,
        texels: &Texels,
        environment: Option<&EnvironmentMap>,
        around: &[u32],
    ) -> Self {
        let absent = SceneHeader { alias_base: NONE, environment_base: NONE, ..SceneHeader::default() };
        let mut attributes = Self { words: Vec::new(), header: absent };
        attributes.add_materials(scene, texels, around);
        attributes.header.light_base = attributes.next_word();
        attributes
            .extend(tables.lights.iter().map(|l| [l.index, l.density.to_bits(), l.kind, (l.area as f32).to_bits()]));
        const { assert!(LIGHT_WORDS == 1 && ALIAS_WORDS == 1) };
        if let Some(alias) = &tables.alias {
            attributes.header.alias_base = attributes.next_word();
            attributes.extend(alias.iter().map(|entry| [entry.threshold.to_bits(), entry.alias, 0, 0]));
        }
        attributes.header.punctual_base = attributes.next_word();
        attributes.extend(scene.lights.iter().flat_map(punctual));
        if let Some(map) = environment {
            attributes.header.environment_base = attributes.next_word();
            let [pixels, rows] = texels.environment;
            let probability = tables.environment_probability().to_bits();
            let record: [[u32; 4]; ENVIRONMENT_WORDS as usize] =
                [[pixels, map.size[0], map.size[1], rows], [map.rotation.to_bits(), probability, 0, 0]];
            attributes.extend(record);
        }
        attributes
    }

    fn next_word(&self) -> u32 {
        (self.words.len() / 4) as u32
    }

    fn extend(&mut self, words: impl IntoIterator<Item = [u32; 4]>) {
        self.words.extend(words.into_iter().flatten());
    }

    /// Materials, then the texture uses and the interiors of those that have any.
    fn add_materials(&mut self, scene: &Scene, texels: &Texels, around: &[u32]) {
        let first = scene.materials.len() as u32 * MATERIAL_WORDS;
        let mut records = Vec::new();
        let lit = lit::materials(scene);
        for (index, material) in scene.materials.iter().enumerate() {
            let slots = material.textures();
            let textured = slots.iter().flatten().any(|used| texels.textures[used.texture] != NONE);
            let uses = if textured { first + records.len() as u32 } else { NONE };
            if textured {
                records.extend(
                    (0..)
                        .zip(slots)
                        .flat_map(|(slot, used)| texture_use(scene, texels, SRGB_SLOTS.contains(&slot), used)),
                );
            }
            let scattering = material.volume.filter(Volume::scatters);
            let interior = if scattering.is_some() { first + records.len() as u32 } else { 0 };
            if let Some(volume) = &scattering {
                let slots = volume.textures();
                let textured = slots.iter().flatten().any(|used| texels.textures[used.texture] != NONE);
                let uses = if textured { interior + INTERIOR_WORDS } else { NONE };
                let clear = lit::is_clear(scene, index, around);
                records.extend(interior_record(volume, uses, lit[index], clear));
                let used = (0..).zip(slots).filter(|_| textured);
                records.extend(
                    used.flat_map(|(slot, used)| texture_use(scene, texels, slot == SLOT_SCATTERING_COLOR, used)),
                );
            }
            self.extend(material_record(material, texels.alpha_flags(material), uses, [interior, around[index]]));
        }
        self.extend(records);
    }
}

/// Of an interior with textures the colour, of another one the albedo and what is absorbed.
fn interior_record(volume: &Volume, uses: u32, lit: bool, clear: bool) -> [[u32; 4]; INTERIOR_WORDS as usize] {
    let medium = volume.medium().unwrap_or(Medium::of_color(Vec3::ZERO, Vec3::ONE, 0.0));
    let (denser_outside, color) =
        volume.scattering.map_or((1.0, [0.0; 3]), |scattering| (scattering.denser_outside, scattering.color));
    let scattered = if uses == NONE { medium.albedo.to_array() } else { color };
    [
        rgb_word(scattered, medium.anisotropy),
        [
            if clear { 0.0 } else { denser_outside }.to_bits(),
            uses,
            u32::from(lit | clear),
            henyey_greenstein_scale(medium.anisotropy).to_bits(),
        ],
        float_word(medium.absorbed, 0),
    ]
}

fn material_record(
    m: &Material,
    alpha_flags: u32,
    uses: u32,
    [interior, around]: [u32; 2],
) -> [[u32; 4]; MATERIAL_WORDS as usize] {
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let flags = alpha_flags
        | flag(m.two_sided_emission, MATERIAL_TWO_SIDED_EMISSION)
        | flag(m.volume.is_some(), MATERIAL_VOLUME);
    let cutoff = if let AlphaMode::Mask { cutoff } = m.alpha_mode { cutoff } else { 0.0 };
    [
        float_word(Vec3::from_array(m.base_color), flags),
        float_word(Vec3::from_array(m.emission), uses),
        rgb_word([m.metallic, m.roughness, m.ior], m.transmission),
        rgb_word(m.diffuse_transmission_color, m.diffuse_transmission),
        rgb_word(m.volume.map_or([0.0; 3], |volume| volume.extinction()), m.normal_scale),
        [flush(m.alpha).to_bits(), flush(cutoff).to_bits(), interior, around],
        rgb_word(m.specular_color, m.specular),
    ]
}

/// Slots of a surface whose colours are sRGB.
const SRGB_SLOTS: [u32; 3] = [SLOT_BASE_COLOR, SLOT_EMISSION, SLOT_SPECULAR_COLOR];

fn texture_use(scene: &Scene, texels: &Texels, srgb: bool, used: Option<&TextureUse>) -> [[u32; 4]; 3] {
    let Some(used) = used else { return [[NONE, 0, 0, 0], [0; 4], [0; 4]] };
    let texture = &scene.textures[used.texture];
    let wrap = |wrap: Wrap, repeat: u32, mirror: u32| match wrap {
        Wrap::Repeat => repeat,
        Wrap::Mirror => mirror,
        Wrap::Clamp => 0,
    };
    let flags = wrap(texture.wrap[0], TEXTURE_REPEAT_U, TEXTURE_MIRROR_U)
        | wrap(texture.wrap[1], TEXTURE_REPEAT_V, TEXTURE_MIRROR_V)
        | if texture.filter == Filter::Nearest { TEXTURE_NEAREST } else { 0 }
        | if srgb { TEXTURE_SRGB } else { 0 }
        | if used.uv_set == UvSet::Second { TEXTURE_SECOND_UVS } else { 0 }
        | if texture.texels.is_fine() { TEXTURE_FINE } else { 0 };
    let [a, b, c, d, e, f] = used.transform;
    [
        [texels.textures[used.texture], texture.size[0], texture.size[1], flags],
        rgb_word([a, b, c], 0.0),
        rgb_word([d, e, f], 0.0),
    ]
}

fn punctual(light: &Light) -> [[u32; 4]; PUNCTUAL_WORDS as usize] {
    let single = |v: DVec3| Vec3::from_array(v.to_array().map(|x| x as f32));
    let (position, direction, kind, [scale, offset]) = match light.kind {
        LightKind::Point { position } => (position, DVec3::Z, PUNCTUAL_POINT, [0.0, 1.0]),
        LightKind::Spot { position, direction, inner, outer } => {
            let scale = 1.0 / (inner.cos() - outer.cos()).max(MIN_FALLOFF);
            (position, direction.normalize(), PUNCTUAL_POINT, [scale, -outer.cos() * scale])
        }
        LightKind::Directional { direction } => (DVec3::ZERO, direction.normalize(), PUNCTUAL_DIRECTIONAL, [0.0, 1.0]),
    };
    [
        float_word(single(position), kind),
        float_word(single(direction), (scale as f32).to_bits()),
        rgb_word(light.intensity, offset as f32),
    ]
}
