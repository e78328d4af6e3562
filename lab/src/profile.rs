//! `cargo lab profile`: where the time of a path traced render goes.
//!
//! What a render asks of its scene is written down first. Then renders and loops over these questions alternate, all on one
//! thread: what the questions take is what visibility takes, without a clock between them; the rest is shading.

use std::hint::black_box;
use std::time::Instant;

use clap::Args;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::replay::{Event, Recording};
use restir_host::scene::Scene;
use restir_host::technique::path::PathSettings;
use restir_kernels::path::path;
use restir_shared::geometry::Ray;
use restir_shared::scene::{SceneView, Still, Trace};

use crate::Error;

/// Pixels along a side, and samples a pixel.
const SIDE: u32 = 128;
const SAMPLES: u32 = 2;

/// Options of `cargo lab profile`.
#[derive(Args)]
pub struct Options {
    /// Scenes as `restir render` takes them.
    #[arg(default_values = ["cornell-mitsuba", "ajar", "many-lights", "glossy", "foliage"])]
    scenes: Vec<String>,
    /// Measurements of which the shortest counts.
    #[arg(long, default_value_t = 15)]
    rounds: u32,
}

/// What takes time, but for the rest.
const PARTS: [&str; 3] = ["closest hits", "shadow rays", "film"];

/// What a render asks of its scene.
#[derive(Default)]
struct Questions {
    closest: Vec<Ray>,
    occluded: Vec<Ray>,
}

/// Seconds of a render and of [`PARTS`].
struct Times {
    render: f64,
    parts: [f64; PARTS.len()],
}

/// Measures and prints the table.
///
/// # Errors
/// [`Error::Host`] if a scene cannot be loaded.
pub fn run(options: &Options) -> Result<(), Error> {
    println!(
        "| scene | ms | {} | shading | closest, Mrays/s | shadow, Mrays/s |",
        PARTS.map(|part| part.to_owned() + ", %").join(" | ")
    );
    println!("|---|---|{}---|---|---|", "---|".repeat(PARTS.len()));
    for name in &options.scenes {
        let buffers = SceneBuffers::build(&Scene::load(name)?)?;
        let settings = Render { count: SAMPLES, seed: 1, ..Render::new([SIDE; 2], PathSettings::default()) };
        let view =
            SceneView { features: settings.technique.integral().features(buffers.features), ..buffers.traced_view() };
        let questions = Questions::of(&buffers, &view, &settings)?;
        let times = shortest(options.rounds, || once(&buffers, &view, &settings, &questions))?;
        println!("{}", row(name, &questions, &times));
    }
    Ok(())
}

impl Questions {
    fn of(buffers: &SceneBuffers, view: &SceneView<'_>, settings: &Render) -> Result<Self, restir_host::Error> {
        let recording = Recording::new(view);
        CpuExecutor::run_over(&Still(&recording), settings.plan(buffers))?;
        let mut questions = Self::default();
        for event in recording.into_events() {
            match event {
                Event::Closest { ray, .. } => questions.closest.push(ray),
                Event::Occluded { ray, .. } => questions.occluded.push(ray),
                _ => {}
            }
        }
        Ok(questions)
    }

    /// Seconds to answer the questions of each kind.
    fn ask(&self, view: &SceneView<'_>) -> [f64; 2] {
        [timed(&self.closest, |ray| view.closest(ray)), timed(&self.occluded, |ray| view.occluded(ray))]
    }
}

fn timed<Q, A>(questions: &[Q], answer: impl Fn(&Q) -> A) -> f64 {
    let start = Instant::now();
    questions.iter().for_each(|question| drop(black_box(answer(question))));
    start.elapsed().as_secs_f64()
}

/// Seconds of the passes that trace paths, and of the others, which are the film's.
fn passes(buffers: &SceneBuffers, settings: &Render) -> Result<[f64; 2], restir_host::Error> {
    let (mut paths, mut film) = (0.0, 0.0);
    let plan = settings.plan(buffers);
    let mut start = Instant::now();
    CpuExecutor::inline().run_observed(plan, &mut |step| {
        let seconds = if step.pass.kernel.name == path::DESC.name { &mut paths } else { &mut film };
        *seconds += start.elapsed().as_secs_f64();
        start = Instant::now();
        Ok(())
    })?;
    Ok([paths, film])
}

fn once(
    buffers: &SceneBuffers,
    view: &SceneView<'_>,
    settings: &Render,
    questions: &Questions,
) -> Result<Times, restir_host::Error> {
    let [paths, film] = passes(buffers, settings)?;
    let [closest, shadow] = questions.ask(view);
    Ok(Times { render: paths + film, parts: [closest, shadow, film] })
}

/// The shortest times of several rounds: the others were disturbed by other processes.
fn shortest(rounds: u32, mut once: impl FnMut() -> Result<Times, restir_host::Error>) -> Result<Times, Error> {
    let mut best = once()?;
    for _ in 1..rounds {
        let next = once()?;
        best.render = best.render.min(next.render);
        best.parts.iter_mut().zip(next.parts).for_each(|(best, next)| *best = best.min(next));
    }
    Ok(best)
}

fn row(name: &str, questions: &Questions, times: &Times) -> String {
    let share = |seconds: f64| format!("{:.0}", 100.0 * seconds / times.render);
    let rest = times.render - times.parts.iter().sum::<f64>();
    let speed = |rays: &[Ray], seconds: f64| rays.len() as f64 / seconds * 1e-6;
    format!(
        "| `{name}` | {:.1} | {} | {} | {:.1} | {:.1} |",
        1e3 * times.render,
        times.parts.map(share).join(" | "),
        share(rest),
        speed(&questions.closest, times.parts[0]),
        speed(&questions.occluded, times.parts[1]),
    )
}
