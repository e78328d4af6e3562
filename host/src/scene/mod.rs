//! What a user edits: meshes, instances, materials and a camera. Executors see its flattened form,
//! [`crate::buffers::SceneBuffers`].

use glam::{DAffine3, DVec3};

pub mod builtin;
pub mod gltf;

/// A scene: instances of meshes, materials, a camera.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for messages: a built-in scene's name or a file.
    pub name: String,
    /// Triangle meshes in their own space.
    pub meshes: Vec<Mesh>,
    /// Placed meshes, in world space.
    pub instances: Vec<Instance>,
    /// Materials.
    pub materials: Vec<Material>,
    /// The camera; `None` is framed automatically, see [`Camera::framing`].
    pub camera: Option<Camera>,
    /// Image size that suits the scene, in pixels.
    pub default_size: Option<[u32; 2]>,
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
    /// Three indices a triangle.
    pub indices: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A mesh placed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// From the mesh's space to the world's.
    pub transform: DAffine3,
}

/// A Lambertian material that may emit.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Diffuse reflectance, linear RGB in [0, 1].
    pub reflectance: [f32; 3],
    /// Emitted radiance, linear RGB, not negative.
    pub emission: [f32; 3],
    /// Emits on both sides, not only on the front.
    pub two_sided_emission: bool,
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
}
