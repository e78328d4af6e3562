//! The camera.

use crate::geometry::Ray;
use crate::layout::CameraParams;
use crate::num;
use crate::vec::normalize;
use glam::{Vec2, Vec3};

/// The ray through a point of the image; `pixel` in pixels from the upper left corner. `lens` is a point of the unit
/// disk, where the ray passes the lens; a pinhole has only one such point.
#[inline(always)]
pub fn primary_ray(camera: &CameraParams, pixel: Vec2, lens: Vec2) -> Ray {
    let x = pixel.x * camera.inv_width * 2.0 - 1.0;
    let y = 1.0 - pixel.y * camera.inv_height * 2.0;
    let right = Vec3::from_array(camera.right);
    let up = Vec3::from_array(camera.up);
    let (lens_x, lens_y) = (lens.x * camera.lens_right, lens.y * camera.lens_up);
    let direction = Vec3::from_array(camera.forward) + right * (x - lens_x) + up * (y - lens_y);
    let origin = Vec3::from_array(camera.position) + right * lens_x + up * lens_y;
    Ray { origin, direction: normalize(direction), t_max: Ray::FAR }
}

/// Whether the camera has a lens.
#[inline(always)]
pub fn has_lens(camera: &CameraParams) -> bool {
    num::max(camera.lens_right, camera.lens_up) > 0.0
}
