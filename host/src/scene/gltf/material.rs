//! Materials: the diffuse part and the emission of glTF's.

use gltf::json;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use restir_shared::num;

use super::{Importer, Problem, label};
use crate::scene::Material;

impl Importer<'_> {
    /// Adds all materials of the file, in its order.
    pub(super) fn add_materials(&mut self) -> Result<(), Problem> {
        let root = self.document.root;
        for (index, material) in root.materials.iter().enumerate() {
            let name = label(material.name.as_ref(), "material", index);
            self.warn_of_approximations(&name, material);
            self.scene.materials.push(converted(name, material)?);
        }
        Ok(())
    }

    /// Index of the material of a primitive that names none, glTF's default: white.
    pub(super) fn default_material(&mut self) -> usize {
        let first_own = self.document.root.materials.len();
        if self.scene.materials.len() == first_own {
            self.scene.materials.push(Material::diffuse("default", [1.0; 3]));
        }
        first_own
    }

    fn warn_of_approximations(&mut self, name: &str, material: &json::Material) {
        let surface = &material.pbr_metallic_roughness;
        let mut warn = |present: bool, what: &str| {
            if present {
                self.warn(format!("material {name}: {what}"));
            }
        };
        warn(surface.base_color_texture.is_some(), "its base colour texture is not supported; only the factor is used");
        warn(material.emissive_texture.is_some(), "its emissive texture is not supported; it does not emit");
        warn(surface.metallic_factor.0 > 0.0, "it is metallic; it is rendered as diffuse, in its base colour");
        warn(
            !surface.base_color_factor.0.iter().all(|factor| (0.0..=1.0).contains(factor)),
            "its base colour factor is not within 0 and 1 and was clamped",
        );
        warn(material.alpha_mode != Checked::Valid(AlphaMode::Opaque), "it is transparent; it is rendered as opaque");
    }
}

fn converted(name: String, material: &json::Material) -> Result<Material, Problem> {
    let [r, g, b, _alpha] = material.pbr_metallic_roughness.base_color_factor.0;
    let emission = emission(material);
    if !emission.iter().all(|channel| channel.is_finite() && *channel >= 0.0) {
        return Err(format!("material {name} emits {emission:?}, which is not a radiance"));
    }
    Ok(Material {
        two_sided_emission: material.double_sided,
        ..Material::emitter(name, [r, g, b].map(|channel| num::clamp(channel, 0.0, 1.0)), emission)
    })
}

/// Radiance; a texture that is not read could make any part of the surface dark, so it makes all of it dark.
fn emission(material: &json::Material) -> [f32; 3] {
    if material.emissive_texture.is_some() {
        return [0.0; 3];
    }
    let extension = material.extensions.as_ref().and_then(|extensions| extensions.emissive_strength.as_ref());
    let strength = extension.map_or(1.0, |extension| extension.emissive_strength.0);
    material.emissive_factor.0.map(|channel| channel * strength)
}
