//! Materials.

use serde_json::{Value, json};

use super::{Document, Problem};
use crate::scene::gltf::exact::denser_outside_extras;
use crate::scene::gltf::{SCATTER, VOLUME_SCATTER};
use crate::scene::{AlphaMode, Material, Scene, Volume, VolumeScattering};

impl Document {
    /// Adds all materials, in their order.
    pub(super) fn add_materials(&mut self, scene: &Scene) -> Result<(), Problem> {
        for material in &scene.materials {
            let converted =
                self.material(material).map_err(|problem| format!("material {:?}: {problem}", material.name))?;
            self.add("materials", converted);
        }
        Ok(())
    }

    fn material(&mut self, material: &Material) -> Result<Value, Problem> {
        check(material)?;
        let [r, g, b] = material.base_color;
        let mut surface = json!({
            "baseColorFactor": [r, g, b, material.alpha],
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        });
        let slots = material.textures().map(|slot| slot.map(|used| self.texture_use(used)).transpose());
        let [base_color, metallic_roughness, normal, emission, specular, specular_color] = slots;
        put(&mut surface, "baseColorTexture", base_color?);
        put(&mut surface, "metallicRoughnessTexture", metallic_roughness?);
        let strength = power_of_two_above(material.emission);
        // The surface of a volume has no back to hide, and should not be double-sided.
        let shows_back = material.emission == [0.0; 3] && material.volume.is_none();
        let mut converted = json!({
            "name": material.name,
            "pbrMetallicRoughness": surface,
            "emissiveFactor": material.emission.map(|channel| channel / strength),
            "doubleSided": material.two_sided_emission || shows_back,
        });
        if let Some(mut texture) = normal? {
            texture["scale"] = json!(material.normal_scale);
            converted["normalTexture"] = texture;
        }
        put(&mut converted, "emissiveTexture", emission?);
        match material.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                converted["alphaMode"] = json!("MASK");
                converted["alphaCutoff"] = json!(cutoff);
            }
            AlphaMode::Blend => converted["alphaMode"] = json!("BLEND"),
        }
        let scattering = material.volume.and_then(|volume| volume.scattering);
        if let Some(scattering) = scattering.filter(|scattering| scattering.denser_outside != 1.0) {
            converted["extras"] = denser_outside_extras(scattering.denser_outside);
        }
        let inside = material.volume.map_or([None, None], |volume| volume.textures().map(|used| used.copied()));
        let [color, inside_strength] = inside.map(|used| used.map(|used| self.texture_use(&used)).transpose());
        converted["extensions"] = self.extensions(material, strength, [specular?, specular_color?]);
        self.scatter(material, &mut converted["extensions"], [color?, inside_strength?]);
        Ok(converted)
    }

    /// All extensions; `specular_textures` are of the factor and of the colour.
    fn extensions(&mut self, material: &Material, strength: f32, specular_textures: [Option<Value>; 2]) -> Value {
        let plain = Material::diffuse("", [0.0; 3]);
        let mut extensions = json!({});
        let mut add = |name: &'static str, members: Value| extensions[self.extension(name)] = members;
        if strength != 1.0 {
            add("KHR_materials_emissive_strength", json!({ "emissiveStrength": strength }));
        }
        // Absent, it is not that of `plain`.
        add("KHR_materials_ior", json!({ "ior": material.ior }));
        let specular = |material: &Material| (material.specular, material.specular_color);
        if specular(material) != specular(&plain) || specular_textures.iter().any(Option::is_some) {
            let mut members =
                json!({ "specularFactor": material.specular, "specularColorFactor": material.specular_color });
            let [factor, color] = specular_textures;
            put(&mut members, "specularTexture", factor);
            put(&mut members, "specularColorTexture", color);
            add("KHR_materials_specular", members);
        }
        if material.transmission != plain.transmission {
            add("KHR_materials_transmission", json!({ "transmissionFactor": material.transmission }));
        }
        let diffuse = |material: &Material| (material.diffuse_transmission, material.diffuse_transmission_color);
        if diffuse(material) != diffuse(&plain) {
            let members = json!({
                "diffuseTransmissionFactor": material.diffuse_transmission,
                "diffuseTransmissionColorFactor": material.diffuse_transmission_color,
            });
            add("KHR_materials_diffuse_transmission", members);
        }
        if let Some(Volume { attenuation_color, attenuation_distance, .. }) = material.volume {
            // Any thickness makes a volume; path tracers take the surface's own.
            let mut members = json!({ "thicknessFactor": 1.0, "attenuationColor": attenuation_color });
            if attenuation_distance.is_finite() {
                members["attenuationDistance"] = json!(attenuation_distance);
            }
            add("KHR_materials_volume", members);
        }
        extensions
    }

    /// What scatters light inside, with the textures of its colour and strength: in the older draft, which alone has bodies that light enters by
    /// Lambert's law, unless there is a texture that only the later one has.
    fn scatter(&mut self, material: &Material, extensions: &mut Value, [color_texture, strength]: [Option<Value>; 2]) {
        let scattering = material.volume.and_then(|volume| volume.scattering);
        let Some(VolumeScattering { color, anisotropy, .. }) = scattering else { return };
        let mut members = json!({ "multiscatterColorFactor": color, "scatterAnisotropy": anisotropy });
        put(&mut members, "multiscatterColorTexture", color_texture);
        let name = if strength.is_some() { SCATTER } else { VOLUME_SCATTER };
        if strength.is_some() {
            members["scatterStrengthFactor"] = json!(1.0);
        }
        put(&mut members, "scatterStrengthTexture", strength);
        extensions[self.extension(name)] = members;
    }
}

fn put(object: &mut Value, name: &str, texture: Option<Value>) {
    if let Some(texture) = texture {
        object[name] = texture;
    }
}

/// JSON has no NaN and no infinity.
fn check(material: &Material) -> Result<(), Problem> {
    let scalars = [
        material.alpha,
        if let AlphaMode::Mask { cutoff } = material.alpha_mode { cutoff } else { 0.0 },
        material.metallic,
        material.roughness,
        material.normal_scale,
        material.ior,
        material.specular,
        material.transmission,
        material.diffuse_transmission,
    ];
    let colors = [material.base_color, material.emission, material.specular_color, material.diffuse_transmission_color];
    let interior = material.volume.map_or([1.0; 3], |volume| volume.attenuation_color);
    let scattering = material.volume.and_then(|volume| volume.scattering);
    let medium = scattering
        .map_or([0.0; 5], |VolumeScattering { color: [r, g, b], anisotropy, denser_outside, .. }| {
            [r, g, b, anisotropy, denser_outside]
        });
    let all = scalars.iter().chain(colors.as_flattened()).chain(&interior).chain(&medium);
    if all.copied().all(f32::is_finite) { Ok(()) } else { Err("one of its factors is not finite".to_owned()) }
}

/// The largest power of two that a float holds.
const LARGEST_POWER: f32 = 1.701_411_8e38;

/// A power of two by which the colour lies within 0 and 1 (or, at the end of the range of floats, 2): dividing by it
/// loses no bit.
pub(super) fn power_of_two_above(color: [f32; 3]) -> f32 {
    let largest = color.into_iter().fold(1.0, f32::max);
    let mut power = 1.0;
    while power < largest && power < LARGEST_POWER {
        power *= 2.0;
    }
    power
}
