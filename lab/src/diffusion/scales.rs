//! How far off profile and hybrid are from dense bodies to thin ones, and what is lost where narrow media count as Lambertian.

use std::fmt::Write as _;

use rayon::prelude::*;
use restir_cli::trial::squared_difference;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Volume;
use restir_host::scene::subsurface::medium;
use restir_host::technique::path::{Fit, PathSettings, Subsurface};
use restir_shared::camera::spread;

use super::pictures::{Interval, Pictures, SIZE, TILE, root};
use super::{MEDIA, filled, settings};
use crate::Error;

/// Lengths of a millimetre, in units of the scene: from dense bodies to thin ones.
const SCALES: [f64; 7] = [0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
/// Scenes, their media, and how many times as many samples they need: the cube's noise is that of its small light.
const SCENES: [(&str, &str, u32); 3] = [("statue", "skin1", 1), ("statue", "marble", 1), ("cube", "wax", 16)];
/// Values of `lambert_below`.
const BELOW: [f64; 4] = [0.1, 0.3, 1.0, 3.0];

/// Errors by the length of a millimetre.
pub(super) fn report(samples: u32) -> Result<String, Error> {
    let mut text = format!(
        "\n## Over the length of a millimetre\n\nThe root of the mean squared difference of tiles of {TILE} x {TILE} pixels from the walk's, in percent of their mean, over the whole \
         picture; the noise of both is taken off, so that what is small may come out negative. Intervals of 95 %. A millimetre is as many units of the scene as the second column says: the statue is 1.9 \
         units high, its ears 0.1 thick.\n\n| scene | millimetre | profile | hybrid, diffuse | hybrid, searchlight | the profile's less the hybrid's |\n|---|---:|---:|---:|---:|---:|\n"
    );
    for (name, medium, more) in SCENES {
        for scale in SCALES {
            let scene = filled(name, medium, scale)?;
            let of = |subsurface, profile, seed| {
                let settings = PathSettings { profile, ..settings(subsurface) };
                Ok::<_, Error>(Pictures::of(&scene, &settings, SIZE, more * samples / 8, seed)?.tiles())
            };
            let walk = of(Subsurface::Walk, Fit::Diffuse, 1)?;
            let profile = of(Subsurface::Diffusion, Fit::Diffuse, 2)?;
            let hybrid = of(Subsurface::Hybrid, Fit::Diffuse, 3)?;
            let searchlight = of(Subsurface::Hybrid, Fit::Searchlight, 4)?;
            let off = |other: &Pictures, runs: &[usize]| {
                root(squared_difference(&other.runs, &walk.runs, runs)) / walk.mean(runs)
            };
            let ahead = Interval::of(|runs| off(&profile, runs) - off(&hybrid, runs));
            let row = [&profile, &hybrid, &searchlight].map(|found| found.off(&walk).percent());
            let _ = writeln!(text, "| {name}, {medium} | {scale} | {} | {} |", row.join(" | "), ahead.percent());
        }
    }
    Ok(text)
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
