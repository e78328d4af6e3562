//! What users of comparable loaders reported: files that glTF allows, or nearly so, and that a strict reader calls broken.

use super::*;

/// Documents that are read as the square, each written in another way.
#[test]
fn the_same_is_written_in_several_ways() {
    let plain = square("", FAN, ONE_NODE);
    let right = load(&plain).unwrap();
    let floats = plain.replace("5126", "5126.0").replace(r#""mesh": 0"#, r#""mesh": 0.0"#);
    let data = "data:application/octet-stream;base64,";
    let written = [
        format!("\u{feff}{plain}"),
        floats.replace(r#""count": 4"#, r#""count": 4e0"#),
        plain.replace(data, "DATA:application/octet-stream;BASE64,"),
        plain.replace(r#""version": "2.0""#, r#""version": "2""#),
    ];
    for text in &written {
        let scene = load(text).unwrap_or_else(|problem| panic!("{problem}: {text}"));
        let [read, right] = [&scene, &right].map(|scene| (&scene.meshes[0].positions, &scene.meshes[0].indices));
        assert_eq!(read, right);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
    assert_eq!(written.len(), 4);
}

#[test]
fn other_versions_are_named() {
    let old = r#"{ "asset": { "version": "1.0" }, "meshes": { "a": {} }, "nodes": { "b": {} } }"#;
    assert!(problem(old).contains("glTF 1.0 is not supported"));
    assert!(problem(&old.replace(r#""version": "1.0""#, "")).contains("glTF 1.0 is not supported"));
    assert!(problem(&square("", FAN, ONE_NODE).replace("2.0", "3.0")).contains("glTF 3.0 is not supported"));
}

/// Extensions are known by their members, whether or not a file declares them.
#[test]
fn undeclared_extensions_get_the_warning_of_declared_ones() {
    let coat = r#""materials": [{ "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1 } } }],"#;
    let hidden = r#"[{ "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } }]"#;
    let declared = format!(r#"{coat} "extensionsUsed": ["KHR_materials_clearcoat"],"#);
    for (extra, nodes, name) in [
        (coat, ONE_NODE, "KHR_materials_clearcoat"),
        (&*declared, ONE_NODE, "KHR_materials_clearcoat"),
        ("", hidden, "KHR_node_visibility"),
    ] {
        let scene = load(&square(extra, FAN, nodes)).unwrap();
        assert_eq!(scene.warnings, [format!("the extension {name} is not supported and was ignored")]);
    }
    let extras = r#"[{ "mesh": 0, "extras": { "extensions": { "mine": {} } } }]"#;
    assert!(load(&square("", FAN, extras)).unwrap().warnings.is_empty());
}

/// The target of such a channel is one of an extension; other channels stay.
#[test]
fn channels_without_a_node_are_ignored() {
    let animations = r#""animations": [{ "samplers": [{ "input": 1, "output": 0 }], "channels": [
        { "sampler": 0, "target": { "path": "pointer" } }, { "sampler": 0, "target": { "node": 0, "path": "scale" } }] }],"#;
    let times = r#""type": "VEC3" }, { "bufferView": 0, "byteOffset": 8, "componentType": 5126, "count": 1, "type": "SCALAR" }"#;
    let text = square(animations, FAN, ONE_NODE).replacen(r#""type": "VEC3" }"#, times, 1);
    let one = text.replacen(r#""count": 4"#, r#""count": 1"#, 1);
    let warnings = load(&one).unwrap().warnings;
    assert!(warnings.iter().any(|warning| warning.contains("1 of its channels name no node")), "{warnings:?}");
}

/// A primitive may have compressed data beside plain ones, which are read then; without those there is nothing to read.
#[test]
fn draco_is_named_where_there_is_nothing_else() {
    let compressed =
        FAN.replace("\"mode\"", r#""extensions": { "KHR_draco_mesh_compression": { "bufferView": 0 } }, "mode""#);
    let plain = load(&square("", &compressed, ONE_NODE)).unwrap();
    assert_eq!(plain.meshes[0].indices.len(), 2);
    assert!(plain.warnings[0].contains("KHR_draco_mesh_compression"), "{:?}", plain.warnings);
    let alone = square("", &compressed, ONE_NODE).replace(r#""bufferView": 0, "componentType""#, r#""componentType""#);
    assert!(problem(&alone).contains("compressed by KHR_draco_mesh_compression"), "{}", problem(&alone));
}

/// What nothing uses may be missing.
#[test]
fn unused_materials_may_be_broken() {
    let material = |index: u32| {
        let primitive = format!(r#"{{ "attributes": {{ "POSITION": 0 }}, "mode": 6, "material": {index} }}"#);
        let textured = r#"{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }"#;
        let rest = r#""textures": [{ "source": 0 }], "images": [{ "uri": "missing.png" }],"#;
        load(&square(&format!(r#""materials": [{{}}, {textured}], {rest}"#), &primitive, ONE_NODE))
    };
    let scene = material(0).unwrap();
    assert!(
        scene.warnings[0].contains("missing.png") && scene.warnings[0].contains("left out"),
        "{:?}",
        scene.warnings
    );
    assert!(material(1).unwrap_err().contains("missing.png"));
}

#[test]
fn the_size_is_of_the_cameras_aspect() {
    let size = |aspect: &str| {
        let camera = format!(
            r#""cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.5, "znear": 0.1{aspect} }} }}],"#
        );
        load(&square(&camera, FAN, r#"[{ "mesh": 0, "camera": 0 }]"#)).unwrap().default_size
    };
    assert_eq!(size(""), None);
    for (aspect, right) in [("2", [512, 256]), ("0.5", [256, 512]), ("1", [512, 512]), ("1.7777778", [512, 288])] {
        assert_eq!(size(&format!(r#", "aspectRatio": {aspect}"#)), Some(right));
    }
}

/// An open sheet with a thickness is no body, and a closed one in several primitives is.
#[test]
fn open_volumes_are_told() {
    let glass = |thickness: &str| {
        format!(
            r#""materials": [{{ "extensions": {{ "KHR_materials_transmission": {{ "transmissionFactor": 1 }},
            "KHR_materials_volume": {{ "thicknessFactor": {thickness} }} }} }}],"#
        )
    };
    let side = |mode: u32| format!(r#"{{ "attributes": {{ "POSITION": 0 }}, "mode": {mode}, "material": 0 }}"#);
    let warnings =
        |thickness: &str, primitives: &str| load(&square(&glass(thickness), primitives, ONE_NODE)).unwrap().warnings;
    assert!(warnings("0.1", &side(6))[0].contains("not closed"), "{:?}", warnings("0.1", &side(6)));
    assert!(warnings("0", &side(6)).is_empty());
    // both sides of the same square
    let back = r#"{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }"#;
    let turned: Vec<u8> = CORNERS.iter().flat_map(|x| x.to_le_bytes()).chain([0, 2, 1, 0, 3, 2]).collect();
    let text = square(&glass("0.1"), &format!("{}, {back}", side(6)), ONE_NODE)
        .replace(&format!(r#", "uri": "data:application/octet-stream;base64,{SQUARE}""#), "")
        .replace(r#""byteLength": 48"#, r#""byteLength": 54"#)
        .replace(r#""type": "VEC3" }"#, r#""type": "VEC3" }, { "bufferView": 0, "byteOffset": 48, "componentType": 5121, "count": 6, "type": "SCALAR" }"#);
    let scene = import("test.glb", &container(&text, &turned), None).unwrap();
    assert!(scene.warnings.is_empty() && scene.meshes.len() == 2, "{:?}", scene.warnings);
}
