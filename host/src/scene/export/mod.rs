//! Export as binary glTF 2.0, so that other renderers can load any scene.
//!
//! All of a scene is written that glTF has a name for: meshes with their normals, texture coordinates and tangents,
//! instances as nodes, materials with the extensions that the import reads, textures as PNG, punctual lights, the camera,
//! the rig with its skins and morph targets, and motions as animations.
//! Where glTF's numbers are coarser than the scene's, the exact ones stand in `extras` for [`super::gltf`] to find.
//! Importing the file again gives the scene back: every vertex, matrix, factor and texel has its bits, and a rig poses as it
//! did; motions of instances are rounded to single precision. Left out are what [`left_out`] names, the environment, for which
//! glTF has no name, meshes without a triangle, and the order of meshes and textures: the import numbers them as they are used.
//!
//! Restir renders both sides of a surface, where glTF hides the back of what is not double-sided; what neither emits nor
//! encloses a volume is therefore written as double-sided.
//!
//! ```
//! use restir_host::scene::{Scene, export};
//!
//! let scene = Scene::load("cornell")?;
//! let path = &std::env::temp_dir().join(format!("restir-export-{}.glb", std::process::id()));
//! export::write(&scene, path)?;
//!
//! // imported again, the scene is the same
//! let imported = Scene::open(path)?;
//! assert_eq!(imported.camera, scene.camera);
//! assert_eq!(imported.materials, scene.materials);
//! assert_eq!(imported.bounds(), scene.bounds());
//! # std::fs::remove_file(path).ok();
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};

use super::{MorphTarget, Scene};
use crate::output::write_atomically;
use crate::{Error, memory};

mod binary;
mod material;
mod mesh;
mod node;
mod rig;
mod texture;

pub use rig::left_out;

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
    // the file is in the world
    let mut world = Cow::Borrowed(scene);
    if scene.origin != DVec3::ZERO {
        world.to_mut().set_origin(DVec3::ZERO);
    }
    let scene = &*world;
    let export = || -> Result<Vec<u8>, Problem> {
        scene.animation.problem(scene).map_or(Ok(()), Err)?;
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
            + 8 * (mesh.uvs.len() + mesh.second_uvs.len())
            + 16 * mesh.tangents.len()
    });
    let deformations = scene.animation.rig.deformations.iter().map(|deformation| {
        let deltas = |target: &MorphTarget| target.positions.len() + target.normals.len() + target.tangents.len();
        let joints = deformation.skinning.iter().flat_map(|skinning| &skinning.sets).map(|set| set.joints.len());
        12 * deformation.targets.iter().map(deltas).sum::<usize>() + 24 * joints.sum::<usize>()
    });
    let textures = scene.textures.iter().map(|texture| texture.texels.bytes());
    meshes.chain(deformations).map(|bytes| bytes as u64).chain(textures).sum()
}

/// A file in the making.
#[derive(Default)]
struct Document {
    /// The arrays of its JSON, by their names.
    arrays: BTreeMap<&'static str, Vec<Value>>,
    extensions: BTreeSet<&'static str>,
    /// Its binary chunk.
    bytes: Vec<u8>,
}

impl Document {
    /// Adds a member to an array and gives its index.
    fn add(&mut self, array: &'static str, member: Value) -> usize {
        let members = self.arrays.entry(array).or_default();
        members.push(member);
        members.len() - 1
    }

    /// The nodes that are in no other one.
    fn roots(&self) -> Vec<usize> {
        let nodes = self.arrays.get("nodes").map_or(&[][..], Vec::as_slice);
        let children = nodes.iter().filter_map(|node| node.get("children")?.as_array()).flatten();
        let children: BTreeSet<u64> = children.filter_map(Value::as_u64).collect();
        (0..nodes.len()).filter(|&node| !children.contains(&(node as u64))).collect()
    }

    fn into_file(mut self, scene: &Scene) -> Result<Vec<u8>, Problem> {
        let lights = self.arrays.remove("lights");
        let mut extras = json!({});
        self.finish_animation(scene, &mut extras);
        let nodes = self.roots();
        let mut root: Value = self.arrays.into_iter().collect();
        // glTF has no empty arrays.
        if !self.extensions.is_empty() {
            root["extensionsUsed"] = json!(self.extensions);
        }
        if let Some(lights) = lights {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        }
        if !self.bytes.is_empty() {
            root["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        }
        if !nodes.is_empty() {
            if let Some(size) = scene.default_size {
                extras["size"] = json!(size);
            }
            root["scene"] = json!(0);
            root["scenes"] = json!([{ "nodes": nodes, "extras": { "restir": extras } }]);
        }
        let generator = concat!("restir ", env!("CARGO_PKG_VERSION"));
        root["asset"] = json!({ "version": "2.0", "generator": generator });
        binary::container(root.to_string(), self.bytes)
    }
}

#[cfg(test)]
mod tests;
