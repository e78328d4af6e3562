//! `restir explain`

use std::path::PathBuf;
use std::str::FromStr;

use restir::{
    Error,
    render::Render,
    shared::glam::DVec3,
    technique::Repeats,
    technique::explain::{Place, Subject},
};

use serde_json::{Value, json};

use super::metadata::vector;
use super::parse::natural;
use super::technique::{TechniqueArguments, cameras, configured, refuse_unused};
use super::{console, device, progress::patiently, reference::PictureArguments, scene::DEFAULT_SIZE};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, or a .gltf or .glb file.
    scene: PathBuf,
    /// The pixel as X,Y, counted from 0 from the upper left corner.
    #[arg(long, allow_hyphen_values = true)]
    pixel: Pixel,
    /// Which sample of the pixel (path tracing), counted from 0; 0 if not given. ReSTIR explains its last frame.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    sample: Option<u32>,
    #[command(flatten)]
    technique: TechniqueArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Print one JSON object; a number that is not finite is null.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// A pixel as the user wrote it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pixel {
    x: u32,
    y: u32,
}

impl FromStr for Pixel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (x, y) = text.split_once(',').ok_or("it has to be X,Y, as in 12,34")?;
        Ok(Self { x: natural(x)?, y: natural(y)? })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { technique: options, picture, pixel: Pixel { x, y }, .. } = arguments;
    let technique = configured(&options.name, &options.settings, picture.max_depth, picture.within_pixel.jitter())?;
    let frames = options.frame_count()?;
    let given = [
        ("--sample", arguments.sample.is_some(), Repeats::Samples),
        ("--frames", frames.is_some(), Repeats::Frames),
        ("--camera-path", options.camera_path.is_some(), Repeats::Frames),
    ];
    refuse_unused(technique.as_ref(), &given)?;
    let mut scene = picture.additions.open(&arguments.scene)?;
    let size = picture.size(scene.default_size.unwrap_or(DEFAULT_SIZE))?;
    picture.additions.complete(&mut scene, size)?;
    let buffers = picture.additions.buffers(&scene)?;
    let count = match technique.about().repeats {
        Repeats::Samples => 1,
        Repeats::Frames => frames.unwrap_or(technique.about().default_count),
    };
    let cameras = cameras(options.path(&buffers)?.as_ref(), buffers.camera, count)?;
    let render = Render { count, seed: options.seed, cameras, ..Render::new(size, technique) };
    let place = Place { x: *x, y: *y, sample: arguments.sample.unwrap_or(0) };
    place.check(&render)?;
    render.technique.inspect().check_explained(&buffers, &render)?;
    let mut device = device::open_for(&arguments.device, &buffers, &render)?;
    let subject = Subject { scene: &scene, buffers: &buffers, render: &render, place };
    let explanation = patiently("explaining", || render.technique.inspect().explain(device.as_mut(), subject))?;
    let origin = buffers.origin();
    if origin != DVec3::ZERO {
        console::note(&format!("the scene is far from the origin: positions are relative to {}", vector(origin)));
    }
    match arguments.json {
        true => console::print(&format!("{}\n", located(explanation.json, origin))),
        false => console::print_shortened(&explanation.text),
    }
}

/// An explanation with what its positions are relative to, if that is not the origin of the world.
fn located(mut explanation: Value, origin: DVec3) -> Value {
    if origin != DVec3::ZERO {
        explanation["origin"] = json!(origin.to_array());
    }
    explanation
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_parsed() {
        assert_eq!("12,34".parse(), Ok(Pixel { x: 12, y: 34 }));
        for text in ["", "12", "12,", ",3", "-1,2", "1,2,3", "1.5,2", "4294967296,0"] {
            text.parse::<Pixel>().unwrap_err();
        }
    }
}
