//! A cube of wax between a small light close to its back and a large one above (Zhang and d'Eon 2025): what is thin glows, and edges are
//! bright. A cube that is less deep keeps its back, beside the small light.

use glam::DVec3;

use super::arguments::Arguments;
use super::parts::{ground, sky, stage, waxy};
use crate::Error;
use crate::scene::subsurface::medium;
use crate::scene::{Material, Mesh, Scene};

pub(super) fn scene() -> Scene {
    built("cube", 1.0)
}

/// The cube that `name` asks for by the arguments in `text`.
pub(super) fn varied(name: &str, text: &str) -> Result<Scene, Error> {
    let given = Arguments::parse(name, text, &["depth"])?;
    Ok(built(name, given.number("depth", 1.0, 1.0e-3..=1.0)?))
}

/// One unit wide and high.
fn built(name: &str, depth: f64) -> Scene {
    let mut scene = stage(name, [DVec3::new(1.9, 1.9, 3.6), DVec3::new(0.0, 0.5, 0.0)], 28.0, [512, 512]);
    scene.environment = Some(sky("dim", [16, 8], |_| [0.03, 0.035, 0.04]));
    let wax = scene.add_material(waxy("wax", medium("wax", 0.02).expect("a medium that there is")));
    let floor = scene.add_material(Material::diffuse("floor", [0.3; 3]));
    scene.add_mesh("floor", floor, ground(10.0));
    scene.add_mesh("cube", wax, Mesh::cuboid(DVec3::new(-0.5, 0.001, -0.5), DVec3::new(0.5, 1.001, depth - 0.5)));
    let near = [DVec3::X * 0.24, DVec3::Y * 0.24];
    scene.add_quad_light(DVec3::new(-0.12, 0.4, -0.62), near, [60.0, 52.0, 40.0], false);
    let above = [DVec3::X * 1.6, DVec3::Z * 1.6];
    scene.add_quad_light(DVec3::new(-0.8, 2.6, -0.8), above, [2.2, 2.4, 2.8], false);
    scene
}
