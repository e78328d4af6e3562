//! The camera: framing a scene, and its form on the bus.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};
use restir_shared::layout::CameraParams;

use super::{Camera, MAX_COORDINATE, double};
use crate::error::ensure;

/// Vertical field of view of a framed camera, in radians: 40 degrees.
const FRAMING_FOV: f64 = 40.0 * PI / 180.0;

/// From the scene to a framed camera: from the front (+z, as in glTF), to the right and a little above.
const FRAMING_DIRECTION: DVec3 = DVec3::new(0.55, 0.42, 1.0);

/// How much farther than necessary a framed camera stands.
const FRAMING_MARGIN: f64 = 1.05;

/// The widest and the narrowest vertical field of view, in radians.
const FOV_RANGE: (f64, f64) = (1e-3, 3.1);

/// Where the plane in focus may lie.
const FOCUS_RANGE: [f64; 2] = [1e-6, 8.0 * MAX_COORDINATE];

impl Camera {
    /// A camera without a lens.
    pub fn pinhole(position: DVec3, target: DVec3, up: DVec3, vertical_fov: f64) -> Camera {
        Camera { position, target, up, vertical_fov, lens_radius: 0.0, focus_distance: None }
    }

    /// A camera that has the whole box `bounds` (lower and upper corner) in view, three-quarters from the front.
    ///
    /// `aspect` is width over height. Bounds that are empty or not finite count as a unit cube at the origin, a point
    /// as a small box around it; an aspect that is not positive counts as 1.
    pub fn framing(bounds: [[f32; 3]; 2], aspect: f64) -> Camera {
        let (centre, half) = centre_and_half_size(bounds);
        let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
        let camera = Camera::pinhole(centre + FRAMING_DIRECTION, centre, DVec3::Y, FRAMING_FOV);
        let distance = FRAMING_MARGIN * camera.distance_to_frame(half, aspect);
        Camera { position: centre + FRAMING_DIRECTION.normalize() * distance, ..camera }
    }

    /// The camera at the origin of a node, looking along its -z with +y up, from whose scale nothing follows. Its target is
    /// at distance 1; a lens stays sharp where it was.
    pub(super) fn carried(self, world: &DAffine3) -> Camera {
        let position = world.translation;
        let forward = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
        let up = world.transform_vector3(DVec3::Y).normalize_or(DVec3::Y);
        let focus_distance = if self.lens_radius > 0.0 { Some(self.distance_in_focus()) } else { self.focus_distance };
        Camera { position, target: position + forward, up, focus_distance, ..self }
    }

    /// The camera for an image of `width` x `height` pixels: computed in `f64`, then rounded.
    ///
    /// The image plane lies at distance 1, or where a camera with a lens is sharp. An `up` that is zero or parallel to the view is replaced by the axis that
    /// is most perpendicular to it; a camera that stands on its target looks along -z; the field of view is kept
    /// within 0.001 and 3.1 radians; a side of 0 pixels counts as 1.
    pub fn params(&self, width: u32, height: u32) -> CameraParams {
        let (width, height) = (f64::from(width.max(1)), f64::from(height.max(1)));
        let [right, up, forward] = self.frame();
        let half_height = self.half_height();
        let half_width = half_height * (width / height);
        let distance = if self.lens_radius > 0.0 { self.distance_in_focus() } else { 1.0 };
        CameraParams {
            position: self.position.as_vec3().to_array(),
            inv_width: (1.0 / width) as f32,
            forward: (forward * distance).as_vec3().to_array(),
            inv_height: (1.0 / height) as f32,
            right: (right * half_width * distance).as_vec3().to_array(),
            lens_right: (self.lens_radius / (half_width * distance)) as f32,
            up: (up * half_height * distance).as_vec3().to_array(),
            lens_up: (self.lens_radius / (half_height * distance)) as f32,
        }
    }

    /// Distance of the plane in focus: the target's if none is set; 1 for a camera that stands on its target.
    pub fn distance_in_focus(&self) -> f64 {
        let to_target = (self.target - self.position).length();
        self.focus_distance.unwrap_or(if to_target > 0.0 { to_target } else { 1.0 })
    }

    /// Checks that the camera can be rendered with: where it is, that it looks somewhere, and its lens.
    ///
    /// # Errors
    /// What is wrong, as a sentence without a full stop.
    pub fn check(&self) -> Result<(), String> {
        let Self { position, target, vertical_fov: fov, lens_radius: radius, .. } = *self;
        let direction = target - position;
        // A camera that frames the largest scene stands outside of it.
        let near = position.is_finite() && position.abs().max_element() <= 4.0 * MAX_COORDINATE;
        let looks = direction.is_finite() && direction.length() > 0.0;
        ensure!(near && looks, "the camera at {position} is not within 4.29e9 or looks nowhere; correct it");
        let degrees = fov.to_degrees();
        ensure!(fov > 0.0 && fov < PI, "a field of view of {degrees} degrees is not between 0 and 180");
        let possible = (0.0..=MAX_COORDINATE).contains(&radius);
        ensure!(possible, "a lens radius of {radius} is not within 0 and {MAX_COORDINATE:e}; 0 is a pinhole");
        let (distance, [nearest, farthest]) = (self.distance_in_focus(), FOCUS_RANGE);
        let sharp = radius == 0.0 || (nearest..=farthest).contains(&distance);
        ensure!(sharp, "a focus distance of {distance} is not within {nearest:e} and {farthest:e}");
        Ok(())
    }

    /// Orthonormal right, up and forward.
    pub(super) fn frame(&self) -> [DVec3; 3] {
        let forward = (self.target - self.position).normalize_or(DVec3::NEG_Z);
        let right = unit_perpendicular(forward, self.up);
        [right, right.cross(forward), forward]
    }

    /// The transform of a node that the camera hangs on, as glTF has it: the camera looks along the node's -z.
    pub(super) fn node_transform(&self) -> DAffine3 {
        let [right, up, forward] = self.frame();
        DAffine3::from_mat3_translation(DMat3::from_cols(right, up, -forward), self.position)
    }

    /// Half the height of the image plane at distance 1.
    fn half_height(&self) -> f64 {
        let fov = if self.vertical_fov.is_nan() { FRAMING_FOV } else { self.vertical_fov };
        (0.5 * fov.clamp(FOV_RANGE.0, FOV_RANGE.1)).tan()
    }

    /// How far from the centre of a box of half size `half` the camera has to be to see all of its corners.
    fn distance_to_frame(&self, half: DVec3, aspect: f64) -> f64 {
        let [right, up, forward] = self.frame();
        let half_height = self.half_height();
        let distance = |corner: DVec3| {
            let across = (corner.dot(right).abs() / (half_height * aspect)).max(corner.dot(up).abs() / half_height);
            across - corner.dot(forward)
        };
        corners(half).map(distance).fold(0.0, f64::max)
    }
}

/// The centre and half of the size of a box. What is empty or not finite becomes a unit cube at the origin; the
/// largest half size is never zero.
pub(super) fn centre_and_half_size(bounds: [[f32; 3]; 2]) -> (DVec3, DVec3) {
    let [lo, hi] = bounds.map(double);
    if !lo.is_finite() || !hi.is_finite() || lo.cmpgt(hi).any() {
        return (DVec3::ZERO, DVec3::splat(0.5));
    }
    let centre = 0.5 * (lo + hi);
    // Positions are rounded to f32: a box must be large compared with the spacing of the floats around it.
    let smallest = (1e-3 * centre.abs().max_element()).max(1e-6);
    let half = 0.5 * (hi - lo);
    (centre, if half.max_element() < smallest { DVec3::splat(smallest) } else { half })
}

fn corners(half: DVec3) -> impl Iterator<Item = DVec3> {
    let sign = |corner: u32, axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
    (0..8).map(move |corner| half * DVec3::new(sign(corner, 0), sign(corner, 1), sign(corner, 2)))
}

fn unit_perpendicular(forward: DVec3, up: DVec3) -> DVec3 {
    let right = forward.cross(up.normalize_or_zero());
    if right.length() > 1e-6 {
        return right.normalize();
    }
    let along = |axis: &DVec3| forward.dot(*axis).abs();
    let axes = [DVec3::Z, DVec3::X].into_iter();
    let axis = axes.fold(DVec3::Y, |least, axis| if along(&axis) < along(&least) { axis } else { least });
    forward.cross(axis).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a point lies in the image: within [-1, 1] on both axes is in view, and in front.
    fn project(camera: &Camera, point: DVec3, aspect: f64) -> (f64, f64, f64) {
        let [right, up, forward] = camera.frame();
        let offset = point - camera.position;
        let depth = offset.dot(forward);
        let scale = 1.0 / (depth * camera.half_height());
        (offset.dot(right) * scale / aspect, offset.dot(up) * scale, depth)
    }

    #[test]
    fn framing_has_every_corner_in_view() {
        let boxes = [
            [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]],
            [[0.0, 0.0, 0.0], [1000.0, 1.0, 2.0]],
            [[5.0, 5.0, 5.0], [5.0, 5.0, 5.0]],
            [[0.0; 3], [0.0; 3]],
            [[-1e-3, 7e4, 0.0], [1e-3, 7e4, 1e3]],
        ];
        for bounds in boxes {
            for aspect in [0.25, 1.0, 4.0, 0.0, f64::NAN] {
                let camera = Camera::framing(bounds, aspect);
                assert!(camera.position.is_finite());
                let aspect = if aspect > 0.0 { aspect } else { 1.0 };
                let [lo, hi] = bounds.map(double);
                for corner in corners(0.5 * (hi - lo)) {
                    let (x, y, depth) = project(&camera, 0.5 * (lo + hi) + corner, aspect);
                    assert!(x.abs() < 1.0 && y.abs() < 1.0 && depth > 0.0, "{bounds:?} {aspect}: {x} {y} {depth}");
                }
            }
        }
    }

    #[test]
    fn framing_survives_bad_bounds() {
        for bounds in [[[f32::NAN; 3], [1.0; 3]], [[1.0; 3], [-1.0; 3]], [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]]] {
            assert!(Camera::framing(bounds, 1.0).position.is_finite());
        }
    }

    #[test]
    fn params_of_a_simple_camera() {
        let camera = Camera::pinhole(DVec3::new(0.0, 1.0, 4.0), DVec3::Y, DVec3::Y, 0.5 * PI);
        let params = camera.params(200, 100);
        assert_eq!(params.position, [0.0, 1.0, 4.0]);
        assert_eq!(params.forward, [0.0, 0.0, -1.0]);
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(params.right, [2.0, 0.0, 0.0]), "{:?}", params.right);
        assert!(near(params.up, [0.0, 1.0, 0.0]), "{:?}", params.up);
        assert_eq!((params.inv_width, params.inv_height), (0.005, 0.01));
        assert_eq!((params.lens_right, params.lens_up), (0.0, 0.0));
    }

    #[test]
    fn a_lens_moves_the_image_plane_to_where_it_is_sharp() {
        let pinhole = Camera::pinhole(DVec3::ZERO, DVec3::new(0.0, 0.0, -2.0), DVec3::Y, 0.5 * PI);
        let lens = Camera { lens_radius: 0.5, ..pinhole };
        for (camera, distance) in [(lens, 2.0), (Camera { focus_distance: Some(8.0), ..lens }, 8.0)] {
            let params = camera.params(200, 100);
            assert_eq!(params.forward, [0.0, 0.0, -distance]);
            let length = |v: [f32; 3]| double(v).length();
            for (axis, lens, half) in [(params.right, params.lens_right, 2.0), (params.up, params.lens_up, 1.0)] {
                assert!((length(axis) - half * f64::from(distance)).abs() < 1e-5, "{axis:?}");
                assert!((length(axis) * f64::from(lens) - 0.5).abs() < 1e-6, "the lens has its radius along {axis:?}");
            }
        }
    }

    #[test]
    fn a_lens_has_to_be_possible() {
        let camera = Camera::pinhole(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 1.0);
        camera.check().unwrap();
        Camera { lens_radius: 0.1, focus_distance: Some(3.0), ..camera }.check().unwrap();
        for lens_radius in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(Camera { lens_radius, ..camera }.check().unwrap_err().contains("lens radius"));
        }
        for distance in [0.0, -1.0, f64::NAN, 1e30] {
            let camera = Camera { lens_radius: 0.1, focus_distance: Some(distance), ..camera };
            assert!(camera.check().unwrap_err().contains("focus distance"));
        }
        assert!(Camera { target: DVec3::ZERO, ..camera }.check().unwrap_err().contains("nowhere"));
    }

    #[test]
    fn a_degenerate_camera_still_has_a_frame() {
        for direction in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::ZERO] {
            for up in [direction, DVec3::ZERO] {
                let camera = Camera::pinhole(DVec3::ZERO, direction, up, f64::NAN);
                let [right, up, forward] = camera.frame();
                for axis in [right, up, forward] {
                    assert!((axis.length() - 1.0).abs() < 1e-12);
                }
                assert!(right.dot(up).abs() + up.dot(forward).abs() + forward.dot(right).abs() < 1e-12);
            }
        }
    }
}
