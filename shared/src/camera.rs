//! The pinhole camera.

use crate::geometry::Ray;
use crate::layout::CameraParams;
use crate::vec::normalize;
use glam::{Vec2, Vec3};

/// The ray through a point of the image; `pixel` in pixels from the upper left corner.
#[inline(always)]
pub fn primary_ray(camera: &CameraParams, pixel: Vec2) -> Ray {
    let x = pixel.x * camera.inv_width * 2.0 - 1.0;
    let y = 1.0 - pixel.y * camera.inv_height * 2.0;
    let forward = Vec3::from_array(camera.forward);
    let direction = forward + Vec3::from_array(camera.right) * x + Vec3::from_array(camera.up) * y;
    Ray { origin: Vec3::from_array(camera.position), direction: normalize(direction), t_max: Ray::FAR }
}
