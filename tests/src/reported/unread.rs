//! What loaders stumble over: extensions that are not read, declared or not, and JSON that is unusual.

use super::{Reported, Right, stage};
use crate::gltf_files::{File, painted};
use serde_json::{Value, json};

pub(super) fn files() -> Vec<Reported> {
    [undeclared(), required(), unusual()].into_iter().flatten().collect()
}

fn plain() -> File {
    stage(painted(json!({ "index": 0 })))
}

fn reported(name: impl Into<String>, file: Vec<u8>, right: Right) -> Reported {
    Reported { name: name.into(), file, right }
}

/// What of a document has the extension.
type Place = fn(&mut Value) -> &mut Value;

/// Extensions that are ignored get a warning, wherever they are, also where `extensionsUsed` does not have them.
fn undeclared() -> Vec<Reported> {
    let places: [(&str, Place); 6] = [
        ("KHR_materials_sheen", |root| &mut root["materials"][0]),
        ("KHR_materials_iridescence", |root| &mut root["materials"][0]),
        ("EXT_mesh_gpu_instancing", |root| &mut root["nodes"][0]),
        ("MSFT_texture_dds", |root| &mut root["textures"][0]),
        ("EXT_mesh_manifold", |root| &mut root["meshes"][0]),
        ("EXT_lights_image_based", |root| root),
    ];
    let files = |(name, place): (&'static str, Place)| {
        [true, false].map(|declared| {
            let mut file = plain();
            place(&mut file.document)["extensions"] = json!({ name: {} });
            let file = if declared { file.glb() } else { file.undeclared_glb() };
            let right = Right::Warning(format!("the extension {name} is not supported and was ignored"));
            reported(format!("{name}, declared {declared}"), file, right)
        })
    };
    places.into_iter().flat_map(files).collect()
}

/// What a file cannot be shown without is named.
fn required() -> Vec<Reported> {
    let names = ["EXT_meshopt_compression", "KHR_texture_basisu", "KHR_draco_mesh_compression", "KHR_materials_sheen"];
    let files = names.map(|name| {
        let mut file = plain();
        file.document["extensionsRequired"] = json!([name]);
        reported(format!("{name}, required"), file.glb(), Right::Refusal(name.to_owned()))
    });
    files.into()
}

fn unusual() -> Vec<Reported> {
    let same = |name: &str, edit: fn(String) -> String| {
        let (file, wrong) = (plain(), stage(json!({})));
        let right = Right::Picture { same: plain().glb(), wrong: wrong.glb(), within: 0.0 };
        reported(name, file.edited_glb(edit), right)
    };
    let pointer = |target: Value| {
        let mut file = plain();
        let times = file.floats(&[0.0, 1.0], 1);
        let scales = file.floats(&[1.0; 6], 3);
        file.add(
            "animations",
            json!({ "samplers": [{ "input": times, "output": scales }],
                "channels": [{ "sampler": 0, "target": target }] }),
        );
        file.glb()
    };
    let unnamed = || Right::Warning("1 of its channels name no node".to_owned());
    let unused = |member: &str, value: Value| {
        let mut file = plain();
        file.add(member, value);
        file.glb()
    };
    vec![
        same("a byte order mark", |text| format!("\u{feff}{text}")),
        same("integers written as decimals", |text| {
            text.replace("5126", "5126.0").replace(r#""mode":6"#, r#""mode":6.0"#)
        }),
        same("integers written with exponents", |text| text.replace("5126", "5.126e3")),
        same("a version without its point", |text| text.replace(r#""2.0""#, r#""2""#)),
        same("members that nobody knows", |text| text.replacen('{', r#"{"mine":[{"a":null}],"#, 1)),
        reported(
            "an older version",
            plain().edited_glb(|text| text.replace(r#""2.0""#, r#""1.0""#)),
            Right::Refusal("glTF 1.0 is not supported".to_owned()),
        ),
        reported(
            "a later version",
            plain().edited_glb(|text| text.replace(r#""2.0""#, r#""2.1","minVersion":"2.1""#)),
            Right::Refusal("it needs glTF version \"2.1\"".to_owned()),
        ),
        reported(
            "a channel of a pointer",
            pointer(
                json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": "/materials/0" } } }),
            ),
            unnamed(),
        ),
        reported("a channel without a node", pointer(json!({ "path": "scale" })), unnamed()),
        reported(
            "an image that nothing uses and is missing",
            unused("images", json!({ "uri": "missing.png" })),
            Right::Silence,
        ),
        reported(
            "a material that nothing has and is broken",
            unused("materials", json!({ "name": "broken", "emissiveTexture": { "index": 99 } })),
            Right::Warning("nothing has this material".to_owned()),
        ),
    ]
}
