//! The binary chunk of a file: buffer views, accessors, and the container around it.

use serde_json::{Value, json};

use super::Problem;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

/// Bytes, and the views and accessors into them.
#[derive(Default)]
pub(super) struct Binary {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
}

impl Binary {
    /// Adds bytes and gives the index of their view.
    pub(super) fn add(&mut self, bytes: &[u8]) -> usize {
        self.view(bytes.iter().copied(), None)
    }

    /// Adds an attribute of every vertex, with its bounds if `bounded`, and gives the index of its accessor.
    pub(super) fn attribute<const N: usize>(&mut self, values: &[[f32; N]], bounded: bool) -> usize {
        let view = self.view(values.as_flattened().iter().flat_map(|x| x.to_le_bytes()), Some(VERTICES));
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": format!("VEC{N}"),
        });
        if bounded {
            let extreme = |of: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
                (0..N).map(|axis| values.iter().fold(start, |bound, value| of(bound, value[axis]))).collect()
            };
            accessor["min"] = json!(extreme(f32::min, f32::INFINITY));
            accessor["max"] = json!(extreme(f32::max, f32::NEG_INFINITY));
        }
        self.accessor(accessor)
    }

    /// Adds the vertices of triangles and gives the index of their accessor.
    pub(super) fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let view = self.view(triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()), Some(INDICES));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * triangles.len(), "type": "SCALAR",
        }))
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }
}

/// The file: a header, a chunk of JSON, and a chunk of bytes if there are any.
pub(super) fn container(mut json: Vec<u8>, bytes: Vec<u8>) -> Result<Vec<u8>, Problem> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut chunks = vec![(b"JSON", json)];
    if !bytes.is_empty() {
        chunks.push((b"BIN\0", bytes));
    }
    let length = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let length = u32::try_from(length).map_err(|_| "it is larger than the 4 GiB of a .glb file".to_owned())?;
    let mut file = Vec::with_capacity(length as usize);
    file.extend(b"glTF\x02\0\0\0");
    file.extend(length.to_le_bytes());
    for (kind, data) in chunks {
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    Ok(file)
}
