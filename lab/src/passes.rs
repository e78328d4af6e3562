//! `cargo lab passes`: what each kernel of a frame takes and asks.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_host::technique::{self, asked::asked_after};

use crate::Error;

/// Options of `cargo lab passes`.
#[derive(Args)]
pub struct Options {
    /// A scene that stands still, as `restir render` takes it.
    scene: String,
    /// A technique of frames.
    #[arg(long)]
    technique: String,
    /// A setting of the technique, as KEY=VALUE, or preset=NAME.
    #[arg(long = "set")]
    settings: Vec<String>,
    /// Width of the image in pixels; its height is two thirds of it.
    #[arg(long, default_value_t = 432)]
    width: u32,
    /// Frames that are measured, after as many that give them a history.
    #[arg(long, default_value_t = 8)]
    frames: u32,
}

/// Measures on all threads, counts, and prints a table of milliseconds a frame, and of rays and light samples a pixel and frame.
///
/// # Errors
/// [`Error::Host`] for a scene or settings that cannot be rendered.
pub fn run(options: &Options) -> Result<(), Error> {
    let scene = SceneBuffers::build(&Scene::load(&options.scene)?)?;
    let mut technique = technique::named(&options.technique)?;
    technique::configure(&mut *technique, &options.settings)?;
    let size = [options.width, options.width * 2 / 3];
    let render = Render { count: 2 * options.frames, accumulate: true, ..Render::new(size, technique) };
    let times = times(&scene, &render, options.frames)?;
    let asked = asked_after(&scene, &render, options.frames)?;
    let share = 1.0 / (f64::from(size[0]) * f64::from(size[1]) * f64::from(options.frames));
    println!("{} at {} x {}, {} threads", options.scene, size[0], size[1], rayon::current_num_threads());
    println!(
        "| kernel | ms a frame | rays for the nearest hit | shadow rays | surfaces | light samples |\n|---|---:|---:|---:|---:|---:|"
    );
    for (kernel, asked) in asked {
        let ms = times.get(kernel).copied().unwrap_or_default().as_secs_f64() * 1e3 / f64::from(options.frames);
        let counts = asked.counts;
        let [closest, shadow, surfaces, lights] =
            [counts.closest, counts.shadow, counts.surfaces, counts.light_samples].map(|count| count as f64 * share);
        println!("| `{kernel}` | {ms:.1} | {closest:.2} | {shadow:.2} | {surfaces:.2} | {lights:.2} |");
    }
    Ok(())
}

/// How long the passes of each kernel take in the frames after the first `settled`.
fn times(scene: &SceneBuffers, render: &Render, settled: u32) -> Result<BTreeMap<&'static str, Duration>, Error> {
    let mut executor = CpuExecutor::new()?;
    let mut measure = |count: u32| {
        let mut times: BTreeMap<&'static str, Duration> = BTreeMap::new();
        let render = Render { count, ..render.clone() };
        let mut begun = Instant::now();
        executor.run_observed(render.plan(scene), &mut |step| {
            *times.entry(step.pass.kernel.name).or_default() += begun.elapsed();
            begun = Instant::now();
            Ok(())
        })?;
        Ok::<_, Error>(times)
    };
    let before = measure(settled)?;
    let mut all = measure(render.count)?;
    for (kernel, time) in &mut all {
        *time = time.saturating_sub(before.get(kernel).copied().unwrap_or_default());
    }
    Ok(all)
}
