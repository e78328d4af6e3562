//! The binary chunk of a file: buffer views, accessors, and the container around it.

use gltf::binary::{Glb, Header};
use serde_json::{Value, json};

use super::{Document, Problem};
use crate::error::ensure;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

impl Document {
    /// Adds an attribute of every vertex to those of a mesh, if there are values; positions have bounds.
    pub(super) fn add_attribute<const N: usize>(&mut self, attributes: &mut Value, name: &str, values: &[[f32; N]]) {
        if values.is_empty() {
            return;
        }
        let view = self.view(values.as_flattened().iter().flat_map(|x| x.to_le_bytes()), Some(VERTICES));
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": format!("VEC{N}"),
        });
        if name == "POSITION" {
            let extreme = |of: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
                (0..N).map(|axis| values.iter().fold(start, |bound, value| of(bound, value[axis]))).collect()
            };
            accessor["min"] = json!(extreme(f32::min, f32::INFINITY));
            accessor["max"] = json!(extreme(f32::max, f32::NEG_INFINITY));
        }
        attributes[name] = self.add("accessors", accessor).into();
    }

    /// Adds the vertices of triangles and gives the index of their accessor.
    pub(super) fn add_triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let view = self.view(triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()), Some(INDICES));
        let count = 3 * triangles.len();
        let accessor = json!({ "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" });
        self.add("accessors", accessor)
    }

    /// Adds numbers of tracks or matrices, with the bounds that glTF wants of times, and gives the index of their accessor.
    pub(super) fn add_floats(&mut self, values: &[f32], kind: &str) -> usize {
        let view = self.view(values.iter().flat_map(|x| x.to_le_bytes()), None);
        let width = match kind {
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let count = values.len() / width;
        let mut accessor = json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind });
        if width == 1 {
            accessor["min"] = json!([values.iter().copied().fold(f32::INFINITY, f32::min)]);
            accessor["max"] = json!([values.iter().copied().fold(f32::NEG_INFINITY, f32::max)]);
        }
        self.add("accessors", accessor)
    }

    /// Adds the joints of every vertex and gives the index of their accessor.
    pub(super) fn add_joints(&mut self, joints: &[[u16; 4]]) -> usize {
        let view = self.view(joints.as_flattened().iter().flat_map(|i| i.to_le_bytes()), Some(VERTICES));
        let accessor =
            json!({ "bufferView": view, "componentType": UNSIGNED_SHORT, "count": joints.len(), "type": "VEC4" });
        self.add("accessors", accessor)
    }

    /// Adds bytes and gives the index of their view.
    pub(super) fn view(&mut self, bytes: impl IntoIterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.add("bufferViews", view)
    }
}

/// The file: a header, a chunk of JSON, and a chunk of bytes if there are any.
pub(super) fn container(json: String, bytes: Vec<u8>) -> Result<Vec<u8>, Problem> {
    // The length is worked out as it is written.
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let bin = (!bytes.is_empty()).then(|| bytes.into());
    let file = Glb { header, json: json.into_bytes().into(), bin }.to_vec().map_err(|error| error.to_string())?;
    ensure!(u32::try_from(file.len()).is_ok(), "it is larger than the 4 GiB of a .glb file");
    Ok(file)
}
