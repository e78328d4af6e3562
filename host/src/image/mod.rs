//! Images: EXR without loss (feature `exr`), PNG to look at (feature `png`).
//!
//! ```
//! use restir_host::image::Image;
//! # #[cfg(feature = "exr")]
//! use restir_host::image::{read_exr, read_exr_metadata, write_exr};
//!
//! let image = Image { width: 2, height: 1, pixels: vec![[0.25, 1.0, 40.0], [1.0e-3, 0.0, 7.5]] };
//! # #[cfg(feature = "exr")] {
//! let path = &std::env::temp_dir().join(format!("restir-image-{}.exr", std::process::id()));
//! let metadata = [("seed".to_owned(), "7".to_owned())];
//! write_exr(path, &image, &metadata)?;
//! assert_eq!(read_exr(path)?, image);
//! assert_eq!(read_exr_metadata(path)?, metadata);
//! # std::fs::remove_file(path).ok();
//! # }
//! # Ok::<(), restir_host::Error>(())
//! ```

#[cfg(feature = "exr")]
mod exr;
#[cfg(feature = "png")]
mod png;

#[cfg(feature = "exr")]
pub use exr::{
    Content, exr_bytes, read_exr, read_exr_content, read_exr_metadata, read_exr_with, write_exr, write_exr_with,
};
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
