//! Images: EXR without loss (feature `exr`), PNG to look at (feature `png`).

#[cfg(feature = "exr")]
mod exr;
#[cfg(feature = "png")]
mod png;

#[cfg(feature = "exr")]
pub use exr::{Content, read_exr, read_exr_content, read_exr_metadata, write_exr, write_exr_with};
#[cfg(feature = "png")]
pub use png::write_png;

/// Longest side of an image in pixels.
pub const MAX_SIDE: u32 = 16_384;

/// A linear RGB image in 32-bit floats.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels, rows from top to bottom.
    pub pixels: Vec<[f32; 3]>,
}

/// A further channel of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name: that of its layer, a point, and its own; R, G and B are taken.
    pub name: &'static str,
    /// A value a pixel, rows from top to bottom.
    pub values: Vec<f32>,
}

/// Whether the image has a size, and that is the number of pixels of what is to be written.
#[cfg(any(feature = "exr", feature = "png"))]
fn check_pixels(path: &std::path::Path, image: &Image, pixels: usize) -> Result<(), crate::Error> {
    let Image { width, height, .. } = image;
    let expected = u64::from(*width) * u64::from(*height);
    let problem = || crate::Error::cannot_write(path, format!("an image of {width} x {height} with {pixels} pixels"));
    (expected != 0 && expected == pixels as u64).then_some(()).ok_or_else(problem)
}
