//! Parameters of the denoiser's kernels.

use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::resample::reproject::Grid;
use bytemuck::{Pod, Zeroable};

/// Parameters of [`super::guide()`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GuideParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// Those of the last frame, in the same arenas.
    pub other_scene: SceneHeader,
    /// The camera.
    pub camera: CameraParams,
    /// That of the last frame.
    pub other_camera: CameraParams,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Seed of the picture's random numbers.
    pub seed: u32,
    /// The first sample of the picture.
    pub first_sample: u32,
    /// How many of them the reflectance is a mean of; not zero.
    pub samples: u32,
    /// See the constants.
    pub flags: u32,
}

crate::fields!(GuideParams: scene, other_scene, camera, other_camera, width, height, seed, first_sample, samples, flags);

impl GuideParams {
    /// Camera rays are spread over the pixel.
    pub const JITTER: u32 = 1;
    /// They are spread by the Blackman-Harris filter.
    pub const BLACKMAN_HARRIS: u32 = 1 << 1;
    /// Random numbers of different samples are independent, not points of a sequence.
    pub const INDEPENDENT: u32 = 1 << 2;

    /// The pixels of the image.
    pub(super) fn grid(&self) -> Grid {
        Grid { width: self.width, height: self.height }
    }
}

impl Extent for GuideParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// Parameters of the functions after [`super::guide()`].
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DenoiseParams {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// How far apart the pixels of [`super::share()`] and [`super::filter()`] are.
    pub step: u32,
    /// Most frames that a history is worth; 0 where there is no last frame.
    pub history: f32,
    /// Frames that the picture is the mean of.
    pub frames: f32,
    /// The height of a pixel in the middle of the image, at the distance 1 from the camera.
    pub spread: f32,
    /// Differences of luminance of so many standard deviations are not noise any more.
    pub deviations: f32,
    /// Zero.
    pub reserved: u32,
}

crate::fields!(DenoiseParams: width, height, step, history, frames, spread, deviations, reserved);

impl Default for DenoiseParams {
    /// Of an empty image, for struct update: a single frame, a view of 45 degrees over 256 pixels.
    fn default() -> Self {
        Self { width: 0, height: 0, step: 1, history: 0.0, frames: 1.0, spread: 0.003, deviations: 8.0, reserved: 0 }
    }
}

impl DenoiseParams {
    /// Index of the pixel that lies `across` and `down` from another one, and whether there is one.
    #[inline(always)]
    pub(super) fn neighbour(&self, [x, y]: [u32; 2], across: i32, down: i32) -> (usize, bool) {
        let (x, y) = ((x as i32).wrapping_add(across), (y as i32).wrapping_add(down));
        let inside = (x >= 0) & (y >= 0) & (x < self.width as i32) & (y < self.height as i32);
        let index = if inside { (y as u32).wrapping_mul(self.width).wrapping_add(x as u32) } else { 0 };
        (index as usize, inside)
    }
}

impl Extent for DenoiseParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

const _: () = assert!(size_of::<DenoiseParams>() == 32);
