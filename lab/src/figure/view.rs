//! Between points of the world and pixels of a picture.

use restir::scene::Camera;
use restir_shared::glam::{DVec2, DVec3};

/// A camera without a lens, and the picture that it takes.
pub(super) struct View {
    position: DVec3,
    /// Unit vector along the view, and half of the picture's width and height at the distance 1.
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    size: DVec2,
}

impl View {
    pub(super) fn new(camera: &Camera, [width, height]: [u32; 2]) -> Self {
        let params = camera.params(width, height);
        let double = |x: [f32; 3]| DVec3::from_array(x.map(f64::from));
        let size = DVec2::new(f64::from(width), f64::from(height));
        let [forward, right, up] = [params.forward, params.right, params.up].map(double);
        Self { position: double(params.position), forward, right, up, size }
    }

    /// The pixel in which a point is, if it is in the picture.
    pub(super) fn pixel(&self, point: DVec3) -> Option<[u32; 2]> {
        let to = point - self.position;
        let along = |axis: DVec3| to.dot(axis) / axis.length_squared();
        let (x, y) = (along(self.right) / along(self.forward), along(self.up) / along(self.forward));
        let at = DVec2::new(0.5 * (1.0 + x), 0.5 * (1.0 - y)) * self.size;
        let inside = along(self.forward) > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmplt(self.size).all();
        inside.then_some([at.x as u32, at.y as u32])
    }

    /// Where the middle of a pixel sees the plane of the points whose coordinate along an axis is that.
    pub(super) fn seen(&self, [x, y]: [u32; 2], axis: usize, coordinate: f64) -> DVec3 {
        let at = 2.0 * (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / self.size - 1.0;
        let direction = self.forward + at.x * self.right - at.y * self.up;
        self.position + direction * ((coordinate - self.position[axis]) / direction[axis])
    }

    /// Width and height of the picture.
    pub(super) fn sides(&self) -> [u32; 2] {
        self.size.to_array().map(|side| side as u32)
    }

    /// Whether a surface shows this side.
    pub(super) fn faces(&self, point: DVec3, normal: DVec3) -> bool {
        normal.dot(self.position - point) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_pixel_sees_is_in_it() {
        let camera = Camera::pinhole(DVec3::new(2.0, 1.5, 3.0), DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.5);
        let view = View::new(&camera, [16, 12]);
        for pixel in [[0, 0], [15, 0], [7, 5], [3, 11]] {
            let point = view.seen(pixel, 2, 0.5);
            assert!((point.z - 0.5).abs() < 1.0e-9);
            assert_eq!(view.pixel(point), Some(pixel), "{point}");
        }
        assert_eq!(view.pixel(DVec3::new(4.0, 2.5, 6.0)), None, "behind the camera");
        assert!(view.faces(DVec3::ZERO, DVec3::Z) && !view.faces(DVec3::ZERO, DVec3::NEG_X));
    }
}
