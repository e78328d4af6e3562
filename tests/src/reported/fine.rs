//! Images of sixteen bits a channel. Each is of one colour, so that factors give its picture; at eight bits it would give another.

use super::{Reported, Right};
use crate::gltf_files::{File, LINEAR, REPEAT, lamp, sampler};
use png::{BitDepth, ColorType};
use serde_json::{Value, json};

/// A texel in the channels of a PNG.
struct Texel {
    color: ColorType,
    channels: &'static [u16],
}

/// A texture of one texel, and what gives the same picture.
struct Case {
    name: &'static str,
    texel: Texel,
    textured: Value,
    /// Another material.
    factors: Value,
    /// The texel of that, if it has a texture.
    other: Option<Texel>,
    within: f64,
}

/// Factors are rounded to single precision.
const ROUNDED: f64 = 1.0e-5;
/// Between two codes of eight bits, decoding sRGB is off by up to 6e-6.
const DECODED: f64 = 5.0e-5;

pub(super) fn files() -> Vec<Reported> {
    let reported = |Case { name, texel, textured, factors, other, within }: Case| Reported {
        name: format!("{name} of sixteen bits"),
        file: file(textured.clone(), Some(png(&texel, BitDepth::Sixteen))),
        right: Right::Picture {
            same: file(factors, other.map(|texel| png(&texel, BitDepth::Sixteen))),
            wrong: file(textured, Some(png(&texel, BitDepth::Eight))),
            within,
        },
    };
    cases().into_iter().map(reported).collect()
}

fn cases() -> Vec<Case> {
    let rgb = |channels| Texel { color: ColorType::Rgb, channels };
    let metal = |members: Value| {
        let mut metal = json!({ "baseColorFactor": [0.9, 0.7, 0.3, 1.0] });
        metal
            .as_object_mut()
            .into_iter()
            .for_each(|metal| metal.extend(members.as_object().cloned().unwrap_or_default()));
        json!({ "pbrMetallicRoughness": metal })
    };
    let paint = |members: Value| json!({ "pbrMetallicRoughness": members, "alphaMode": "MASK", "alphaCutoff": 0.4985 });
    let glow = |factor: Value, strength: f64| json!({ "emissiveFactor": factor, "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } } });
    let lit = |strength: f64| {
        let mut glow = glow(json!([1.0, 1.0, 1.0]), strength);
        glow["emissiveTexture"] = json!({ "index": 0 });
        glow
    };
    let specular = |members: Value| {
        json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.3, "baseColorFactor": [0.0, 0.0, 0.0, 1.0] },
            "extensions": { "KHR_materials_specular": members } })
    };
    let bumps = |scale: f64| {
        json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.2 },
        "normalTexture": { "index": 0, "scale": scale } })
    };
    let texture = json!({ "index": 0 });
    vec![
        Case {
            name: "roughness",
            texel: rgb(&[0, 20_000, 65_535]),
            textured: metal(json!({ "metallicRoughnessTexture": texture })),
            factors: metal(json!({ "roughnessFactor": unit(20_000) })),
            other: None,
            within: ROUNDED,
        },
        Case {
            name: "grey roughness and metalness",
            texel: Texel { color: ColorType::Grayscale, channels: &[30_001] },
            textured: metal(json!({ "metallicRoughnessTexture": texture })),
            factors: metal(json!({ "roughnessFactor": unit(30_001), "metallicFactor": unit(30_001) })),
            other: None,
            within: ROUNDED,
        },
        Case {
            name: "colour",
            texel: rgb(&[51_000, 45_678, 33_333]),
            textured: metal(json!({ "baseColorTexture": texture, "baseColorFactor": [1.0, 1.0, 1.0, 1.0] })),
            factors: metal(json!({ "baseColorFactor": [linear(51_000), linear(45_678), linear(33_333), 1.0] })),
            other: None,
            within: DECODED,
        },
        Case {
            name: "mask",
            texel: Texel { color: ColorType::GrayscaleAlpha, channels: &[65_535, 32_700] },
            textured: paint(json!({ "baseColorTexture": texture })),
            factors: paint(json!({ "baseColorFactor": [1.0, 1.0, 1.0, unit(32_700)] })),
            other: None,
            within: ROUNDED,
        },
        Case {
            name: "dim emission",
            texel: rgb(&[100, 80, 60]),
            textured: lit(3000.0),
            factors: glow(json!([linear(100), linear(80), linear(60)]), 3000.0),
            other: None,
            within: ROUNDED,
        },
        Case {
            name: "specular factor",
            texel: Texel { color: ColorType::GrayscaleAlpha, channels: &[0, 1_150] },
            textured: specular(json!({ "specularTexture": texture })),
            factors: specular(json!({ "specularFactor": unit(1_150) })),
            other: None,
            // little of the light is reflected specularly
            within: 0.1 * ROUNDED,
        },
        Case {
            name: "slope",
            texel: rgb(&[33_268, 32_517, 65_535]),
            textured: bumps(3.0),
            factors: bumps(1.0),
            // three times as far from 32767.5
            other: Some(rgb(&[34_269, 32_016, 65_535])),
            within: ROUNDED,
        },
    ]
}

/// A stage of a material, which may have a texture.
fn file(subject: Value, image: Option<Vec<u8>>) -> Vec<u8> {
    let mut file = File::stage(json!([subject, lamp()]));
    if let Some(image) = image {
        file.texture(&image, sampler(LINEAR, [REPEAT; 2]));
    }
    file.glb()
}

/// An image of two by two times the texel.
fn png(texel: &Texel, depth: BitDepth) -> Vec<u8> {
    let bytes = |channel: u16| match depth {
        BitDepth::Sixteen => channel.to_be_bytes().to_vec(),
        _ => vec![((u32::from(channel) + 128) / 257) as u8],
    };
    let texel_bytes: Vec<u8> = texel.channels.iter().flat_map(|&channel| bytes(channel)).collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 2, 2);
    encoder.set_color(texel.color);
    encoder.set_depth(depth);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&texel_bytes.repeat(4))?;
        writer.finish()
    });
    written.expect("a PNG in memory");
    file
}

fn unit(code: u16) -> f64 {
    f64::from(code) / 65_535.0
}

/// The linear value of an sRGB code (IEC 61966-2-1).
fn linear(code: u16) -> f64 {
    let s = unit(code);
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}
