//! `restir denoise`

use std::path::PathBuf;

use restir::Error;
use restir::advanced::output::check_writable;
use restir::denoise::Denoise;
use restir::image::{read_exr_metadata, read_exr_with, write_exr};

use super::parse::{ends_in, require};
use super::scene::refuse_overwriting;
use super::{console, device, interrupt, metadata, progress::patiently};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The image, EXR, with layers of what its pixels see: of `restir render --aov albedo,normal,depth,id,scattering`, or of Blender's passes Denoising
    /// Data, Depth and Object Index.
    image: PathBuf,
    /// The EXR file to write.
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    device: device::DeviceArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { image: input, output, .. } = arguments;
    require(ends_in(output, "exr"), format_args!("the output {} has to end in .exr", output.display()))?;
    check_writable(output)?;
    refuse_overwriting([input.as_path()], [output])?;
    let layers = Denoise::NEEDS.into_iter().chain(Denoise::KNOWS);
    let names: Vec<&'static str> = layers.flat_map(|layer| layer.channels()).copied().collect();
    let (image, channels) = patiently("reading the image", || read_exr_with(input, &names))?;
    let mut pairs = read_exr_metadata(input)?;
    let mut device = device::open(&arguments.device)?;
    let denoise = Denoise::default();
    let denoised = patiently("denoising", || denoise.image(&image, &channels, device.as_mut()));
    let denoised = denoised.map_err(|error| match error {
        Error::Setting(problem) => Error::cannot_read(input, problem),
        error => error,
    })?;
    pairs.retain(|(key, _)| key != "denoise");
    pairs.push(("denoise".to_owned(), metadata::of_denoiser(&denoise)));
    interrupt::check()?;
    interrupt::begin_writing();
    patiently("writing the image", || write_exr(output, &denoised, &pairs))?;
    console::print(&format!("wrote {}\n", output.display()))
}
