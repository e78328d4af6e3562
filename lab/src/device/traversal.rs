//! Rays alone: what a technique would make if it did nothing but trace.

use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Camera, Material, Mesh, Scene};
use restir_tests::meshes::sphere;
use restir_tests::parity::plan;
use restir_tests::traversal::{Kind, case, frozen, rays};

use super::bench::Bench;
use super::pace::pass_seconds;
use super::rows::Row;
use super::{Found, Part};
use crate::Error;

/// The interior: a hall with 72 thousand triangles.
const INTERIOR: &str = "hall-1";
/// Quads around the ball and along it: 262 144 triangles, but for those without area at its poles.
const BALL: [u32; 2] = [512, 256];

pub(super) fn measure(bench: &mut Bench) -> Result<Found, Error> {
    let scenes = [(INTERIOR, Scene::load(INTERIOR)?), ("the ball", ball())];
    let (mut found, budget, mut left_out) = (Found::default(), bench.budget(), Vec::new());
    for (name, scene) in scenes {
        let scene = SceneBuffers::build(&scene)?;
        let triangles = scene.stats().triangles;
        for kind in Kind::ALL {
            let subject = format!("{}: {name}, {triangles} triangles", kind.name());
            if budget.is_over() {
                left_out.push(subject);
            } else {
                found.rows.extend(of_kind(bench, &subject, &scene, kind)?);
            }
        }
    }
    found.leave_out(&left_out);
    Ok(found)
}

/// Rays a second of one kind in one scene. Pixels without a ray take next to no time, and do not count.
fn of_kind(bench: &mut Bench, subject: &str, scene: &SceneBuffers, kind: Kind) -> Result<Vec<Row>, Error> {
    let (size, seconds) = (bench.size(), bench.figure_seconds());
    let rays = rays(scene, size, kind);
    let traced = rays.iter().filter(|ray| ray.t_max > 0.0).count() as f64;
    let case = frozen(case(subject, scene, size, kind, &rays), scene);
    if let Some(gpu) = bench.exact() {
        super::parity::same_hits(gpu, &case)?;
    }
    let mut rows = vec![Row::new(Part::Traversal, subject, "million rays", traced * 1.0e-6)];
    for (flavour, gpu) in bench.executors() {
        let rate = traced / pass_seconds(gpu, plan(&case), seconds)? * 1.0e-6;
        rows.push(Row::new(Part::Traversal, subject, format!("{flavour}, Mrays/s"), rate));
    }
    Ok(rows)
}

/// A ball full of bumps on a floor, under a lamp.
fn ball() -> Scene {
    let mut scene = Scene { name: "ball".to_owned(), ..Scene::default() };
    scene.camera = Some(Camera::pinhole(DVec3::new(0.0, 1.6, 3.2), DVec3::new(0.0, 0.0, 0.0), DVec3::Y, 0.8));
    let grey = scene.add_material(Material::diffuse("grey", [0.6; 3]));
    let mut bumpy = sphere(1.0, BALL[0], BALL[1]);
    bumpy.positions.iter_mut().for_each(|at| *at = bumped(*at));
    scene.add_mesh("ball", grey, bumpy);
    let edges = [DVec3::Z * 12.0, DVec3::X * 12.0];
    scene.add_mesh("floor", grey, Mesh::quad(DVec3::new(-6.0, -1.2, -6.0), edges));
    scene.add_quad_light(DVec3::new(-1.0, 4.0, -1.0), [DVec3::X * 2.0, DVec3::Z * 2.0], [10.0; 3], true);
    scene
}

/// A point of the unit sphere, moved out or in by up to a twentieth.
fn bumped(at: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = at.map(f64::from);
    let scale = 1.0 + 0.05 * (17.0 * x).sin() * (13.0 * y).sin() * (19.0 * z).cos();
    [x, y, z].map(|component| (scale * component) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As large as is asked for, with rays of all kinds.
    #[test]
    #[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
    fn the_ball_is_large_and_lit() {
        let scene = SceneBuffers::build(&ball()).unwrap();
        assert!((200_000..300_000).contains(&scene.stats().triangles), "{}", scene.stats().triangles);
        for kind in Kind::ALL {
            let rays = rays(&scene, [24, 16], kind);
            let traced = rays.iter().filter(|ray| ray.t_max > 0.0).count();
            assert!(traced * 2 > rays.len(), "{kind:?}: {traced} of {}", rays.len());
        }
    }
}
