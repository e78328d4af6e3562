//! Parts of an image that stand for all of it.

use restir::render::Render;
use restir::scene::Camera;

/// Steps of the R2 sequence (Roberts 2018): the inverse of the plastic number, and its square.
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// A part of an image with the same number of pixels a degree, so that neighbours are as alike as they are in the whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The size of the whole image in pixels.
    pub whole: [u32; 2],
    /// The size of the window in pixels, its margin included.
    pub size: [u32; 2],
    /// Pixels at each edge that are rendered for the sake of others, which reuse them.
    pub margin: u32,
    /// Where its middle is, from -1 at the left and lower edges of the whole to 1.
    pub middle: [f64; 2],
}

impl Window {
    /// `count` windows that are spread evenly, or one of all where they would have as many pixels.
    pub fn spread(whole: [u32; 2], size: [u32; 2], margin: u32, count: u32) -> Vec<Self> {
        let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        if pixels(size) * u64::from(count) >= pixels(whole) || (0..2).any(|axis| size[axis] >= whole[axis]) {
            return vec![Self { whole, size: whole, margin: 0, middle: [0.0; 2] }];
        }
        let middle = |index: u32, axis: usize| {
            let room = 1.0 - f64::from(size[axis]) / f64::from(whole[axis]);
            room * (2.0 * ((f64::from(index) + 0.5) * STEPS[axis]).fract() - 1.0)
        };
        (0..count).map(|index| Self { whole, size, margin, middle: [0, 1].map(|axis| middle(index, axis)) }).collect()
    }

    /// The render of the whole, seen through the window by cameras that turn to it.
    pub fn of(&self, render: &Render) -> Render {
        let [width, height] = self.size;
        let cameras = match self.size == self.whole {
            true => render.cameras.clone(),
            false => render.cameras.iter().map(|camera| self.camera(camera)).collect(),
        };
        Render { width, height, cameras, ..render.clone() }
    }

    fn camera(&self, camera: &Camera) -> Camera {
        let [width, height] = self.whole.map(f64::from);
        let ahead = camera.target - camera.position;
        let right = ahead.cross(camera.up).normalize();
        let up = right.cross(ahead).normalize();
        let half = (0.5 * camera.vertical_fov).tan();
        let [x, y] = [self.middle[0] * half * width / height, self.middle[1] * half];
        let distance = ahead.length();
        let to = (ahead / distance + right * x + up * y).normalize() * distance;
        let vertical_fov = 2.0 * (half * f64::from(self.size[1]) / height).atan();
        Camera { target: camera.position + to, vertical_fov, ..*camera }
    }

    /// The pixels that count, of an image through the window.
    pub fn inner<'a, T>(&self, pixels: &'a [T]) -> impl Iterator<Item = &'a T> {
        let [width, height] = self.size.map(|side| side as usize);
        let margin = self.margin as usize;
        let row = move |y: usize| &pixels[y * width + margin..(y + 1) * width - margin];
        (margin..height - margin).flat_map(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir::shared::glam::DVec3;

    #[test]
    fn windows_lie_within_the_whole_and_apart() {
        let windows = Window::spread([640, 480], [48, 36], 4, 8);
        assert_eq!(windows.len(), 8);
        for window in &windows {
            let edge =
                |axis: usize| window.middle[axis].abs() + f64::from(window.size[axis]) / f64::from(window.whole[axis]);
            assert!((0..2).all(|axis| edge(axis) <= 1.0 + 1e-12), "{window:?}");
        }
        let same = |a: &Window, b: &Window| (0..2).all(|axis| (a.middle[axis] - b.middle[axis]).abs() < 0.1);
        assert!((0..8).all(|i| (0..i).all(|k| !same(&windows[i], &windows[k]))), "{windows:?}");
        assert_eq!(Window::spread([640, 480], [48, 36], 4, 500).len(), 1);
        assert_eq!(Window::spread([40, 480], [48, 36], 4, 1)[0].size, [40, 480]);
    }

    /// Its middle shows what the whole shows there, with pixels of the same size.
    #[test]
    fn a_window_shows_its_part() {
        let camera = Camera::pinhole(DVec3::ZERO, DVec3::new(0.0, 0.0, -2.0), DVec3::Y, 1.0);
        let window = Window { whole: [400, 200], size: [40, 20], margin: 2, middle: [0.5, -0.25] };
        let seen = window.camera(&camera);
        let half = 0.5_f64.tan();
        let expected = DVec3::new(0.5 * half * 2.0, -0.25 * half, -1.0).normalize() * 2.0;
        assert!((seen.target - expected).length() < 1e-12, "{seen:?}");
        assert!(((0.5 * seen.vertical_fov).tan() - 0.1 * half).abs() < 1e-12);
        let pixels: Vec<u32> = (0..800).collect();
        let inner: Vec<u32> = window.inner(&pixels).copied().collect();
        assert_eq!((inner.len(), inner[0], inner[35], inner[36]), (36 * 16, 82, 117, 122));
    }
}
