//! Materials: glTF's metallic-roughness model and its extensions.

use gltf::json;
use gltf::json::extensions::material::Material as Extensions;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use restir_shared::num;
use serde_json::Value;

use super::texture::Slot;
use super::{Importer, Problem, label};
use crate::scene::{Material, TextureUse, Volume};

/// Index of refraction of a material that names none.
const DEFAULT_IOR: f32 = 1.5;

/// The least share of light that an interior may leave: no share at all would be an infinite density.
const LEAST_ATTENUATION: f32 = 1e-6;

/// What a material asks of the vertices of its meshes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Needs {
    /// The set of texture coordinates that its textures lie on.
    pub(super) uv_set: Option<u32>,
    /// Tangents, for a normal map.
    pub(super) tangents: bool,
}

/// Members of an extension that the `gltf` crate does not know.
struct Members<'a>(&'a Value);

impl Members<'_> {
    fn number(&self, name: &str, default: f32) -> f32 {
        self.0.get(name).and_then(Value::as_f64).map_or(default, |number| number as f32)
    }

    fn color(&self, name: &str) -> [f32; 3] {
        let color = self.0.get(name).and_then(Value::as_array);
        let channel = |i: usize| color.and_then(|channels| channels.get(i)?.as_f64()).map_or(1.0, |x| x as f32);
        [0, 1, 2].map(channel)
    }

    fn has(&self, name: &str) -> bool {
        self.0.get(name).is_some()
    }
}

impl Importer<'_> {
    /// Adds all materials of the file, in its order.
    pub(super) fn add_materials(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        for (index, material) in root.materials.iter().enumerate() {
            let name = label(material.name.as_ref(), "material", index);
            let (converted, needs) =
                self.converted(name.clone(), material).map_err(|problem| format!("material {name}: {problem}"))?;
            self.scene.materials.push(converted);
            self.needs.push(needs);
        }
        Ok(())
    }

    /// Index of the material of a primitive that names none, glTF's default: a white and rough metal.
    pub(super) fn default_material(&mut self) -> usize {
        let first_own = self.document.root.materials.len();
        if self.scene.materials.len() == first_own {
            let white = Material::diffuse("default", [1.0; 3]);
            self.scene.materials.push(Material { metallic: 1.0, ior: DEFAULT_IOR, ..white });
            self.needs.push(Needs::default());
        }
        first_own
    }

    fn converted(&mut self, name: String, material: &json::Material) -> Result<(Material, Needs), Problem> {
        let surface = &material.pbr_metallic_roughness;
        let normal = material.normal_texture.as_ref();
        let slots = [
            surface.base_color_texture.as_ref().map(Slot::from),
            surface.metallic_roughness_texture.as_ref().map(Slot::from),
            normal.map(Slot::from),
            material.emissive_texture.as_ref().map(Slot::from),
        ];
        let needs = Needs { uv_set: self.uv_set(&name, &slots), tangents: normal.is_some() };
        let [base_color_texture, metallic_roughness_texture, normal_texture, emission_texture] =
            self.texture_uses(&slots)?;
        let [r, g, b, _alpha] = surface.base_color_factor.0;
        let mut converted = Material {
            base_color: self.unit(&name, "base colour factor", [r, g, b]),
            base_color_texture,
            metallic: self.unit(&name, "metallic factor", [surface.metallic_factor.0])[0],
            roughness: self.unit(&name, "roughness factor", [surface.roughness_factor.0])[0],
            metallic_roughness_texture,
            normal_texture,
            normal_scale: normal.map_or(1.0, |normal| normal.scale),
            emission: material.emissive_factor.0,
            emission_texture,
            ior: DEFAULT_IOR,
            ..Material::diffuse(name, [0.0; 3])
        };
        if let Some(extensions) = &material.extensions {
            self.extend(&mut converted, extensions);
        }
        // A black surface emits on neither side.
        converted.two_sided_emission = material.double_sided && converted.emission != [0.0; 3];
        if material.alpha_mode != Checked::Valid(AlphaMode::Opaque) {
            self.warn_of(&converted.name, "it is transparent; it is rendered as opaque");
        }
        check(&converted)?;
        Ok((converted, needs))
    }

    fn texture_uses(&mut self, slots: &[Option<Slot>; 4]) -> Result<[Option<TextureUse>; 4], Problem> {
        let mut uses = [None; 4];
        for (texture_use, slot) in uses.iter_mut().zip(slots) {
            *texture_use = slot.as_ref().map(|slot| self.texture_use(slot)).transpose()?;
        }
        Ok(uses)
    }

    /// The texture coordinates of the first texture; a mesh has one set.
    fn uv_set(&mut self, name: &str, slots: &[Option<Slot>]) -> Option<u32> {
        let mut sets = slots.iter().flatten().map(|slot| slot.uv_set);
        let first = sets.next()?;
        if sets.any(|set| set != first) {
            self.warn_of(
                name,
                &format!("its textures lie on several sets of texture coordinates; set {first} is used"),
            );
        }
        Some(first)
    }

    fn extend(&mut self, material: &mut Material, extensions: &Extensions) {
        let name = material.name.clone();
        if let Some(strength) = &extensions.emissive_strength {
            material.emission = material.emission.map(|channel| channel * strength.emissive_strength.0);
        }
        if let Some(transmission) = &extensions.transmission {
            material.transmission = self.unit(&name, "transmission factor", [transmission.transmission_factor.0])[0];
            self.warn_if(transmission.transmission_texture.is_some(), &name, "its transmission texture is ignored");
        }
        if let Some(members) = extensions.others.get("KHR_materials_diffuse_transmission").map(Members) {
            let factor = members.number("diffuseTransmissionFactor", 0.0);
            material.diffuse_transmission = self.unit(&name, "diffuse transmission factor", [factor])[0];
            let color = members.color("diffuseTransmissionColorFactor");
            material.diffuse_transmission_color = self.unit(&name, "diffuse transmission colour", color);
            let textured = members.has("diffuseTransmissionTexture") | members.has("diffuseTransmissionColorTexture");
            self.warn_if(textured, &name, "its textures of diffuse transmission are ignored");
        }
        if let Some(volume) = &extensions.volume {
            self.warn_if(volume.thickness_texture.is_some(), &name, "its thickness texture is ignored");
            material.volume = (volume.thickness_factor.0 > 0.0).then(|| self.volume(&name, volume));
        }
        if let Some(ior) = &extensions.ior {
            self.set_ior(material, ior.ior.0);
        }
    }

    fn volume(&mut self, name: &str, volume: &json::extensions::material::Volume) -> Volume {
        let color = volume.attenuation_color.0;
        let attenuation_color = color.map(|channel| num::clamp(channel, LEAST_ATTENUATION, 1.0));
        self.warn_if(
            attenuation_color != color,
            name,
            &format!("its attenuation colour is not within {LEAST_ATTENUATION:e} and 1 and was clamped"),
        );
        Volume { attenuation_color, attenuation_distance: volume.attenuation_distance.0 }
    }

    /// An index of 0 stands for a Fresnel reflectance of 1 (`KHR_materials_ior`): a white mirror, as rough as the
    /// material, where it is no metal.
    fn set_ior(&mut self, material: &mut Material, ior: f32) {
        if ior == 0.0 {
            let metallic = material.metallic;
            material.base_color = material.base_color.map(|channel| 1.0 + (channel - 1.0) * metallic);
            if metallic == 0.0 {
                material.base_color_texture = None;
            }
            material.metallic = 1.0;
            self.warn_of(&material.name, "its index of refraction is 0; it is rendered as a white metal");
            return;
        }
        material.ior = ior.max(1.0);
        self.warn_if(ior < 1.0, &material.name, "its index of refraction is less than 1 and was raised to 1");
    }

    /// Factors within 0 and 1.
    fn unit<const N: usize>(&mut self, name: &str, what: &str, factors: [f32; N]) -> [f32; N] {
        let inside = factors.iter().all(|factor| (0.0..=1.0).contains(factor));
        self.warn_if(!inside, name, &format!("its {what} is not within 0 and 1 and was clamped"));
        factors.map(|factor| num::clamp(factor, 0.0, 1.0))
    }

    fn warn_if(&mut self, condition: bool, material: &str, what: &str) {
        if condition {
            self.warn_of(material, what);
        }
    }

    fn warn_of(&mut self, material: &str, what: &str) {
        self.warn(format!("material {material}: {what}"));
    }
}

/// What no clamping can correct.
fn check(material: &Material) -> Result<(), Problem> {
    let Material { emission, ior, normal_scale, volume, .. } = material;
    if !emission.iter().all(|channel| channel.is_finite() && *channel >= 0.0) {
        return Err(format!("it emits {emission:?}, which is not a radiance"));
    }
    if !ior.is_finite() {
        return Err(format!("its index of refraction is {ior}"));
    }
    if !normal_scale.is_finite() {
        return Err(format!("the scale of its normal texture is {normal_scale}"));
    }
    match volume {
        Some(volume) if volume.attenuation_distance.is_nan() || volume.attenuation_distance <= 0.0 => {
            Err(format!("its attenuation distance is {}; it has to be positive", volume.attenuation_distance))
        }
        _ => Ok(()),
    }
}
