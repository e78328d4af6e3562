//! Refuses scenes that kernels could not render, each with a sentence that says what and where.

use super::scene_error;
use crate::Error;
use crate::scene::{
    AlphaMode, Camera, Environment, Light, LightKind, MAX_COORDINATE, Material, Mesh, Scene, Texture, TextureUse,
};
use restir_shared::bsdf::IOR_MAX;
use restir_shared::medium::MAX_ANISOTROPY;
use std::sync::Arc;

/// Emission beyond this could overflow in sums over paths.
const MAX_EMISSION: f32 = 1.0e20;
/// The longest side of a texture or an environment.
pub(super) const MAX_TEXTURE_SIDE: u32 = 16_384;

/// Checks all that does not depend on the flattened triangles.
pub(super) fn check(scene: &Scene) -> Result<(), Error> {
    check_edited(scene, None)
}

/// As [`check`]. What is shared with a scene that was checked is not looked at again.
pub(super) fn check_edited(scene: &Scene, checked: Option<&Scene>) -> Result<(), Error> {
    let meshes = checked.map_or(&[][..], |checked| &checked.meshes);
    let is_checked = |index: usize| meshes.get(index).is_some_and(|mesh| Arc::ptr_eq(mesh, &scene.meshes[index]));
    let pixels = checked.and_then(|checked| Some(&checked.environment.as_ref()?.pixels));
    let problem = scene
        .textures
        .iter()
        .find_map(texture_problem)
        .or_else(|| scene.materials.iter().find_map(|m| material_problem(scene, m)))
        .or_else(|| (0..scene.meshes.len()).filter(|&i| !is_checked(i)).find_map(|i| mesh_problem(&scene.meshes[i])))
        .or_else(|| scene.lights.iter().find_map(light_problem))
        .or_else(|| scene.environment.as_ref().and_then(|environment| environment_problem(environment, pixels)))
        .or_else(|| scene.animation.problem(scene));
    problem.map_or(Ok(()), |problem| Err(scene_error(scene, problem)))
}

/// Checks the lights alone, which may have moved.
pub(super) fn check_lights(scene: &Scene) -> Result<(), Error> {
    let problem = scene.lights.iter().find_map(light_problem);
    problem.map_or(Ok(()), |problem| Err(scene_error(scene, problem)))
}

pub(super) fn check_camera(scene: &Scene, camera: &Camera) -> Result<(), Error> {
    camera.check().map_err(|problem| scene_error(scene, problem))
}

fn outside(values: &[f32], lo: f32, hi: f32) -> bool {
    values.iter().any(|v| !(lo..=hi).contains(v))
}

fn material_problem(scene: &Scene, m: &Material) -> Option<String> {
    let fractions = [
        ("base colour", &m.base_color[..]),
        ("alpha", &[m.alpha]),
        ("metallic", &[m.metallic]),
        ("roughness", &[m.roughness]),
        ("transmission", &[m.transmission]),
        ("diffuse transmission", &[m.diffuse_transmission]),
        ("diffuse transmission colour", &m.diffuse_transmission_color),
    ];
    let fraction = fractions.iter().find(|(_, values)| outside(values, 0.0, 1.0));
    let problem = if let Some((what, values)) = fraction {
        format!("{what} {values:?} is outside [0, 1]")
    } else if outside(&m.emission, 0.0, MAX_EMISSION) {
        format!("emission {:?} is outside [0, {MAX_EMISSION:e}]", m.emission)
    } else if outside(&[m.ior], 1.0, IOR_MAX) {
        format!("index of refraction {} is outside [1, {IOR_MAX}]", m.ior)
    } else if let AlphaMode::Mask { cutoff } = m.alpha_mode
        && outside(&[cutoff], 0.0, f32::MAX)
    {
        format!("alpha cutoff {cutoff} is not a finite number from 0 on")
    } else if !m.normal_scale.is_finite() {
        format!("normal scale {} is not finite", m.normal_scale)
    } else if let Some(v) = m.volume
        && (outside(&v.attenuation_color, 0.0, 1.0) || v.attenuation_distance.is_nan() || v.attenuation_distance <= 0.0)
    {
        format!(
            "attenuation {:?} at distance {} is not a colour at a positive one",
            v.attenuation_color, v.attenuation_distance
        )
    } else if let Some(s) = m.volume.and_then(|volume| volume.scattering)
        && (outside(&s.color, 0.0, 1.0)
            || outside(&[s.anisotropy], -MAX_ANISOTROPY, MAX_ANISOTROPY)
            || outside(&[s.denser_outside], 1.0, IOR_MAX))
    {
        format!(
            "scattering of the colour {:?}, the anisotropy {} and an outside denser by {} is outside [0, 1], [-{MAX_ANISOTROPY}, \
             {MAX_ANISOTROPY}] or [1, {IOR_MAX}]",
            s.color, s.anisotropy, s.denser_outside
        )
    } else {
        m.all_textures().find_map(|used| texture_use_problem(scene, used))?
    };
    Some(format!("material {:?}: {problem}; correct it in the file", m.name))
}

fn texture_use_problem(scene: &Scene, used: &TextureUse) -> Option<String> {
    if used.texture >= scene.textures.len() {
        Some(format!("it refers to texture {}, which does not exist", used.texture))
    } else if used.transform.iter().any(|x| !x.is_finite()) {
        Some(format!("a texture transform {:?} is not finite", used.transform))
    } else {
        None
    }
}

fn texture_problem(t: &Texture) -> Option<String> {
    size_problem(&format!("texture {:?}", t.name), t.size, t.texels.count())
}

fn size_problem(what: &str, [width, height]: [u32; 2], pixels: usize) -> Option<String> {
    if width == 0 || height == 0 {
        Some(format!("{what} of {width}x{height} pixels has no pixel; replace it"))
    } else if width > MAX_TEXTURE_SIDE || height > MAX_TEXTURE_SIDE {
        Some(format!("{what} of {width}x{height} pixels is too large; the longest side is {MAX_TEXTURE_SIDE}"))
    } else if pixels != width as usize * height as usize {
        Some(format!("{what} of {width}x{height} pixels has {pixels} of them; correct it"))
    } else {
        None
    }
}

fn mesh_problem(mesh: &Mesh) -> Option<String> {
    let count = mesh.positions.len();
    let attributes = [
        ("normal", mesh.normals.len(), mesh.normals.as_flattened()),
        ("texture coordinate", mesh.uvs.len(), mesh.uvs.as_flattened()),
        ("second texture coordinate", mesh.second_uvs.len(), mesh.second_uvs.as_flattened()),
        ("tangent", mesh.tangents.len(), mesh.tangents.as_flattened()),
    ];
    let wrong = attributes.iter().find(|(_, length, _)| *length != 0 && *length != count);
    let problem = if let Some((what, length, _)) = wrong {
        format!("{length} {what}s for {count} vertices")
    } else {
        let (what, ..) = attributes.iter().find(|(.., values)| values.iter().any(|x| !x.is_finite()))?;
        format!("a {what} is not finite")
    };
    Some(format!("mesh {:?}: {problem}; correct it in the file", mesh.name))
}

fn light_problem(light: &Light) -> Option<String> {
    let (position, direction) = match light.kind {
        LightKind::Point { position } => (Some(position), None),
        LightKind::Spot { position, direction, .. } => (Some(position), Some(direction)),
        LightKind::Directional { direction } => (None, Some(direction)),
    };
    let problem = if outside(&light.intensity, 0.0, MAX_EMISSION) {
        format!("intensity {:?} is outside [0, {MAX_EMISSION:e}]", light.intensity)
    } else if position.is_some_and(|p| p.is_nan() || p.abs().max_element() > MAX_COORDINATE) {
        "its position is not within 1.07e9".to_owned()
    } else if direction.is_some_and(|d| !(d.is_finite() && d.length() > 0.0)) {
        "its direction is not one".to_owned()
    } else if let LightKind::Spot { inner, outer, .. } = light.kind
        && !(inner >= 0.0 && inner < outer && outer <= std::f64::consts::FRAC_PI_2)
    {
        format!("cone angles {inner} and {outer} are not 0 <= inner < outer <= pi / 2")
    } else {
        return None;
    };
    Some(format!("light {:?}: {problem}; correct it in the file", light.name))
}

fn environment_problem(environment: &Environment, checked: Option<&Arc<[[f32; 3]]>>) -> Option<String> {
    let Environment { name, size, pixels, scale, rotation, .. } = environment;
    size_problem(&format!("environment {name:?}"), *size, pixels.len()).or_else(|| {
        if !(0.0..=MAX_EMISSION).contains(scale) || !rotation.is_finite() {
            let values = format!("scale {scale} or rotation {rotation}");
            return Some(format!("environment {name:?}: {values} is out of range; correct it"));
        }
        if checked.is_some_and(|checked| Arc::ptr_eq(checked, pixels)) {
            return None;
        }
        let at = pixels.iter().position(|pixel| outside(pixel, 0.0, MAX_EMISSION))?;
        let (x, y, pixel) = (at % size[0] as usize, at / size[0] as usize, pixels[at]);
        Some(format!("environment {name:?}: pixel {x},{y} is {pixel:?}, not a radiance; repair the image"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Volume, VolumeScattering, builtin};

    #[test]
    fn what_is_no_medium_is_refused_in_a_sentence() {
        fn scattering(volume: &mut Volume, change: fn(&mut VolumeScattering)) {
            volume.scattering.iter_mut().for_each(change);
        }
        type Case = (fn(&mut Volume), &'static str);
        let cases: [Case; 12] = [
            (|v| v.attenuation_color[0] = f32::NAN, "attenuation [NaN"),
            (|v| v.attenuation_color[1] = -0.1, "attenuation"),
            (|v| v.attenuation_color[2] = 1.5, "is not a colour"),
            (|v| v.attenuation_distance = f32::NAN, "at distance NaN"),
            (|v| v.attenuation_distance = -2.0, "at distance -2"),
            (|v| v.attenuation_distance = 0.0, "a positive one"),
            (|v| scattering(v, |s| s.color[1] = f32::NAN), "of the colour"),
            (|v| scattering(v, |s| s.color[2] = 1.0e38), "[0, 1]"),
            (|v| scattering(v, |s| s.anisotropy = 1.0), "the anisotropy 1"),
            (|v| scattering(v, |s| s.anisotropy = f32::NAN), "the anisotropy NaN"),
            (|v| scattering(v, |s| s.denser_outside = 0.5), "denser by 0.5"),
            (|v| scattering(v, |s| s.denser_outside = f32::INFINITY), "denser by inf"),
        ];
        for (change, known) in cases {
            let mut scene = builtin::scene("slab").expect("built in");
            check(&scene).expect("as it is");
            scene.materials[0].volume.iter_mut().for_each(change);
            let problem = check(&scene).expect_err(known).to_string();
            assert!(
                problem.contains(known) && problem.contains("material \"medium\"") && problem.contains("correct"),
                "{problem}"
            );
        }
    }
}
