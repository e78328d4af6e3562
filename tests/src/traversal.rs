//! Rays as techniques trace them, by which traversal alone is compared and measured.

use crate::scenes::buffers;
use rayon::prelude::*;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_kernels::Case;
use restir_kernels::check::ray_check::{self, PackedRay, RayCheckParams};
use restir_shared::camera::camera_ray;
use restir_shared::geometry::Ray;
use restir_shared::glam::{UVec4, Vec2};
use restir_shared::layout::CameraParams;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::sampling::sample_cosine_hemisphere;
use restir_shared::scene::{Lights, SceneView, Surface, Trace};
use restir_shared::transport::Vertex;

/// The random numbers of bounces and of points on lights.
const BOUNCE: u32 = 8;
const LIGHT: u32 = 9;
const SEED: u32 = 11;

/// What rays are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From the camera: rays of neighbours have most of their way in common.
    Primary,
    /// From what the camera sees, about its normal with a density as the cosine.
    Bounce,
    /// From what the camera sees to points on lights, where any hit will do.
    Shadow,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Bounce, Self::Shadow];

    /// As reports have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Bounce => "diffuse bounce",
            Self::Shadow => "shadow",
        }
    }

    /// The ray of a pixel; [`Ray::NONE`] where there is none: the camera sees nothing there, or nothing of the light.
    fn ray(self, view: &SceneView<'_>, camera: &CameraParams, [x, y]: [u32; 2]) -> Ray {
        let rng = Rng::new(x, y, 0, SEED, Sampler::Sobol);
        let seen = camera_ray(camera, false, |u| u, view.features, &rng, x, y);
        if self == Self::Primary {
            return seen;
        }
        let hit = view.closest(&seen);
        if !hit.is_hit() {
            return Ray::NONE;
        }
        let vertex = Vertex::new(&view.surface(&seen, &hit), &seen, view.features);
        if self == Self::Shadow {
            let connection = vertex.connect(&view.sample_light(rng.draw(LIGHT)));
            return if connection.shines() { connection.shadow } else { Ray::NONE };
        }
        let UVec4 { x: u, y: v, z: key, .. } = rng.draw(BOUNCE);
        let direction = vertex.frame.to_world(sample_cosine_hemisphere(Vec2::new(unit(u), unit(v))));
        let key = Ray::random_key(view.features, key);
        Ray { origin: vertex.origin(direction), direction, t_max: Ray::FAR, key }
    }
}

/// The rays of an image of a scene, one a pixel.
pub fn rays(scene: &SceneBuffers, [width, height]: [u32; 2], kind: Kind) -> Vec<PackedRay> {
    let (view, camera) = (scene.traced_view(), scene.camera.params(width, height));
    let ray = |at| PackedRay::pack(&kind.ray(&view, &camera, [at % width, at / width]));
    (0..width * height).into_par_iter().map(ray).collect()
}

/// The rays of an image as a case of the kernel, specialised to what they are for.
pub fn case(name: &str, scene: &SceneBuffers, [width, height]: [u32; 2], kind: Kind, rays: &[PackedRay]) -> Case {
    let params = RayCheckParams { scene: scene.header, width, height, reserved: [0; 2] };
    let general = Case::new(&ray_check::DESC, format!("{}, {name}", kind.name()), width, height);
    with_constant(general, "any_hit", u32::from(kind == Kind::Shadow))
        .with(&[params])
        .with(&scene.geometry)
        .with(&scene.attributes)
        .with(&scene.texels)
        .with(rays)
        .output()
}

/// The case, specialised to the features of its scene as well.
#[must_use]
pub fn frozen(case: Case, scene: &SceneBuffers) -> Case {
    with_constant(case, "features", scene.features)
}

fn with_constant(mut case: Case, name: &str, value: u32) -> Case {
    for (constant, own) in case.kernel.constants.iter().zip(&mut case.constants) {
        *own = if constant.name == name { value } else { *own };
    }
    case
}

/// Scenes of parity cases: a hall that opens on another, and leaves that are masked and blended.
const SCENES: [&str; 2] = ["ajar", "foliage"];
/// Width and height of the images of parity cases.
const SIZE: [u32; 2] = [24, 16];

/// The parity cases of the kernel.
///
/// # Errors
/// If a scene cannot be built.
pub(crate) fn cases() -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for name in SCENES {
        let scene = buffers(name)?;
        cases.extend(Kind::ALL.map(|kind| case(name, &scene, SIZE, kind, &rays(&scene, SIZE, kind))));
    }
    Ok(cases)
}
