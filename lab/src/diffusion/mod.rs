//! `cargo lab diffusion`: what is wrong about profiles, and what they save, beside the walk.

mod bodies;
mod equal_time;
mod pictures;
mod scales;

use std::fmt::Write as _;

use clap::{Args, ValueEnum};
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::scene::{Scene, builtin};
use restir_host::technique::asked::asked;
use restir_host::technique::path::{Parts, PathSettings, Subsurface};

use crate::Error;
use crate::origin::{commit, machine};
use crate::report::publish;

/// Media of the statue, and lengths of a millimetre, where times are compared.
const MEDIA: [(&str, f64); 4] = [("skin1", 0.02), ("marble", 0.02), ("skin1", 0.0025), ("marble", 0.0025)];

/// Options of `cargo lab diffusion`.
#[derive(Args)]
pub struct Options {
    /// Samples of each pixel in pictures that are compared tile by tile; converged ones have eight times as many.
    #[arg(long, default_value_t = 96)]
    samples: u32,
    /// Make one section alone, and print it.
    #[arg(long, value_enum, conflicts_with = "write")]
    only: Option<Section>,
    /// Write the report to docs/diffusion.md.
    #[arg(long)]
    write: bool,
}

/// The sections of the report, in their order.
#[derive(Clone, Copy, ValueEnum)]
enum Section {
    Bodies,
    Scales,
    Media,
    EqualTime,
    LambertBelow,
    Elsewhere,
    Rays,
}

/// A built-in scene whose bodies have a medium.
fn filled(name: &str, medium: &str, scale: f64) -> Result<SceneBuffers, Error> {
    let mut scene: Scene =
        builtin::scene(name).ok_or_else(|| Error::Environment(format!("there is no scene called {name}")))?;
    scene.fill(medium, Some(scale))?;
    Ok(SceneBuffers::build(&scene)?)
}

fn settings(subsurface: Subsurface) -> PathSettings {
    PathSettings { subsurface, max_depth: 3, ..PathSettings::default() }
}

/// Prints the report.
///
/// # Errors
/// If a scene cannot be rendered, or the report not written.
pub fn run(options: &Options) -> Result<(), Error> {
    if let Some(section) = options.only {
        println!("{}", section.report(options.samples)?);
        return Ok(());
    }
    let head = head();
    let sections = Section::value_variants().iter().map(|section| section.report(options.samples));
    publish("diffusion", &format!("{head}{}", sections.collect::<Result<String, _>>()?), options.write)
}

impl Section {
    fn report(self, samples: u32) -> Result<String, Error> {
        match self {
            Self::Bodies => bodies::report(samples.div_ceil(12)),
            Self::Scales => scales::report(samples),
            Self::Media => scales::media(samples),
            Self::EqualTime => equal_time::report(samples),
            Self::LambertBelow => scales::lambert_below(samples),
            Self::Elsewhere => equal_time::elsewhere(),
            Self::Rays => rays(),
        }
    }
}

fn head() -> String {
    format!(
        "# Profiles beside the walk\n\nMade by `cargo lab diffusion --write`, of commit {}, on {}. At `max_depth=3`; media by Lambert's boundary. Errors are \
         against the walk. Where it does not say otherwise, pictures have 48 x 64 pixels.\n",
        commit(),
        machine()
    )
}

/// Rays of each part, a sample that enters.
fn rays() -> Result<String, Error> {
    let mut text = "\n## Rays\n\nOf the built-in slab, a sample: every camera ray enters, and is counted in the first row alone. (The figure [zhang2025-profiles](figures/zhang2025-profiles/report.md) counts it in each, under a sky that is white \
        all around, where fewer light samples lie in the dark.) `profile_paths` off is what Zhang and d'Eon count (slide 81): for \
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
