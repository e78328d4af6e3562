//! Images of textures: PNG and JPEG, as RGBA of eight bits a channel, or of sixteen where a file has more.
//!
//! Colours are taken as they are stored: as glTF demands, gamma and colour profiles are ignored, and the first frame
//! counts. The JPEG decoder runs without vector instructions, so that every machine
//! gets the same texels.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::Problem;
use crate::error::ensure;
use crate::error::gib;
use crate::scene::Texels;

/// The most texels along a side of a texture.
const MAX_SIDE: u32 = 16_384;

/// Memory that a texel takes at most while it is decoded: the coefficients of a progressive JPEG, its colours, the texel.
const DECODING_BYTES: u64 = 16;

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG_SIGNATURE: &[u8] = b"\xff\xd8\xff";

/// An image's size and its texels, rows from the top.
#[derive(Clone)]
pub(super) struct Decoded {
    pub(super) size: [u32; 2],
    pub(super) texels: Texels,
}

/// Decodes a PNG or JPEG file, which takes at most `room` bytes of memory.
pub(super) fn decode(file: &[u8], room: u64) -> Result<Decoded, Problem> {
    if file.starts_with(PNG_SIGNATURE) {
        png(file, room)
    } else if file.starts_with(JPEG_SIGNATURE) {
        jpeg(file, room)
    } else {
        Err("it is neither a PNG nor a JPEG file; convert it to one".to_owned())
    }
}

fn check_size(width: u32, height: u32, room: u64) -> Result<(), Problem> {
    let texels = format!("{width} x {height} texels");
    let fits = [width, height].iter().all(|side| (1..=MAX_SIDE).contains(side));
    ensure!(fits, "it has {texels}; a texture has at least 1 and at most {MAX_SIDE} on a side: resize it");
    let bytes = DECODING_BYTES * u64::from(width) * u64::from(height);
    let [taken, left] = [bytes, room].map(gib);
    ensure!(
        bytes <= room,
        "decoding its {texels} takes {taken}, more than the {left} that is left for textures; use smaller ones"
    );
    Ok(())
}

fn png(file: &[u8], room: u64) -> Result<Decoded, Problem> {
    let broken =
        |error: png::DecodingError| format!("its PNG is broken ({}); save it anew", one_line(&error.to_string()));
    let mut decoder = png::Decoder::new(Cursor::new(file));
    // Palettes become colours, and less than eight bits become eight.
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(broken)?;
    let (width, height) = reader.info().size();
    check_size(width, height, room)?;
    let (color, depth) = reader.output_color_type();
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("its PNG is too large")?];
    reader.next_frame(&mut bytes).map_err(broken)?;
    let texels = if depth == png::BitDepth::Sixteen {
        let channels: Vec<u16> = bytes.as_chunks().0.iter().map(|&channel| u16::from_be_bytes(channel)).collect();
        drop(bytes);
        Texels::new(rgba(&channels, color, u16::MAX)?)
    } else {
        Texels::Eight(rgba(&bytes, color, u8::MAX)?.into())
    };
    Ok(Decoded { size: [width, height], texels })
}

/// The texels of channels in the order of a PNG.
fn rgba<T: Copy>(channels: &[T], color: png::ColorType, opaque: T) -> Result<Vec<[T; 4]>, Problem> {
    Ok(match color {
        png::ColorType::Grayscale => texels(channels, |&[grey]| [grey, grey, grey, opaque]),
        png::ColorType::GrayscaleAlpha => texels(channels, |&[grey, alpha]| [grey, grey, grey, alpha]),
        png::ColorType::Rgb => texels(channels, |&[r, g, b]| [r, g, b, opaque]),
        png::ColorType::Rgba => texels(channels, |&texel: &[T; 4]| texel),
        png::ColorType::Indexed => return Err("its PNG has a palette that cannot be read".to_owned()),
    })
}

fn jpeg(file: &[u8], room: u64) -> Result<Decoded, Problem> {
    let broken = |error: zune_jpeg::errors::DecodeErrors| {
        format!("its JPEG is broken or of an unusual kind ({}); export it again", one_line(&error.to_string()))
    };
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(broken)?;
    let info = decoder.info().ok_or("its JPEG has no size")?;
    let size = [info.width, info.height].map(u32::from);
    check_size(size[0], size[1], room)?;
    let bytes = decoder.decode().map_err(broken)?;
    let texels = texels(&bytes, |&[r, g, b]| [r, g, b, u8::MAX]);
    let complete = texels.len() as u64 == u64::from(size[0]) * u64::from(size[1]);
    ensure!(complete, "its JPEG has channels that are no colours; export it as RGB");
    Ok(Decoded { size, texels: Texels::Eight(texels.into()) })
}

fn texels<T, const N: usize>(channels: &[T], texel: impl Fn(&[T; N]) -> [T; 4]) -> Vec<[T; 4]> {
    channels.as_chunks::<N>().0.iter().map(texel).collect()
}

fn one_line(message: &str) -> String {
    message.replace(['\n', '\r'], " ")
}
