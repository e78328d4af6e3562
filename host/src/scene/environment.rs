//! Environment maps from images.

use std::sync::Arc;

use super::Environment;
use crate::error::ensure;
use crate::image::Image;
use crate::{Error, memory};

/// Radiance beyond this could overflow in sums over paths.
const MAX_RADIANCE: f32 = 1.0e20;

/// The most pixels along a side of an environment.
const MAX_SIDE: u32 = 32_768;

/// Memory that a pixel takes while it is read and its tables are made.
const BYTES_PER_PIXEL: u64 = 40;

impl Environment {
    /// Reads a latitude-longitude image from an EXR file: the channels R, G and B, of any type, of the first layer that has
    /// them; then as [`Environment::of_image`].
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read; those of [`Environment::of_image`].
    #[cfg(feature = "exr")]
    pub fn load(path: &std::path::Path, warnings: &mut Vec<String>) -> Result<Environment, Error> {
        Self::of_image(path.display().to_string(), &crate::image::read_exr(path)?, warnings)
    }

    /// Takes a latitude-longitude image of radiance in linear RGB.
    ///
    /// Its sides may have any ratio. Negative values, which filters leave behind in photographs, count as 0; that is
    /// added to `warnings`, as are other oddities, a sentence each. `name` is what messages call it.
    ///
    /// # Errors
    /// [`Error::File`] if the image has a pixel that is not finite or brighter than 1e20, or has more than 32768 pixels on a
    /// side; [`Error::Memory`].
    pub fn of_image(name: String, image: &Image, warnings: &mut Vec<String>) -> Result<Environment, Error> {
        check(image).map_err(|problem| Error::cannot_read(name.as_ref(), problem))?;
        let bytes = image.pixels.len() as u64 * BYTES_PER_PIXEL;
        memory::check(bytes, &format!("the environment {name}"), "use a smaller image")?;
        let negative = image.pixels.iter().filter(|pixel| pixel.iter().any(|&channel| channel < 0.0)).count();
        if negative > 0 {
            warnings.push(format!("environment {name}: {negative} of its pixels are negative and count as 0"));
        }
        // Also turns -0 into 0.
        let positive = |pixel: &[f32; 3]| pixel.map(|channel| if channel > 0.0 { channel } else { 0.0 });
        let pixels: Arc<[[f32; 3]]> = image.pixels.iter().map(positive).collect();
        if pixels.iter().all(|pixel| *pixel == [0.0; 3]) {
            warnings.push(format!("environment {name}: it is black"));
        }
        Ok(Environment { name, size: [image.width, image.height], pixels, scale: 1.0, rotation: 0.0 })
    }

    /// Sets the factor on the radiance and the turn about +y in degrees.
    ///
    /// # Errors
    /// [`Error::Environment`] for a scale that is negative, not finite or makes a pixel brighter than 1e20, and for a turn
    /// that is not finite.
    pub fn placed(self, scale: f32, rotation: f64) -> Result<Environment, Error> {
        let largest = self.pixels.as_flattened().iter().fold(0.0, |largest: f32, &channel| largest.max(channel));
        let problem = if !(scale >= 0.0 && f64::from(scale) * f64::from(largest).max(1.0) <= f64::from(MAX_RADIANCE)) {
            format!("scale {scale} has to be at least 0 and must not make it brighter than {MAX_RADIANCE:e}")
        } else if !rotation.is_finite() {
            format!("turn of {rotation} degrees has to be finite")
        } else {
            return Ok(Environment { scale, rotation, ..self });
        };
        Err(Error::Environment { problem })
    }
}

fn check(Image { width, height, pixels }: &Image) -> Result<(), String> {
    let fits = *width.max(height) <= MAX_SIDE && *width.min(height) > 0;
    ensure!(fits, "it has {width} x {height} pixels; an environment has at most {MAX_SIDE} on a side");
    let bad = |pixel: &[f32; 3]| pixel.iter().any(|&channel| !channel.is_finite() || channel > MAX_RADIANCE);
    let Some(index) = pixels.iter().position(bad) else { return Ok(()) };
    let (pixel, x, y) = (pixels[index], index % *width as usize, index / *width as usize);
    Err(format!("its pixel at x {x}, y {y} is {pixel:?}, which is not finite within {MAX_RADIANCE:e}; correct it"))
}

#[cfg(all(test, feature = "exr"))]
mod tests {
    use super::*;
    use crate::image::write_exr;

    /// What a file of these pixels is read as, and the warnings.
    fn loaded(pixels: Vec<[f32; 3]>, width: u32) -> Result<(Environment, Vec<String>), Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.exr");
        let height = pixels.len() as u32 / width;
        write_exr(&path, &Image { width, height, pixels }, &[]).unwrap();
        let mut warnings = Vec::new();
        Environment::load(&path, &mut warnings).map(|environment| (environment, warnings))
    }

    #[test]
    fn pixels_keep_their_bits_and_negative_ones_are_black() {
        let (environment, warnings) = loaded(vec![[1.0, 0.1, 3e10], [-0.5, 2.0, -0.0]], 2).unwrap();
        assert_eq!((environment.size, environment.scale, environment.rotation), ([2, 1], 1.0, 0.0));
        assert_eq!(*environment.pixels, [[1.0, 0.1, 3e10], [0.0, 2.0, 0.0]]);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains("1 of its pixels are negative"), "{warnings:?}");
    }

    #[test]
    fn a_pixel_that_is_no_radiance_is_named() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            let mut pixels = vec![[1.0; 3]; 6];
            pixels[4][1] = bad;
            let message = loaded(pixels, 3).unwrap_err().to_string();
            assert!(message.contains("x 1, y 1") && message.contains("sky.exr"), "{message}");
        }
    }

    #[test]
    fn black_is_told() {
        let (_, warnings) = loaded(vec![[0.0; 3]; 2], 1).unwrap();
        assert!(warnings[0].contains("black"), "{warnings:?}");
    }

    #[test]
    fn scale_and_turn_are_checked() {
        let (environment, _) = loaded(vec![[1e10; 3]; 2], 2).unwrap();
        let placed = environment.clone().placed(2.0, -30.0).unwrap();
        assert_eq!((placed.scale, placed.rotation), (2.0, -30.0));
        for (scale, rotation) in [(-1.0, 0.0), (f32::NAN, 0.0), (1e15, 0.0), (1.0, f64::NAN)] {
            environment.clone().placed(scale, rotation).unwrap_err();
        }
    }
}
