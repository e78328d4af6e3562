//! Light inside of bodies, by the walk, by profiles and by both: what a sample takes, and the error in equal time.

use std::time::Duration;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::GpuExecutor;
use restir_host::reference::{self, Goal, Picture};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_host::settings::Choice as _;
use restir_host::technique::Technique as _;
use restir_host::technique::path::{PathSettings, Subsurface};

use super::bench::Bench;
use super::pace::took;
use super::rows::Row;
use super::{Extent, Found, Part};
use crate::Error;
use crate::bench::error::{Errors, Truth};

const SCENE: &str = "statue";
/// What the statue is filled with, and how long a millimetre is.
const MEDIUM: (&str, f64) = ("skin1", 0.02);
const DEPTH: u32 = 3;
/// Samples of a method in equal time, however fast it is.
const MOST_SAMPLES: f64 = 4096.0;
/// Images with seeds of their own, over which an error is the mean.
const IMAGES: u32 = 4;

/// How much is rendered to know errors.
struct Effort {
    size: [u32; 2],
    /// Samples of the walk, whose time all methods have.
    samples: u32,
    reference: Goal,
    /// The walk first, whose time the others have.
    methods: &'static [Subsurface],
}

fn effort(extent: Extent) -> Effort {
    let goal = |samples, seconds| Goal { samples, time: Some(Duration::from_secs(seconds)) };
    match extent {
        // what takes long on a software adapter is to compile
        Extent::Quick => Effort {
            size: [12, 8],
            samples: 1,
            reference: goal(128, 1),
            methods: &[Subsurface::Walk, Subsurface::Hybrid],
        },
        _ => Effort {
            size: [240, 135],
            samples: 16,
            reference: goal(16384, 25),
            methods: &[Subsurface::Walk, Subsurface::Diffusion, Subsurface::Hybrid],
        },
    }
}

fn settings(subsurface: Subsurface) -> PathSettings {
    PathSettings { subsurface, max_depth: DEPTH, ..PathSettings::default() }
}

pub(super) fn measure(bench: &mut Bench) -> Result<Found, Error> {
    let mut scene = Scene::load(SCENE)?;
    scene.fill(MEDIUM.0, Some(MEDIUM.1))?;
    let scene = SceneBuffers::build(&scene)?;
    let (size, seconds) = (bench.size(), bench.figure_seconds());
    let Effort { size: small, samples, reference, methods } = effort(bench.extent);
    let budget = bench.budget();
    let gpu = bench.main();
    let picture = Picture { size: small, integral: settings(Subsurface::Walk).integral() };
    let truth = Truth::new(&reference::make(gpu, &scene, picture, None, reference, &mut |_| Ok(()))?);
    let (mut found, mut time, mut left_out) = (Found::default(), None, Vec::new());
    for &method in methods {
        let subject = format!("{} in `{SCENE}` of {}", method.name(), MEDIUM.0);
        if budget.is_over() {
            left_out.push(subject);
            continue;
        }
        let milliseconds = took(gpu, &scene, &Render::new(size, settings(method)), seconds)?.milliseconds;
        let time = *time.get_or_insert(f64::from(samples) * milliseconds);
        let count = (time / milliseconds).round().clamp(1.0, MOST_SAMPLES) as u32;
        let error =
            truth.rel_mse(error(gpu, &scene, &Render { count, ..Render::new(small, settings(method)) }, &truth)?);
        let figure = |column, value| Row::new(Part::Subsurface, &subject, column, value);
        found.rows.extend([figure("ms a sample", milliseconds), figure("samples in equal time", f64::from(count))]);
        match error.corrected() {
            Some(error) => found.rows.push(figure("relMSE", error)),
            None => found.notes.push(format!("The reference is too noisy to know the error of {subject}.")),
        }
    }
    found.leave_out(&left_out);
    Ok(found)
}

/// The mean relMSE of a few images, as measured.
fn error(gpu: &mut GpuExecutor, scene: &SceneBuffers, render: &Render, truth: &Truth) -> Result<f64, Error> {
    let image = |seed| Ok(truth.errors(&Render { seed, ..render.clone() }.render(scene, gpu)?.image));
    let errors = (0..IMAGES).map(image).collect::<Result<Vec<Errors>, Error>>()?;
    Ok(Errors::mean(errors).rel_mse)
}
