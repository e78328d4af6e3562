//! The JSON of a file: what glTF allows and the types of the crate `gltf` do not is mended before they see it.

use std::collections::BTreeSet;

use gltf::json::{self, Root};
use serde::Deserialize;
use serde_json::{Number, Value};

use super::{Problem, is_supported};
use crate::error::ensure;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Whole numbers beyond this need not be exact in double precision: 2^53.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A document, and what of it is left out.
pub(super) struct Parsed {
    pub(super) root: Root,
    pub(super) warnings: Vec<String>,
    /// Of each node.
    pub(super) digits: Vec<Digits>,
}

/// The transform of a node in double precision: the types of the crate `gltf` have single precision.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Digits {
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

/// Reads a document.
pub(super) fn parse(text: &[u8]) -> Result<Parsed, Problem> {
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let mut value: Value = serde_json::from_slice(text).map_err(broken)?;
    check_version(&value)?;
    let mut used = BTreeSet::new();
    extensions(&value, &mut used);
    let declared = value["extensionsUsed"].as_array().map(Vec::as_slice).unwrap_or_default();
    used.extend(declared.iter().filter_map(|name| name.as_str().map(str::to_owned)));
    let unknown = used.iter().filter(|name| !is_supported(name));
    let mut warnings: Vec<String> =
        unknown.map(|name| format!("the extension {name} is not supported and was ignored")).collect();
    let nodes = value["nodes"].as_array().map(Vec::as_slice).unwrap_or_default();
    // what is wrong with a node is said below
    let digits = nodes.iter().map(|node| Digits::deserialize(node).unwrap_or_default()).collect();
    // what is read as it stands keeps its digits, and errors their places
    let root = typed(text).or_else(|problem| {
        drop_channels(&mut value, &mut warnings);
        whole_numbers(&mut value);
        typed(value.to_string().as_bytes()).map_err(|_| problem)
    })?;
    Ok(Parsed { root, warnings, digits })
}

fn typed(text: &[u8]) -> Result<Root, Problem> {
    json::deserialize::from_slice(text).map_err(broken)
}

fn broken(error: json::Error) -> Problem {
    format!("its JSON is broken: {error}; export it again")
}

/// A file of another version has other types, so this comes before all of them.
fn check_version(value: &Value) -> Result<(), Problem> {
    let version = match &value["asset"]["version"] {
        Value::String(version) => version.clone(),
        Value::Number(version) => version.to_string(),
        // glTF 1.0 did without, and had its lists as objects
        _ if value["meshes"].is_object() || value["nodes"].is_object() => "1.0".to_owned(),
        _ => return Ok(()),
    };
    let supported = version == "2" || version.starts_with("2.");
    ensure!(supported, "glTF {version} is not supported; convert it to 2.0");
    Ok(())
}

/// The names of all extensions that have members somewhere.
fn extensions(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::Array(elements) => elements.iter().for_each(|element| extensions(element, names)),
        Value::Object(members) => {
            for (name, member) in members {
                if name == "extensions" {
                    names.extend(member.as_object().into_iter().flatten().map(|(name, _)| name.clone()));
                }
                // what is in extras is nobody else's
                if name != "extras" {
                    extensions(member, names);
                }
            }
        }
        _ => {}
    }
}

/// Leaves out channels of animations that name no node: their target is one of an extension.
fn drop_channels(value: &mut Value, warnings: &mut Vec<String>) {
    let animations = value.get_mut("animations").and_then(Value::as_array_mut);
    for (index, animation) in animations.into_iter().flatten().enumerate() {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        let count = channels.len();
        channels.retain(|channel| channel["target"].get("node").is_some());
        if channels.len() < count {
            let left_out = count - channels.len();
            warnings.push(format!("animation {index}: {left_out} of its channels name no node and were ignored"));
        }
    }
}

/// Numbers like 5126.0 become 5126: both are the same in JSON.
fn whole_numbers(value: &mut Value) {
    match value {
        Value::Array(elements) => elements.iter_mut().for_each(whole_numbers),
        Value::Object(members) => members.values_mut().for_each(whole_numbers),
        Value::Number(number) => {
            let whole = number.as_f64().filter(|x| number.is_f64() && x.fract() == 0.0 && x.abs() < EXACT);
            // the sign of a zero is worth keeping
            if let Some(whole) = whole.filter(|x| *x != 0.0 || x.is_sign_positive()) {
                *number = Number::from(whole as i64);
            }
        }
        _ => {}
    }
}
