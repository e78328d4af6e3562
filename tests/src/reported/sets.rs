//! Textures of one material on several sets of texture coordinates.

use super::{BUMPS, COLORS, METALLIC_ROUGHNESS, Reported, Right, TRANSLUCENT, stage};
use serde_json::{Value, json};

/// A material whose textures lie on two sets, by the numbers of these.
type Subject = fn([u32; 2]) -> Value;

const SUBJECTS: [(&str, Subject); 6] = [
    ("baked emission", |[a, b]| {
        let color = json!({ "baseColorTexture": on(COLORS, a), "metallicFactor": 0.0 });
        json!({ "pbrMetallicRoughness": color, "emissiveTexture": on(COLORS, b), "emissiveFactor": [1.0, 0.5, 1.0] })
    }),
    ("normal map", |[a, b]| {
        let color = json!({ "baseColorTexture": on(COLORS, a), "metallicFactor": 0.0, "roughnessFactor": 0.4 });
        json!({ "pbrMetallicRoughness": color, "normalTexture": on(BUMPS, b) })
    }),
    ("mask", |[a, b]| {
        let color =
            json!({ "baseColorTexture": on(TRANSLUCENT, b), "metallicRoughnessTexture": on(METALLIC_ROUGHNESS, a) });
        json!({ "pbrMetallicRoughness": color, "alphaMode": "MASK", "alphaCutoff": 0.5 })
    }),
    ("metalness", |[a, b]| {
        let metal = json!({ "baseColorTexture": on(COLORS, a), "metallicRoughnessTexture": on(METALLIC_ROUGHNESS, b) });
        json!({ "pbrMetallicRoughness": metal })
    }),
    ("specular factor", |[a, b]| {
        json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.4 }, "extensions": {
            "KHR_materials_specular": {
                "specularTexture": on(TRANSLUCENT, b), "specularColorTexture": on(COLORS, a) } } })
    }),
    ("set of a transform", |[a, b]| {
        let mut moved = on(COLORS, b);
        moved["extensions"] = json!({ "KHR_texture_transform": { "texCoord": a, "scale": [1.5, 0.7] } });
        let color = json!({ "baseColorTexture": moved, "metallicFactor": 0.0 });
        json!({ "pbrMetallicRoughness": color, "emissiveTexture": on(COLORS, b), "emissiveFactor": [0.4, 0.5, 0.6] })
    }),
];

fn on(texture: usize, set: u32) -> Value {
    json!({ "index": texture, "texCoord": set })
}

/// The same picture, whatever the numbers of the sets, and whether or not others lie between them.
pub(super) fn files() -> Vec<Reported> {
    let numbered = |(name, subject): (&str, Subject)| {
        [[1, 0], [0, 2]].map(|numbers| Reported {
            name: format!("{name} on sets {numbers:?}"),
            file: file(subject(numbers), numbers),
            right: Right::Picture {
                same: file(subject([0, 1]), [0, 1]),
                wrong: file(subject([0, 0]), [0, 1]),
                within: 0.0,
            },
        })
    };
    SUBJECTS.into_iter().flat_map(numbered).collect()
}

/// A stage whose meshes have their own texture coordinates and others under these numbers; a set between them fits nothing.
fn file(subject: Value, numbers: [u32; 2]) -> Vec<u8> {
    let mut file = stage(subject);
    let others = [[0.1, 0.9], [0.4, 0.2], [0.8, 0.3], [1.9, 0.7]];
    let others = file.floats(others.as_flattened(), 2);
    let between = file.floats(&[7.0; 8], 2);
    for mesh in file.document["meshes"].as_array_mut().into_iter().flatten() {
        let attributes = &mut mesh["primitives"][0]["attributes"];
        let own = attributes["TEXCOORD_0"].take();
        for set in 0..=numbers[0].max(numbers[1]) {
            attributes[format!("TEXCOORD_{set}")] = match numbers.iter().position(|&number| number == set) {
                Some(0) => own.clone(),
                Some(_) => json!(others),
                None => json!(between),
            };
        }
    }
    file.glb()
}
