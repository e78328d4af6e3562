//! `cargo lab aov`: the layers of `restir render --aov` as one picture, for the documentation.

use std::path::PathBuf;

use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::image::{Channel, Image, write_png};
use restir_host::scene::Scene;
use restir_host::technique::{Technique, path::PathSettings};
use restir_shared::num::clamp;

use crate::Error;

const SIZE: [u32; 2] = [288, 216];
/// Seconds of the scene's animation.
const TIME: f64 = 1.5;
const ROWS: [[Aov; 3]; 2] = [[Aov::Albedo, Aov::Normal, Aov::Depth], [Aov::Position, Aov::Motion, Aov::Id]];
/// Pixels of motion that are shown at full strength.
const FAST: f32 = 4.0;

/// What to draw.
#[derive(clap::Args)]
pub struct Options {
    /// The picture to write.
    #[arg(long, default_value = "docs/aov.png")]
    out: PathBuf,
}

/// Draws them.
///
/// # Errors
/// If the picture cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let mut scene = Scene::load("toys")?;
    scene.animation.start = TIME;
    let scene = SceneBuffers::build(&scene)?;
    let integral = PathSettings::default().integral();
    let camera = |frame| scene.camera_at(frame);
    let shot = Shot { scene: &scene, frame: 0.0, camera: &camera, size: SIZE, seed: 0, integral, samples: 64 };
    let [width, height] = SIZE;
    let mut image = Image { width: 3 * width, height: 2 * height, pixels: Vec::new() };
    for row in ROWS {
        let tiles = row.iter().map(|layer| Ok(shown(*layer, &shot.channels(&[*layer])?)));
        let tiles: Vec<Vec<[f32; 3]>> = tiles.collect::<Result<_, Error>>()?;
        for y in 0..height as usize {
            image.pixels.extend(tiles.iter().flat_map(|tile| &tile[y * width as usize..][..width as usize]));
        }
    }
    Ok(write_png(&options.out, &image)?)
}

/// A layer as colours in [0, 1].
fn shown(layer: Aov, channels: &[Channel]) -> Vec<[f32; 3]> {
    let value = |channel: usize, pixel: usize| channels.get(channel).map_or(0.0, |channel| channel.values[pixel]);
    let vector = |pixel: usize| [0, 1, 2].map(|channel| value(channel, pixel));
    let count = channels.first().map_or(0, |channel| channel.values.len());
    let seen = |x: &f32| *x < 1.0e9;
    let ends = |channel: &Channel| {
        let ends = |least: f32, x: &f32| least.min(*x);
        let low = channel.values.iter().filter(|x| seen(x)).fold(f32::INFINITY, ends);
        let high = channel.values.iter().filter(|x| seen(x)).fold(f32::NEG_INFINITY, |most, x| most.max(*x));
        [low, high]
    };
    let ends: Vec<[f32; 2]> = channels.iter().map(ends).collect();
    let within = |x: f32, [low, high]: [f32; 2]| clamp((x - low) / (high - low).max(1.0e-6), 0.0, 1.0);
    let color = |pixel: usize| match layer {
        Aov::Normal => vector(pixel).map(|x| 0.5 + 0.5 * x),
        Aov::Depth => [1.0 - within(value(0, pixel), ends[0]); 3],
        Aov::Position => [0, 1, 2].map(|channel| within(value(channel, pixel), ends[channel])),
        Aov::Motion => [0.5 + value(0, pixel) / FAST, 0.5 + value(1, pixel) / FAST, 0.5],
        Aov::Id => of_object(value(0, pixel)),
        // albedos, and what a later version has
        _ => vector(pixel),
    };
    (0..count).map(color).collect()
}

/// A colour for each object, and black for none.
fn of_object(id: f32) -> [f32; 3] {
    let hash = (id as u32).wrapping_mul(0x9e37_79b1).to_be_bytes();
    [hash[0], hash[1], hash[2]].map(|byte| f32::from(byte) / 255.0)
}
