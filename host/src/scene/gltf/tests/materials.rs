//! Materials and their extensions.

use super::*;
use crate::scene::{AlphaMode, Material, Volume};

/// The material that a file with this one has, and the warnings, but for that the square is no body.
fn material(members: &str) -> (Material, Vec<String>) {
    let scene = load(&with_material(members)).unwrap();
    let warnings = scene.warnings.into_iter().filter(|warning| !warning.contains("is not closed")).collect();
    (scene.materials[scene.meshes[0].material].clone(), warnings)
}

fn with_material(members: &str) -> String {
    let primitive = r#"{ "attributes": { "POSITION": 0 }, "mode": 6, "material": 0 }"#;
    square(&format!(r#""materials": [{{ {members} }}],"#), primitive, ONE_NODE)
}

#[test]
fn factors_and_emission_are_read() {
    let (lamp, warnings) = material(
        r#""name": "lamp", "emissiveFactor": [1, 0.5, 0], "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 2, -1, 1], "metallicFactor": 0.25, "roughnessFactor": 0.5 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } }"#,
    );
    assert_eq!((lamp.base_color, lamp.emission), ([0.5, 1.0, 0.0], [8.0, 4.0, 0.0]));
    assert_eq!((lamp.metallic, lamp.roughness), (0.25, 0.5));
    assert!(lamp.two_sided_emission);
    assert!(warnings.len() == 1 && warnings[0].contains("clamped"), "{warnings:?}");
}

#[test]
fn alpha_is_read() {
    let factor = r#""pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.25] }"#;
    let mode = |members: &str| {
        let (material, warnings) = material(&format!("{factor}{members}"));
        assert!(material.alpha == 0.25 && warnings.is_empty(), "{members}: {warnings:?}");
        material.alpha_mode
    };
    assert_eq!(mode(""), AlphaMode::Opaque);
    assert_eq!(mode(r#", "alphaMode": "OPAQUE", "alphaCutoff": 0.1"#), AlphaMode::Opaque);
    assert_eq!(mode(r#", "alphaMode": "MASK""#), AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(mode(r#", "alphaMode": "MASK", "alphaCutoff": 1.5"#), AlphaMode::Mask { cutoff: 1.5 });
    assert_eq!(mode(r#", "alphaMode": "BLEND""#), AlphaMode::Blend);
    let problem = problem(&with_material(r#""name": "leaf", "alphaMode": "MASK", "alphaCutoff": -0.5"#));
    assert!(problem.contains("leaf") && problem.contains("alpha cutoff"), "{problem}");
    let (clamped, warnings) = material(r#""pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 2] }"#);
    assert!(clamped.alpha == 1.0 && warnings[0].contains("alpha"), "{warnings:?}");
}

#[test]
fn defaults_are_those_of_gltf() {
    let (plain, warnings) = material("");
    let expected = Material { metallic: 1.0, ior: 1.5, ..Material::diffuse("material 0", [1.0; 3]) };
    assert_eq!(plain, expected);
    assert!(warnings.is_empty());
    let scene = load(&square("", FAN, ONE_NODE)).unwrap();
    assert_eq!(scene.materials, [Material { name: "default".to_owned(), ..expected }]);
}

#[test]
fn extensions_are_read() {
    let (glass, warnings) = material(
        r#""extensions": {
        "KHR_materials_ior": { "ior": 1.25 },
        "KHR_materials_transmission": { "transmissionFactor": 0.75 },
        "KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [0.25, 0.5, 1] },
        "KHR_materials_volume": {
            "thicknessFactor": 0.1, "attenuationDistance": 3, "attenuationColor": [0.5, 1, 0.25] } }"#,
    );
    assert_eq!((glass.ior, glass.transmission, glass.diffuse_transmission), (1.25, 0.75, 0.5));
    assert_eq!(glass.diffuse_transmission_color, [0.25, 0.5, 1.0]);
    assert_eq!(glass.volume, Some(Volume::absorbing([0.5, 1.0, 0.25], 3.0)));
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn specular_factors_are_read() {
    let with =
        |members: &str, more: &str| format!(r#""extensions": {{ "KHR_materials_specular": {{ {members} }}{more} }}"#);
    let (plain, warnings) = material(&with("", ""));
    assert_eq!((plain.specular, plain.specular_color, warnings.len()), (1.0, [1.0; 3], 0));
    let factors = r#""specularFactor": 0.25, "specularColorFactor": [2, 0.5, 0]"#;
    let (scaled, warnings) = material(&with(factors, ""));
    assert_eq!((scaled.specular, scaled.specular_color, warnings.len()), (0.25, [2.0, 0.5, 0.0], 0));
    let (clamped, warnings) = material(&with(r#""specularFactor": 1.5"#, ""));
    assert!(clamped.specular == 1.0 && warnings[0].contains("specular factor"), "{warnings:?}");
    let glass = r#", "KHR_materials_transmission": { "transmissionFactor": 0.5 }"#;
    let (_, warnings) = material(&with(factors, glass));
    assert!(warnings[0].contains("transmitting part"), "{warnings:?}");
    let problem = problem(&with_material(&with(r#""specularColorFactor": [1, -1, 1]"#, "")));
    assert!(problem.contains("specular colour") && problem.contains("-1"), "{problem}");
}

#[test]
fn a_volume_needs_a_thickness() {
    let volume = |members: &str| {
        let extension = format!(r#""extensions": {{ "KHR_materials_volume": {{ {members} }} }}"#);
        material(&extension)
    };
    assert_eq!(volume(r#""attenuationDistance": 3"#).0.volume, None);
    let (clear, warnings) = volume(r#""thicknessFactor": 1, "attenuationColor": [0, 1, 1]"#);
    let clear = clear.volume.unwrap();
    assert!(clear.attenuation_distance.is_infinite() && clear.attenuation_color[0] > 0.0);
    assert!(warnings[0].contains("attenuation colour"), "{warnings:?}");
    let broken = r#""extensions": { "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 0 } }"#;
    assert!(problem(&with_material(broken)).contains("attenuation distance"));
}

#[test]
fn interiors_scatter() {
    let with = |scatter: &str, volume: &str| {
        material(&format!(r#""extensions": {{ "KHR_materials_volume": {{ {volume} }}, {scatter} }}"#))
    };
    let thick = r#""thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.5, 0.25, 0.125]"#;
    let scattering = |(material, warnings): (Material, Vec<String>)| {
        let scattering = material.volume.and_then(|volume| volume.scattering);
        (scattering.map(|s| (s.color, s.anisotropy)), warnings.join("; "))
    };
    let draft = |members: &str| scattering(with(&format!(r#""KHR_materials_volume_scatter": {{ {members} }}"#), thick));
    let color = [0.75, 0.5, 0.25];
    for name in ["multiscatterColor", "multiscatterColorFactor"] {
        let read = draft(&format!(r#""{name}": [0.75, 0.5, 0.25], "scatterAnisotropy": -0.5"#));
        assert_eq!(read, (Some((color, -0.5)), String::new()));
    }
    assert_eq!(draft(""), (None, String::new()));
    let (clamped, warnings) = draft(r#""multiscatterColor": [2, 0.5, -1], "scatterAnisotropy": 1"#);
    assert_eq!(clamped, Some(([1.0, 0.5, 0.0], 0.999)));
    assert!(warnings.contains("multiscatter colour") && warnings.contains("anisotropy"), "{warnings}");
    let new = |members: &str| scattering(with(&format!(r#""KHR_materials_scatter": {{ {members} }}"#), thick));
    assert_eq!(new(r#""scatterStrengthFactor": 0.5"#), (Some(([0.5; 3], 0.0)), String::new()));
    assert_eq!(new(r#""multiscatterColorFactor": [1, 1, 1]"#), (None, String::new()));
    let full = r#""KHR_materials_scatter": { "scatterStrengthFactor": 1 }"#;
    assert!(scattering(with(full, "")).1.contains("thickness"));
    assert!(scattering(with(full, r#""thicknessFactor": 1"#)).1.contains("attenuat"));
}

#[test]
fn broken_media_are_clamped_or_refused_in_a_sentence() {
    let json = |volume: &str, scatter: &str| {
        format!(
            r#""name": "jelly", "extensions": {{ "KHR_materials_volume": {{ {volume} }},
            "KHR_materials_volume_scatter": {{ {scatter} }} }}"#
        )
    };
    let thick = r#""thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.5, 0.25, 0.125]"#;
    let color = r#""multiscatterColor": [0.75, 0.5, 0.25]"#;
    for (volume, scatter, known) in [
        (thick, r#""multiscatterColor": [1e39, 0.5, 0.25]"#, "multiscatter colour"),
        (thick, r#""multiscatterColor": [-1e39, 0.5, 0.25]"#, "multiscatter colour"),
        (thick, r#""multiscatterColor": [0.75, 0.5, 0.25], "scatterAnisotropy": 1e39"#, "anisotropy"),
        (thick, r#""multiscatterColor": [0.75, 0.5, 0.25], "scatterAnisotropy": -1"#, "anisotropy"),
        (r#""thicknessFactor": -1, "attenuationDistance": 0.5"#, color, "thickness"),
        (r#""attenuationDistance": 0.5, "attenuationColor": [0.5, 0.25, 0.125]"#, color, "thickness"),
        (
            r#""thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [1, 1, 1]"#,
            color,
            "nothing is attenuated",
        ),
        (
            r#""thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0, -1, 2]"#,
            color,
            "attenuation colour",
        ),
    ] {
        let (material, warnings) = material(&json(volume, scatter));
        assert!(warnings.join("; ").contains(known), "{volume} {scatter}: {warnings:?}");
        let Some(volume) = material.volume else { continue };
        let media = volume.scattering.iter().flat_map(|s| [s.color[0], s.color[1], s.color[2], s.anisotropy.abs()]);
        assert!(volume.attenuation_color.into_iter().chain(media).all(|x| (0.0..=1.0).contains(&x)), "{volume:?}");
    }
    for volume in
        [r#""thicknessFactor": 1, "attenuationDistance": -0.5"#, r#""thicknessFactor": 1, "attenuationDistance": 0"#]
    {
        let problem = problem(&with_material(&json(volume, color)));
        assert!(problem.contains("attenuation distance") && problem.contains("jelly"), "{problem}");
    }
    // no number of JSON
    let problem = problem(&with_material(&json(thick, r#""scatterAnisotropy": NaN"#)));
    assert!(!problem.is_empty(), "{problem}");
}

#[test]
fn unusual_indices_of_refraction() {
    let with = |ior: &str| {
        material(&format!(
            r#""pbrMetallicRoughness": {{ "metallicFactor": 0.5, "baseColorFactor": [0.5, 0, 1, 1] }},
            "extensions": {{ "KHR_materials_ior": {{ "ior": {ior} }} }}"#
        ))
    };
    let (low, warnings) = with("0.5");
    assert_eq!(low.ior, 1.0);
    assert!(warnings[0].contains("raised"), "{warnings:?}");
    let (mirror, warnings) = with("0");
    assert_eq!((mirror.metallic, mirror.base_color, mirror.ior), (1.0, [0.75, 0.5, 1.0], 1.5));
    assert!(warnings[0].contains("white metal"), "{warnings:?}");
}

#[test]
fn textures_of_transmission_are_ignored_with_a_warning() {
    let (_, warnings) = material(
        r#""extensions": {
        "KHR_materials_transmission": { "transmissionTexture": { "index": 9 } },
        "KHR_materials_diffuse_transmission": { "diffuseTransmissionColorTexture": { "index": 9 } },
        "KHR_materials_volume": { "thicknessFactor": 1, "thicknessTexture": { "index": 9 } } }"#,
    );
    assert_eq!(warnings.len(), 3, "{warnings:?}");
}

#[test]
fn what_is_no_radiance_is_refused() {
    let problem = problem(&with_material(r#""name": "lamp", "emissiveFactor": [-1, 0, 0]"#));
    assert!(problem.contains("lamp") && problem.contains("radiance"), "{problem}");
}
