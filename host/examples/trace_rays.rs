//! How fast one thread finds closest hits: random chords of the bounding sphere and coherent primary rays.
//!
//! `trace_rays <scene>` prints Mrays/s of the arena's traversal and of the wide BVH, medians of seven.
//!
//! `trace_rays <scene> <folder>` serves `scripts/compare_embree.py`: it writes the triangles in the order of their ids and
//! the rays to the folder, then traces a set whenever its name arrives on the standard input, writes the hits, and
//! answers with the seconds that it took.

use glam::{DVec3, Vec2, Vec3};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Camera, Scene};
use restir_host::wide_bvh::{SimdLevel, WideBvh};
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::layout::TRIANGLE_WORDS;
use restir_shared::rng::{Rng, unit};
use restir_shared::scene::{SceneView, Trace};
use std::error::Error;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use std::time::Instant;

const SIDE: u32 = 1024;
const RUNS: usize = 7;

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
        let words = Rng::new(i, 0, 0, 1).draw(0);
        let (origin, end) = (point(words.x, words.y), point(words.z, words.w));
        Ray { origin, direction: end - origin, t_max: Ray::FAR }
    };
    (0..SIDE * SIDE).map(chord).collect()
}

/// Rays through the pixels' centres of a square image that shows the whole scene.
fn primary(bounds: [[f32; 3]; 2]) -> Vec<Ray> {
    let camera = Camera::framing(bounds, 1.0).params(SIDE, SIDE);
    let centre = |i: u32| Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5);
    (0..SIDE * SIDE).map(|i| primary_ray(&camera, centre(i))).collect()
}

/// Traces all rays on this thread; gives the hits and the seconds.
fn trace(tracer: &dyn Trace, rays: &[Ray], hits: &mut Vec<Hit>) -> f64 {
    hits.clear();
    let start = Instant::now();
    hits.extend(rays.iter().map(|ray| tracer.closest(ray)));
    start.elapsed().as_secs_f64()
}

fn trace_best(tracer: &dyn Trace, rays: &[Ray], hits: &mut Vec<Hit>, best: &mut Vec<f64>) {
    hits.clear();
    best.resize(128, f64::INFINITY);
    for (chunk, best) in rays.chunks(1 << 13).zip(best) {
        let start = Instant::now();
        hits.extend(chunk.iter().map(|ray| tracer.closest(ray)));
        *best = best.min(start.elapsed().as_secs_f64());
    }
}

fn report(view: &SceneView<'_>, sets: &[(&str, Vec<Ray>)]) {
    let wide = SimdLevel::available()
        .into_iter()
        .map(|level| (format!("wide {level:?}"), WideBvh::new(view).with_level(level)));
    let wide: Vec<_> = wide.collect();
    let mut tracers: Vec<(&str, &dyn Trace)> = vec![("arena", view)];
    tracers.extend(wide.iter().map(|(name, tracer)| (name.as_str(), tracer as &dyn Trace)));
    let mut hits = Vec::with_capacity((SIDE * SIDE) as usize);
    for (set, rays) in sets {
        let mut seconds = vec![Vec::new(); tracers.len()];
        for _ in 0..RUNS {
            for ((_, tracer), seconds) in tracers.iter().zip(&mut seconds) {
                trace_best(*tracer, rays, &mut hits, seconds);
            }
        }
        for ((name, _), seconds) in tracers.iter().zip(seconds) {
            println!("{set:8} {name:14} {:6.2} Mrays/s", rays.len() as f64 / seconds.iter().sum::<f64>() * 1e-6);
        }
    }
}

fn serve(buffers: &SceneBuffers, sets: &[(&str, Vec<Ray>)], folder: &Path) -> Result<(), Box<dyn Error>> {
    let view = buffers.view();
    let tracer = WideBvh::new(&view);
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
        println!("{seconds}");
    }
    Ok(())
}
