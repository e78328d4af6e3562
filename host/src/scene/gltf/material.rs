//! Materials: glTF's metallic-roughness model and its extensions.

use std::collections::BTreeSet;

use gltf::json;
use gltf::json::extensions::material::Material as Extensions;
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::validation::Checked;
use restir_shared::medium::MAX_ANISOTROPY;
use restir_shared::num;
use serde::Deserialize;

use super::exact::denser_outside;
use super::texture::{Slot, UvSets};
use super::{Importer, Problem, SCATTER, VOLUME_SCATTER, label};
use crate::error::ensure;
use crate::scene::{AlphaMode, Material, Volume, VolumeScattering};

/// Index of refraction of a material that names none.
const DEFAULT_IOR: f32 = 1.5;

/// Cutoff of a mask that names none.
const DEFAULT_CUTOFF: f32 = 0.5;

/// The least share of light that an interior may leave: no share at all would be an infinite density.
const LEAST_ATTENUATION: f32 = 1e-6;

/// What a material asks of the vertices of its meshes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Needs {
    /// The sets of texture coordinates that its textures lie on.
    pub(super) uv_sets: UvSets,
    /// Tangents, for a normal map.
    pub(super) tangents: bool,
}

impl Importer<'_> {
    /// Adds all materials of the file, in its order.
    pub(super) fn add_materials(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        for (index, material) in root.materials.iter().enumerate() {
            let name = label(material.name.as_ref(), "material", index);
            let subject = format!("material {name}");
            let converted = self.about(subject, |importer| importer.converted(name.clone(), material));
            let (converted, needs) = match converted {
                Err(problem) if !self.is_used(index) => {
                    self.warn(format!("{problem}; nothing has this material, which was left out"));
                    (Material::diffuse(name, [0.0; 3]), Needs::default())
                }
                converted => converted?,
            };
            self.scene.materials.push(converted);
            self.needs.push(needs);
        }
        Ok(())
    }

    /// Whether a mesh has the material.
    fn is_used(&self, index: usize) -> bool {
        let mut primitives = self.document.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        primitives.any(|primitive| primitive.material.is_some_and(|material| material.value() == index))
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
        let extensions = material.extensions.as_ref();
        let specular = extensions.and_then(|extensions| extensions.specular.as_ref());
        let slots = [
            surface.base_color_texture.as_ref().map(Slot::from),
            surface.metallic_roughness_texture.as_ref().map(Slot::from),
            normal.map(Slot::from),
            material.emissive_texture.as_ref().map(Slot::from),
            specular.and_then(|specular| specular.specular_texture.as_ref()).map(Slot::from),
            specular.and_then(|specular| specular.specular_color_texture.as_ref()).map(Slot::from),
        ];
        let scattering = extensions.and_then(scattering_members).map_or([None, None], |(members, _)| {
            [texture_slot(members, "multiscatterColorTexture"), texture_slot(members, "scatterStrengthTexture")]
        });
        let uv_sets = self.uv_sets(slots.iter().chain(&scattering));
        let needs = Needs { uv_sets, tangents: normal.is_some() };
        let [base_color, metallic_roughness, normal_map, emission, specular, specular_color] =
            slots.map(|slot| slot.map(|slot| self.texture_use(&slot, uv_sets)).transpose());
        let [scattering_color, scattering_strength] =
            scattering.map(|slot| slot.map(|slot| self.texture_use(&slot, uv_sets)).transpose());
        let [r, g, b, alpha] = surface.base_color_factor.0;
        let mut converted = Material {
            base_color: self.unit("base colour factor", [r, g, b]),
            alpha: self.unit("alpha", [alpha])[0],
            alpha_mode: alpha_mode(material),
            base_color_texture: base_color?,
            metallic: self.unit("metallic factor", [surface.metallic_factor.0])[0],
            roughness: self.unit("roughness factor", [surface.roughness_factor.0])[0],
            metallic_roughness_texture: metallic_roughness?,
            normal_texture: normal_map?,
            normal_scale: normal.map_or(1.0, |normal| normal.scale),
            emission: material.emissive_factor.0,
            emission_texture: emission?,
            specular_texture: specular?,
            specular_color_texture: specular_color?,
            ior: DEFAULT_IOR,
            ..Material::diffuse(name, [0.0; 3])
        };
        if let Some(extensions) = extensions {
            self.extend(&mut converted, extensions);
        }
        if let Some(scattering) = converted.volume.as_mut().and_then(|volume| volume.scattering.as_mut()) {
            scattering.denser_outside = denser_outside(&material.extras).unwrap_or(1.0);
            scattering.color_texture = scattering_color?;
            scattering.strength_texture = scattering_strength?;
        }
        // A black surface emits on neither side.
        converted.two_sided_emission = material.double_sided && converted.emission != [0.0; 3];
        check(&converted)?;
        Ok((converted, needs))
    }

    /// The first two sets of texture coordinates that its textures lie on; a mesh has two.
    fn uv_sets<'a>(&mut self, slots: impl Iterator<Item = &'a Option<Slot>>) -> UvSets {
        let sets: BTreeSet<u32> = slots.flatten().map(|slot| slot.uv_set).collect();
        let sets = Vec::from_iter(sets);
        if let [first, _, more @ ..] = &sets[..] {
            let warning = format!(
                "its textures lie on the sets {sets:?} of texture coordinates; set {first} is used for {more:?}"
            );
            self.warn_if(!more.is_empty(), warning);
        }
        [sets.first().copied(), sets.get(1).copied()]
    }

    fn extend(&mut self, material: &mut Material, extensions: &Extensions) {
        if let Some(strength) = &extensions.emissive_strength {
            material.emission = material.emission.map(|channel| channel * strength.emissive_strength.0);
        }
        if let Some(transmission) = &extensions.transmission {
            material.transmission = self.unit("transmission factor", [transmission.transmission_factor.0])[0];
            self.warn_if(transmission.transmission_texture.is_some(), "its transmission texture is ignored");
        }
        if let Some(members) = extensions.others.get("KHR_materials_diffuse_transmission") {
            let factor = members["diffuseTransmissionFactor"].as_f64().unwrap_or(0.0) as f32;
            material.diffuse_transmission = self.unit("diffuse transmission factor", [factor])[0];
            let color = &members["diffuseTransmissionColorFactor"];
            let color = [0, 1, 2].map(|channel| color[channel].as_f64().unwrap_or(1.0) as f32);
            material.diffuse_transmission_color = self.unit("diffuse transmission colour", color);
            let textures = ["diffuseTransmissionTexture", "diffuseTransmissionColorTexture"];
            let textured = textures.iter().any(|name| members.get(name).is_some());
            self.warn_if(textured, "its textures of diffuse transmission are ignored");
        }
        if let Some(volume) = &extensions.volume {
            self.warn_if(volume.thickness_texture.is_some(), "its thickness texture is ignored");
            material.volume = (volume.thickness_factor.0 > 0.0).then(|| self.volume(volume));
        }
        if let Some((members, strength)) = scattering_members(extensions) {
            let strength = self.unit("scatter strength factor", [strength])[0];
            self.set_scattering(material, members, strength);
        }
        if let Some(specular) = &extensions.specular {
            self.set_specular(material, specular);
        }
        if let Some(ior) = &extensions.ior {
            self.set_ior(material, ior.ior.0);
        }
    }

    fn set_specular(&mut self, material: &mut Material, specular: &json::extensions::material::Specular) {
        material.specular = self.unit("specular factor", [specular.specular_factor.0])[0];
        material.specular_color = specular.specular_color_factor.0;
        let textured = specular.specular_texture.is_some() || specular.specular_color_texture.is_some();
        let scaled = textured || material.specular != 1.0 || material.specular_color != [1.0; 3];
        let warning = "its specular factor and colour do not scale what its transmitting part reflects";
        self.warn_if(scaled && material.transmission > 0.0, warning);
    }

    fn volume(&mut self, volume: &json::extensions::material::Volume) -> Volume {
        let color = volume.attenuation_color.0;
        let attenuation_color = color.map(|channel| num::clamp(channel, LEAST_ATTENUATION, 1.0));
        let warning = format!("its attenuation colour is not within {LEAST_ATTENUATION:e} and 1 and was clamped");
        self.warn_if(attenuation_color != color, warning);
        Volume::absorbing(attenuation_color, volume.attenuation_distance.0)
    }

    /// Both drafts have the same members, of which one had another name first; `strength` scales the colour.
    fn set_scattering(&mut self, material: &mut Material, members: &json::Value, strength: f32) {
        let colors = ["multiscatterColorFactor", "multiscatterColor"];
        let given = colors.iter().find_map(|name| members.get(*name));
        let absent = if members.get("scatterStrengthFactor").is_some() { 1.0 } else { 0.0 };
        let channel = |i: usize| given.and_then(|color| color[i].as_f64()).unwrap_or(absent) as f32;
        let color = self.unit("multiscatter colour", [0, 1, 2].map(channel)).map(|channel| strength * channel);
        let given = members["scatterAnisotropy"].as_f64().unwrap_or(0.0) as f32;
        let anisotropy = num::clamp(given, -MAX_ANISOTROPY, MAX_ANISOTROPY);
        let warning = format!("its scatter anisotropy is not within {MAX_ANISOTROPY} of 0 and was clamped");
        self.warn_if(given != anisotropy, warning);
        if color == [0.0; 3] {
            return;
        }
        let Some(volume) = &mut material.volume else {
            return self
                .warn("it scatters light inside, but its thickness is none, so that it has no inside; it is a sheet");
        };
        volume.scattering = Some(VolumeScattering { anisotropy, ..VolumeScattering::of_color(color) });
        let clear = volume.extinction() == [0.0; 3];
        self.warn_if(
            clear,
            "it scatters light inside, but nothing is attenuated there; give an attenuation colour and distance",
        );
    }

    /// An index of 0 stands for a Fresnel reflectance of 1 (`KHR_materials_ior`): a white mirror, as rough as the
    /// material, where it is no metal.
    fn set_ior(&mut self, material: &mut Material, ior: f32) {
        if ior == 0.0 {
            let metallic = std::mem::replace(&mut material.metallic, 1.0);
            material.base_color = material.base_color.map(|channel| 1.0 + (channel - 1.0) * metallic);
            // of a colour that counts no more the alpha still does
            let in_use = metallic != 0.0 || material.alpha_mode != AlphaMode::Opaque;
            material.base_color_texture = material.base_color_texture.filter(|_| in_use);
            self.warn("its index of refraction is 0; it is rendered as a white metal");
        } else {
            material.ior = ior.max(1.0);
            self.warn_if(ior < 1.0, "its index of refraction is less than 1 and was raised to 1");
        }
    }

    /// Factors within 0 and 1.
    fn unit<const N: usize>(&mut self, what: &str, factors: [f32; N]) -> [f32; N] {
        let inside = factors.iter().all(|factor| (0.0..=1.0).contains(factor));
        self.warn_if(!inside, format!("its {what} is not within 0 and 1 and was clamped"));
        factors.map(|factor| num::clamp(factor, 0.0, 1.0))
    }
}

/// The members of an extension by which the interior scatters light, and a factor on its colour: of both drafts the later one, unless its
/// factor is zero.
fn scattering_members(extensions: &Extensions) -> Option<(&json::Value, f32)> {
    let strength = |members: &json::Value| members["scatterStrengthFactor"].as_f64().unwrap_or(0.0) as f32;
    let later = extensions.others.get(SCATTER).map(|members| (members, strength(members)));
    let first = || extensions.others.get(VOLUME_SCATTER).map(|members| (members, 1.0));
    later.filter(|(_, strength)| *strength > 0.0).or_else(first)
}

/// A texture among the members of an extension.
fn texture_slot(members: &json::Value, name: &str) -> Option<Slot> {
    let info = json::texture::Info::deserialize(members.get(name)?).ok()?;
    Some(Slot::from(&info))
}

/// What alpha means; an unknown mode counts as the default.
fn alpha_mode(material: &json::Material) -> AlphaMode {
    match material.alpha_mode {
        Checked::Valid(JsonAlphaMode::Mask) => {
            AlphaMode::Mask { cutoff: material.alpha_cutoff.map_or(DEFAULT_CUTOFF, |cutoff| cutoff.0) }
        }
        Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
        _ => AlphaMode::Opaque,
    }
}

/// What no clamping can correct.
fn check(material: &Material) -> Result<(), Problem> {
    let Material { emission, ior, specular_color, normal_scale, volume, .. } = material;
    let possible = emission.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
    ensure!(possible, "it emits {emission:?}, which is not a radiance");
    let possible = specular_color.iter().all(|channel| channel.is_finite() && *channel >= 0.0);
    ensure!(possible, "its specular colour is {specular_color:?}, which is not a reflectance");
    if let AlphaMode::Mask { cutoff } = material.alpha_mode {
        ensure!(cutoff.is_finite() && cutoff >= 0.0, "its alpha cutoff is {cutoff}; it has to be a number from 0 on");
    }
    ensure!(ior.is_finite(), "its index of refraction is {ior}");
    ensure!(normal_scale.is_finite(), "the scale of its normal texture is {normal_scale}");
    let distance = volume.map_or(f32::INFINITY, |volume| volume.attenuation_distance);
    let positive = distance > 0.0;
    ensure!(positive, "its attenuation distance is {distance}; it has to be positive");
    Ok(())
}
