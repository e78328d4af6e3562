//! The camera.

use bytemuck::{Pod, Zeroable};

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

const _: () = assert!(size_of::<CameraParams>() == 64);
