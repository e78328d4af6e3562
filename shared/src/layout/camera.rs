//! The camera.

use crate::num;
use crate::vec::{cross, normalize};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A camera with a thin lens, or a pinhole. `right` and `up` span half of the image plane at distance `|forward|`, which
/// is the plane in focus if there is a lens. A point (x, y) of the unit disk is the point
/// `position + right * (lens_right * x) + up * (lens_up * y)` of the lens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CameraParams {
    /// Centre of projection.
    pub position: [f32; 3],
    /// 1 / width of the image in pixels.
    pub inv_width: f32,
    /// From the centre of projection to the centre of the image plane.
    pub forward: [f32; 3],
    /// 1 / height of the image in pixels.
    pub inv_height: f32,
    /// From the centre of the image plane to the middle of its right edge.
    pub right: [f32; 3],
    /// Radius of the lens over the length of `right`; zero for a pinhole.
    pub lens_right: f32,
    /// From the centre of the image plane to the middle of its upper edge.
    pub up: [f32; 3],
    /// Radius of the lens over the length of `up`; zero for a pinhole.
    pub lens_up: f32,
}

crate::fields!(CameraParams: position, inv_width, forward, inv_height, right, lens_right, up, lens_up);

impl CameraParams {
    /// A pinhole at `position` that looks at `target`, elsewhere, with `up` to the upper edge of the image, which is not along the view.
    /// The vertical field of view is in turns, between 0 and 1/2; the image has a positive number of pixels.
    pub fn pinhole(position: Vec3, target: Vec3, up: Vec3, vertical_fov: f32, [width, height]: [u32; 2]) -> Self {
        let forward = normalize(target - position);
        let right = normalize(cross(forward, up));
        let (sin, cos) = num::sin_cos(0.5 * vertical_fov);
        let (half_height, aspect) = (num::div(sin, cos), num::div(width as f32, height as f32));
        Self {
            position: position.to_array(),
            inv_width: num::recip(width as f32),
            forward: forward.to_array(),
            inv_height: num::recip(height as f32),
            right: (right * (half_height * aspect)).to_array(),
            up: (cross(right, forward) * half_height).to_array(),
            ..Self::default()
        }
    }
}

const _: () = assert!(size_of::<CameraParams>() == 64);
