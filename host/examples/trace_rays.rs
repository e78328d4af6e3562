//! How fast one thread finds closest hits: random chords of the bounding sphere and coherent primary rays.
//!
//! `trace_rays <scene>` prints Mrays/s of the arena's traversal and of the wide BVH at each level of the processor.
//!
//! `trace_rays <scene> <folder>` serves `scripts/compare_embree.py`: it writes the triangles in the order of their ids and
//! the rays to the folder, then traces a set whenever its name arrives on the standard input, writes the hits, and
//! answers with the seconds that each chunk took.

use glam::{DVec3, Vec2, Vec3};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Camera, Scene};
use restir_host::wide_bvh::{SimdLevel, WideBvh};
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::layout::TRIANGLE_WORDS;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::scene::{SceneView, Trace};
use std::error::Error;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use std::time::Instant;

const SIDE: u32 = 1024;
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
    let buffers = SceneBuffers::build(&Scene::load(scene)?)?;
    let bounds = buffers.stats().bounds;
    let sets = [("chords", chords(bounds)), ("primary", primary(bounds))];
    match folder {
        Some(folder) => serve(&buffers, &sets, folder),
        None => {
            report(&buffers.view(), &sets);
            Ok(())
        }
    }
}

/// Segments between uniform points of the sphere around the bounds, going on beyond them.
fn chords(bounds: [[f32; 3]; 2]) -> Vec<Ray> {
    let [lo, hi] = bounds.map(|corner| Vec3::from_array(corner).as_dvec3());
    let (centre, radius) = ((lo + hi) * 0.5, (hi - lo).length() * 0.5);
    let point = |u: u32, v: u32| {
        let (z, turn) = (2.0 * f64::from(unit(u)) - 1.0, f64::from(unit(v)));
        let ring = (1.0 - z * z).sqrt();
        (centre + radius * DVec3::new(ring * (TAU * turn).cos(), ring * (TAU * turn).sin(), z)).as_vec3()
    };
    let chord = |i| {
        let words = Rng::new(i, 0, 0, 1, Sampler::Independent).draw(0);
        let (origin, end) = (point(words.x, words.y), point(words.z, words.w));
        Ray { origin, direction: end - origin, t_max: Ray::FAR, key: 0 }
    };
    (0..SIDE * SIDE).map(chord).collect()
}

/// Rays through the pixels' centres of a square image that shows the whole scene.
fn primary(bounds: [[f32; 3]; 2]) -> Vec<Ray> {
    let camera = Camera::framing(bounds, 1.0).params(SIDE, SIDE);
    let centre = |i: u32| Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
    (0..SIDE * SIDE).map(|i| primary_ray(&camera, centre(i), Vec2::ZERO)).collect()
}

/// Traces all rays on this thread; gives the hits, and the seconds that each chunk took.
fn trace(tracer: &dyn Trace, rays: &[Ray], hits: &mut Vec<Hit>) -> Vec<f64> {
    hits.clear();
    let timed = |chunk: &[Ray]| {
        let start = Instant::now();
        hits.extend(chunk.iter().map(|ray| tracer.closest(ray)));
        start.elapsed().as_secs_f64()
    };
    rays.chunks(CHUNK).map(timed).collect()
}

/// The shortest time of each chunk over several runs, which alternate between the tracers.
fn report(view: &SceneView<'_>, sets: &[(&str, Vec<Ray>)]) {
    let wide = |level| (format!("wide, {level:?}"), WideBvh::new(view).with_level(level));
    let wide: Vec<_> = SimdLevel::available().into_iter().map(wide).collect();
    let traced = wide.iter().map(|(name, wide)| (name.as_str(), SceneView { tracer: Some(wide), ..*view }));
    let tracers: Vec<(&str, SceneView<'_>)> = std::iter::once(("arena", *view)).chain(traced).collect();
    let mut hits = Vec::with_capacity((SIDE * SIDE) as usize);
    for (set, rays) in sets {
        let mut shortest = vec![vec![f64::INFINITY; rays.len().div_ceil(CHUNK)]; tracers.len()];
        for _ in 0..RUNS {
            for ((_, tracer), shortest) in tracers.iter().zip(&mut shortest) {
                let seconds = trace(tracer, rays, &mut hits);
                shortest.iter_mut().zip(seconds).for_each(|(best, seconds)| *best = best.min(seconds));
            }
        }
        for ((name, _), shortest) in tracers.iter().zip(shortest) {
            println!("{set:8} {name:15} {:6.2} Mrays/s", rays.len() as f64 / shortest.iter().sum::<f64>() * 1e-6);
        }
    }
}

fn serve(buffers: &SceneBuffers, sets: &[(&str, Vec<Ray>)], folder: &Path) -> Result<(), Box<dyn Error>> {
    let view = buffers.view();
    let tracer = buffers.traced_view();
    let floats = |v: Vec3| v.to_array().map(f32::to_le_bytes);
    let triangles = &view.geometry[view.header.triangle_base as usize..];
    let corner = |word: &glam::UVec4| [word.x, word.y, word.z].map(u32::to_le_bytes);
    let corners = triangles[..(view.header.triangle_count * TRIANGLE_WORDS) as usize].iter().flat_map(corner);
    fs::write(folder.join("triangles.f32"), corners.flatten().collect::<Vec<u8>>())?;
    for (name, rays) in sets {
        let bytes = rays.iter().flat_map(|ray| [floats(ray.origin), floats(ray.direction)]).flatten().flatten();
        fs::write(folder.join(format!("{name}.f32")), bytes.collect::<Vec<u8>>())?;
    }
    println!("ready");
    let mut hits = Vec::with_capacity((SIDE * SIDE) as usize);
    for line in std::io::stdin().lines() {
        let line = line?;
        let (name, rays) = sets.iter().find(|(name, _)| *name == line).ok_or(format!("there are no rays {line:?}"))?;
        let seconds = trace(&tracer, rays, &mut hits);
        let words = hits.iter().flat_map(|hit| [hit.t.to_bits(), hit.id]).flat_map(u32::to_le_bytes);
        fs::write(folder.join(format!("{name}.hits")), words.collect::<Vec<u8>>())?;
        println!("{}", seconds.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
    }
    Ok(())
}
