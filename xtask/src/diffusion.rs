//! `cargo xtask diffusion`: what is wrong about profiles, and what they save, beside the walk.

use std::fmt::Write as _;

use clap::Args;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::{self, Render};
use restir_host::scene::{Scene, builtin};
use restir_host::technique::asked::asked;
use restir_host::technique::path::{Crossings, Fit, Parts, PathSettings, RadiusChoice, Subsurface, WayOut};

use crate::Error;
use crate::report::publish;
use crate::time::thread_seconds;

/// Pixels along a side of the tiles that are compared.
const TILE: usize = 8;
/// Widths and heights of the pictures.
const SIZE: [u32; 2] = [48, 64];
/// Lengths of a millimetre, in units of the scene: from dense bodies to thin ones.
const SCALES: [f64; 7] = [0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
/// Media of the statue, and lengths of a millimetre, where times are compared.
const EQUAL_TIME: [(&str, f64); 4] = [("skin1", 0.02), ("marble", 0.02), ("skin1", 0.0025), ("marble", 0.0025)];
/// Samples of equal-time rows.
const SPP: [u32; 3] = [1, 4, 16];
/// Renders whose errors are averaged there.
const RENDERS: u32 = 8;

/// Options of `cargo xtask diffusion`.
#[derive(Args)]
pub struct Options {
    /// Samples of each pixel in what is compared tile by tile; converged walks have eight times as many.
    #[arg(long, default_value_t = 96)]
    samples: u32,
    /// Write the report to docs/diffusion.md.
    #[arg(long)]
    write: bool,
}

/// The image of a render, in double precision.
type Pixels = Vec<[f64; 3]>;

fn filled(name: &str, medium: &str, scale: f64) -> Result<SceneBuffers, Error> {
    let mut scene: Scene =
        builtin::scene(name).ok_or_else(|| Error::Environment(format!("there is no scene called {name}")))?;
    scene.fill(medium, Some(scale))?;
    Ok(SceneBuffers::build(&scene)?)
}

fn settings(subsurface: Subsurface) -> PathSettings {
    PathSettings { subsurface, max_depth: 3, ..PathSettings::default() }
}

fn image(scene: &SceneBuffers, settings: &PathSettings, samples: u32, seed: u32) -> Result<Pixels, Error> {
    let render = Render { count: samples, seed, ..Render::new(SIZE, settings.clone()) };
    let rendered = render::render(&mut CpuExecutor::inline(), scene, &render, &mut |_| Ok(()))?;
    Ok(rendered.image.pixels.iter().map(|pixel| pixel.map(f64::from)).collect())
}

/// The mean of several renders, side by side.
fn converged(scene: &SceneBuffers, settings: &PathSettings, samples: u32, seed: u32) -> Result<Pixels, Error> {
    const PARTS: u32 = 8;
    let parts: Vec<Pixels> = (0..PARTS)
        .into_par_iter()
        .map(|part| image(scene, settings, samples / PARTS, seed * PARTS + part))
        .collect::<Result<_, _>>()?;
    let mean =
        |index: usize| [0, 1, 2].map(|c| parts.iter().map(|part| part[index][c]).sum::<f64>() / f64::from(PARTS));
    Ok((0..parts[0].len()).map(mean).collect())
}

fn tiles(pixels: &Pixels) -> Vec<f64> {
    let (width, across) = (SIZE[0] as usize, SIZE[0] as usize / TILE);
    let mut tiles = vec![0.0; 3 * across * (SIZE[1] as usize / TILE)];
    for (index, pixel) in pixels.iter().enumerate() {
        let tile = index / width / TILE * across + index % width / TILE;
        (0..3).for_each(|c| tiles[3 * tile + c] += pixel[c]);
    }
    tiles
}

/// The mean difference of tiles and channels over the mean of the second image, in percent.
fn difference(a: &Pixels, b: &Pixels) -> f64 {
    let (a, b) = (tiles(a), tiles(b));
    let off: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum();
    100.0 * off / b.iter().sum::<f64>()
}

fn squared(a: &Pixels, b: &Pixels) -> f64 {
    let sum: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b) * (a - b)).sum();
    sum / (3 * a.len()) as f64
}

/// Prints the report.
///
/// # Errors
/// If a scene cannot be rendered, or the report not written.
pub fn run(options: &Options) -> Result<(), Error> {
    let report = [scales(options.samples)?, equal_time(options.samples)?, variances()?, ways_out()?, rays()?].concat();
    publish("diffusion", &format!("{HEAD}{report}"), options.write)
}

const HEAD: &str = "# Profiles beside the walk\n\nMade by `cargo xtask diffusion --write`. Pictures of 48 x 64 pixels at `max_depth=3`; \
    media by Lambert's boundary. Errors are against the walk.\n";

/// How far off profile and hybrid are, from dense bodies to thin ones.
fn scales(samples: u32) -> Result<String, Error> {
    let mut text = "\n## Over the length of a millimetre\n\nThe mean difference of tiles of 8 x 8 pixels from the walk's, in percent of its mean, over \
        the whole picture; noise is that of two walks. A millimetre is as many units of the scene as the first column says: the statue is 1.9 \
        units high, its ears 0.1 thick.\n\n| scene | millimetre | profile | hybrid, diffuse | hybrid, searchlight | noise |\n|---|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for (name, medium) in [("statue", "skin1"), ("statue", "marble"), ("cube", "wax")] {
        for scale in SCALES {
            let scene = filled(name, medium, scale)?;
            let of = |subsurface, profile, seed| {
                let settings = PathSettings { profile, ..settings(subsurface) };
                converged(&scene, &settings, samples, seed)
            };
            let walk = converged(&scene, &settings(Subsurface::Walk), 2 * samples, 1)?;
            let again = of(Subsurface::Walk, Fit::Diffuse, 7)?;
            let profile = of(Subsurface::Diffusion, Fit::Diffuse, 2)?;
            let hybrid = of(Subsurface::Hybrid, Fit::Diffuse, 3)?;
            let searchlight = of(Subsurface::Hybrid, Fit::Searchlight, 4)?;
            let row = [profile, hybrid, searchlight, again].map(|found| format!("{:.1} %", difference(&found, &walk)));
            let _ = writeln!(text, "| {name}, {medium} | {scale} | {} |", row.join(" | "));
        }
    }
    Ok(text)
}

/// Time and variance of one sample, and what does not go away.
struct Cost {
    seconds: f64,
    variance: f64,
    bias: f64,
}

/// Root mean square errors at few samples, and when the walk overtakes.
fn equal_time(samples: u32) -> Result<String, Error> {
    let mut text = "\n## At equal time\n\nOne thread; the error is the root of the mean squared error against a converged walk, of 8 renders. Time is the \
        processor's, of a sample of each pixel.\n\n| statue of | method | ms a sample | RMSE at 1 | at 4 | at 16 | what stays |\n|---|---|---:|---:|---:|---:|---:|\n".to_owned();
    let mut after = String::new();
    for (medium, scale) in EQUAL_TIME {
        let scene = filled("statue", medium, scale)?;
        let reference = converged(&scene, &settings(Subsurface::Walk), 8 * samples, 11)?;
        let check = converged(&scene, &settings(Subsurface::Walk), 8 * samples, 12)?;
        // of each of the two references the half
        let noise = 0.5 * squared(&reference, &check);
        let mut costs = Vec::new();
        for subsurface in [Subsurface::Walk, Subsurface::Hybrid, Subsurface::Diffusion] {
            let (row, cost) = at_few(&scene, &settings(subsurface), &reference, noise, samples)?;
            let _ = writeln!(text, "| {medium}:{scale} | {} | {row} |", subsurface.name());
            costs.push(cost);
        }
        for (name, index) in [("hybrid", 1), ("diffusion", 2)] {
            let (walk, other): (&Cost, &Cost) = (&costs[0], &costs[index]);
            let gain = walk.variance * walk.seconds / (other.variance * other.seconds);
            let overtakes = (walk.variance * walk.seconds - other.variance * other.seconds) / (other.bias * other.bias);
            let _ = writeln!(
                after,
                "* {medium}:{scale}, {name}: at equal time the variance of the walk is {gain:.2} times as large{}.",
                if overtakes > 0.0 {
                    let samples = overtakes / walk.seconds;
                    format!("; the walk overtakes after {overtakes:.2} s, {samples:.0} of its samples a pixel")
                } else {
                    ": the walk is ahead from the beginning".to_owned()
                }
            );
        }
    }
    let _ = write!(text, "\n{after}");
    Ok(text)
}

fn at_few(
    scene: &SceneBuffers,
    settings: &PathSettings,
    reference: &Pixels,
    noise: f64,
    samples: u32,
) -> Result<(String, Cost), Error> {
    let mut errors = Vec::new();
    let mut time = 0.0;
    for spp in SPP {
        let mut sum = 0.0;
        for seed in 0..RENDERS {
            let start = thread_seconds();
            let found = image(scene, settings, spp, 1000 + seed)?;
            time += thread_seconds() - start;
            sum += squared(&found, reference) - noise;
        }
        errors.push((sum / f64::from(RENDERS)).max(0.0));
    }
    let (one, other) = (converged(scene, settings, 8 * samples, 21)?, converged(scene, settings, 8 * samples, 22)?);
    let own = 0.5 * squared(&one, &other);
    let bias = (squared(&one, reference) - noise - own).max(0.0).sqrt();
    let time = time / f64::from(RENDERS * SPP.iter().sum::<u32>());
    let cost = Cost { seconds: time, variance: (errors[0] - bias * bias).max(0.0), bias };
    let shown: Vec<String> = errors.iter().map(|error| format!("{:.4}", error.sqrt())).collect();
    Ok((format!("{:.2} | {} | {bias:.4}", 1000.0 * time, shown.join(" | ")), cost))
}

/// The variance of a pixel's sample, and how long a sample of the picture takes, in milliseconds.
fn variance(scene: &SceneBuffers, settings: &PathSettings, pairs: u32) -> Result<[f64; 2], Error> {
    let start = thread_seconds();
    let mut sum = 0.0;
    for pair in 0..pairs {
        sum += 0.5 * squared(&image(scene, settings, 1, 2 * pair)?, &image(scene, settings, 1, 2 * pair + 1)?);
    }
    Ok([sum / f64::from(pairs), 1000.0 * (thread_seconds() - start) / f64::from(2 * pairs)])
}

/// What a method's variance is made of, and what other choices make of it.
fn variances() -> Result<String, Error> {
    const PAIRS: u32 = 48;
    let hybrid = settings(Subsurface::Hybrid);
    let part = |parts| PathSettings { parts, ..hybrid.clone() };
    let rows = [
        ("walk", settings(Subsurface::Walk)),
        ("hybrid", hybrid.clone()),
        ("of it: what enters no body", part(Parts::Rest)),
        ("boundary term", part(Parts::Boundary)),
        ("single scattering", part(Parts::Single)),
        ("profile", part(Parts::Profile)),
        ("hybrid, 1 segment", PathSettings { segments: 1, ..hybrid.clone() }),
        ("4 segments", PathSettings { segments: 4, ..hybrid.clone() }),
        ("light samples alone", PathSettings { profile_paths: false, ..hybrid.clone() }),
        ("one crossing of a segment", PathSettings { crossings: Crossings::One, ..hybrid.clone() }),
        ("radii by the albedo", PathSettings { radius_channel: RadiusChoice::Albedo, ..hybrid.clone() }),
        ("way out drawn", PathSettings { way_out: WayOut::Drawn, ..hybrid.clone() }),
    ];
    let mut text = "\n## Where the variance comes from\n\nThe variance of a pixel's sample, the processor's milliseconds of a sample of the picture, and \
        their product, which is the variance at equal time: of the whole, of each part, and of other choices.\n"
        .to_owned();
    for (medium, scale) in EQUAL_TIME {
        let scene = filled("statue", medium, scale)?;
        let _ = writeln!(text, "\n| statue of {medium}:{scale} | variance | ms | product |\n|---|---:|---:|---:|");
        for (name, settings) in &rows {
            let [variance, ms] = variance(&scene, settings, PAIRS)?;
            let _ = writeln!(text, "| {name} | {variance:.4} | {ms:.2} | {:.3} |", variance * ms);
        }
    }
    Ok(text)
}

/// Both ways out of a body, of single scattering alone.
fn ways_out() -> Result<String, Error> {
    let mut text = "\n## Ways out\n\nSingle scattering alone: the variance of a pixel's sample, times the time of one sample of the picture.\n\n\
        | scene | way out | ms a sample | variance | product |\n|---|---|---:|---:|---:|\n"
        .to_owned();
    for (name, medium, scale) in [("statue", "skin1", 0.02), ("statue", "marble", 0.02), ("cube", "wax", 0.05)] {
        let scene = filled(name, medium, scale)?;
        for way_out in [WayOut::Dimmed, WayOut::Drawn] {
            let settings = PathSettings { way_out, parts: Parts::Single, ..settings(Subsurface::Hybrid) };
            let [variance, ms] = variance(&scene, &settings, 8)?;
            let (name_of_way, product) = (way_out.name(), variance * ms);
            let _ = writeln!(text, "| {name}, {medium} | {name_of_way} | {ms:.2} | {variance:.5} | {product:.5} |");
        }
    }
    Ok(text)
}

/// Rays of each part, a sample that enters.
fn rays() -> Result<String, Error> {
    let mut text = "\n## Rays\n\nOf the built-in slab, whose every camera ray enters, a sample. `profile_paths` off is what Zhang and d'Eon count (slide 81): for \
        single scattering two rays and two shadow rays, of which ours needs no shadow ray where an exit lies in the dark, and one more ray for each exit \
        whose direction is drawn as well; for the profile one probe and a shadow ray for each point that it finds.\n\n\
        | part | rays | shadow rays | probes |\n|---|---:|---:|---:|\n"
        .to_owned();
    let scene = builtin::scene("slab").ok_or_else(|| Error::Environment("there is no scene called slab".to_owned()))?;
    let scene = SceneBuffers::build(&scene)?;
    let hybrid = settings(Subsurface::Hybrid);
    for (name, settings) in [
        ("up to the entry", PathSettings { parts: Parts::Rest, ..hybrid.clone() }),
        ("boundary term", PathSettings { parts: Parts::Boundary, ..hybrid.clone() }),
        (
            "single scattering, with the segment of the boundary term",
            PathSettings { parts: Parts::Single, ..hybrid.clone() },
        ),
        ("profile", PathSettings { parts: Parts::Profile, ..hybrid.clone() }),
        (
            "profile, light samples alone",
            PathSettings { parts: Parts::Profile, profile_paths: false, ..hybrid.clone() },
        ),
        ("all", hybrid.clone()),
        ("walk", settings(Subsurface::Walk)),
    ] {
        let render = Render { count: 16, ..Render::new([32, 32], settings) };
        let counts = asked(&scene, &render)?.into_values().fold(Default::default(), |sum, of| of.counts.plus(sum));
        let restir_host::replay::Counts { closest, shadow, probes, .. } = counts;
        let of = |count: u64| count as f64 / (16.0 * 1024.0);
        // the camera's own is in the first row alone
        let first = if name == "up to the entry" { 0.0 } else { 1.0 };
        let _ = writeln!(text, "| {name} | {:.2} | {:.2} | {:.2} |", of(closest) - first, of(shadow), of(probes));
    }
    Ok(text)
}
