//! `cargo lab simd`: what each level of instructions gains, and whether all give the same bits.

use std::fmt::Write;

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::scene::{Scene, builtin};
use restir_host::technique;
use restir_host::wide_bvh::SimdLevel;

use crate::Error;
use crate::origin::{commit, machine};
use crate::report::{judge, publish};
use crate::time::thread_seconds;

/// Options of `cargo lab simd`.
#[derive(Args)]
pub struct Options {
    /// Scenes, as `restir render` takes them; without any the built-in ones and a mesh under a sky.
    scenes: Vec<String>,
    /// How often each render is measured.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Write docs/simd.md.
    #[arg(long)]
    write: bool,
}

const MESH: &str = "assets/dragon.gltf";
const SIZE: [u32; 2] = [128, 96];
/// Techniques with kernels that have a form by SIMD, and their numbers of samples or frames.
const RENDERS: [(&str, u32); 2] = [("path", 16), ("restir-di", 4)];

/// The step of the thread's clock, in seconds.
const CLOCK: f64 = 0.004;

/// A way to run kernels.
struct Way {
    name: String,
    level: SimdLevel,
    has_lanes: bool,
}

/// Measures by the time of one thread, all ways in turns, and prints the table.
///
/// # Errors
/// [`Error::Host`] for scenes that cannot be rendered, [`Error::Failed`] if the bits of levels differ.
pub fn run(options: &Options) -> Result<(), Error> {
    let built_in = builtin::NAMES.iter().map(|(name, _)| (*name).to_owned()).chain([MESH.to_owned()]);
    let scenes: Vec<String> = if options.scenes.is_empty() { built_in.collect() } else { options.scenes.clone() };
    let ways = ways();
    let (mut rows, mut different, mut slower) = (String::new(), Vec::new(), Vec::new());
    for name in &scenes {
        let scene = SceneBuffers::build(&Scene::load(name)?)?;
        for (technique, count) in RENDERS {
            let render = Render { count, ..Render::new(SIZE, technique::named(technique)?) };
            let what = format!("{name}, {technique}");
            let measured = measured(&scene, &render, &ways, options.runs)?;
            if !measured.same_bits {
                different.push(what.clone());
            }
            slower.extend(measured.slower(&ways).map(|way| format!("`{name}` by `{technique}` {way}")));
            rows += &measured.row(name, technique);
        }
    }
    judge("levels give other bits", different)?;
    publish("simd", &report(&ways, &rows, &slower, options.runs), options.write)
}

/// Without lanes and with them, at each level that the processor has.
fn ways() -> Vec<Way> {
    let of_level = |level: SimdLevel| {
        let way = |has_lanes, name| Way { name, level, has_lanes };
        let lanes = (level != SimdLevel::Portable).then(|| way(true, format!("{level:?}")));
        [Some(way(false, format!("{level:?}, pixel by pixel"))), lanes]
    };
    SimdLevel::available().into_iter().flat_map(of_level).flatten().collect()
}

/// Seconds of each way, sorted.
struct Measured {
    seconds: Vec<Vec<f64>>,
    same_bits: bool,
}

fn measured(scene: &SceneBuffers, render: &Render, ways: &[Way], runs: u32) -> Result<Measured, Error> {
    let mut films = Vec::new();
    let mut seconds = vec![Vec::new(); ways.len()];
    // the first run builds the tree, and is not measured
    for run in 0..=runs {
        for (way, seconds) in ways.iter().zip(&mut seconds) {
            let cpu = CpuExecutor::inline().with_level(way.level);
            let mut cpu = if way.has_lanes { cpu } else { cpu.without_lanes() };
            let begun = thread_seconds();
            let film = cpu.run(render.plan(scene))?;
            if run == 0 {
                films.push(film);
            } else {
                seconds.push(thread_seconds() - begun);
            }
        }
    }
    seconds.iter_mut().for_each(|seconds| seconds.sort_by(f64::total_cmp));
    Ok(Measured { seconds, same_bits: films.windows(2).all(|films| films[0] == films[1]) })
}

impl Measured {
    fn median(&self, way: usize) -> f64 {
        self.seconds[way][self.seconds[way].len() / 2]
    }

    /// Ways with lanes that take longer than without, at the same level, by the medians and by more than the clock's step.
    fn slower<'a>(&'a self, ways: &'a [Way]) -> impl Iterator<Item = String> + 'a {
        let lanes = ways.iter().enumerate().filter(|(_, way)| way.has_lanes);
        lanes.filter_map(|(at, way)| {
            let (with, without) = (self.median(at), self.median(at - 1));
            (with > without + CLOCK).then(|| format!("at {} ({:.2})", way.name, with / without))
        })
    }

    fn row(&self, scene: &str, technique: &str) -> String {
        let first = self.median(0);
        let mut row = format!("| `{scene}` | `{technique}` | {first:.3} |");
        for way in 1..self.seconds.len() {
            let _ = write!(row, " {:.2} |", self.median(way) / first);
        }
        row + "\n"
    }
}

fn report(ways: &[Way], rows: &str, slower: &[String], runs: u32) -> String {
    let mut head = vec![format!("seconds, {}", ways.first().map_or("", |way| way.name.as_str()))];
    head.extend(ways.iter().skip(1).map(|way| way.name.clone()));
    let slower = if slower.is_empty() {
        "In no row lanes take longer than pixel by pixel at the same level.".to_owned()
    } else {
        format!("Lanes take longer than pixel by pixel at the same level in {}.", slower.join(", "))
    };
    let ([width, height], [(_, samples), (_, frames)]) = (SIZE, RENDERS);
    format!(
        "# What SIMD gains\n\nTimes of rendering by the instructions of a level, over those with the instructions that every processor of its kind has: smaller is better. \
         All levels give the same bits, which the command compares. \"Pixel by pixel\" uses a level's instructions to trace rays alone; without these words path tracing runs \
         sixteen paths in SIMD lanes, and ReSTIR DI sixteen pixels or candidates. Light inside of bodies has kernels without lanes: by `path` they gain nothing on `candles`, `cube` and `slab`.\n\n\
         Made by `cargo lab simd --write` (3 min) of {commit} on {machine}: {width} x {height} pixels, {samples} samples or {frames} frames, time of one thread \
         in steps of {step} s, medians of {runs} runs in turns.\n\n{slower}\n\n\
         | scene | technique | {head} |\n|---|---|{columns}\n{rows}",
        commit = commit(),
        machine = machine(),
        step = CLOCK,
        columns = "---:|".repeat(head.len()),
        head = head.join(" | "),
    )
}
