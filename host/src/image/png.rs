//! PNG files, to look at.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use super::{Image, check_pixels};
use crate::Error;
use crate::output::write_atomically;

/// Writes an 8-bit PNG file, whole or not at all: values are clamped to [0, 1] and encoded in sRGB; NaN is black.
///
/// # Errors
/// [`Error::File`] if the file cannot be written, or if the image has no pixels or not `width * height`.
pub fn write_png(path: &Path, image: &Image) -> Result<(), Error> {
    check_pixels(path, image, image.pixels.len())?;
    let bytes: Vec<u8> = image.pixels.as_flattened().iter().map(|&value| srgb_byte(value)).collect();
    write_atomically(path, |file| encode_png(file, image, &bytes).map_err(io::Error::other))
}

fn encode_png(file: &mut BufWriter<&File>, image: &Image, bytes: &[u8]) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(file, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()
}

fn srgb_byte(linear: f32) -> u8 {
    let linear = f64::from(linear).clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    // The cast turns NaN into 0.
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    #[test]
    fn png_is_srgb_and_clamped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        write_png(&path, &Image::default()).unwrap_err();
        let image = Image { width: 2, height: 1, pixels: vec![[0.0, 0.5, 1.0], [-1.0, 7.0, f32::NAN]] };
        write_png(&path, &image).unwrap();
        let mut reader = png::Decoder::new(BufReader::new(File::open(&path).unwrap())).read_info().unwrap();
        let mut bytes = [0; 6];
        reader.next_frame(&mut bytes).unwrap();
        assert_eq!(bytes, [0, 188, 255, 0, 255, 0]);
    }
}
