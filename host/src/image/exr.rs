//! EXR files: read, and written without loss of a bit.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use exr::meta::{BlockDescription, header::Header};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage, Layer,
    LayerAttributes, LineOrder, MetaData, ReadChannels, ReadLayers, ReadSpecificChannel, Text, Vec2, WritableImage,
};

use super::{Channel, Image, check_pixels};
use crate::error::explained;
use crate::output::write_atomically;
use crate::{Error, input, memory};

/// The EXR attribute that holds the metadata. It is one attribute because the `exr` crate writes several in a random
/// order, and equal renders should give equal files.
const METADATA_ATTRIBUTE: &str = "restir";

/// The most pixels that are read from a file: a damaged header must not exhaust the memory.
const MAX_PIXELS: u64 = 16_384 * 16_384;

/// More pixels than this in each byte of a file are not true. The densest compression, a ZIP of zeros, has 172: 1032
/// bytes in one, and 6 bytes a pixel.
const MAX_PIXELS_PER_BYTE: u64 = 1024;

/// Copies of a block while it is read: as it is in the file, decompressed, put in order, and one that the decompression needs.
const COPIES_OF_A_BLOCK: u64 = 4;

/// Reads the channels R, G and B of the first layer that has them, else those after the name of a layer, as in `ViewLayer.Combined.R`, else the
/// luminance Y; half floats are widened exactly.
///
/// # Errors
/// [`Error::File`] if the file is missing, damaged, lacks these channels or has more than 2^28 pixels; [`Error::Memory`] if reading takes
/// too much ([`exr_bytes`]).
pub fn read_exr(path: &Path) -> Result<Image, Error> {
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    if !read_header(path)?.headers.iter().any(|header| ["R", "G", "B"].iter().all(|name| has(header, name))) {
        return read_exr_with(path, &[]).map(|(image, _)| image);
    }
    memory::check(exr_bytes(path)?, &format!("reading {}", path.display()), "use a smaller image")?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(black, |image: &mut Image, at: Vec2<usize>, (r, g, b): (f32, f32, f32)| {
            if let Some(pixel) = image.pixels.get_mut(at.y() * image.width as usize + at.x()) {
                *pixel = [r, g, b];
            }
        })
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(open(path)?)
        .map_err(|error| not_exr(path, error))?;
    Ok(image.layer_data.channel_data.pixels)
}

/// As [`read_exr`], with those of the named channels that the layer has. A name may come after that of a view and a point, as in
/// `ViewLayer.Depth.Z`.
///
/// # Errors
/// As of [`read_exr`].
pub fn read_exr_with(path: &Path, names: &[&'static str]) -> Result<(Image, Vec<Channel>), Error> {
    let bytes = exr_bytes(path)?.saturating_add(bytes_of_channels(&read_header(path)?));
    memory::check(bytes, &format!("reading {}", path.display()), "use a smaller image, or one with fewer channels")?;
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let read = read.all_attributes().non_parallel().from_buffered(open(path)?);
    let layer = read.map_err(|error| not_exr(path, error))?.layer_data;
    let channels = layer.channel_data.list;
    let values = |channel: &AnyChannel<FlatSamples>| channel.sample_data.values_as_f32().collect::<Vec<f32>>();
    let exact = |name: &str| channels.iter().find(|channel| channel.name.eq(name)).map(values);
    let named = |name: &str| {
        let ending = format!(".{name}");
        let of_layer = || channels.iter().find(|channel| channel.name.to_string().ends_with(&ending)).map(values);
        exact(name).or_else(of_layer)
    };
    let color = |find: &dyn Fn(&str) -> Option<Vec<f32>>, [r, g, b]: [&str; 3]| find(r).zip(find(g)).zip(find(b));
    let own = color(&exact, ["R", "G", "B"]);
    let of_blender = || color(&named, ["Combined.R", "Combined.G", "Combined.B"]);
    let of_any = || color(&named, ["R", "G", "B"]).or_else(|| color(&named, ["Y"; 3]));
    let Some(((red, green), blue)) = own.or_else(of_blender).or_else(of_any) else {
        let found = channels.iter().map(|channel| channel.name.to_string()).collect::<Vec<_>>().join(", ");
        return Err(Error::cannot_read(path, format!("it has no channels R, G and B, but {found}; save its colours")));
    };
    let pixels = red.into_iter().zip(green).zip(blue).map(|((r, g), b)| [r, g, b]).collect();
    let image = Image { width: layer.size.width() as u32, height: layer.size.height() as u32, pixels };
    let channel = |name: &&'static str| named(name).map(|values| Channel { name, values });
    Ok((image, names.iter().filter_map(channel).collect()))
}

/// What all channels of a layer take, as they are read and as floats.
fn bytes_of_channels(meta: &MetaData) -> u64 {
    let bytes = |header: &Header| (header.layer_size.area() * header.channels.list.len()) as u64 * 8;
    meta.headers.iter().map(bytes).max().unwrap_or(0)
}

/// Reads the metadata that [`write_exr`] wrote; empty for a file of another program.
///
/// # Errors
/// [`Error::File`] if the file is missing or its header is damaged.
pub fn read_exr_metadata(path: &Path) -> Result<Vec<(String, String)>, Error> {
    let meta = read_header(path)?;
    let attribute = meta.headers.iter().find_map(|header| {
        let other = &header.own_attributes.other;
        other.iter().find(|(name, _)| METADATA_ATTRIBUTE == *name).map(|(_, value)| value)
    });
    let Some(AttributeValue::Text(text)) = attribute else {
        return Ok(Vec::new());
    };
    let text = text.to_string();
    let pairs = text.lines().filter_map(|line| line.split_once(": "));
    Ok(pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect())
}

/// What an EXR file says of its content.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// Width and height of the first layer in pixels.
    pub size: [usize; 2],
    /// Names of all channels of all layers; a layer's own name and a point come before.
    pub channels: Vec<String>,
    /// As of [`read_exr_metadata`].
    pub metadata: Vec<(String, String)>,
}

/// Reads what an EXR file says of its content, but no pixels.
///
/// # Errors
/// As of [`read_exr_metadata`].
#[doc(hidden)]
pub fn read_exr_content(path: &Path) -> Result<Content, Error> {
    let headers = read_header(path)?.headers;
    let size = headers.first().map_or([0; 2], |header| [header.layer_size.width(), header.layer_size.height()]);
    let named = |header: &Header| {
        let layer = header.own_attributes.layer_name.as_ref().map_or_else(String::new, |name| format!("{name}."));
        header.channels.list.iter().map(|channel| format!("{layer}{}", channel.name)).collect::<Vec<_>>()
    };
    let channels = headers.iter().flat_map(named).collect();
    Ok(Content { size, channels, metadata: read_exr_metadata(path)? })
}

/// Writes an EXR file, whole or not at all: channels R, G, B of 32-bit floats, ZIP-compressed without loss of a bit.
///
/// `metadata` goes into one text attribute, `restir`, as a line `key: value` for each pair. Equal images and metadata
/// give equal files.
///
/// # Errors
/// [`Error::File`] if the file cannot be written, or if the image has no pixels or not `width * height`.
pub fn write_exr(path: &Path, image: &Image, metadata: &[(String, String)]) -> Result<(), Error> {
    write_exr_with(path, image, &[], metadata)
}

/// As [`write_exr`], with further channels beside R, G and B, which other readers of the image pass over.
///
/// # Errors
/// As of [`write_exr`], also for a channel that has not `width * height` values.
pub fn write_exr_with(
    path: &Path,
    image: &Image,
    more: &[Channel],
    metadata: &[(String, String)],
) -> Result<(), Error> {
    check_pixels(path, image, image.pixels.len())?;
    more.iter().try_for_each(|channel| check_pixels(path, image, channel.values.len()))?;
    let channel = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    let color = ["R", "G", "B"].into_iter().enumerate();
    let color = color.map(|(i, name)| channel(name, image.pixels.iter().map(|pixel| pixel[i]).collect()));
    let more = more.iter().map(|Channel { name, values }| channel(name, values.clone()));
    let channels = AnyChannels::sort(color.chain(more).collect());
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (image.width as usize, image.height as usize);
    let layer = Layer::new(size, attributes(metadata), encoding, channels);
    write_atomically(path, |file| {
        ExrImage::from_layer(layer).write().non_parallel().to_buffered(file).map_err(io::Error::other)
    })
}

fn attributes(metadata: &[(String, String)]) -> LayerAttributes {
    let lines: Vec<String> = metadata.iter().map(|(key, value)| format!("{key}: {}\n", one_line(value))).collect();
    let mut attributes = LayerAttributes::default();
    if !lines.is_empty() {
        attributes.other.insert(latin1(METADATA_ATTRIBUTE), AttributeValue::Text(latin1(&lines.concat())));
    }
    attributes
}

fn one_line(value: &str) -> String {
    value.replace(['\n', '\r'], " ")
}

/// EXR text has one byte a character; what does not fit becomes a question mark.
fn latin1(text: &str) -> Text {
    Text::from_bytes_unchecked(text.chars().map(|c| u8::try_from(c).unwrap_or(b'?')).collect())
}

fn black(size: Vec2<usize>, _channels: &impl Sized) -> Image {
    Image { width: size.width() as u32, height: size.height() as u32, pixels: vec![[0.0; 3]; size.area()] }
}

/// Bytes that [`read_exr`] takes, as far as the header says it: for the pixels, and for a block of all channels, which may be a tile as large
/// as the image.
///
/// # Errors
/// As of [`read_exr`], as far as the header tells.
#[doc(hidden)]
pub fn exr_bytes(path: &Path) -> Result<u64, Error> {
    let bytes = std::fs::metadata(path).map_err(|error| Error::cannot_read(path, error))?.len();
    let pixels = |size: Vec2<usize>| (size.width() as u64).saturating_mul(size.height() as u64);
    let headers = read_header(path)?.headers;
    let claimed = headers.iter().map(|header| pixels(header.layer_size)).max().unwrap_or(0);
    let problem = if claimed > MAX_PIXELS {
        format!("it has {claimed} pixels, more than {MAX_PIXELS}")
    } else if claimed / MAX_PIXELS_PER_BYTE > bytes {
        format!("it is damaged: its {bytes} bytes cannot hold the {claimed} pixels that its header claims")
    } else {
        return Ok(headers.iter().map(bytes_of_layer).max().unwrap_or(0));
    };
    Err(Error::cannot_read(path, problem))
}

/// What reading a layer takes.
fn bytes_of_layer(header: &Header) -> u64 {
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let [columns, rows] = match header.blocks {
        BlockDescription::Tiles(tiles) => [tiles.tile_size.width().min(width), tiles.tile_size.height().min(height)],
        BlockDescription::ScanLines => [width, header.compression.scan_lines_per_block().min(height)],
    };
    let product =
        |factors: [usize; 3]| factors.into_iter().fold(1_u64, |product, by| product.saturating_mul(by as u64));
    let block = product([columns, rows, header.channels.bytes_per_pixel]);
    product([width, height, size_of::<[f32; 3]>()]).saturating_add(block.saturating_mul(COPIES_OF_A_BLOCK))
}

fn read_header(path: &Path) -> Result<MetaData, Error> {
    MetaData::read_from_buffered(open(path)?, false).map_err(|error| not_exr(path, error))
}

/// What files of Radiance begin with.
const RADIANCE: &[u8] = b"#?";

fn not_exr(path: &Path, error: exr::error::Error) -> Error {
    let mut start = [0; RADIANCE.len()];
    let is_read = File::open(path).and_then(|mut file| io::Read::read_exact(&mut file, &mut start)).is_ok();
    if is_read && start == RADIANCE {
        return Error::cannot_read(path, "it is a Radiance file (.hdr); convert it to EXR");
    }
    let sentence = match &error {
        exr::error::Error::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => error.to_string(),
        exr::error::Error::NotSupported(what) => format!("{what} cannot be read; save it as a plain EXR file"),
        error => {
            let what = "it is no EXR file with colours, or a damaged one";
            format!("{what} ({error}); give an EXR file, or save it anew")
        }
    };
    Error::cannot_read(path, explained(one_line(&sentence), error))
}

fn open(path: &Path) -> Result<BufReader<File>, Error> {
    input::open(path).map(BufReader::new).map_err(|error| Error::cannot_read(path, error))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn awkward() -> Image {
        let bits = [0, 1, 0x8000_0000, 0x8000_0001, 0x007f_ffff, 0x3f80_0001, 0x7f80_0000, 0xff80_0000, 0x7fc0_1234];
        let values: Vec<f32> = (0..17 * 35 * 3_u32)
            .map(|i| f32::from_bits(bits.get(i as usize).copied().unwrap_or(i.wrapping_mul(2_654_435_761))))
            .collect();
        Image { width: 17, height: 35, pixels: values.as_chunks::<3>().0.to_vec() }
    }

    /// A folder, and the path of an image to be written in it.
    fn place() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        (folder, path)
    }

    fn bits(image: &Image) -> Vec<u32> {
        image.pixels.as_flattened().iter().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn exr_keeps_every_bit_and_the_metadata() {
        let (_folder, path) = place();
        let metadata = |scene: &str| [("scene", scene), ("seed", "7")].map(|(k, v)| (k.to_owned(), v.to_owned()));
        write_exr(&path, &awkward(), &metadata("böx\nin a box")).unwrap();
        let read = read_exr(&path).unwrap();
        assert_eq!((read.width, read.height), (17, 35));
        assert_eq!(bits(&read), bits(&awkward()));
        assert_eq!(read_exr_metadata(&path).unwrap(), metadata("böx in a box"));
    }

    #[test]
    fn further_channels_leave_the_image_as_it_is() {
        let (_folder, path) = place();
        let values = |shift| (0..17 * 35_u16).map(|i| f32::from(i) + shift).collect();
        let more = [("layer.b", 0.5), ("layer.A", 0.25)].map(|(name, shift)| Channel { name, values: values(shift) });
        write_exr_with(&path, &awkward(), &more, &[]).unwrap();
        assert_eq!(bits(&read_exr(&path).unwrap()), bits(&awkward()));
        let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        let channels = image.layer_data.channel_data.list;
        assert!(channels.iter().map(|c| c.name.to_string()).eq(["B", "G", "R", "layer.A", "layer.b"]));
        for (channel, expected) in channels[3..].iter().zip([&more[1], &more[0]]) {
            assert_eq!(channel.sample_data.values_as_f32().collect::<Vec<_>>(), expected.values);
        }
        let short = [Channel { name: "layer.c", values: vec![0.0] }];
        write_exr_with(&path, &awkward(), &short, &[]).unwrap_err();
    }

    /// Colours after the name of a layer, of several the combined ones, and luminance alone; other channels by their endings.
    #[test]
    fn colours_of_layers_are_read() {
        let (_folder, path) = place();
        let encoding =
            Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let read = |names: &[&str]| {
            let channel = |(i, name): (usize, &&str)| AnyChannel::new(*name, FlatSamples::F32(vec![i as f32; 6]));
            let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
            let layer = Layer::new((3, 2), LayerAttributes::default(), encoding, channels);
            ExrImage::from_layer(layer).write().non_parallel().to_file(&path).unwrap();
            (read_exr(&path).map(|image| image.pixels[5]), read_exr_with(&path, &["Depth.Z"]).unwrap_or_default())
        };
        let blender = ["V.A.R", "V.A.G", "V.A.B", "V.Combined.R", "V.Combined.G", "V.Combined.B", "V.Depth.Z"];
        let (image, (same, layers)) = read(&blender);
        assert_eq!((image.unwrap(), same.pixels[5], same.width), ([3.0, 4.0, 5.0], [3.0, 4.0, 5.0], 3));
        assert_eq!(layers, [Channel { name: "Depth.Z", values: vec![6.0; 6] }]);
        assert_eq!(read(&blender[..3]).0.unwrap(), [0.0, 1.0, 2.0]);
        assert_eq!(read(&["R", "G", "B", "V.Combined.R", "V.Combined.G", "V.Combined.B"]).0.unwrap(), [0.0, 1.0, 2.0]);
        assert_eq!(read(&["A", "Y"]).0.unwrap(), [1.0; 3]);
        let problem = read(&["U", "V"]).0.unwrap_err().to_string();
        assert!(problem.contains("no channels R, G and B, but U, V"), "{problem}");
        std::fs::write(&path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n").unwrap();
        let problem = read_exr(&path).unwrap_err().to_string();
        assert!(problem.contains("Radiance file") && problem.contains("convert it to EXR"), "{problem}");
    }

    #[test]
    fn equal_images_give_equal_files() {
        let metadata: Vec<_> = (0..20).map(|i| (format!("key {i}"), i.to_string())).collect();
        let [a, b] = [place(), place()].map(|(_folder, path)| {
            write_exr(&path, &awkward(), &metadata).unwrap();
            std::fs::read(path).unwrap()
        });
        assert_eq!(a, b);
    }

    #[test]
    fn damaged_files_are_errors() {
        let (_folder, path) = place();
        write_exr(&path, &awkward(), &[]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for length in [0, 4, 100, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(matches!(read_exr(&path), Err(Error::File { .. })), "{length} bytes");
        }
        assert!(matches!(read_exr(&path.with_extension("missing")), Err(Error::File { .. })));
    }

    /// A changed size in the header, found by the eight bytes of the last pixel's coordinates.
    #[test]
    fn a_header_cannot_claim_what_the_file_does_not_hold() {
        let (_folder, path) = place();
        write_exr(&path, &awkward(), &[]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let corner = [16_i32.to_le_bytes(), 34_i32.to_le_bytes()].concat();
        for (claimed, word) in [([16_383_i32, 16_383], "damaged"), ([1 << 20, 1 << 20], "more than")] {
            let claimed = claimed.map(i32::to_le_bytes).concat();
            let mut changed = bytes.clone();
            while let Some(at) = changed.windows(8).position(|window| window == corner) {
                changed[at..at + 8].copy_from_slice(&claimed);
            }
            std::fs::write(&path, changed).unwrap();
            let message = read_exr(&path).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    /// 12 bytes a pixel, and four blocks of 16 rows with all channels.
    #[test]
    fn what_reading_takes_is_known_before() {
        let (_folder, path) = place();
        write_exr(&path, &awkward(), &[]).unwrap();
        assert_eq!(exr_bytes(&path).unwrap(), 12 * 17 * 35 + 4 * (12 * 17 * 16));
        let more = ["a", "b"].map(|name| Channel { name, values: vec![0.0; 17 * 35] });
        write_exr_with(&path, &awkward(), &more, &[]).unwrap();
        assert_eq!(exr_bytes(&path).unwrap(), 12 * 17 * 35 + 4 * (20 * 17 * 16));
    }

    #[test]
    fn a_folder_is_no_image() {
        let message = read_exr(tempfile::tempdir().unwrap().path()).unwrap_err().to_string();
        assert!(message.contains("folder"), "{message}");
    }

    #[test]
    fn a_changed_byte_never_panics() {
        let (_folder, path) = place();
        let image = Image { width: 3, height: 2, pixels: vec![[0.25; 3]; 6] };
        write_exr(&path, &image, &[("key".to_owned(), "value".to_owned())]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for position in 0..bytes.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut changed = bytes.clone();
                changed[position] = value;
                std::fs::write(&path, changed).unwrap();
                let _ = (read_exr(&path), read_exr_metadata(&path));
            }
        }
    }

    #[test]
    fn an_image_must_have_its_pixels() {
        let (_folder, path) = place();
        write_exr(&path, &Image { width: 2, height: 2, pixels: vec![[0.0; 3]; 3] }, &[]).unwrap_err();
        write_exr(&path, &Image::default(), &[]).unwrap_err();
    }
}
