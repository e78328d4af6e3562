//! Small documents, whole and broken.

use glam::DVec3;
use gltf::binary::{Glb, Header};
use restir_shared::layout::TRIANGLE_WORDS;

use super::*;
use crate::buffers::SceneBuffers;

mod attributes;
mod lights;
mod materials;
mod reported;
mod textures;

/// The corners of a unit square, counter-clockwise seen from +z.
const CORNERS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
/// Base64 of their bytes.
const SQUARE: &str = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAA";

/// A document with the square as mesh 0 and the given nodes; `extra` members of the root end in a comma.
fn square(extra: &str, primitive: &str, nodes: &str) -> String {
    format!(
        r#"{{ {extra}
        "asset": {{ "version": "2.0" }},
        "scenes": [{{ "nodes": [0] }}],
        "nodes": {nodes},
        "buffers": [{{ "byteLength": 48, "uri": "data:application/octet-stream;base64,{SQUARE}" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 48 }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }}],
        "meshes": [{{ "name": "square", "primitives": [{primitive}] }}] }}"#
    )
}

const FAN: &str = r#"{ "attributes": { "POSITION": 0 }, "mode": 6 }"#;
const ONE_NODE: &str = r#"[{ "mesh": 0 }]"#;

fn load(text: &str) -> Result<Scene, Problem> {
    import("test.gltf", text.as_bytes(), None)
}

fn problem(text: &str) -> Problem {
    let problem = load(text).unwrap_err();
    assert!(!problem.contains('\n'), "{problem}");
    problem
}

/// Normals of all triangles in world space, as the kernels see them.
fn normals(scene: &Scene) -> Vec<DVec3> {
    let buffers = SceneBuffers::build(scene).unwrap();
    let triangles = &buffers.geometry[4 * buffers.header.triangle_base as usize..];
    let corner = |words: &[u32]| DVec3::from_array([0, 1, 2].map(|axis| f64::from(f32::from_bits(words[axis]))));
    let triangle = |words: &[u32]| [0, 4, 8].map(|word| corner(&words[word..]));
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
    triangles.chunks(4 * TRIANGLE_WORDS as usize).map(|words| normal(triangle(words))).collect()
}

#[test]
fn a_fan_is_read() {
    let scene = load(&square("", FAN, ONE_NODE)).unwrap();
    assert_eq!(scene.meshes[0].positions[2], [1.0, 1.0, 0.0]);
    assert_eq!(scene.meshes[0].indices, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!((scene.camera, scene.has_light()), (None, false));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn primitives_of_a_node_are_one_object() {
    let twice = format!("{FAN}, {FAN}");
    let nodes = r#"[{ "mesh": 0, "children": [1] }, { "mesh": 0 }]"#;
    assert_eq!(load(&square("", &twice, nodes)).unwrap().objects(), [0, 0, 2, 2]);
    assert_eq!(load(&square("", FAN, nodes)).unwrap().objects(), [0, 1]);
}

#[test]
fn strips_alternate_and_lists_drop_the_rest() {
    let strip = load(&square("", r#"{ "attributes": { "POSITION": 0 }, "mode": 5 }"#, ONE_NODE)).unwrap();
    assert_eq!(strip.meshes[0].indices, [[0, 1, 2], [1, 3, 2]]);
    let list = load(&square("", r#"{ "attributes": { "POSITION": 0 } }"#, ONE_NODE)).unwrap();
    assert_eq!(list.meshes[0].indices, [[0, 1, 2]]);
    assert!(list.warnings[0].contains("incomplete"));
}

#[test]
fn instances_share_a_mesh_and_transforms_multiply() {
    let nodes = r#"[{ "children": [1, 2], "translation": [10, 0, 0] }, { "mesh": 0 },
        { "mesh": 0, "matrix": [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,5,0,1] }]"#;
    let scene = load(&square("", FAN, nodes)).unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    let origin = |i: usize| scene.instances[i].transform.transform_point3(DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(origin(0), DVec3::new(11.0, 1.0, 0.0));
    assert_eq!(origin(1), DVec3::new(12.0, 7.0, 0.0));
}

#[test]
fn a_mirrored_square_faces_where_a_mirror_shows_it() {
    for (scale, expected) in [("[-1, 1, 1]", DVec3::Z), ("[1, 1, -1]", DVec3::NEG_Z), ("[-1, -1, 1]", DVec3::Z)] {
        let scene = load(&square("", FAN, &format!(r#"[{{ "mesh": 0, "scale": {scale} }}]"#))).unwrap();
        assert!(normals(&scene).iter().all(|&normal| normal == expected), "{scale}: {:?}", normals(&scene));
    }
}

#[test]
fn rotation_turns_the_camera() {
    let cameras = r#""cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],"#;
    let nodes = r#"[{ "children": [1, 2] }, { "mesh": 0 },
        { "camera": 0, "translation": [3, 0, 0], "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476] }]"#;
    let camera = load(&square(cameras, FAN, nodes)).unwrap().camera.unwrap();
    assert_eq!(camera.position, DVec3::new(3.0, 0.0, 0.0));
    assert!((camera.target - DVec3::new(2.0, 0.0, 0.0)).length() < 1e-6, "{}", camera.target);
    assert_eq!((camera.up, camera.vertical_fov), (DVec3::Y, 0.5));
}

#[test]
fn what_cannot_be_drawn_is_skipped_with_a_warning() {
    for (primitive, word) in [
        (r#"{ "attributes": {} }"#, "positions"),
        (r#"{ "attributes": { "POSITION": 0 }, "mode": 0 }"#, "points"),
        (r#"{ "attributes": { "POSITION": 0 }, "mode": 3 }"#, "lines"),
    ] {
        let scene = load(&square("", primitive, ONE_NODE)).unwrap();
        assert!(scene.instances.is_empty() && scene.warnings[0].contains(word), "{:?}", scene.warnings);
    }
    let scene = load(&square(r#""extensionsUsed": ["KHR_materials_unlit"],"#, FAN, ONE_NODE)).unwrap();
    assert!(scene.warnings[0].contains("KHR_materials_unlit"));
}

#[test]
fn a_required_extension_is_named() {
    let required = r#""extensionsRequired": ["KHR_draco_mesh_compression"],"#;
    assert!(problem(&square(required, FAN, ONE_NODE)).contains("KHR_draco_mesh_compression"));
}

#[test]
fn nodes_have_to_form_trees() {
    assert!(problem(&square("", FAN, r#"[{ "children": [0] }]"#)).contains("twice"));
    assert!(problem(&square("", FAN, r#"[{ "children": [1] }, { "children": [0] }]"#)).contains("twice"));
    assert!(problem(&square("", FAN, r#"[{ "children": [1, 1] }, {}]"#)).contains("twice"));
    assert!(problem(&square("", FAN, r#"[{ "children": [7] }]"#)).contains("node 7"));
    assert!(problem(&square(r#""scene": 3,"#, FAN, ONE_NODE)).contains("scene 3"));
}

#[test]
fn broken_nodes_are_explained() {
    for (node, word) in [
        (r#""rotation": [0, 0, 0, 0]"#, "rotation"),
        (r#""matrix": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]"#, "affine"),
        (r#""scale": [3e38, 1, 1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]"#, "affine"),
        (r#""scale": [1e39, 1, 1]"#, "out of range"),
        (r#""mesh": 4"#, "mesh 4"),
        (r#""camera": 4"#, "camera 4"),
    ] {
        assert!(problem(&square("", FAN, &format!("[{{ {node} }}]"))).contains(word), "{node}");
    }
    let camera = r#""cameras": [{ "name": "eye", "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }],"#;
    let wide = camera.replace(r#""yfov": 1"#, r#""yfov": 4"#);
    assert!(problem(&square(&wide, FAN, r#"[{ "camera": 0 }]"#)).contains("field of view"));
    let far = problem(&square(camera, FAN, r#"[{ "camera": 0, "translation": [0, 1e10, 0] }]"#));
    assert!(far.contains("eye") && far.contains("beyond"), "{far}");
}

#[test]
fn broken_references_are_explained() {
    let primitive = |text: &str| problem(&square("", text, ONE_NODE));
    assert!(primitive(r#"{ "attributes": { "POSITION": 9 } }"#).contains("accessor 9"));
    assert!(primitive(r#"{ "attributes": { "POSITION": 0 }, "indices": 9 }"#).contains("accessor 9"));
    assert!(primitive(r#"{ "attributes": { "POSITION": 0 }, "indices": 0 }"#).contains("SCALAR"));
    assert!(primitive(r#"{ "attributes": { "POSITION": 0 }, "material": 9 }"#).contains("material 9"));
    assert!(primitive(r#"{ "attributes": { "POSITION": 0 }, "mode": 9 }"#).contains("mode"));
}

const VIEW: &str = r#"{ "buffer": 0, "byteLength": 48 }"#;
const ACCESSOR: &str = r#"{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" }"#;

/// The square's document with another accessor or view in the place of its own.
fn with_data(view: &str, accessor: &str) -> String {
    square("", FAN, ONE_NODE).replace(VIEW, view).replace(ACCESSOR, accessor)
}

#[test]
fn ranges_are_checked() {
    let accessor = |offset: u64, count: u64| {
        ACCESSOR.replace(r#""count": 4"#, &format!(r#""byteOffset": {offset}, "count": {count}"#))
    };
    let beyond = |view: &str, accessor: &str| problem(&with_data(view, accessor));
    assert!(beyond(VIEW, &accessor(0, 5)).contains("beyond its buffer view"));
    assert!(beyond(VIEW, &accessor(4, 4)).contains("beyond its buffer view"));
    assert!(beyond(VIEW, &accessor(u64::MAX, 4)).contains("beyond its buffer view"));
    assert!(beyond(VIEW, &accessor(0, u64::MAX)).contains("beyond its buffer view"));
    let ok = accessor(0, 4);
    assert!(beyond(r#"{ "buffer": 0, "byteLength": 49 }"#, &ok).contains("beyond its buffer"));
    assert!(beyond(r#"{ "buffer": 0, "byteLength": 48, "byteOffset": 18446744073709551615 }"#, &ok).contains("beyond"));
    assert!(beyond(r#"{ "buffer": 3, "byteLength": 48 }"#, &ok).contains("buffer 3"));
    assert!(beyond(r#"{ "buffer": 0, "byteLength": 48, "byteStride": 4 }"#, &ok).contains("stride"));
    assert!(load(&with_data(VIEW, &accessor(0, 0))).unwrap().warnings[0].contains("no triangles"));
    assert!(beyond(VIEW, &ok.replace("5126", "77")).contains("component type"));
    assert!(beyond(VIEW, r#"{ "componentType": 5126, "count": 999999999999, "type": "VEC3" }"#).contains("elements"));
}

#[test]
fn a_small_file_cannot_take_all_memory() {
    let many = [r#"{ "attributes": { "POSITION": 0 } }"#; 40].join(",");
    let text = square("", &many, ONE_NODE);
    let without_data = r#"{ "componentType": 5126, "count": 16777216, "type": "VEC3" }"#;
    assert!(problem(&text.replace(ACCESSOR, without_data)).contains("GiB"));
    assert!(problem(&text.replace(ACCESSOR, &without_data.replace("16777216", "130000000"))).contains("GiB"));
    assert_eq!(load(&text).unwrap().meshes.len(), 40);
}

#[test]
fn a_stride_skips_bytes() {
    let view = r#"{ "buffer": 0, "byteLength": 48, "byteStride": 16 }"#;
    let accessor = r#"{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }"#;
    let scene = load(&with_data(view, accessor)).unwrap();
    assert_eq!(scene.meshes[0].positions, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
}

#[test]
fn sparse_accessors_replace_elements() {
    // Indices 0 and 0x3f80 = 16256 in 16 bits, at bytes 10 and 14 of the square's bytes: only the first exists.
    let sparse = |index_offset: u32, count: u32| {
        format!(
            r#"{{ "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {{ "count": {count},
            "indices": {{ "bufferView": 0, "byteOffset": {index_offset}, "componentType": 5123 }},
            "values": {{ "bufferView": 0, "byteOffset": 24 }} }} }}"#
        )
    };
    let scene = load(&with_data(VIEW, &sparse(10, 1))).unwrap();
    assert_eq!(scene.meshes[0].positions, [[1.0, 1.0, 0.0], [0.0; 3], [0.0; 3], [0.0; 3]]);
    assert!(problem(&with_data(VIEW, &sparse(14, 1))).contains("replaces element 16256"));
    assert!(problem(&with_data(VIEW, &sparse(10, 40))).contains("beyond"));
}

#[test]
fn quantized_positions_are_read() {
    let accessor = r#"{ "bufferView": 0, "componentType": 5121, "count": 3, "type": "VEC3", "normalized": true }"#;
    let view = r#"{ "buffer": 0, "byteLength": 36, "byteStride": 4, "byteOffset": 12 }"#;
    let scene = load(&with_data(view, accessor)).unwrap();
    assert_eq!(scene.meshes[0].positions, [[0.0, 0.0, 128.0 / 255.0], [0.0; 3], [0.0; 3]]);
}

#[test]
fn buffers_have_to_be_there() {
    let with_uri = |uri: &str| square("", FAN, ONE_NODE).replace("data:application/octet-stream;base64,", uri);
    assert!(problem(&with_uri("data:text/plain,")).contains("base64"));
    assert!(problem(&with_uri("data:;base64,*")).contains("base64"));
    assert!(problem(&with_uri("https://example.com/")).contains("https://example.com/"));
    assert!(problem(&with_uri("missing-folder/")).contains("missing-folder"));
    let longer = square("", FAN, ONE_NODE).replace(r#""byteLength": 48, "uri""#, r#""byteLength": 480, "uri""#);
    assert!(problem(&longer).contains("48 bytes of the 480"));
    let none = square("", FAN, ONE_NODE).replace(r#", "uri": "data"#, r#", "name": "data"#);
    assert!(problem(&none).contains("no data"));
}

#[test]
fn buffers_are_files_in_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    std::fs::write(folder.path().join("zeros"), [0; 64]).unwrap();
    let uri = format!("data:application/octet-stream;base64,{SQUARE}");
    let import = |name: &str| {
        let text = square("", FAN, ONE_NODE).replace(&uri, name);
        import("test.gltf", text.as_bytes(), Some(folder.path()))
    };
    assert_eq!(import("zeros").unwrap().meshes[0].positions, [[0.0; 3]; 4]);
    assert!(import("folder").unwrap_err().contains("it is a folder"));
    let absolute = folder.path().join("zeros");
    for outside in ["folder/../zeros", "%2e%2e/zeros", absolute.to_str().unwrap(), "file:///zeros"] {
        assert!(import(outside).unwrap_err().contains("relative URI"), "{outside}");
    }
}

#[test]
fn vertices_have_to_be_finite_and_indices_in_range() {
    // The first float is a NaN, then the first index is 1.0 as an integer.
    let nan = square("", FAN, ONE_NODE).replace("base64,AAAA", "base64,AADA");
    let nan = nan.replacen("base64,AADAAA", "base64,AADAfw", 1);
    assert!(problem(&nan).contains("vertex 0 is not finite"));
    let accessors = r#""type": "VEC3" }, { "bufferView": 0, "componentType": 5125, "count": 6, "type": "SCALAR" }"#;
    let indexed = square("", r#"{ "attributes": { "POSITION": 0 }, "indices": 1 }"#, ONE_NODE);
    assert!(problem(&indexed.replace(r#""type": "VEC3" }"#, accessors)).contains("index 1065353216"));
}

#[test]
fn other_versions_and_broken_json_are_refused() {
    assert!(problem(&square("", FAN, ONE_NODE).replace("2.0", "1.0")).contains("1.0"));
    for (least, refused) in [("2.0", false), ("1.0", false), ("2.1", true), ("9.9", true), ("new", true)] {
        let version = format!(r#""version": "2.0", "minVersion": "{least}""#);
        let loaded = load(&square("", FAN, ONE_NODE).replace(r#""version": "2.0""#, &version));
        assert_eq!(loaded.is_err(), refused, "{least}");
    }
    assert!(problem("{").contains("JSON"));
    assert!(problem("").contains("JSON"));
    assert!(problem(&"[".repeat(100_000)).contains("JSON"));
}

/// A binary container with the text and the bytes.
fn container(text: &str, bytes: &[u8]) -> Vec<u8> {
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    Glb { header, json: text.as_bytes().into(), bin: Some(bytes.into()) }.to_vec().unwrap()
}

#[test]
fn a_binary_file_cut_anywhere_is_an_error() {
    let text = square("", FAN, ONE_NODE).replace(r#", "uri": "data"#, r#", "name": "data"#);
    let file = container(&text, &CORNERS.map(f32::to_le_bytes).concat());
    assert_eq!(import("test.glb", &file, None).unwrap().meshes[0].indices.len(), 2);
    for length in 0..file.len() {
        let problem = import("test.glb", &file[..length], None).unwrap_err();
        assert!(!problem.contains('\n'), "{problem}");
    }
}

#[test]
fn a_binary_file_with_a_changed_byte_never_panics() {
    let text = square("", FAN, ONE_NODE).replace(r#", "uri": "data"#, r#", "name": "data"#);
    let file = container(&text, &[0; 48]);
    for position in 0..file.len() {
        for value in [0, b'9', b'"', b'}', 0xff] {
            let mut changed = file.clone();
            changed[position] = value;
            let _ = import("test.glb", &changed, None);
        }
    }
}
