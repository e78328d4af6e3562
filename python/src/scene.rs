//! Scenes, which are read from files or made of arrays.

use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use restir::buffers::SceneBuffers;
use restir::scene::{self, Camera, Environment, Instance, Light, LightKind, Material, Mesh, Volume};
use restir::shared::glam::{DAffine3, DMat4, DVec3};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::{array, refused};

/// What a scene is, and what kernels see of it, which is built when it is asked for.
#[derive(Clone, Default)]
struct Inner {
    scene: scene::Scene,
    /// A light above it is added when it is built: an automatic camera does not frame that.
    default_light: bool,
    built: Option<Arc<SceneBuffers>>,
}

/// A scene.
#[pyclass(frozen, module = "restir")]
#[derive(Default)]
pub(crate) struct Scene(Mutex<Inner>);

/// A scene as it stands.
pub(crate) struct Snapshot {
    pub(crate) scene: scene::Scene,
    pub(crate) buffers: Arc<SceneBuffers>,
    /// Lower and upper corner, without the default light.
    bounds: [[f32; 3]; 2],
}

impl Snapshot {
    /// The camera that shows all of it.
    pub(crate) fn framing(&self, [width, height]: [u32; 2]) -> Camera {
        Camera::framing(self.bounds, f64::from(width) / f64::from(height.max(1)))
    }

    /// The scene, seen by a camera of its own.
    pub(crate) fn framed(mut self, size: [u32; 2]) -> scene::Scene {
        self.scene.camera = self.scene.camera.or_else(|| Some(self.framing(size)));
        self.scene
    }
}

/// Three numbers.
type Vector = [f64; 3];
/// Position, target, up, vertical field of view in degrees, radius of the lens, distance in focus.
pub(crate) type CameraTuple = (Vector, Vector, Vector, f64, f64, Option<f64>);

pub(crate) fn camera_of((position, target, up, fov, lens_radius, focus_distance): CameraTuple) -> PyResult<Camera> {
    let pinhole = Camera::pinhole(position.into(), target.into(), up.into(), fov.to_radians());
    let camera = Camera { lens_radius, focus_distance, ..pinhole };
    camera.check().map(|()| camera).map_err(refused)
}

impl Scene {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn edit<T>(&self, edit: impl FnOnce(&mut scene::Scene) -> T) -> T {
        let mut inner = self.inner();
        inner.built = None;
        edit(&mut inner.scene)
    }

    /// The scene as it stands with its light, as kernels see it, and what a camera frames.
    pub(crate) fn snapshot(&self) -> Result<Snapshot, restir::Error> {
        let mut inner = self.inner();
        let (mut scene, bounds) = (inner.scene.clone(), inner.scene.bounds());
        if inner.default_light {
            scene.add_default_light();
        }
        let buffers = match &inner.built {
            Some(built) => built.clone(),
            None => Arc::new(SceneBuffers::build(&scene)?),
        };
        inner.built = Some(buffers.clone());
        Ok(Snapshot { scene, buffers, bounds })
    }
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let scene = py.detach(|| {
            let mut scene = scene::Scene::open(&path)?;
            scene.warn_of_touching_bodies();
            scene.warn_of_nested_bodies();
            scene.warn_of_dim_light();
            Ok::<_, restir::Error>(scene)
        });
        Ok(Self(Mutex::new(Inner { scene: scene.map_err(refused)?, ..Inner::default() })))
    }

    fn copy(&self) -> Self {
        Self(Mutex::new(self.inner().clone()))
    }

    #[getter]
    fn name(&self) -> String {
        self.inner().scene.name.clone()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner().scene.warnings.clone()
    }

    #[getter]
    fn default_size(&self) -> Option<(u32, u32)> {
        self.inner().scene.default_size.map(|[width, height]| (width, height))
    }

    #[getter]
    fn mesh_names(&self) -> Vec<String> {
        self.inner().scene.meshes.iter().map(|mesh| mesh.name.clone()).collect()
    }

    #[getter]
    fn material_names(&self) -> Vec<String> {
        self.inner().scene.materials.iter().map(|material| material.name.clone()).collect()
    }

    #[getter]
    fn instance_count(&self) -> usize {
        self.inner().scene.instances.len()
    }

    /// As [`camera_of`] takes it; none, if it is framed automatically.
    #[getter]
    fn camera(&self) -> Option<CameraTuple> {
        let camera = self.inner().scene.camera?;
        let [position, target, up] = [camera.position, camera.target, camera.up].map(|vector| vector.to_array());
        Some((position, target, up, camera.vertical_fov.to_degrees(), camera.lens_radius, camera.focus_distance))
    }

    fn set_camera(&self, camera: CameraTuple) -> PyResult<()> {
        let camera = camera_of(camera)?;
        self.edit(|scene| {
            scene.animation.rig.release_camera();
            scene.camera = Some(camera.moved(-scene.origin));
        });
        Ok(())
    }

    #[pyo3(signature = (name, *, base_color, emission, metallic, roughness, ior, transmission, two_sided_emission, attenuation=None, mean_free_path=None, anisotropy=0.0))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn add_material(
        &self,
        name: String,
        base_color: [f32; 3],
        emission: [f32; 3],
        metallic: f32,
        roughness: f32,
        ior: f32,
        transmission: f32,
        two_sided_emission: bool,
        attenuation: Option<([f32; 3], f32)>,
        mean_free_path: Option<[f32; 3]>,
        anisotropy: f32,
    ) -> usize {
        let absorbing = attenuation.map(|(color, distance)| Volume::absorbing(color, distance));
        let scattering = mean_free_path.map(|mean| Volume::scattering(base_color, mean, anisotropy));
        let material = Material {
            emission,
            metallic,
            roughness,
            ior,
            transmission,
            two_sided_emission,
            volume: scattering.or(absorbing),
            ..Material::diffuse(name, base_color)
        };
        self.edit(|scene| scene.add_material(material))
    }

    #[pyo3(signature = (name, positions, indices, material, normals=None, uvs=None))]
    fn add_mesh(
        &self,
        name: String,
        positions: PyReadonlyArray2<'_, f32>,
        indices: PyReadonlyArray2<'_, u32>,
        material: usize,
        normals: Option<PyReadonlyArray2<'_, f32>>,
        uvs: Option<PyReadonlyArray2<'_, f32>>,
    ) -> PyResult<usize> {
        let mesh = Mesh {
            name,
            positions: rows("positions", &positions)?,
            indices: rows("indices", &indices)?,
            normals: normals.map_or(Ok(Vec::new()), |normals| rows("normals", &normals))?,
            uvs: uvs.map_or(Ok(Vec::new()), |uvs| rows("uvs", &uvs))?,
            material,
            ..Mesh::default()
        };
        Ok(self.edit(|scene| {
            scene.meshes.push(Arc::new(mesh));
            scene.meshes.len() - 1
        }))
    }

    /// The vertices of a mesh, in its own space.
    fn positions<'py>(&self, py: Python<'py>, mesh: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let positions = self.mesh(mesh)?.positions.clone();
        let shape = [positions.len(), 3];
        positions.into_flattened().into_pyarray(py).reshape(shape)
    }

    fn indices<'py>(&self, py: Python<'py>, mesh: usize) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let indices = self.mesh(mesh)?.indices.clone();
        let shape = [indices.len(), 3];
        indices.into_flattened().into_pyarray(py).reshape(shape)
    }

    fn set_positions(&self, mesh: usize, positions: PyReadonlyArray2<'_, f32>) -> PyResult<()> {
        let positions = rows("positions", &positions)?;
        let expected = self.mesh(mesh)?.positions.len();
        if positions.len() != expected {
            let problem = format!("the mesh has {expected} vertices, and {} positions were given", positions.len());
            return Err(refused(problem));
        }
        self.edit(|scene| Arc::make_mut(&mut scene.meshes[mesh]).positions = positions);
        Ok(())
    }

    #[pyo3(signature = (mesh, transform=None))]
    fn add_instance(&self, mesh: usize, transform: Option<PyReadonlyArray2<'_, f64>>) -> PyResult<usize> {
        let transform = transform.map_or(Ok(DAffine3::IDENTITY), |transform| affine(&transform))?;
        self.mesh(mesh)?;
        Ok(self.edit(|scene| {
            scene.instances.push(Instance::new(mesh, transform));
            scene.instances.len() - 1
        }))
    }

    fn set_transform(&self, instance: usize, transform: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        let (transform, count) = (affine(&transform)?, self.instance_count());
        if instance >= count {
            return Err(refused(format!("there is no instance {instance}; the scene has {count}")));
        }
        self.edit(|scene| scene.instances[instance].transform = transform);
        Ok(())
    }

    #[pyo3(signature = (kind, intensity, position=None, direction=None, inner=0.0, outer=45.0))]
    fn add_light(
        &self,
        kind: &str,
        intensity: [f32; 3],
        position: Option<Vector>,
        direction: Option<Vector>,
        inner: f64,
        outer: f64,
    ) -> PyResult<()> {
        let needed = |name: &str, vector: Option<Vector>| {
            vector.map(DVec3::from_array).ok_or_else(|| refused(format!("a {kind} light has a {name}; give it")))
        };
        let kind = match kind {
            "point" => LightKind::Point { position: needed("position", position)? },
            "spot" => LightKind::Spot {
                position: needed("position", position)?,
                direction: needed("direction", direction)?,
                inner: inner.to_radians(),
                outer: outer.to_radians(),
            },
            "directional" => LightKind::Directional { direction: needed("direction", direction)? },
            other => return Err(refused(format!("there is no light {other:?}; there are: point, spot, directional"))),
        };
        self.edit(|scene| scene.lights.push(Light { name: String::new(), intensity, kind }));
        Ok(())
    }

    fn set_environment(&self, radiance: PyReadonlyArray3<'_, f32>, scale: f32, rotation: f64) -> PyResult<Vec<String>> {
        let image = array::image(&radiance)?;
        let mut warnings = Vec::new();
        let environment = Environment::of_image("array".to_owned(), &image, &mut warnings)
            .and_then(|environment| environment.placed(scale, rotation))
            .map_err(refused)?;
        self.edit(|scene| {
            scene.environment = Some(environment);
            scene.warnings.extend(warnings.clone());
        });
        Ok(warnings)
    }

    #[pyo3(signature = (medium, scale=None))]
    fn fill(&self, medium: &str, scale: Option<f64>) -> PyResult<()> {
        self.edit(|scene| scene.fill(medium, scale)).map_err(refused)
    }

    fn add_default_light(&self) {
        let mut inner = self.inner();
        (inner.default_light, inner.built) = (true, None);
    }

    fn __repr__(&self) -> String {
        let inner = self.inner();
        let scene::Scene { name, meshes, instances, materials, .. } = &inner.scene;
        let [meshes, instances, materials] = [meshes.len(), instances.len(), materials.len()];
        format!("<restir.Scene {name:?}: {meshes} meshes, {instances} instances, {materials} materials>")
    }
}

impl Scene {
    fn mesh(&self, index: usize) -> PyResult<Arc<Mesh>> {
        let inner = self.inner();
        let count = inner.scene.meshes.len();
        let problem = || refused(format!("there is no mesh {index}; the scene has {count}"));
        inner.scene.meshes.get(index).cloned().ok_or_else(problem)
    }
}

/// The rows of an array, each of N values.
fn rows<T: numpy::Element + Copy, const N: usize>(
    name: &str,
    array: &PyReadonlyArray2<'_, T>,
) -> PyResult<Vec<[T; N]>> {
    let view = array.as_array();
    if view.ncols() != N {
        let problem = format!("{name} has {} values a row; give {N}", view.ncols());
        return Err(refused(problem));
    }
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|column| row[column])).collect())
}

/// A transform of a matrix of 4 rows and columns, which multiplies columns from the left, as numpy users have it.
fn affine(matrix: &PyReadonlyArray2<'_, f64>) -> PyResult<DAffine3> {
    let rows: Vec<[f64; 4]> = rows("a transform", matrix)?;
    let rows: [[f64; 4]; 4] = rows.try_into().map_err(|_| refused("a transform has 4 rows and 4 columns"))?;
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(refused("the last row of a transform is 0, 0, 0, 1; transpose it, if that is its last column"));
    }
    Ok(DAffine3::from_mat4(DMat4::from_cols_array_2d(&rows).transpose()))
}
