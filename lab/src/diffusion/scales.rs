//! How far off profile and hybrid are from dense bodies to thin ones, and what is lost where narrow media count as Lambertian.

use std::fmt::Write as _;

use rayon::prelude::*;
use restir_cli::trial::squared_difference;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::subsurface::medium;
use restir_host::scene::{Scene, Volume};
use restir_host::technique::path::{Fit, PathSettings, Subsurface, Thickness};
use restir_shared::camera::spread;

use super::pictures::{Interval, Pictures, SIZE, TILE, root};
use super::{MEDIA, filled, settings};
use crate::Error;

/// Lengths of a millimetre, in units of the scene: from dense bodies to thin ones.
const SCALES: [f64; 7] = [0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
/// Scenes, their media, and how many times as many samples they need: the cube's noise is that of its small light.
const SCENES: [(&str, &str, u32); 3] = [("statue", "skin1", 1), ("statue", "marble", 1), ("cube", "wax", 16)];
/// Bodies, and how many times as many samples they need: the bunny's noise is that of the default light.
const BODIES: [(&str, u32); 2] = [("bunny", 8), ("statue", 1)];
/// Their media and scales.
const BODY_MEDIA: [&str; 4] = ["marble", "wax", "milk", "skin1"];
const BODY_SCALES: [f64; 3] = [0.0025, 0.02, 0.2];
/// Values of `lambert_below`.
const BELOW: [f64; 4] = [0.1, 0.3, 1.0, 3.0];

/// How far profile and hybrid are from the walk in pictures of one scene, so many samples of each pixel in a run.
struct Compared {
    /// Of the profile, the hybrid, the hybrid with the other fit, and the hybrid whose profile is that of a half space.
    off: [Interval; 4],
    /// How much more the profile's is than the hybrid's.
    ahead: Interval,
}

impl Compared {
    fn of(scene: &SceneBuffers, samples: u32) -> Result<Self, Error> {
        let of =
            |settings: PathSettings, seed| Ok::<_, Error>(Pictures::of(scene, &settings, SIZE, samples, seed)?.tiles());
        let hybrid = settings(Subsurface::Hybrid);
        let walk = of(settings(Subsurface::Walk), 1)?;
        let found = [
            of(settings(Subsurface::Diffusion), 2)?,
            of(hybrid.clone(), 3)?,
            of(PathSettings { profile: Fit::Searchlight, ..hybrid.clone() }, 4)?,
            of(PathSettings { thickness: Thickness::Ignored, ..hybrid }, 5)?,
        ];
        let off = |other: &Pictures, runs: &[usize]| {
            root(squared_difference(&other.runs, &walk.runs, runs)) / walk.mean(runs)
        };
        let ahead = Interval::of(|runs| off(&found[0], runs) - off(&found[1], runs));
        Ok(Self { off: found.map(|other| other.off(&walk)), ahead })
    }

    /// The cells of a row.
    fn cells(&self) -> String {
        let off = self.off.map(|off| off.percent()).join(" | ");
        format!("{off} | {}", self.ahead.percent())
    }
}

/// What tables of [`Compared`] have above their columns.
const COLUMNS: &str = "profile | hybrid | hybrid, searchlight | hybrid, thickness ignored | the profile's less the hybrid's |\n|---|---:|---:|---:|---:|---:|---:|\n";

/// Errors by the length of a millimetre.
pub(super) fn report(samples: u32) -> Result<String, Error> {
    let mut text = format!(
        "\n## Over the length of a millimetre\n\nThe root of the mean squared difference of tiles of {TILE} x {TILE} pixels from the walk's, in percent of their mean, over the whole \
         picture; the noise of both is taken off, so that what is small may come out negative. Intervals of 95 %. A millimetre is as many units of the scene as the second column says: the statue is 1.9 \
         units high, its ears 0.1 thick.\n\n| scene | millimetre | {COLUMNS}"
    );
    for (name, medium, more) in SCENES {
        for scale in SCALES {
            let compared = Compared::of(&filled(name, medium, scale)?, more * samples / 8)?;
            let _ = writeln!(text, "| {name}, {medium} | {scale} | {} |", compared.cells());
        }
    }
    Ok(text)
}

/// Errors by body and medium, from dense to thin.
pub(super) fn media(samples: u32) -> Result<String, Error> {
    let mut text = format!(
        "\n## By body and medium\n\nAs above. The bunny (`assets/bunny.glb`) is 1.8 units high and lit by the default light. Of `candles`, whose light is inside of bodies, profiles know \
         little.\n\n| scene | millimetre | {COLUMNS}"
    );
    let (mut ahead, mut behind) = (0, 0);
    for (body, more) in BODIES {
        for medium in BODY_MEDIA {
            for scale in BODY_SCALES {
                let compared = Compared::of(&body_of(body, medium, scale)?, more * samples / 8)?;
                ahead += u32::from(compared.ahead.is_positive() == Some(true));
                behind += u32::from(compared.ahead.is_positive() == Some(false));
                let _ = writeln!(text, "| {body}, {medium} | {scale} | {} |", compared.cells());
            }
        }
    }
    let candles = Scene::load("candles").and_then(|scene| SceneBuffers::build(&scene))?;
    let _ = writeln!(text, "| candles | | {} |", Compared::of(&candles, samples)?.cells());
    let cells = BODIES.len() * BODY_MEDIA.len() * BODY_SCALES.len();
    let _ = writeln!(
        text,
        "\nOf the {cells} bodies the hybrid is nearer to the walk in {ahead}, the profile in {behind}; the rest is not decided."
    );
    Ok(text)
}

/// A body of a medium, as `--subsurface` makes it.
fn body_of(name: &str, medium: &str, scale: f64) -> Result<SceneBuffers, Error> {
    if name != "bunny" {
        return filled(name, medium, scale);
    }
    let mut scene = Scene::load("assets/bunny.glb")?;
    scene.fill(medium, Some(scale))?;
    scene.add_default_light();
    Ok(SceneBuffers::build(&scene)?)
}

/// Errors and times of `lambert_below`.
pub(super) fn lambert_below(samples: u32) -> Result<String, Error> {
    let mut text = "\n## Narrow media as Lambertian surfaces\n\n`lambert_below`, in pixels: channels whose mean free path is shorter are Lambertian. How far the hybrid's tiles are then from its own without (as \
        above, with the same random numbers), and the processor's milliseconds of a sample; the shortest and longest mean free path of a channel, in pixels in the middle \
        of the picture.\n\n| statue of | mean free paths | without: ms |"
        .to_owned();
    for below in BELOW {
        let _ = write!(text, " {below} | ms |");
    }
    let _ = writeln!(text, "\n|---|---:|---:|{}", "---:|---:|".repeat(BELOW.len()));
    let rows = MEDIA.par_iter().map(|&(medium, scale)| row(medium, scale, samples)).collect::<Result<Vec<_>, _>>()?;
    Ok(text + &rows.concat())
}

fn row(medium: &str, scale: f64, samples: u32) -> Result<String, Error> {
    let scene = filled("statue", medium, scale)?;
    let of = |lambert_below: f64| {
        let settings = PathSettings { lambert_below: lambert_below as f32, ..settings(Subsurface::Hybrid) };
        Ok::<_, Error>(Pictures::of(&scene, &settings, SIZE, samples / 8, 5)?.tiles())
    };
    let time = |pictures: &Pictures| {
        let of = |runs: &[usize]| runs.iter().map(|&run| pictures.milliseconds[run]).sum::<f64>() / runs.len() as f64;
        format!("{:.2}", Interval::of(of))
    };
    let without = of(0.0)?;
    let [shortest, longest] = in_pixels(&scene, medium, scale)?;
    let mut row = format!("| {medium}:{scale} | {shortest:.2} to {longest:.2} | {} |", time(&without));
    for below in BELOW {
        let with = of(below)?;
        let _ = write!(row, " {} | {} |", with.off(&without).percent(), time(&with));
    }
    Ok(row + "\n")
}

/// The shortest and the longest mean free path of a medium's channels, in pixels in the middle of the picture.
fn in_pixels(scene: &SceneBuffers, name: &str, scale: f64) -> Result<[f64; 2], Error> {
    let Volume { attenuation_color, attenuation_distance, .. } = medium(name, scale)?;
    let pixel = f64::from(spread(&scene.camera.params(SIZE[0], SIZE[1]))) * scene.camera.distance_in_focus();
    let paths = attenuation_color.map(|left| -f64::from(attenuation_distance) / f64::from(left).ln() / pixel);
    Ok([paths.into_iter().fold(f64::INFINITY, f64::min), paths.into_iter().fold(0.0, f64::max)])
}
