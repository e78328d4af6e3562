//! The reference of path tracing: the harness's path tracer in `f64`, which shares no code with it. It knows Lambertian
//! surfaces only, and intersects by brute force.

use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Scene;
use restir_host::technique::{Integral, PixelFilter};
use restir_tests::oracle::{Camera, Oracle, Triangle};

use super::SIZE;
use crate::Error;

/// Brute force has its limits.
const MAX_TRIANGLES: usize = 500;

/// The scene in the oracle's form.
///
/// # Errors
/// [`Error::Environment`] for a scene that is too large, and for a filter that it has not.
pub(super) fn oracle(scene: &Scene, buffers: &SceneBuffers, integral: Integral) -> Result<Oracle, Error> {
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
