//! Normals, texture coordinates and tangents.

use super::*;

/// A document with the square, a material, and attributes over `data`, 32-bit floats after the square's.
fn with_attribute(attribute: &str, accessor: &str, data: &[f32], material: &str) -> Result<Scene, Problem> {
    let bytes: Vec<u8> = CORNERS.iter().chain(data).flat_map(|x| x.to_le_bytes()).collect();
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "nodes": [{{ "mesh": 0 }}], "materials": [{{ {material} }}],
        "buffers": [{{ "byteLength": {0} }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48, "byteLength": {1} }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }}, {{ {accessor} }}],
        "meshes": [{{ "name": "square", "primitives": [
            {{ "attributes": {{ "POSITION": 0, {attribute} }}, "mode": 6, "material": 0 }}] }}],
        {TEXTURE} }}"#,
        bytes.len(),
        bytes.len() - 48,
    );
    import("test.glb", &container(&text, &bytes), None)
}

/// A PNG of one texel.
const TEXTURE: &str = r#""textures": [{ "source": 0 }], "images": [{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==" }]"#;
const TEXTURED: &str = r#""pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": 1 } }"#;
const NORMAL_MAPPED: &str = r#""normalTexture": { "index": 0 }"#;
const VEC3: &str = r#""bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3""#;

#[test]
fn normals_are_made_unit_vectors() {
    let z = [0.0, 0.0, 1.0];
    let normals = [[0.0, 3.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, -0.5], z];
    let scene = with_attribute(r#""NORMAL": 1"#, VEC3, normals.as_flattened(), "").unwrap();
    assert_eq!(scene.meshes[0].normals, [[0.0, 1.0, 0.0], [0.6, 0.0, 0.8], [0.0, 0.0, -1.0], z]);
    assert!(scene.warnings.is_empty() && scene.meshes[0].uvs.is_empty());
}

#[test]
fn zero_normals_are_derived_and_broken_ones_refused() {
    let z = [0.0, 0.0, 1.0];
    let mut normals = [[1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]];
    let scene = with_attribute(r#""NORMAL": 1"#, VEC3, normals.as_flattened(), "").unwrap();
    assert_eq!(scene.meshes[0].normals, [normals[0], z, normals[2], z]);
    assert!(scene.warnings[0].contains("2 of its normals are zero"), "{:?}", scene.warnings);
    normals[2][1] = f32::NAN;
    let broken = with_attribute(r#""NORMAL": 1"#, VEC3, normals.as_flattened(), "").unwrap_err();
    assert!(broken.contains("square") && broken.contains("normal of vertex 2"), "{broken}");
}

#[test]
fn vertex_colours_are_ignored_with_a_warning() {
    let scene = with_attribute(r#""COLOR_0": 1"#, VEC3, &[0.5; 12], "").unwrap();
    assert!(scene.warnings[0].contains("vertex colours"), "{:?}", scene.warnings);
}

#[test]
fn texture_coordinates_are_those_of_the_first_texture() {
    let vec2 = r#""bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2""#;
    let data = [0.0, 0.25, 0.5, 0.75, -1.0, 2.0, 3.0, 4.0];
    let scene = with_attribute(r#""TEXCOORD_1": 1"#, vec2, &data, TEXTURED).unwrap();
    assert_eq!(scene.meshes[0].uvs, *data.as_chunks::<2>().0);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let other = with_attribute(r#""TEXCOORD_0": 1"#, vec2, &data, TEXTURED).unwrap();
    assert!(other.meshes[0].uvs.is_empty());
    assert!(other.warnings[0].contains("no texture coordinates 1"), "{:?}", other.warnings);
    let few = with_attribute(r#""TEXCOORD_1": 1"#, &vec2.replace('4', "3"), &data, TEXTURED);
    assert!(few.unwrap_err().contains("for 3"));
}

/// The lower set of the file is the first.
#[test]
fn two_sets_of_texture_coordinates_are_read() {
    let vec2 = r#""bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2""#;
    let accessors = format!(r#"{vec2} }}, {{ {vec2}, "byteOffset": 32"#);
    let data: Vec<f32> = (0..16).map(|i| i as f32).collect();
    let glowing = format!(r#"{TEXTURED}, "emissiveTexture": {{ "index": 0 }}, "emissiveFactor": [1, 1, 1]"#);
    let mesh = |attributes: &str, material: &str| {
        let scene = with_attribute(attributes, &accessors, &data, material).unwrap();
        (scene.meshes[0].clone(), scene.warnings)
    };
    let both = r#""TEXCOORD_1": 1, "TEXCOORD_0": 2"#;
    let (own, warnings) = mesh(both, &glowing);
    assert_eq!((&own.second_uvs[..], &own.uvs[..]), (&data.as_chunks::<2>().0[..4], &data.as_chunks::<2>().0[4..]));
    assert!(warnings.is_empty(), "{warnings:?}");
    let (one, _) = mesh(both, TEXTURED);
    assert!(one.second_uvs.is_empty() && one.uvs == own.second_uvs, "only what is used is read");
    let (lacking, warnings) = mesh(r#""TEXCOORD_0": 2"#, &glowing);
    assert!(lacking.second_uvs.is_empty() && lacking.uvs == own.uvs);
    assert!(warnings[0].contains("no texture coordinates 1"), "{warnings:?}");
}

#[test]
fn texture_coordinates_can_be_integers() {
    let data = [f32::from_bits(0xff00_00ff), f32::from_bits(0x0080_ff00)];
    let read = |kind: &str, normalized: bool| {
        let accessor = format!(
            r#""bufferView": 1, "componentType": {kind}, "count": 4, "type": "VEC2", "normalized": {normalized}"#
        );
        with_attribute(r#""TEXCOORD_1": 1"#, &accessor, &data, TEXTURED).map(|scene| scene.meshes[0].uvs.clone())
    };
    let half = 128.0 / 255.0;
    assert_eq!(read("5121", true).unwrap(), [[1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [half, 0.0]]);
    assert_eq!(read("5121", false).unwrap()[3], [128.0, 0.0]);
    assert!(read("5125", false).unwrap_err().contains("32-bit"));
}

#[test]
fn tangents_are_read_for_normal_maps() {
    let vec4 = r#""bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC4""#;
    let uvs = r#""TEXCOORD_0": 2, "TANGENT": 1, "NORMAL": 0"#;
    let data = [[2.0, 0.0, 0.0, -1.0]; 4];
    let accessors =
        format!(r#"{vec4} }}, {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2", "byteOffset": 0"#);
    let scene = with_attribute(uvs, &accessors, data.as_flattened(), NORMAL_MAPPED).unwrap();
    assert_eq!(scene.meshes[0].tangents, [[1.0, 0.0, 0.0, -1.0]; 4]);
    let textured = TEXTURED.replace(r#", "texCoord": 1"#, "");
    let unmapped = with_attribute(uvs, &accessors, data.as_flattened(), &textured).unwrap();
    assert!(unmapped.meshes[0].tangents.is_empty() && !unmapped.meshes[0].uvs.is_empty());
    let zero = with_attribute(uvs, &accessors, &[0.0; 16], NORMAL_MAPPED).unwrap();
    assert!(
        zero.meshes[0].tangents.is_empty() && zero.warnings.iter().any(|warning| warning.contains("tangents")),
        "{:?}",
        zero.warnings
    );
}

/// glTF 2.0, 3.7.2.1: without normals a mesh is flat, and its tangents must be ignored.
#[test]
fn tangents_without_normals_are_ignored() {
    let vec4 = r#""bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC4""#;
    let data = [0.0, 1.0, 0.0, 1.0].repeat(4);
    let coordinates = r#""TANGENT": 1, "TEXCOORD_0": 2"#;
    let accessors =
        format!(r#"{vec4} }}, {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2", "byteOffset": 0"#);
    let scene = with_attribute(coordinates, &accessors, &data, NORMAL_MAPPED).unwrap();
    assert!(scene.meshes[0].tangents.is_empty() && !scene.meshes[0].uvs.is_empty());
}
