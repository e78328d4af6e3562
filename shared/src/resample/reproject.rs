//! Where other reservoirs are looked for: at the pixel that saw the same surface in another frame ([`Grid::project`]), and at places around a
//! pixel ([`Grid::nearby`]).
//!
//! ```
//! use restir_shared::camera::primary_ray;
//! use restir_shared::glam::{UVec4, Vec2, Vec3};
//! use restir_shared::layout::CameraParams;
//! use restir_shared::resample::reproject::{Grid, Place};
//!
//! let grid = Grid { width: 64, height: 48 };
//! let camera = CameraParams::pinhole(Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y, 0.1, [64, 48]);
//!
//! // what the pixel (10, 20) sees is found in that pixel again
//! let ray = primary_ray(&camera, Vec2::new(10.5, 20.5), Vec2::ZERO);
//! let place = grid.project(&camera, ray.origin + ray.direction * 3.0);
//! assert!(place.inside && [place.x, place.y] == [10, 20]);
//! // what lies behind the camera is not
//! assert!(!grid.project(&camera, ray.origin - ray.direction).inside);
//!
//! // neighbours within 8 pixels, mirrored at the borders of the image
//! let near = |n| grid.nearby(8.0, Place { x: 0, y: 47, inside: true }, n, UVec4::ZERO);
//! assert!((1..20).all(|n| near(n).x <= 8 && near(n).y >= 39));
//! ```

use crate::layout::CameraParams;
use crate::num;
use crate::rng;
use crate::sampling::sample_concentric_disk;
use crate::vec::dot;
use glam::{UVec4, Vec3};

/// Surfaces nearer to the camera's plane than this part of the distance to the image plane are behind it.
pub(crate) const MIN_DEPTH: f32 = 1.0e-6;

/// The pixels of an image.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

/// A pixel position, if it is one.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The column of the pixel.
    pub x: u32,
    /// The row of the pixel.
    pub y: u32,
    /// Whether it lies in the image.
    pub inside: bool,
}

/// A point of the image plane.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// To the right of the left edge, in pixels.
    pub x: f32,
    /// Below the upper edge, in pixels.
    pub y: f32,
    /// Distance from the camera along its axis, in distances of the image plane; not positive behind the camera.
    pub depth: f32,
}

impl Place {
    /// Whether the places are less than `radius` apart.
    #[inline(always)]
    pub fn is_near(&self, other: &Self, radius: f32) -> bool {
        let (dx, dy) = (self.x as f32 - other.x as f32, self.y as f32 - other.y as f32);
        dx * dx + dy * dy < radius * radius
    }
}

impl Grid {
    /// Index of a pixel in a plane: row by row from the upper left corner, `y * width + x`.
    #[inline(always)]
    pub fn index(&self, [x, y]: [u32; 2]) -> u32 {
        y * self.width + x
    }

    /// The pixel of an index.
    #[inline(always)]
    pub fn at(&self, index: u32) -> [u32; 2] {
        [index % self.width, index / self.width]
    }

    /// The n-th place in a disk around `center`, mirrored at the image's borders; the words shift the sequence.
    #[doc(hidden)]
    #[inline(always)]
    pub fn nearby(&self, radius: f32, center: Place, n: u32, words: UVec4) -> Place {
        let at = sample_concentric_disk(rng::r2([words.x, words.y], n)) * radius;
        let x = (center.x as i32).wrapping_add(num::nearest(at.x));
        let y = (center.y as i32).wrapping_add(num::nearest(at.y));
        Place { x: mirrored(x, self.width), y: mirrored(y, self.height), inside: center.inside }
    }

    /// Where a camera sees a position: the pixel that it lies in.
    #[doc(hidden)]
    #[inline(always)]
    pub fn project(&self, camera: &CameraParams, position: Vec3) -> Place {
        let Point { x, y, depth } = self.point(camera, position);
        // compared as floats: a conversion beyond the range would not be the same everywhere
        let inside = (depth > MIN_DEPTH) & (x >= 0.0) & (y >= 0.0) & (x < self.width as f32) & (y < self.height as f32);
        if inside { Place { x: x as u32, y: y as u32, inside } } else { Place { x: 0, y: 0, inside } }
    }

    /// Where in the image a camera sees a position; some point if it lies behind.
    #[doc(hidden)]
    #[inline(always)]
    pub fn point(&self, camera: &CameraParams, position: Vec3) -> Point {
        let to = position - Vec3::from_array(camera.position);
        let [forward, right, up] =
            [Vec3::from_array(camera.forward), Vec3::from_array(camera.right), Vec3::from_array(camera.up)];
        let depth = num::div(dot(to, forward), dot(forward, forward));
        let inv_depth = num::recip(if depth > MIN_DEPTH { depth } else { 1.0 });
        let across = num::div(dot(to, right), dot(right, right)) * inv_depth;
        let along = num::div(dot(to, up), dot(up, up)) * inv_depth;
        let x = (across + 1.0) * 0.5 * self.width as f32;
        let y = (1.0 - along) * 0.5 * self.height as f32;
        Point { x, y, depth }
    }
}

/// A coordinate beyond a border, mirrored at it; limited to the image, should it be narrower than the way.
#[inline(always)]
fn mirrored(x: i32, size: u32) -> u32 {
    let size = size as i32;
    let from_low = if x < 0 { !x } else { x };
    let from_high = if from_low >= size { size.wrapping_mul(2).wrapping_add(!from_low) } else { from_low };
    (if from_high < 0 { 0 } else { from_high }) as u32
}
