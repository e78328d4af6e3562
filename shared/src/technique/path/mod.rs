//! Path tracing: next-event estimation and BSDF sampling, joined by the balance heuristic (Veach 1997, §9.2).
//!
//! A sample is one path from the camera. (`Floor` is the scene that the documentation of [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::Vec3;
//! use restir_shared::rng::{Rng, Sampler};
//! use restir_shared::technique::path::radiance;
//!
//! // a ray down to the point below the lamp, whose radiance is 1; two segments are direct light, more add nothing to a floor alone
//! let ray = Ray { origin: Vec3::Y, direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
//! for depth in [2, 5] {
//!     let samples = (0..16).map(|sample| radiance(&Floor, ray, &Rng::new(0, 0, sample, 7, Sampler::Sobol), depth, false));
//!     let mean = samples.sum::<Vec3>() / 16.0;
//!     assert!((mean - Vec3::ONE).length() < 1e-3);
//! }
//! ```

mod flags;
// the kernels of light inside of things: a pass each
#[doc(hidden)]
pub mod hybrid;
#[doc(hidden)]
pub mod media;
mod params;
#[cfg(not(target_arch = "spirv"))]
mod simd;
mod walk;

pub use crate::transport::Chosen;
pub use flags::PathFlags;
pub use params::*;
#[cfg(not(target_arch = "spirv"))]
#[doc(hidden)]
pub use simd::pixels;
pub use walk::{Numbers, Receiver, Walk};

use crate::camera::{about_pixel, camera_ray};
use crate::film::{CUT, sum_block};
use crate::geometry::Ray;
use crate::layout::FilmPixel;
use crate::rng::Rng;
use crate::scene::{Lights, Surface, Trace};
use glam::{Vec2, Vec3};

/// The sum of one block of samples of the pixel (x, y).
pub fn pixel<S: Trace + Surface + Lights>(scene: &S, params: &PathParams, x: u32, y: u32) -> FilmPixel {
    sum_block(params.first_sample, params.block_log2, |sample| {
        let mut sum = Vec3::ZERO;
        let whole = trace(scene, params, [x, y], sample, &mut sum);
        if whole { sum } else { CUT }
    })
}

/// Where a sample passes the image, in pixels from the upper left corner of its own.
#[inline(always)]
fn place(flags: PathFlags, u: Vec2) -> Vec2 {
    if flags.contains(PathFlags::BLACKMAN_HARRIS) { about_pixel(u) } else { u }
}

/// The first segment of a sample.
#[inline(always)]
fn camera_segment(params: &PathParams, rng: &Rng, features: u32, [x, y]: [u32; 2]) -> Ray {
    let jitter = params.flags.contains(PathFlags::JITTER | PathFlags::BLACKMAN_HARRIS);
    camera_ray(&params.camera, jitter, |u| place(params.flags, u), features, rng, x, y)
}

/// Traces one sample of a pixel, and gives what it finds to `receiver`; false if the device cut it short.
#[inline(always)]
pub fn trace<S: Trace + Surface + Lights, R: Receiver<S::Material>>(
    scene: &S,
    params: &PathParams,
    [x, y]: [u32; 2],
    sample: u32,
    receiver: &mut R,
) -> bool {
    let rng = Rng::new(x, y, sample, params.seed, params.sampler());
    let ray = camera_segment(params, &rng, scene.features(), [x, y]);
    Walk::new(ray).run(scene, &rng, params.max_depth, params.flags.contains(PathFlags::ROULETTE), receiver)
}

/// An estimate of the radiance that arrives along `ray`, whose direction has unit length, over paths of up to
/// `max_depth` segments.
pub fn radiance<S: Trace + Surface + Lights>(scene: &S, ray: Ray, rng: &Rng, max_depth: u32, roulette: bool) -> Vec3 {
    let mut sum = Vec3::ZERO;
    if Walk::new(ray).run(scene, rng, max_depth, roulette, &mut sum) { sum } else { CUT }
}
