//! Export as binary glTF 2.0, so that other renderers can load any scene.
//!
//! All of a scene is written that glTF has a name for: meshes with their normals, texture coordinates and tangents,
//! instances as nodes, materials with the extensions that the import reads, textures as PNG, punctual lights, the camera.
//! Where glTF's numbers are coarser than the scene's, the exact ones stand in `extras` for [`super::gltf`] to find.
//! Importing the file again gives the scene back: every vertex, matrix, factor and texel has its bits. Left out are the
//! animation, the environment, for which glTF has no name, meshes without a triangle, and the order of meshes and textures: the import
//! numbers them as they are used.
//!
//! Restir renders both sides of a surface, where glTF hides the back of what is not double-sided; what neither emits nor
//! encloses a volume is therefore written as double-sided.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::Scene;
use crate::output::write_atomically;
use crate::{Error, memory};

mod binary;
mod material;
mod mesh;
mod node;
mod texture;

use binary::Binary;

/// What is wrong with a scene, as a sentence without a full stop.
type Problem = String;

/// Writes a scene as a `.glb` file, whole or not at all.
///
/// # Errors
/// [`Error::Scene`] as of [`glb`], [`Error::Memory`], [`Error::File`] if the file cannot be written.
pub fn write(scene: &Scene, path: &Path) -> Result<(), Error> {
    let file = glb(scene)?;
    write_atomically(path, |output| output.write_all(&file))
}

/// A scene as the bytes of a `.glb` file.
///
/// # Errors
/// [`Error::Scene`] for a scene that is inconsistent (an index out of range, a normal for each vertex but one), not
/// finite, or larger than the 4 GiB of such a file; [`Error::Memory`].
pub fn glb(scene: &Scene) -> Result<Vec<u8>, Error> {
    // The bytes are gathered once, and copied into the file.
    memory::check(2 * bytes(scene), &format!("the export of scene {}", scene.name), "choose a smaller scene")?;
    let export = || -> Result<Vec<u8>, Problem> {
        let mut document = Document::default();
        document.add_textures(scene)?;
        document.add_materials(scene)?;
        let meshes = document.add_meshes(scene)?;
        document.add_nodes(scene, &meshes)?;
        document.into_file(scene)
    };
    export().map_err(|problem| Error::Scene { scene: scene.name.clone(), problem })
}

/// About how much a file will hold.
fn bytes(scene: &Scene) -> u64 {
    let meshes = scene.meshes.iter().map(|mesh| {
        12 * (mesh.positions.len() + mesh.normals.len() + mesh.indices.len())
            + 8 * mesh.uvs.len()
            + 16 * mesh.tangents.len()
    });
    let textures = scene.textures.iter().map(|texture| 4 * texture.texels.len());
    meshes.chain(textures).map(|bytes| bytes as u64).sum()
}

/// A file in the making: the arrays of its JSON, and its binary chunk.
#[derive(Default)]
struct Document {
    binary: Binary,
    extensions: BTreeSet<&'static str>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    textures: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    nodes: Vec<Value>,
}

impl Document {
    fn into_file(self, scene: &Scene) -> Result<Vec<u8>, Problem> {
        let mut root = Map::new();
        let mut put = |name: &str, array: Vec<Value>| {
            // glTF has no empty arrays.
            if !array.is_empty() {
                root.insert(name.to_owned(), Value::Array(array));
            }
        };
        let nodes: Vec<usize> = (0..self.nodes.len()).collect();
        put("images", self.images);
        put("samplers", self.samplers);
        put("textures", self.textures);
        put("materials", self.materials);
        put("meshes", self.meshes);
        put("cameras", self.cameras);
        put("nodes", self.nodes);
        put("accessors", self.binary.accessors);
        put("bufferViews", self.binary.views);
        put("extensionsUsed", self.extensions.iter().map(|&name| name.into()).collect());
        if !self.lights.is_empty() {
            root.insert("extensions".to_owned(), json!({ "KHR_lights_punctual": { "lights": self.lights } }));
        }
        if !self.binary.bytes.is_empty() {
            root.insert("buffers".to_owned(), json!([{ "byteLength": self.binary.bytes.len() }]));
        }
        if !nodes.is_empty() {
            let size = scene.default_size.map(|size| json!({ "restir": { "size": size } }));
            root.insert("scene".to_owned(), json!(0));
            root.insert("scenes".to_owned(), json!([{ "nodes": nodes, "extras": size }]));
        }
        let generator = concat!("restir ", env!("CARGO_PKG_VERSION"));
        root.insert("asset".to_owned(), json!({ "version": "2.0", "generator": generator }));
        binary::container(Value::Object(root).to_string().into_bytes(), self.binary.bytes)
    }
}

#[cfg(test)]
mod tests;
