//! Import of glTF 2.0, `.gltf` and `.glb`.
//!
//! The import reads meshes (triangles, strips and fans) with normals, tangents and texture coordinates, their morph targets and
//! skins, the node hierarchy, animations of nodes and weights, the first perspective camera, materials with their alpha and their textures
//! (PNG and JPEG), and the extensions in [`SUPPORTED_EXTENSIONS`]. What is skipped or replaced gets a warning: textures of
//! transmission and thickness, vertex colours, the range of lights, a third set of texture coordinates in one material. Occlusion
//! textures are not needed.
//!
//! The file is untrusted. The `gltf` crate only gives the structs of the JSON; its readers and its validation index
//! without checks, so every reference and every range is checked here.
//!
//! ```
//! // a triangle, whose three corners are 36 bytes in base64
//! let text = r#"{ "asset": { "version": "2.0" },
//!     "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }],
//!     "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
//!     "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
//!     "meshes": [{ "name": "sail", "primitives": [{ "attributes": { "POSITION": 0 } }] }],
//!     "nodes": [{ "mesh": 0, "translation": [0, 0, 5] }], "scenes": [{ "nodes": [0] }], "scene": 0 }"#;
//! let path = &std::env::temp_dir().join(format!("restir-sail-{}.gltf", std::process::id()));
//! std::fs::write(path, text)?;
//!
//! let scene = restir_host::scene::gltf::load(path)?;
//! assert_eq!(scene.meshes[0].positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
//! assert_eq!(scene.bounds(), [[0.0, 0.0, 5.0], [1.0, 1.0, 5.0]]);
//! # std::fs::remove_file(path).ok();
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::DAffine3;
use gltf::json::{self, Index, Root, root::Get};

use super::{Part, Scene, Track};
use crate::error::ensure;
use crate::error::gib;
use crate::{Error, input};

mod accessor;
mod animation;
mod attribute;
mod budget;
mod buffer;
mod container;
mod deform;
mod document;
pub(super) mod exact;
mod image;
mod light;
mod material;
mod mesh;
mod node;
mod origin;
mod rig;
mod texture;
mod uri;

/// Scattering interiors, a draft of Khronos.
pub(in crate::scene) const VOLUME_SCATTER: &str = "KHR_materials_volume_scatter";
/// The draft that replaces it (pull request 2579 of Khronos' glTF). It cannot say that light enters by Lambert's law, so it is not written.
pub(in crate::scene) const SCATTER: &str = "KHR_materials_scatter";

/// The glTF extensions that are read; a file that requires another is refused, one that only uses it gets a warning.
pub const SUPPORTED_EXTENSIONS: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    VOLUME_SCATTER,
    SCATTER,
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

const DRACO: &str = "KHR_draco_mesh_compression";
/// The glTF extensions for want of which a file is refused that only uses them, where it holds nothing else in their place.
pub const REFUSED_EXTENSIONS: &[&str] = &[DRACO];

/// What is wrong with a file, as a sentence without a full stop.
type Problem = String;

/// Loads the default scene of a file, or its first if none is the default.
///
/// # Errors
/// [`Error::File`] if the file cannot be read, [`Error::Scene`] if it is broken or requires an extension that is not
/// supported.
pub fn load(path: &Path) -> Result<Scene, Error> {
    let bytes = read(path).map_err(|error| Error::cannot_read(path, error))?;
    let name = path.display().to_string();
    let mut scene = import(&name, &bytes, path.parent()).map_err(|problem| Error::Scene { scene: name, problem })?;
    scene.files.push(path.to_owned());
    Ok(scene)
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = input::open(path)?;
    let (length, most) = (file.metadata()?.len(), budget::max_bytes());
    if length > most {
        let [length, most] = [length, most].map(gib);
        return Err(io::Error::other(format!("it has {length}, more than the {most} that may be read")));
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

pub(super) fn import(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Scene, Problem> {
    let (text, blob) = container::split(bytes)?;
    let document::Parsed { root, warnings, digits } = document::parse(text)?;
    check_support(&root)?;
    let mut file_room = budget::max_bytes();
    let buffers = buffer::load_all(&root, blob, folder, &mut file_room)?;
    let document = Document { root: &root, buffers, digits };
    document.check_memory()?;
    let mut importer = Importer {
        document,
        folder,
        file_room,
        scene: Scene { name: name.to_owned(), files: files(&root, folder), ..Scene::default() },
        subject: String::new(),
        meshes: BTreeMap::new(),
        needs: Vec::new(),
        textures: BTreeMap::new(),
        images: BTreeMap::new(),
        tracks: Vec::new(),
        movers: rig::Movers::default(),
        places: Vec::new(),
        rigged: Vec::new(),
    };
    warnings.into_iter().for_each(|warning| importer.warn(warning));
    importer.add_materials()?;
    importer.add_animations()?;
    importer.add_nodes()?;
    importer.add_rig()?;
    importer.move_to_origin()?;
    importer.scene.warn_of_coarse_vertices();
    Ok(importer.scene)
}

/// The files that the document refers to.
fn files(root: &Root, folder: Option<&Path>) -> Vec<PathBuf> {
    let buffers = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let images = root.images.iter().filter_map(|image| image.uri.as_deref());
    buffers.chain(images).filter_map(|uri| uri::file(uri, folder)).collect()
}

/// The JSON and the bytes that it refers to.
struct Document<'a> {
    root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
    /// Of each node its transform in double precision.
    digits: Vec<document::Digits>,
}

impl<'a> Document<'a> {
    /// An object of the JSON; `reference` says who refers to it, and what it is.
    fn get<T>(&self, index: Index<T>, reference: &str) -> Result<&'a T, Problem>
    where
        Root: Get<T>,
    {
        self.root.get(index).ok_or_else(|| format!("{reference} {index}, which does not exist"))
    }
}

/// A scene in the making.
struct Importer<'a> {
    document: Document<'a>,
    folder: Option<&'a Path>,
    /// Bytes that may still be read from files.
    file_room: u64,
    scene: Scene,
    /// What is being read, as it stands before warnings and problems.
    subject: String,
    /// Which meshes of the scene came from which of the file.
    meshes: BTreeMap<Index<json::Mesh>, Range<usize>>,
    /// What each of the scene's materials needs of its meshes.
    needs: Vec<material::Needs>,
    /// Which texture of the scene came from which of the file.
    textures: BTreeMap<Index<json::Texture>, usize>,
    images: BTreeMap<Index<json::Image>, image::Decoded>,
    /// How nodes of the file move.
    tracks: Vec<Track>,
    movers: rig::Movers,
    /// What stands where a node is, and from the node's space to the world's in double precision.
    places: Vec<(Part, DAffine3)>,
    /// The nodes of the rig, by their indices in the file.
    rigged: Vec<usize>,
}

impl Importer<'_> {
    /// Reads `subject`, which all warnings and problems name first.
    fn about<T>(&mut self, subject: String, read: impl FnOnce(&mut Self) -> Result<T, Problem>) -> Result<T, Problem> {
        let outer = std::mem::replace(&mut self.subject, format!("{subject}: "));
        let result = read(self).map_err(|problem| format!("{subject}: {problem}"));
        self.subject = outer;
        result
    }

    fn warn(&mut self, warning: impl Display) {
        let warning = format!("{}{warning}", self.subject);
        if !self.scene.warnings.contains(&warning) {
            self.scene.warnings.push(warning);
        }
    }

    fn warn_if(&mut self, condition: bool, warning: impl Display) {
        if condition {
            self.warn(warning);
        }
    }
}

fn check_support(root: &Root) -> Result<(), Problem> {
    let least = root.asset.min_version.as_deref().unwrap_or("2.0");
    ensure!(is_at_most_2_0(least), "it needs glTF version {least:?}; export it for 2.0");
    let required = root.extensions_required.iter().find(|name| !is_supported(name));
    required.map_or(Ok(()), |name| {
        Err(format!("it requires the glTF extension {name}, which is not supported; export it without"))
    })
}

fn is_at_most_2_0(version: &str) -> bool {
    let numbers = version.split_once('.').and_then(|(major, minor)| Some((major.parse().ok()?, minor.parse().ok()?)));
    numbers.is_some_and(|numbers: (u32, u32)| numbers <= (2, 0))
}

fn is_supported(extension: &str) -> bool {
    SUPPORTED_EXTENSIONS.contains(&extension)
}

/// `name`, or what it is and its index.
fn label(name: Option<&String>, kind: &str, index: impl Display) -> String {
    name.filter(|name| !name.is_empty()).cloned().unwrap_or_else(|| format!("{kind} {index}"))
}

#[cfg(test)]
mod tests;
