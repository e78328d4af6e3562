//! The film.

use super::Extent;
use bytemuck::{Pod, Zeroable};

/// Parameters of the film kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FilmParams {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Number of samples that the film holds (`film_resolve` divides by it).
    pub samples: f32,
    /// Zero.
    pub reserved: u32,
}

crate::fields!(FilmParams: width, height, samples, reserved);

impl Extent for FilmParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// A pixel of a film plane: a sum over an aligned block of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FilmPixel {
    /// Sum of radiance, linear RGB.
    pub sum: [f32; 3],
    /// How many samples were dropped because they were not finite or the device cut them short.
    pub dropped: f32,
}

const _: () = {
    assert!(size_of::<FilmParams>() == 16);
    assert!(size_of::<FilmPixel>() == 16);
};
