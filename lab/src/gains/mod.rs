//! `cargo lab gains`: what ReSTIR PT, suffix ReSTIR and ReSTIR SSS gain over path tracing in equal time and with equal rays, with each option off, what the errors of
//! frames have in common, how noisy surfaces are that come into view, and the reports of it.

mod correlated;
mod moving;
mod parts;
mod report;
mod study;
mod uncovered;

use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use restir_cli::trial::{Estimate, Subject, Trial, Tried, Window, judge, median, try_once};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::CameraPath;
use restir_host::technique::asked::asked_after;
use restir_host::tonemap::{Operator, Tone};

use crate::{Error, flip, report::publish, time::thread_seconds};
use correlated::Correlated;
use parts::Part;
use study::{Pictured, Study};
use uncovered::Uncovered;

/// Frames of a chain.
const FRAMES: u32 = 16;
/// Frames after which a frame costs what all later ones cost.
const SETTLED: u32 = 4;
/// Path tracing with so many samples a pixel; in between, its error is taken to follow a power of their number.
const SAMPLES: [u32; 4] = [1, 4, 16, 64];
/// Chains whose time is taken; the median counts.
const TIMED: u32 = 3;
/// Samples of what pictures are compared with by eye, whose seed no other picture has.
const TRUE_SAMPLES: u32 = 4096;
const TRUE_SEED: u32 = 1 << 31;
/// How pictures are shown.
const SHOWN: Tone = Tone { exposure: 0.0, operator: Operator::Aces };

/// Options of `cargo lab gains`.
#[derive(Args)]
pub struct Options {
    /// Independent images of each setting.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    images: u32,
    /// Width of an image; the height is three quarters of it.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Print what is measured where things move, and nothing else.
    #[arg(long, conflicts_with = "write")]
    moving: bool,
    /// Measure ReSTIR SSS, and not ReSTIR PT.
    #[arg(long, conflicts_with = "moving")]
    subsurface: bool,
    /// Measure suffix ReSTIR, and not ReSTIR PT.
    #[arg(long, conflicts_with_all = ["moving", "subsurface"])]
    suffixes: bool,
    /// Replace docs/restir-pt-gains.md, docs/restir-sss-gains.md or docs/restir-suffix-gains.md.
    #[arg(long)]
    write: bool,
}

/// Measures all views, prints the report and writes it where asked.
///
/// # Errors
/// [`Error::Host`] for what cannot be rendered; [`Error::Io`] if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let start = Instant::now();
    let size = [options.width, options.width * 3 / 4];
    if options.moving {
        println!("{}", report::where_things_move(&moving::measured(options.images, size)?));
        return Ok(());
    }
    let study = match options {
        Options { subsurface: true, .. } => &study::SUBSURFACE,
        Options { suffixes: true, .. } => &study::SUFFIXES,
        _ => &study::PATHS,
    };
    let measured = study.views.par_iter().map(|pictured| {
        let view = View::measured(options, study, pictured);
        eprintln!("{:4.0} s  {}", start.elapsed().as_secs_f64(), pictured.name());
        view
    });
    let views = measured.collect::<Result<Vec<_>, _>>()?;
    let moving = if study.moving { moving::measured(options.images, size)? } else { Vec::new() };
    publish(study.report, &report::markdown(options, study, &views, &moving), options.write)
}

/// What a sample or a frame costs, once there is a history.
#[derive(Clone, Copy, Debug)]
struct Cost {
    seconds: f64,
    /// Of a pixel.
    rays: f64,
}

/// Settings and what they give.
struct Row {
    settings: &'static str,
    /// How many frames the error has been paid with.
    frames: u32,
    rel_mse: Estimate,
    /// How different the picture looks from the true one, the mean over pictures.
    flip: f64,
    cost: Cost,
}

/// A scene as it is seen.
struct View {
    name: String,
    /// relMSE of path tracing with each of [`SAMPLES`].
    path: Vec<Estimate>,
    /// FLIP of these.
    path_flip: Vec<f64>,
    sample: Cost,
    /// Of each of the study's settings.
    rows: Vec<Row>,
    /// Of views that stand still.
    correlated: Vec<Correlated>,
    uncovered: Vec<Uncovered>,
    parts: Vec<Part>,
}

impl View {
    fn measured(options: &Options, study: &Study, pictured: &Pictured) -> Result<Self, restir_host::Error> {
        let size = [options.width, options.width * 3 / 4];
        let scene = pictured.scene()?;
        let buffers = SceneBuffers::build(&scene)?;
        let orbit = || CameraPath::Orbit.cameras(buffers.camera, FRAMES);
        let cameras = if pictured.orbits { orbit()? } else { Vec::new() };
        let subject = Subject::new(&scene, buffers, cameras, FRAMES)?;
        let whole = [Window { whole: size, size, margin: 0, middle: [0.0; 2] }];
        let path = SAMPLES.map(|count| Ok(Render { count, ..study.path_tracing(size)? }));
        let chains =
            study.settings.iter().map(|&(text, accumulate)| Ok(Render { accumulate, ..study.chain(size, text)? }));
        let renders = path.into_iter().chain(chains).collect::<Result<Vec<_>, restir_host::Error>>()?;
        let compared = renders.len();
        let renders = [renders, parts::renders(study, size)?].concat();
        let trials: Vec<Trial<'_>> = renders.iter().map(|render| subject.trial(render, &whole)).collect();
        let mut tried = vec![Tried::default(); trials.len()];
        for seed in 0..options.images {
            try_once(&mut CpuExecutor::inline(), &thread_seconds, &trials, &mut tried, seed, &mut |_| Ok(()))?;
        }
        let flips = flips(&subject, &study.path_tracing(size)?, &whole, &tried[..compared])?;
        let (trials, parts) = (&trials[..compared], parts::measured(study, &tried[compared..]));
        let judged = judge(trials, &tried[..compared]);
        let costs = trials.iter().map(cost).collect::<Result<Vec<_>, _>>()?;
        let (path, chains) = judged.split_at(SAMPLES.len());
        let (path_flip, chain_flips) = flips.split_at(SAMPLES.len());
        let rows = study.settings.iter().zip(chains).zip(&costs[SAMPLES.len()..]).zip(chain_flips).map(
            |(((&(settings, is_mean), judged), cost), &flip)| {
                let frames = if is_mean { FRAMES } else { 1 };
                Row { settings, frames, rel_mse: judged.rel_mse, flip, cost: *cost }
            },
        );
        let truth = mean(&tried[SAMPLES.len() - 1], size);
        let correlates = !study.correlated.is_empty() && !pictured.orbits;
        let correlated =
            if correlates { Correlated::all(trials[0].scene, &truth, study.correlated)? } else { Vec::new() };
        let uncovered = if pictured.orbits { Vec::new() } else { Uncovered::all(trials[0].scene, study.uncovered)? };
        Ok(Self {
            name: pictured.name(),
            path: path.iter().map(|judged| judged.rel_mse).collect(),
            path_flip: path_flip.to_vec(),
            sample: costs[SAMPLES.len() - 1],
            rows: rows.collect(),
            correlated,
            uncovered,
            parts,
        })
    }

    /// relMSE of path tracing with that many samples, which need not be a whole number.
    fn path_tracing(&self, samples: f64) -> Estimate {
        let after = SAMPLES.iter().position(|&count| f64::from(count) >= samples).unwrap_or(SAMPLES.len() - 1).max(1);
        let [a, b] = [after - 1, after].map(|i| (f64::from(SAMPLES[i]).ln(), self.path[i]));
        let t = (samples.ln() - a.0) / (b.0 - a.0);
        let value = ((1.0 - t) * a.1.value.ln() + t * b.1.value.ln()).exp();
        let relative = [a.1, b.1].map(|of| of.error / of.value);
        Estimate { value, error: value * ((1.0 - t) * relative[0]).hypot(t * relative[1]) }
    }

    /// The error of a row over that of path tracing that costs as much, by what is asked of costs.
    fn over_path_tracing(&self, row: &Row, of: fn(&Cost) -> f64) -> Estimate {
        let samples = f64::from(row.frames) * of(&row.cost) / of(&self.sample);
        let path = self.path_tracing(samples);
        let value = row.rel_mse.value / path.value;
        let error = value * (row.rel_mse.error / row.rel_mse.value).hypot(path.error / path.value);
        Estimate { value, error }
    }
}

/// FLIP of each of the tried, the mean over its images, beside a picture by path tracing that has next to no noise.
fn flips(subject: &Subject, path: &Render, whole: &[Window], tried: &[Tried]) -> Result<Vec<f64>, restir_host::Error> {
    let truth = Render { count: TRUE_SAMPLES, seed: TRUE_SEED, ..path.clone() };
    let Trial { scene, pieces } = subject.trial(&truth, whole);
    let (_, render) = &pieces[0];
    let truth = render.render(scene, &mut CpuExecutor::inline())?.image;
    let of = |values: &Vec<f64>| flip::mean(SHOWN, &truth, &image([truth.width, truth.height], values));
    let mean = |tried: &Tried| tried.values().iter().map(of).sum::<f64>() / tried.images() as f64;
    Ok(tried.iter().map(mean).collect())
}

/// What repeats after the first ones cost on one thread, of which each is shown or added to what is.
fn cost(trial: &Trial<'_>) -> Result<Cost, restir_host::Error> {
    let (_, render) = &trial.pieces[0];
    let render = &Render { accumulate: true, ..render.clone() };
    let seconds = seconds(trial.scene, render)?;
    let counted = Render { count: 2 * SETTLED, ..render.clone() };
    let rays: u64 = asked_after(trial.scene, &counted, SETTLED)?.values().map(|asked| asked.counts.rays()).sum();
    let pixels = f64::from(render.width) * f64::from(render.height);
    Ok(Cost { seconds, rays: rays as f64 / (pixels * f64::from(SETTLED)) })
}

/// The processor time of a repeat after the first ones.
fn seconds(scene: &SceneBuffers, render: &Render) -> Result<f64, restir_host::Error> {
    let seconds = |count: u32| {
        let render = Render { count, ..render.clone() };
        let start = thread_seconds();
        CpuExecutor::inline().run(render.plan(scene))?;
        Ok::<_, restir_host::Error>(thread_seconds() - start)
    };
    let later = f64::from(FRAMES - SETTLED);
    let times = (0..TIMED).map(|_| Ok((seconds(FRAMES)? - seconds(SETTLED)?) / later));
    Ok(median(&times.collect::<Result<Vec<_>, restir_host::Error>>()?))
}

/// The mean of a trial's images.
fn mean(tried: &Tried, size: [u32; 2]) -> Image {
    let mut sums = vec![0.0; 3 * (size[0] * size[1]) as usize];
    for values in tried.values() {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / tried.images() as f64);
    }
    image(size, &sums)
}

fn image([width, height]: [u32; 2], values: &[f64]) -> Image {
    let pixels = values.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]].map(|value| value as f32)).collect();
    Image { width, height, pixels }
}
