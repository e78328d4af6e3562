//! What a user edits: meshes, instances, materials, textures, lights, an environment and a camera. Kernels see its flattened form,
//! [`crate::buffers::SceneBuffers`].
//!
//! ```
//! use restir_host::buffers::SceneBuffers;
//! use restir_host::scene::{Camera, Light, LightKind, Material, Mesh, Scene};
//! use restir_shared::glam::DVec3;
//!
//! let mut scene = Scene { name: "table".to_owned(), ..Scene::default() };
//! let wood = scene.add_material(Material::diffuse("wood", [0.4, 0.25, 0.1]));
//! scene.add_mesh("top", wood, Mesh::cuboid(DVec3::new(-1.0, -0.1, -1.0), DVec3::new(1.0, 0.0, 1.0)));
//! scene.add_mesh("ball", wood, Mesh::sphere(DVec3::Y * 0.3, 0.3, 2));
//! let kind = LightKind::Point { position: DVec3::new(1.0, 2.0, 1.0) };
//! scene.lights.push(Light { name: "lamp".to_owned(), intensity: [10.0; 3], kind });
//! scene.camera = Some(Camera::pinhole(DVec3::new(0.0, 1.5, 3.0), DVec3::ZERO, DVec3::Y, 0.7));
//!
//! assert!(scene.has_light());
//! let buffers = SceneBuffers::build(&scene)?;
//! assert_eq!(buffers.header.triangle_count, 12 + 20 * 16);
//! assert_eq!(buffers.header.light_count, 1);
//! # Ok::<(), restir_host::Error>(())
//! ```

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::Error;

mod animation;
mod boxes;
pub mod builtin;
mod camera;
mod camera_path;
pub(crate) mod closed;
#[cfg(feature = "gltf")]
mod coarse;
mod default_light;
mod dim;
mod emitters;
mod environment;
#[cfg(feature = "gltf")]
pub mod export;
#[cfg(feature = "gltf")]
pub mod gltf;
mod light;
mod material;
mod nesting;
mod origin;
mod rig;
mod shapes;
pub mod subsurface;
mod texture;
mod touching;

pub use animation::{Animation, Blackout, Emitter, Motion, Pose};
pub use camera_path::{CameraPath, Keyframe};
pub use dim::EMISSION_RANGE;
pub use light::{Environment, Light, LightKind};
pub use material::{AlphaMode, Material, TextureUse, UvSet, Volume, VolumeScattering};
pub use rig::{
    Attachment, Deformation, Influences, Interpolation, MorphTarget, Node, Part, Placement, Property, Rig, Skin,
    Skinning, Track,
};
pub use texture::{Filter, Texels, Texture, Wrap};

/// A scene: instances of meshes, materials, lights, a camera.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for messages: a built-in scene's name or a file.
    pub name: String,
    /// Triangle meshes in their own space, shared between copies of the scene.
    pub meshes: Vec<Arc<Mesh>>,
    /// Placed meshes, in the space of the scene: that of the world, or moved by its [origin](Self::origin).
    pub instances: Vec<Instance>,
    /// The materials that meshes refer to.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub textures: Vec<Texture>,
    /// Lights without a surface, in the space of the scene. Emissive surfaces are meshes of an emissive material.
    pub lights: Vec<Light>,
    /// Light from all around; black without.
    pub environment: Option<Environment>,
    /// The camera; `None` is framed automatically, see [`Camera::framing`].
    pub camera: Option<Camera>,
    /// How it changes with time. What does not ask for a time sees the scene at time 0.
    pub animation: Animation,
    /// Where in the world the origin of the scene's coordinates is. It is zero but for a scene that was far from the world's origin and has
    /// been moved near its own ([`Self::move_to_origin`]), as the import does: all coordinates of the scene, and of cameras
    /// that see it, are those of the world minus this. The nodes of a rig alone stay in the world.
    pub origin: DVec3,
    /// Image size that suits the scene, in pixels.
    pub default_size: Option<[u32; 2]>,
    /// The files that it was read from: a document and what that refers to. None of a scene that was made otherwise.
    pub files: Vec<PathBuf>,
    /// What the importer skipped or assumed, a sentence each.
    pub warnings: Vec<String>,
}

/// An indexed triangle mesh with one material. Counter-clockwise is the front side.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit shading normals, one a vertex; empty for a faceted mesh.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one a vertex; empty without.
    pub uvs: Vec<[f32; 2]>,
    /// A second set of them, for the textures that lie on it ([`UvSet::Second`]); empty without.
    pub second_uvs: Vec<[f32; 2]>,
    /// Unit tangents along u, with the sign of the bitangent (normal x tangent) as in glTF, one a vertex; empty to
    /// have them derived from positions and texture coordinates where a normal map needs them.
    pub tangents: Vec<[f32; 4]>,
    /// Three indices a triangle.
    pub indices: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A mesh placed in the scene, whose coordinates are relative to [`Scene::origin`].
///
/// An instance is an object: what light that scatters below a surface crosses without leaving it, and what other objects of the same
/// material are apart from, also where they touch. Where a file has an object in several parts, these are a group.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// From the mesh's space to the scene's. The front side of a triangle stays its front side also under a transform
    /// that mirrors, as in glTF.
    pub transform: DAffine3,
    /// Instances of the same group and material are one object; `None` is a group by itself. In a scene from glTF a node whose mesh
    /// has several primitives is a group.
    pub group: Option<u32>,
}

impl Instance {
    /// An instance that is an object by itself.
    pub fn new(mesh: usize, transform: DAffine3) -> Self {
        Self { mesh, transform, group: None }
    }
}

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection.
    pub position: DVec3,
    /// A point in the middle of the image.
    pub target: DVec3,
    /// Direction that is up in the image; not parallel to the view.
    pub up: DVec3,
    /// Vertical field of view in radians.
    pub vertical_fov: f64,
    /// Radius of the lens, in the scene's unit of length; 0 is a pinhole, with which everything is sharp.
    pub lens_radius: f64,
    /// Distance along the view at which a camera with a lens is sharp; `None` is that of the target.
    pub focus_distance: Option<f64>,
}

/// Coordinates of vertices and cameras beyond this magnitude cannot be rendered: 2^30.
#[doc(hidden)]
pub const MAX_COORDINATE: f64 = 1_073_741_824.0;

impl Scene {
    /// Loads a built-in scene by its name, or else a `.gltf` or `.glb` file.
    ///
    /// # Errors
    /// [`Error::Scene`] for what is neither, with the names of the built-in scenes, and for a broken file;
    /// [`Error::File`] for a file that cannot be read.
    pub fn load(name_or_path: &str) -> Result<Scene, Error> {
        Self::open(Path::new(name_or_path))
    }

    /// As [`Scene::load`], also for a path that is not UTF-8.
    ///
    /// # Errors
    /// As of [`Scene::load`].
    pub fn open(path: &Path) -> Result<Scene, Error> {
        if let Some(name) = path.to_str()
            && let Some(scene) = builtin::scene(name).map(Ok).or_else(|| builtin::varied(name))
        {
            return scene;
        }
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extension == "gltf" || extension == "glb" {
            #[cfg(feature = "gltf")]
            return gltf::load(path);
            #[cfg(not(feature = "gltf"))]
            return Err(Error::Scene {
                scene: path.display().to_string(),
                problem: "this build reads no glTF; build restir-host with its feature `gltf`".to_owned(),
            });
        }
        let names: Vec<&str> = builtin::NAMES.iter().chain(builtin::FAMILIES).map(|(name, _)| *name).collect();
        Err(Error::Scene {
            scene: path.display().to_string(),
            problem: format!("it is neither a built-in scene ({}) nor a .gltf or .glb file", names.join(", ")),
        })
    }

    /// Whether anything in the scene emits.
    pub fn has_light(&self) -> bool {
        let bright = |rgb: &[f32; 3]| rgb.iter().any(|&channel| channel > 0.0);
        let emissive = self
            .instances
            .iter()
            .filter_map(|instance| self.meshes.get(instance.mesh))
            .filter(|mesh| !mesh.indices.is_empty())
            .filter_map(|mesh| self.materials.get(mesh.material))
            .any(|material| bright(&material.emission));
        emissive
            || self.lights.iter().any(|light| bright(&light.intensity))
            || self.environment.as_ref().is_some_and(|e| e.scale > 0.0 && e.pixels.iter().any(bright))
    }

    /// For each instance its object, which is named by the first of its instances. Indices have to be in range.
    pub(crate) fn objects(&self) -> Vec<u32> {
        let mut first = HashMap::new();
        let object = |(index, instance): (u32, &Instance)| {
            let part_of = instance.group.map(|group| (group, self.meshes[instance.mesh].material));
            part_of.map_or(index, |part_of| *first.entry(part_of).or_insert(index))
        };
        (0..).zip(&self.instances).map(object).collect()
    }

    /// Lower and upper corner of all instances' vertices, relative to [`Self::origin`], rounded outwards; an empty scene has its
    /// lower corner at +infinity and its upper at -infinity. Vertices that are NaN do not count.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let [lo, hi] = self.exact_bounds();
        [lo.to_array().map(round_down), hi.to_array().map(round_up)]
    }

    /// [`Self::bounds`] before they are rounded.
    fn exact_bounds(&self) -> [DVec3; 2] {
        if self.animation != Animation::default() {
            return self.at(0.0).exact_bounds();
        }
        let mut lo = DVec3::INFINITY;
        let mut hi = DVec3::NEG_INFINITY;
        for instance in &self.instances {
            for &position in self.meshes.get(instance.mesh).map_or(&[][..], |mesh| &mesh.positions) {
                let point = instance.transform.transform_point3(double(position));
                if !point.is_nan() {
                    lo = lo.min(point);
                    hi = hi.max(point);
                }
            }
        }
        [lo, hi]
    }
}

/// A vector in double precision.
fn double(vector: [f32; 3]) -> DVec3 {
    DVec3::from_array(vector.map(f64::from))
}

fn round_down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}

fn round_up(value: f64) -> f32 {
    -round_down(-value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_scene_is_told_the_names() {
        let message = Scene::load("teapot").unwrap_err().to_string();
        assert!(message.contains("teapot") && message.contains("cornell-mitsuba"), "{message}");
    }

    #[test]
    fn bounds_are_rounded_outwards() {
        let mut scene = Scene::default();
        let points = Mesh { positions: vec![[1.0; 3], [2.0; 3], [f32::NAN; 3]], ..Mesh::default() };
        scene.place_mesh("points", 0, points, DAffine3::from_scale(DVec3::splat(0.1)));
        let [lo, hi] = scene.bounds();
        assert!(f64::from(lo[0]) <= 0.1 && f64::from(lo[0].next_up()) > 0.1);
        assert!(f64::from(hi[0]) >= 0.2 && f64::from(hi[0].next_down()) < 0.2);
        assert_eq!(Scene::default().bounds(), [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]);
    }
}
