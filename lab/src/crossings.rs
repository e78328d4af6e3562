//! `cargo lab crossings`: probes against brute force, on host and devices, and what they cost.

use std::fmt::Write as _;

use clap::Args;
use glam::{Vec2, Vec3};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::GpuExecutor;
use restir_host::exec::gpu::adapters;
use restir_host::scene::Scene;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::layout::NONE;
use restir_shared::num;
use restir_shared::scene::{Probe, SceneView, Surface, Trace};
use restir_shared::vec::Frame;
use restir_tests::crossings::{Tally, case, compare, scenes};
use restir_tests::parity;
use restir_tests::random::SplitMix;

use crate::Error;
use crate::report::publish;
use crate::time::thread_seconds;

/// Segments of a dispatch on a device.
const DISPATCH: u64 = 1 << 16;
/// Half the length of a timed segment, relative to the scene's largest side.
const REACHES: [f32; 3] = [0.003, 0.03, 0.3];
/// Timed segments of each length.
const TIMED: usize = 1 << 18;

/// Options of `cargo lab crossings`.
#[derive(Args)]
pub struct Options {
    /// Segments in all, split evenly over the scenes.
    #[arg(long, default_value_t = 1_000_000)]
    segments: u64,
    /// Part of the name of the adapters to test, in any case; all if not given.
    #[arg(long, default_value = "")]
    adapter: String,
    /// Built-in scenes or glTF files in which probes are timed.
    #[arg(long, value_delimiter = ',', default_value = "statue,cornell-mixed")]
    timed: Vec<String>,
    /// Write the report to docs/crossings.md.
    #[arg(long)]
    write: bool,
}

const HEAD: &str = "# All hits of an object on a segment\n\nMade by `cargo lab crossings --write`. Segments at and through triangles of scenes that are hard: along edges and axes, through \
    vertices, of objects that touch or are there twice, of more than eight sheets, far from the origin. Every answer, the number of hits and the eight nearest ones with their places, is compared by its bits with brute \
    force: by the arena's tree and by the wide tree at every level of vector instructions that this processor has. *Tied* segments have hits at the same distance; *tight* ones are answered otherwise by boxes without \
    padding, which these traversals would be if they had lost theirs.\n\n| scene | segments | with a hit | with more than eight | tied | tight | differ |\n|---|---:|---:|---:|---:|---:|---:|\n";

/// Compares and times.
///
/// # Errors
/// [`Error::Failed`] if an answer differs, [`Error::Host`] if a scene cannot be loaded or an adapter not be opened.
pub fn run(options: &Options) -> Result<(), Error> {
    let scenes = scenes();
    let each = options.segments.div_ceil(scenes.len() as u64);
    let mut report = HEAD.to_owned();
    let mut all = Tally::default();
    for (stream, (name, buffers)) in (0..).zip(&scenes) {
        let tally = compare(name, buffers, each, 600 + stream);
        report += &row(name, &tally);
        all = all.plus(tally);
    }
    report += &row("all", &all);
    let mut differing = all.differing;
    report += "\n## Devices\n\nThe same by the kernel `crossing_check`, beside the host's arena.\n\n| device | segments | words that differ |\n|---|---:|---:|\n";
    for adapter in adapters() {
        if adapter.name.to_lowercase().contains(&options.adapter.to_lowercase()) {
            differing += on_device(&adapter.name, &scenes, each, &mut report)?;
        }
    }
    report += "\n## Times\n\nMillion segments a second of one thread's time, as disk sampling makes them: beside points of triangles, along an axis of their frame; half the length is relative to the scene's largest side.\n";
    for name in &options.timed {
        report += &time(name)?;
    }
    publish("crossings", &report, options.write)?;
    if differing > 0 { Err(Error::Failed(format!("{differing} answers differ"))) } else { Ok(()) }
}

fn row(name: &str, tally: &Tally) -> String {
    let Tally { segments, hit, overflowing, tied, seen, differing } = tally;
    format!("| {name} | {segments} | {hit} | {overflowing} | {tied} | {seen} | {differing} |\n")
}

/// How many words of a device's answers differ from those of the host.
fn on_device(adapter: &str, scenes: &[(String, SceneBuffers)], each: u64, report: &mut String) -> Result<u64, Error> {
    let mut device = GpuExecutor::builder().adapter(adapter).open()?;
    let (mut segments, mut differing) = (0, 0);
    for (stream, (name, buffers)) in (0..).zip(scenes) {
        for part in 0..each.div_ceil(DISPATCH) {
            let count = DISPATCH.min(each - part * DISPATCH);
            let outcome = parity::compare(&mut device, &case(name, buffers, count, 700 + 100 * part + stream))?;
            if !outcome.is_exact() {
                eprintln!("{name}: {outcome}");
            }
            segments += count;
            differing += (outcome.differing + outcome.poisoned) as u64;
        }
    }
    let _ = writeln!(report, "| {adapter} | {segments} | {differing} |");
    Ok(differing)
}

/// Segments about points of a scene's triangles, as disk sampling makes them: beside the point, along an axis of its frame. With
/// their objects.
fn segments(view: &SceneView<'_>, reach: f32) -> Vec<(Ray, u32)> {
    let mut random = SplitMix::new(9);
    let extent = (Vec3::from_array(view.header.bounds_hi) - Vec3::from_array(view.header.bounds_lo)).max_element();
    let mut segment = || {
        let mut unit = || random.unit() as f32;
        let [a, b, r, angle, axis] = [unit(), unit(), unit() * reach * extent, unit(), unit()];
        let uv = if a + b > 1.0 { Vec2::new(1.0 - a, 1.0 - b) } else { Vec2::new(a, b) };
        let hit = Hit { t: 0.0, id: (unit() * view.header.triangle_count as f32) as u32, uv };
        let seen = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR, key: 0 };
        let point = view.surface(&seen, &hit);
        let Frame { s, t, n } = Frame::new(point.normal);
        let [x, y, z] = if axis < 0.5 {
            [s, t, n]
        } else if axis < 0.75 {
            [t, n, s]
        } else {
            [n, s, t]
        };
        let (sin, cos) = num::sin_cos(angle);
        let half = num::sqrt((reach * extent - r) * (reach * extent + r));
        let origin = point.position + x * (r * cos) + y * (r * sin) + z * half;
        (Ray { origin, direction: -z, t_max: 2.0 * half, key: 0 }, view.object(&hit))
    };
    (0..TIMED).map(|_| segment()).collect()
}

/// Millions a second, of a single thread.
fn rate(segments: &[(Ray, u32)], answer: impl Fn(&Ray, u32) -> u32) -> f64 {
    let start = thread_seconds();
    let sum = segments.iter().fold(0_u32, |sum, (ray, object)| sum.wrapping_add(answer(ray, *object)));
    let seconds = thread_seconds() - start;
    std::hint::black_box(sum);
    segments.len() as f64 / seconds * 1.0e-6
}

fn time(name: &str) -> Result<String, Error> {
    let buffers = SceneBuffers::build(&Scene::load(name)?)?;
    let mut text = format!(
        "\n{name}, {} triangles:\n\n| half length | hits | arena, closest | arena, probe | wide, closest | wide, probe |\n|---:|---:|---:|---:|---:|---:|\n",
        buffers.stats().triangles
    );
    for reach in REACHES {
        let segments = segments(&buffers.view(), reach);
        let hits: u64 =
            segments.iter().map(|(ray, object)| u64::from(buffers.traced_view().probe(ray, *object).count)).sum();
        let rates = [buffers.view(), buffers.traced_view()].map(|view| {
            let closest = rate(&segments, |ray, _| if view.closest(ray).id == NONE { 0 } else { 1 });
            [closest, rate(&segments, |ray, object| view.probe(ray, object).count)]
        });
        let [[a, b], [c, d]] = rates;
        let hits = hits as f64 / segments.len() as f64;
        let _ = writeln!(text, "| {reach} | {hits:.2} | {a:.2} | {b:.2} | {c:.2} | {d:.2} |");
    }
    Ok(text)
}
