//! Environment maps from EXR files.

use std::path::Path;

use super::Environment;
use crate::image::read_exr;
use crate::{Error, memory};

/// Radiance beyond this could overflow in sums over paths.
const MAX_RADIANCE: f32 = 1.0e20;

/// The most pixels along a side of an environment.
const MAX_SIDE: u32 = 32_768;

/// Memory that a pixel takes while it is read and its tables are made.
const BYTES_PER_PIXEL: u64 = 40;

impl Environment {
    /// Reads a latitude-longitude image: the channels R, G and B, of any type, of the first layer that has them.
    ///
    /// Its sides may have any ratio. Negative values, which filters leave behind in photographs, count as 0; that is
    /// added to `warnings`, as are other oddities, a sentence each.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read, has a pixel that is not finite or brighter than 1e20, or has more
    /// than 32768 pixels on a side; [`Error::Memory`].
    pub fn load(path: &Path, warnings: &mut Vec<String>) -> Result<Environment, Error> {
        let image = read_exr(path)?;
        let name = path.display().to_string();
        let refuse = |reason: String| Error::File { action: "read", path: path.to_owned(), reason };
        let [width, height] = [image.width, image.height];
        if width.max(height) > MAX_SIDE || width.min(height) == 0 {
            return Err(refuse(format!(
                "it has {width} x {height} pixels; an environment has at most {MAX_SIDE} on a side"
            )));
        }
        memory::check(
            u64::from(width) * u64::from(height) * BYTES_PER_PIXEL,
            &format!("the environment {name}"),
            "use a smaller image",
        )?;
        let mut pixels = image.pixels;
        let mut negative = 0_usize;
        for (index, pixel) in pixels.iter_mut().enumerate() {
            if pixel.iter().any(|&channel| !channel.is_finite() || channel > MAX_RADIANCE) {
                let (x, y) = (index % width as usize, index / width as usize);
                return Err(refuse(format!(
                    "its pixel at x {x}, y {y} is {pixel:?}, which is not finite within {MAX_RADIANCE:e}; correct it"
                )));
            }
            negative += usize::from(pixel.iter().any(|&channel| channel < 0.0));
            // Also turns -0 into 0.
            *pixel = pixel.map(|channel| if channel > 0.0 { channel } else { 0.0 });
        }
        if negative > 0 {
            warnings.push(format!("environment {name}: {negative} of its pixels are negative and count as 0"));
        }
        if pixels.iter().all(|pixel| *pixel == [0.0; 3]) {
            warnings.push(format!("environment {name}: it is black"));
        }
        Ok(Environment { name, size: [width, height], pixels: pixels.into(), scale: 1.0, rotation: 0.0 })
    }

    /// Sets the factor on the radiance and the turn about +y in degrees.
    ///
    /// # Errors
    /// [`Error::Setting`] for a scale that is negative, not finite or makes a pixel brighter than 1e20, and for a turn
    /// that is not finite.
    pub fn placed(self, scale: f32, rotation: f64) -> Result<Environment, Error> {
        let largest = self.pixels.as_flattened().iter().fold(0.0, |largest: f32, &channel| largest.max(channel));
        if !(scale >= 0.0 && f64::from(scale) * f64::from(largest).max(1.0) <= f64::from(MAX_RADIANCE)) {
            return Err(Error::Setting(format!(
                "the environment's scale {scale} has to be at least 0 and must not make it brighter than {MAX_RADIANCE:e}"
            )));
        }
        if !rotation.is_finite() {
            return Err(Error::Setting(format!("the environment's turn of {rotation} degrees has to be finite")));
        }
        Ok(Environment { scale, rotation, ..self })
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::image::{Image, write_exr};

    fn written(pixels: Vec<[f32; 3]>, width: u32) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.exr");
        let height = pixels.len() as u32 / width;
        write_exr(&path, &Image { width, height, pixels }, &[]).unwrap();
        (folder, path)
    }

    #[test]
    fn pixels_keep_their_bits_and_negative_ones_are_black() {
        let (_folder, path) = written(vec![[1.0, 0.1, 3e10], [-0.5, 2.0, -0.0]], 2);
        let mut warnings = Vec::new();
        let environment = Environment::load(&path, &mut warnings).unwrap();
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
            let (_folder, path) = written(pixels, 3);
            let message = Environment::load(&path, &mut Vec::new()).unwrap_err().to_string();
            assert!(message.contains("x 1, y 1") && message.contains("sky.exr"), "{message}");
        }
    }

    #[test]
    fn black_is_told() {
        let (_folder, path) = written(vec![[0.0; 3]; 2], 1);
        let mut warnings = Vec::new();
        Environment::load(&path, &mut warnings).unwrap();
        assert!(warnings[0].contains("black"), "{warnings:?}");
    }

    #[test]
    fn scale_and_turn_are_checked() {
        let (_folder, path) = written(vec![[1e10; 3]; 2], 2);
        let environment = Environment::load(&path, &mut Vec::new()).unwrap();
        let placed = environment.clone().placed(2.0, -30.0).unwrap();
        assert_eq!((placed.scale, placed.rotation), (2.0, -30.0));
        for (scale, rotation) in [(-1.0, 0.0), (f32::NAN, 0.0), (1e15, 0.0), (1.0, f64::NAN)] {
            environment.clone().placed(scale, rotation).unwrap_err();
        }
    }
}
