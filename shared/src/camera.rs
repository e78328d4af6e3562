//! Rays of the camera: a pinhole or a thin lens ([`CameraParams`]), through the centres of pixels or through points spread about them.
//!
//! ```
//! use restir_shared::camera::{camera_ray, primary_ray};
//! use restir_shared::glam::{Vec2, Vec3};
//! use restir_shared::layout::CameraParams;
//! use restir_shared::rng::{Rng, Sampler};
//!
//! // a pinhole at (0, 0, 5) that looks at the origin, with a vertical field of view of a quarter turn
//! let camera = CameraParams::pinhole(Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y, 0.25, [64, 64]);
//! let center = primary_ray(&camera, Vec2::splat(32.0), Vec2::ZERO);
//! assert!((center.direction - Vec3::NEG_Z).length() < 1e-6);
//! let top = primary_ray(&camera, Vec2::new(32.0, 0.0), Vec2::ZERO);
//! assert!((top.direction.y - 0.5_f32.sqrt()).abs() < 1e-6);
//!
//! // the sample 0 of the pixel (10, 20), somewhere in the pixel
//! let rng = Rng::new(10, 20, 0, 7, Sampler::Sobol);
//! let ray = camera_ray(&camera, true, |u| u, 0, &rng, 10, 20);
//! let image = Vec2::new(ray.direction.x, -ray.direction.y) / -ray.direction.z * 32.0 + 32.0;
//! assert_eq!((image.x as u32, image.y as u32), (10, 20));
//! ```

use crate::geometry::Ray;
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::{LANES, Lanes};
use crate::layout::{CameraParams, FEATURE_BLEND};
use crate::num;
use crate::rng::{self, Rng};
use crate::sampling::{sample_blackman_harris, sample_concentric_disk};
use crate::vec::{length, normalize};

use glam::{UVec4, Vec2, Vec3};

/// The random dimension of a sample's point of the pixel.
const PIXEL_DIMENSION: u32 = 0;
/// The random dimension of a sample's point of the lens.
const LENS_DIMENSION: u32 = 1;
/// The first dimension that is left for others.
pub(crate) const AFTER_CAMERA: u32 = 2;

/// The ray through a point of the image; `pixel` in pixels from the upper left corner. `lens` is a point of the unit
/// disk, where the ray passes the lens; a pinhole has only one such point.
#[inline(always)]
pub fn primary_ray(camera: &CameraParams, pixel: Vec2, lens: Vec2) -> Ray {
    let ray = ray_of_any_length(camera, pixel, lens);
    Ray { direction: normalize(ray.direction), ..ray }
}

/// The ray through a point of the image and the centre of the lens.
#[doc(hidden)]
#[inline(always)]
pub fn central_ray(camera: &CameraParams, pixel: Vec2) -> Ray {
    let x = pixel.x * camera.inv_width * 2.0 - 1.0;
    let y = 1.0 - pixel.y * camera.inv_height * 2.0;
    // in the order of `ray_of_any_length`, so that it has the bits of a pinhole's ray
    let across = Vec3::from_array(camera.forward) + Vec3::from_array(camera.right) * x;
    let direction = normalize(across + Vec3::from_array(camera.up) * y);
    Ray { origin: Vec3::from_array(camera.position), direction, t_max: Ray::FAR, key: 0 }
}

/// [`primary_ray`], but for the length of its direction, which is that on the camera's image plane.
#[inline(always)]
fn ray_of_any_length(camera: &CameraParams, pixel: Vec2, lens: Vec2) -> Ray {
    let x = pixel.x * camera.inv_width * 2.0 - 1.0;
    let y = 1.0 - pixel.y * camera.inv_height * 2.0;
    let right = Vec3::from_array(camera.right);
    let up = Vec3::from_array(camera.up);
    let (lens_x, lens_y) = (lens.x * camera.lens_right, lens.y * camera.lens_up);
    let direction = Vec3::from_array(camera.forward) + right * (x - lens_x) + up * (y - lens_y);
    let origin = Vec3::from_array(camera.position) + right * lens_x + up * lens_y;
    Ray { origin, direction, t_max: Ray::FAR, key: 0 }
}

/// How far beyond a pixel its corners are taken to lie, in pixels. Rounded products and sums are monotone, so that rays of any length are
/// between those through the corners of the pixel itself; this leaves room for the rounding that makes a direction's length one. Where a
/// pixel is so narrow that it is not room enough, the padding of a box ([`crate::geometry::Slab`]) is.
#[cfg(not(target_arch = "spirv"))]
const MARGIN: f32 = 1.0 / 64.0;

/// Rays of a pinhole that are about the pixel (x, y), in each lane that to one of its corners: every component of the direction of a ray
/// through the pixel, whatever its length, is between those of theirs.
#[doc(hidden)]
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub fn rays_about_pixel(camera: &CameraParams, [x, y]: [u32; 2]) -> Lanes<Ray> {
    let mut rays = Lanes::ZERO;
    for lane in 0..LANES {
        let beyond = |bit: usize| if lane & bit == 0 { -MARGIN } else { 1.0 + MARGIN };
        let corner = Vec2::new(x as f32, y as f32) + Vec2::new(beyond(1), beyond(2));
        rays.set(lane, ray_of_any_length(camera, corner, Vec2::ZERO));
    }
    rays
}

/// The height of a pixel in the middle of the image, at the distance 1 from the camera.
#[doc(hidden)]
#[inline(always)]
pub fn spread(camera: &CameraParams) -> f32 {
    let up = length(Vec3::from_array(camera.up));
    2.0 * camera.inv_height * num::div(up, length(Vec3::from_array(camera.forward)))
}

/// Whether the camera has a lens.
#[inline(always)]
pub fn has_lens(camera: &CameraParams) -> bool {
    num::max(camera.lens_right, camera.lens_up) > 0.0
}

/// Width of the Blackman-Harris filter in pixels: that of Cycles by default.
pub(crate) const BLACKMAN_HARRIS_WIDTH: f32 = 3.0;

/// A point about a pixel, of two uniform numbers, with the density of the Blackman-Harris filter (filter importance sampling: Ernst,
/// Stamminger and Greiner 2006). The mean over such points is the filtered image; none has a weight.
#[doc(hidden)]
#[inline(always)]
pub fn about_pixel(u: Vec2) -> Vec2 {
    let place = |u: f32| 0.5 + sample_blackman_harris(u) * BLACKMAN_HARRIS_WIDTH;
    Vec2::new(place(u.x), place(u.y))
}

/// The camera's ray of a sample of the pixel (x, y): through its centre, or with `jitter` through the point that `place` makes of two
/// uniform numbers, such as [`about_pixel`] or these numbers themselves, which are anywhere in the pixel. It has a random key where the scene's `features` say that there are blended surfaces.
#[inline(always)]
pub fn camera_ray(
    camera: &CameraParams,
    jitter: bool,
    place: impl Fn(Vec2) -> Vec2,
    features: u32,
    rng: &Rng,
    x: u32,
    y: u32,
) -> Ray {
    let words = if jitter | (features & FEATURE_BLEND != 0) { rng.draw(PIXEL_DIMENSION) } else { UVec4::ZERO };
    let within = if jitter { place(Vec2::new(rng::unit(words.x), rng::unit(words.y))) } else { Vec2::splat(0.5) };
    let lens = if has_lens(camera) {
        let words = rng.draw(LENS_DIMENSION);
        sample_concentric_disk(Vec2::new(rng::unit(words.x), rng::unit(words.y)))
    } else {
        Vec2::ZERO
    };
    Ray { key: Ray::random_key(features, words.z), ..primary_ray(camera, Vec2::new(x as f32, y as f32) + within, lens) }
}
