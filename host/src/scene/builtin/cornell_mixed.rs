//! The Cornell box with a mirror, glass, and glossy blocks whose roughness is on either side of 0.2, a usual threshold
//! between what is connected to and what is not.

use std::sync::Arc;

use glam::DVec3;

use super::cornell;
use super::parts::{glass, metal, plastic};
use crate::scene::{Mesh, Scene};

pub(super) fn scene() -> Scene {
    let mut scene = Scene { name: "cornell-mixed".to_owned(), ..cornell::scene() };
    let copper = scene.add_material(metal("copper", [0.95, 0.73, 0.6], 0.15));
    let white = scene.add_material(plastic("plastic", [0.62, 0.62, 0.65], 0.3));
    let mirror = scene.add_material(metal("mirror", [0.95; 3], 0.0));
    let clear = scene.add_material(glass("glass", 0.0));
    for mesh in &mut scene.meshes {
        match mesh.name.as_str() {
            "tall block" => Arc::make_mut(mesh).material = copper,
            "short block" => Arc::make_mut(mesh).material = white,
            _ => {}
        }
    }
    // in front of the right wall, facing into the box
    let panel = Mesh::quad(DVec3::new(0.985, -0.55, -0.75), [DVec3::Z * 1.1, DVec3::Y * 1.1]);
    scene.add_mesh("mirror", mirror, panel);
    scene.add_mesh("glass sphere", clear, Mesh::sphere(DVec3::new(0.35, -0.11, 0.4), 0.27, 5));
    scene
}
