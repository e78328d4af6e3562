//! How fast one thread answers queries: closest hits of random chords of the bounding sphere, of primary rays and of rays
//! scattered where those hit; and occlusion of segments to lights from the first and the second hit.
//!
//! `trace_rays <scene>` prints Mrays/s of the arena's traversal and of the wide BVH at each level of the processor.
//!
//! `trace_rays <scene> <folder>` serves `scripts/compare_embree.py`: it writes the triangles in the order of their ids and
//! the rays to the folder, then traces a set whenever its name arrives on the standard input, writes the answers, and
//! says how many seconds each chunk took.

mod rays;

use rays::{COUNT, Query, Set};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Scene;
use restir_host::wide_bvh::{SimdLevel, WideBvh};
use restir_shared::geometry::Ray;
use restir_shared::layout::{NONE, TRIANGLE_WORDS};
use restir_shared::scene::{SceneView, Trace};
use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

const RUNS: usize = 7;
/// Rays that are timed together: short enough to be left alone by other processes now and then.
const CHUNK: usize = 1 << 13;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (scene, folder) = match arguments.as_slice() {
        [scene] => (scene, None),
        [scene, folder] => (scene, Some(Path::new(folder))),
        _ => return Err("usage: trace_rays <scene> [<folder>]".into()),
    };
    let scene = Scene::load(scene)?;
    let buffers = SceneBuffers::build(&scene)?;
    let sets = rays::sets(&buffers, scene.camera.as_ref())?;
    match folder {
        Some(folder) => serve(&buffers, &sets, folder),
        None => {
            report(&buffers.view(), &sets);
            Ok(())
        }
    }
}

/// The bits of a distance, and an id or [`NONE`]; of what is asked for occlusion only whether the id is `NONE`.
type Answer = [u32; 2];

/// Traces all rays of a set on this thread; gives the answers, and the seconds that each chunk took.
fn trace(tracer: &dyn Trace, set: &Set, answers: &mut Vec<Answer>) -> Vec<f64> {
    answers.clear();
    match set.query {
        Query::Closest => timed(&set.rays, answers, |ray| {
            let hit = tracer.closest(ray);
            [hit.t.to_bits(), hit.id]
        }),
        Query::Occluded => timed(&set.rays, answers, |ray| [0, if tracer.occluded(ray) { 0 } else { NONE }]),
    }
}

fn timed(rays: &[Ray], answers: &mut Vec<Answer>, ask: impl Fn(&Ray) -> Answer) -> Vec<f64> {
    let timed = |chunk: &[Ray]| {
        let start = Instant::now();
        answers.extend(chunk.iter().map(&ask));
        start.elapsed().as_secs_f64()
    };
    rays.chunks(CHUNK).map(timed).collect()
}

/// The shortest time of each chunk over several runs, which alternate between the tracers.
fn report(view: &SceneView<'_>, sets: &[Set]) {
    let wide = |level| (format!("wide, {level:?}"), WideBvh::thorough(view).with_level(level));
    let wide: Vec<_> = SimdLevel::available().into_iter().map(wide).collect();
    let traced = wide.iter().map(|(name, wide)| (name.as_str(), SceneView { tracer: Some(wide), ..*view }));
    let tracers: Vec<(&str, SceneView<'_>)> = std::iter::once(("arena", *view)).chain(traced).collect();
    let mut answers = Vec::with_capacity(COUNT as usize);
    for set in sets {
        let mut shortest = vec![vec![f64::INFINITY; set.rays.len().div_ceil(CHUNK)]; tracers.len()];
        for _ in 0..RUNS {
            for ((_, tracer), shortest) in tracers.iter().zip(&mut shortest) {
                let seconds = trace(tracer, set, &mut answers);
                shortest.iter_mut().zip(seconds).for_each(|(best, seconds)| *best = best.min(seconds));
            }
        }
        for ((name, _), shortest) in tracers.iter().zip(shortest) {
            let speed = set.rays.len() as f64 / shortest.iter().sum::<f64>() * 1e-6;
            println!("{:13} {name:15} {speed:6.2} Mrays/s", set.name);
        }
    }
}

fn serve(buffers: &SceneBuffers, sets: &[Set], folder: &Path) -> Result<(), Box<dyn Error>> {
    let view = buffers.view();
    let tracer = buffers.traced_view();
    let triangles = &view.geometry[view.header.triangle_base as usize..];
    let corner = |word: &glam::UVec4| [word.x, word.y, word.z];
    let corners = triangles[..(view.header.triangle_count * TRIANGLE_WORDS) as usize].iter().flat_map(corner);
    write(&folder.join("triangles.f32"), corners)?;
    for Set { name, rays, .. } in sets {
        let words = |ray: &Ray| ray.origin.to_array().into_iter().chain(ray.direction.to_array()).chain([ray.t_max]);
        write(&folder.join(format!("{name}.f32")), rays.iter().flat_map(words).map(f32::to_bits))?;
    }
    println!("{}", sets.iter().map(|set| format!("{}:{:?}", set.name, set.query)).collect::<Vec<_>>().join(" "));
    let mut answers = Vec::with_capacity(COUNT as usize);
    for line in std::io::stdin().lines() {
        let line = line?;
        let set = sets.iter().find(|set| set.name == line).ok_or(format!("there are no rays {line:?}"))?;
        let seconds = trace(&tracer, set, &mut answers);
        write(&folder.join(format!("{line}.answers")), answers.iter().flatten().copied())?;
        println!("{}", seconds.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
    }
    Ok(())
}

fn write(path: &Path, words: impl Iterator<Item = u32>) -> std::io::Result<()> {
    fs::write(path, words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
}
