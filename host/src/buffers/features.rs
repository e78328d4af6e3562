//! The feature bits of a scene: what its kernels may be specialised to.

use super::lights::{LightTables, emits};
use super::{Flat, lit};
use crate::scene::{Material, Scene};
use glam::Vec3;
use restir_shared::bsdf::Material as Scattering;
use restir_shared::layout::{
    FEATURE_ALPHA, FEATURE_BLEND, FEATURE_CLEAR, FEATURE_CLEAR_BORDER, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION,
    FEATURE_EMISSIVE, FEATURE_ENVIRONMENT, FEATURE_FINE_TEXELS, FEATURE_GLOSSY, FEATURE_LIGHT_TABLE,
    FEATURE_MULTISCATTER, FEATURE_PUNCTUAL, FEATURE_SECOND_UVS, FEATURE_SHADING, FEATURE_SPECULAR, FEATURE_SUBSURFACE,
    FEATURE_TEXTURES, FEATURE_TRANSMISSION, FEATURE_VOLUME, LIGHT_ENVIRONMENT, LIGHT_PUNCTUAL, MATERIAL_BLEND,
};

/// Every feature with its name.
const NAMES: [(u32, &str); 20] = [
    (FEATURE_LIGHT_TABLE, "light-table"),
    (FEATURE_EMISSIVE, "emissive"),
    (FEATURE_PUNCTUAL, "punctual"),
    (FEATURE_ENVIRONMENT, "environment"),
    (FEATURE_TEXTURES, "textures"),
    (FEATURE_SHADING, "shading"),
    (FEATURE_GLOSSY, "glossy"),
    (FEATURE_DELTA, "delta"),
    (FEATURE_TRANSMISSION, "transmission"),
    (FEATURE_DIFFUSE_TRANSMISSION, "diffuse-transmission"),
    (FEATURE_VOLUME, "volume"),
    (FEATURE_CLEAR, "clear-glass"),
    (FEATURE_MULTISCATTER, "multiscatter"),
    (FEATURE_SPECULAR, "specular"),
    (FEATURE_ALPHA, "alpha"),
    (FEATURE_BLEND, "blend"),
    (FEATURE_SUBSURFACE, "subsurface"),
    (FEATURE_CLEAR_BORDER, "clear-border"),
    (FEATURE_SECOND_UVS, "second-uvs"),
    (FEATURE_FINE_TEXELS, "fine-texels"),
];

/// The names of the features that are set.
pub(super) fn names(features: u32) -> Vec<&'static str> {
    NAMES.iter().filter(|(bit, _)| features & bit != 0).map(|(_, name)| *name).collect()
}

/// The features of the materials in use and the lights.
pub(super) fn of_scene(scene: &Scene, flat: &Flat, tables: &LightTables, around: &[u32]) -> u32 {
    let Flat { used_materials, with_shading, with_second_uvs, texels, .. } = flat;
    let materials = scene.materials.iter().zip(used_materials).filter(|(_, used)| **used);
    let of_lights_and_tables = all_of(&[
        (tables.alias.is_some(), FEATURE_LIGHT_TABLE),
        (tables.count(LIGHT_PUNCTUAL) > 0, FEATURE_PUNCTUAL),
        (tables.count(LIGHT_ENVIRONMENT) > 0, FEATURE_ENVIRONMENT),
        (*with_shading, FEATURE_SHADING),
        (texels.count() > 0, FEATURE_TEXTURES),
        (*with_second_uvs, FEATURE_SECOND_UVS),
        (texels.any_fine(scene), FEATURE_FINE_TEXELS),
        (
            (0..scene.materials.len()).any(|m| used_materials[m] && lit::is_clear(scene, m, around)),
            FEATURE_CLEAR_BORDER,
        ),
    ]);
    materials.fold(of_lights_and_tables, |features, (m, _)| features | of_material(m, texels.alpha_flags(m)))
}

/// The bits whose feature is present.
fn all_of(bits: &[(bool, u32)]) -> u32 {
    bits.iter().filter(|(present, _)| *present).fold(0, |features, (_, bit)| features | bit)
}

fn of_material(m: &Material, alpha_flags: u32) -> u32 {
    // a texture scales its factor by anything from 0 to 1
    let scaled = m.specular_texture.is_some() || m.specular_color_texture.is_some();
    let scattering = Scattering {
        base_color: Vec3::from_array(m.base_color),
        metallic: m.metallic,
        roughness: m.roughness,
        ior: m.ior,
        specular: if scaled { 0.0 } else { m.specular },
        specular_color: Vec3::from_array(m.specular_color),
        transmission: m.transmission,
        diffuse_transmission: m.diffuse_transmission,
        diffuse_transmission_color: Vec3::from_array(m.diffuse_transmission_color),
        thin: m.volume.is_none(),
    };
    let mut features = scattering.features();
    if m.metallic_roughness_texture.is_some() {
        features |= Scattering { metallic: 0.0, ..scattering }.features();
        features |= Scattering { roughness: 0.0, ..scattering }.features();
        features |= Scattering { metallic: 0.0, roughness: 0.0, ..scattering }.features();
    }
    let absorbs = m.volume.is_some_and(|volume| volume.extinction().iter().any(|&a| a > 0.0));
    features
        | all_of(&[
            (emits(m), FEATURE_EMISSIVE),
            (absorbs, FEATURE_VOLUME),
            (m.volume.is_some_and(|volume| volume.scatters()), FEATURE_SUBSURFACE),
            (alpha_flags != 0, FEATURE_ALPHA),
            (alpha_flags & MATERIAL_BLEND != 0, FEATURE_BLEND),
        ])
}
