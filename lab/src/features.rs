//! `cargo lab features`: what each feature of a scene costs where it is compiled in, and the report of it; or hashes
//! of the specialised modules, which show that a feature costs nothing where it is not.

use std::time::Instant;

use clap::Args;
use restir_host::Shaders;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::gpu::{Pipelines, adapters};
use restir_host::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_host::technique::path::PathSettings;
use restir_kernels::path::path;
use restir_shared::layout::FEATURES_DIFFUSE;
use restir_tests::features::{Content, PARTS, hash, specialised};

use crate::compiled_out::{self, ALL};
use crate::{Error, report};

/// Measurements of which the median counts; those of all rows are interleaved.
const ROUNDS: usize = 5;
/// A scene that needs emission alone.
const SCENE: &str = "cornell";

/// Options of `cargo lab features`.
#[derive(Args)]
pub struct Options {
    /// Replace docs/features.md.
    #[arg(long)]
    write: bool,
    /// Print the hashes of the optimised modules instead: before and after the code of a feature is added, those of the
    /// modules without that feature are equal.
    #[arg(long, conflicts_with = "write")]
    hash: bool,
    /// With --hash: a feature that no set has.
    #[arg(long, requires = "hash")]
    without: Vec<String>,
    /// Compare the modules without each feature with modules of source in which its code is compiled out, all of them or those named; with --write,
    /// replace docs/compiled-out.md.
    #[arg(long, num_args = 0.., conflicts_with = "hash")]
    compiled_out: Option<Vec<String>>,
}

/// A set of features that the kernel is specialised to.
struct Row {
    name: String,
    features: u32,
    /// Operations of the flavours exact and fast.
    operations: [usize; 2],
    /// Seconds in the rounds: to make the pipeline, of a frame on the adapter, of a frame on the CPU.
    seconds: [Vec<f64>; 3],
}

/// Measures and prints the report.
///
/// # Errors
/// [`Error::Environment`] without spirv-opt; [`Error::Host`] where an adapter does not run the kernel, or if the report
/// cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    if options.hash {
        return hashes(&options.without);
    }
    if let Some(names) = &options.compiled_out {
        return compiled_out::run(names, options.write);
    }
    let mut rows = rows().map_err(Error::Environment)?;
    let adapter = measure(&mut rows)?;
    report::publish("features", &report(&rows, adapter.as_deref()), options.write)
}

/// Everything, everything but one feature, and a diffuse scene with one more; all of them run [`SCENE`] correctly but
/// the one without emission, which is not timed against it.
fn sets() -> Vec<(String, u32)> {
    let mut sets = vec![("all".to_owned(), ALL)];
    sets.extend(PARTS.iter().map(|part| (format!("all but {}", part.name), ALL & !part.feature)));
    sets.push(("diffuse".to_owned(), FEATURES_DIFFUSE));
    let extra = PARTS.iter().filter(|part| part.feature & FEATURES_DIFFUSE == 0);
    sets.extend(extra.map(|part| (format!("diffuse and {}", part.name), FEATURES_DIFFUSE | part.feature)));
    sets
}

fn rows() -> Result<Vec<Row>, String> {
    let operations = |flavour, features| Ok::<_, String>(Content::of(&specialised(flavour, features)?)?.operations);
    let row = |(name, features)| {
        let operations = [operations(Flavour::Exact, features)?, operations(Flavour::Fast, features)?];
        Ok(Row { name, features, operations, seconds: Default::default() })
    };
    sets().into_iter().map(row).collect()
}

fn hashes(without: &[String]) -> Result<(), Error> {
    compiled_out::known(without)?;
    let dropped = PARTS.iter().filter(|part| without.iter().any(|name| name == part.name));
    let dropped = dropped.fold(0, |bits, part| bits | part.feature);
    for (name, features) in sets() {
        let hash = hash(Flavour::Exact, features & !dropped).map_err(Error::Environment)?;
        println!("{hash}  {name}");
    }
    Ok(())
}

/// Fills in the times, and gives the name of the adapter if there is one.
fn measure(rows: &mut [Row]) -> Result<Option<String>, restir_host::Error> {
    let mut scene = SceneBuffers::build(&Scene::load(SCENE)?)?;
    let mut cpu = CpuExecutor::new()?;
    let adapter = adapters().into_iter().next().map(|adapter| adapter.name);
    let mut gpu = adapter.as_deref().map(|name| GpuExecutor::builder().adapter(name).open()).transpose()?;
    for round in 0..=ROUNDS {
        for row in rows.iter_mut() {
            scene.features = row.features;
            let mut seconds = [0.0; 3];
            if let Some(gpu) = &mut gpu {
                let device = gpu.device().clone();
                let pipeline = || Pipelines::new(&device, Flavour::Exact, Shaders::Embedded);
                seconds[0] = timed(|| pipeline().get(&path::DESC, &[row.features]).map(drop))?;
                seconds[1] = timed(|| frame(gpu, &scene))?;
            }
            seconds[2] = timed(|| frame(&mut cpu, &scene))?;
            // the first round warms up: caches, and the executor's pipelines
            if round > 0 {
                row.seconds.iter_mut().zip(seconds).for_each(|(all, one)| all.push(one));
            }
        }
    }
    Ok(gpu.and_then(|gpu| gpu.describe().adapter))
}

fn timed(work: impl FnOnce() -> Result<(), restir_host::Error>) -> Result<f64, restir_host::Error> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_secs_f64())
}

fn frame(executor: &mut dyn Executor, scene: &SceneBuffers) -> Result<(), restir_host::Error> {
    let settings = Render { count: 4, seed: 1, ..Render::new([128; 2], PathSettings::default()) };
    settings.render(scene, executor).map(drop)
}

fn median(seconds: &[f64]) -> f64 {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

fn report(rows: &[Row], adapter: Option<&str>) -> String {
    let adapter = adapter.unwrap_or("no adapter");
    let mut text = format!(
        "# What the features of a scene cost\n\nThe kernel `path`, specialised to sets of features and optimised by \
         spirv-opt; \"diffuse\" has emissive triangles and the light table. Times are medians of {ROUNDS} interleaved \
         rounds on `{SCENE}`, 128 x 128 pixels, 4 samples, depth 8, relative to \"all\": what a feature costs that the \
         scene does not use. Without emission there is less to render: that row compares nothing.\n\n\
         GPU: {adapter}, flavour exact. CPU: {}, {} threads; there a feature is a branch at run time, but for a variant \
         of the code for diffuse scenes. [compiled-out.md](compiled-out.md) shows what is left of the code of a feature where it is absent.\n\n\
         Made by `MESA_SHADER_CACHE_DISABLE=true cargo lab features --write`.\n\n\
         | features | operations, exact | operations, fast | pipeline | GPU frame | CPU frame |\n\
         |---|---:|---:|---:|---:|---:|\n",
        processor(),
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    let Some(all) = rows.first() else { return text };
    text.extend(rows.iter().map(|Row { name, operations: [exact, fast], seconds, .. }| {
        let ratio = |i: usize| format!("{:.3}", median(&seconds[i]) / median(&all.seconds[i]));
        format!("| {name} | {exact} | {fast} | {} |\n", [0, 1, 2].map(ratio).join(" | "))
    }));
    let [pipeline, gpu, cpu] = all.seconds.each_ref().map(|seconds| median(seconds));
    text + &format!("\n\"all\": pipeline {pipeline:.3} s, GPU frame {gpu:.3} s, CPU frame {cpu:.3} s.\n")
}

/// The processor's model, where Linux tells it.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|line| line.starts_with("model name")).and_then(|line| line.split(": ").nth(1));
    model.unwrap_or("unknown").to_owned()
}
