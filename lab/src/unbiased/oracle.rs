//! The reference of path tracing: the harness's path tracer in `f64`, which shares no code with it. It knows Lambertian
//! surfaces only, and intersects by brute force. Of the scene `slab` it is the harness's walk in `f64`.

use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Scene, Volume, VolumeScattering};
use restir_host::technique::{Integral, PixelFilter};
use restir_tests::oracle::{Camera, Oracle, Triangle};
use restir_tests::walk_f64::{Body, Border, Walker, from_above};

use super::SIZE;
use crate::Error;

/// Brute force has its limits.
const MAX_TRIANGLES: usize = 500;

/// What path tracing is compared with.
pub(super) enum Independent {
    /// A scene of surfaces.
    Surfaces(Oracle),
    /// A body under the sky of `slab`.
    Body(Walker, Camera),
}

impl Independent {
    /// # Errors
    /// As of [`oracle`].
    pub(super) fn new(scene: &Scene, buffers: &SceneBuffers, integral: Integral) -> Result<Self, Error> {
        if scene.name != "slab" || integral.filter != PixelFilter::Box {
            return Ok(Self::Surfaces(oracle(scene, buffers, integral)?));
        }
        let missing = || Error::Environment("the scene slab has no body; give a test to what it has".to_owned());
        let walker = slab(scene).ok_or_else(missing)?;
        Ok(Self::Body(walker, Camera::new(&buffers.camera.params(SIZE, SIZE), [SIZE; 2])))
    }

    /// One estimate of a pixel's radiance.
    pub(super) fn pixel(&self, restart: u32, x: u32, y: u32) -> [f64; 3] {
        match self {
            Self::Surfaces(oracle) => oracle.pixel(restart, x, y),
            Self::Body(walker, camera) => walker.pixel(camera, restart, x, y),
        }
    }
}

/// The box of the scene `slab`, which is convex: longer paths than a walk and what it escapes to there are none.
fn slab(scene: &Scene) -> Option<Walker> {
    let mesh = scene.meshes.first()?;
    let volume = scene.materials[mesh.material].volume.as_ref()?;
    let VolumeScattering { color, anisotropy, .. } = *volume.scattering.as_ref()?;
    let corners = mesh.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let (lo, hi) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let g = f64::from(anisotropy);
    Some(Walker {
        body: Body::Box(lo, hi),
        border: Border::Open,
        extinction: Volume::extinction(volume).map(f64::from),
        albedo: color.map(|color| albedo(f64::from(color), g)),
        anisotropy: g,
        sky: from_above,
        orders: [0, u32::MAX],
    })
}

/// The albedo of a half space's colour: van de Hulst's `A = (1 - s) (1 - 0.139 s) / (1 + 1.17 s)` solved for s.
fn albedo(color: f64, g: f64) -> f64 {
    let linear = 1.139 + 1.17 * color;
    let s = (linear - (linear * linear - 4.0 * 0.139 * (1.0 - color)).sqrt()) / (2.0 * 0.139);
    (1.0 - s * s) / (1.0 - g * s * s)
}

/// The scene in the oracle's form.
///
/// # Errors
/// [`Error::Environment`] for a scene that is too large, or lit by anything but its surfaces, and for a filter that it has not.
fn oracle(scene: &Scene, buffers: &SceneBuffers, integral: Integral) -> Result<Oracle, Error> {
    if integral.filter != PixelFilter::Box {
        let problem = "brute force has no filter but the box; test other settings than those of the reference";
        return Err(Error::Environment(problem.to_owned()));
    }
    // what has no time is at time 0
    let scene = &scene.at(0.0);
    let count: usize = scene.instances.iter().map(|i| scene.meshes[i.mesh].indices.len()).sum();
    if count > MAX_TRIANGLES {
        return Err(Error::Environment(format!(
            "{}: {count} triangles are too many for brute force, which takes {MAX_TRIANGLES}; test other settings than \
             those of the reference, as path:roulette=on",
            scene.name
        )));
    }
    if scene.environment.is_some() || !scene.lights.is_empty() {
        let problem = "brute force knows no lights but surfaces; test other settings than those of the reference";
        return Err(Error::Environment(format!("{}: {problem}", scene.name)));
    }
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let material = &scene.materials[mesh.material];
        // rounded, as in the arenas
        let position =
            |i: u32| instance.transform.transform_point3(wide(mesh.positions[i as usize])).as_vec3().as_dvec3();
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        triangles.extend(mesh.indices.iter().map(|&[a, b, c]| Triangle {
            vertices: (if mirrored { [a, c, b] } else { [a, b, c] }).map(position),
            reflectance: wide(material.base_color),
            emission: wide(material.emission),
            two_sided: material.two_sided_emission,
        }));
    }
    let camera = Camera::new(&buffers.camera.params(SIZE, SIZE), [SIZE; 2]);
    Ok(Oracle::new(triangles, camera, integral.max_depth, integral.jitter))
}
