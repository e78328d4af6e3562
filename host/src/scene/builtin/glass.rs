//! A mirror, and glass that is smooth, rough, and coloured by absorption: what only paths through perfectly specular
//! vertices reach.

use glam::{DAffine3, DVec3};

use super::parts::{checkered_floor, glass, ground, metal, plastic, sky, stage, tinted_glass};
use crate::scene::{Mesh, Scene};

pub(super) fn scene() -> Scene {
    let mut scene = stage("glass", [DVec3::new(0.35, 1.75, 5.0), DVec3::new(0.05, 0.72, 0.0)], 35.0, [640, 480]);
    scene.environment = Some(sky("dusk", [64, 32], |direction| {
        // from a warm horizon to a blue zenith, dark below
        let up = direction.y.max(0.0) as f32;
        let down = if direction.y < 0.0 { 0.25 } else { 1.0 };
        [0.42 - 0.3 * up, 0.36 - 0.18 * up, 0.34 + 0.1 * up].map(|channel| down * channel)
    }));
    let squares = checkered_floor(&mut scene, [205, 120], [32.0, 32.0]);
    scene.add_mesh("floor", squares, ground(16.0));
    add_mirror(&mut scene);
    add_glasses(&mut scene);
    let lamp = [DVec3::new(1.4, -0.5, 0.0), DVec3::new(0.0, 0.0, 1.6)].map(|edge| 1.2 * edge);
    scene.add_quad_light(DVec3::new(-3.0, 3.6, 0.4), lamp, [9.0, 8.2, 7.0], false);
    scene
}

/// A standing mirror in a wooden frame, turned to the camera.
fn add_mirror(scene: &mut Scene) {
    let mirror = scene.add_material(metal("mirror", [0.95; 3], 0.0));
    let wood = scene.add_material(plastic("frame", [0.3, 0.15, 0.07], 0.35));
    let at = DAffine3::from_translation(DVec3::new(-0.2, 0.0, -1.5)) * DAffine3::from_rotation_y(0.2);
    let (width, height, bar) = (3.4, 1.9, 0.09);
    let half = 0.5 * width;
    let panel = Mesh::quad(DVec3::new(-half, bar, 0.0), [DVec3::X * width, DVec3::Y * height]);
    scene.place_mesh("mirror", mirror, panel, at);
    let block = |x: [f64; 2], y: [f64; 2]| Mesh::cuboid(DVec3::new(x[0], y[0], -0.06), DVec3::new(x[1], y[1], 0.06));
    let top = height + bar;
    let frame = [
        block([-half - bar, -half], [0.0, top + bar]),
        block([half, half + bar], [0.0, top + bar]),
        block([-half, half], [0.0, bar]),
        block([-half, half], [top, top + bar]),
        Mesh::cuboid(DVec3::new(-half - bar, 0.0, -0.08), DVec3::new(half + bar, top + bar, -0.061)),
    ];
    scene.place_mesh("frame", wood, Mesh::union(&frame), at);
}

fn add_glasses(scene: &mut Scene) {
    let smooth = scene.add_material(glass("smooth glass", 0.0));
    let rough = scene.add_material(glass("rough glass", 0.3));
    let green = scene.add_material(tinted_glass("green glass", 0.0, [0.2, 0.75, 0.45], 0.3));
    let amber = scene.add_material(tinted_glass("amber glass", 0.0, [0.95, 0.55, 0.12], 0.1));
    let orange = scene.add_material(plastic("orange", [0.8, 0.28, 0.06], 0.25));
    scene.add_mesh("smooth glass", smooth, Mesh::sphere(DVec3::new(-0.15, 0.551, 0.55), 0.55, 5));
    scene.add_mesh("rough glass", rough, Mesh::sphere(DVec3::new(1.25, 0.451, 0.25), 0.45, 5));
    scene.add_mesh("plastic", orange, Mesh::sphere(DVec3::new(0.72, 0.231, 1.35), 0.23, 4));
    let block = DAffine3::from_translation(DVec3::new(-1.42, 0.001, 0.35)) * DAffine3::from_rotation_y(0.5);
    let size = DVec3::new(0.36, 0.0, 0.24);
    scene.place_mesh("green glass", green, Mesh::cuboid(-size, size + DVec3::Y * 0.85), block);
    let bowl = DAffine3::from_translation(DVec3::new(-0.75, 0.001, 1.45));
    scene.place_mesh("amber glass", amber, Mesh::lathe(&bowl_profile(), 96), bowl);
}

/// A bowl with a thick bottom: out and up along its outside, over the rim, and down its inside to the axis.
fn bowl_profile() -> Vec<[f64; 2]> {
    const STEPS: u32 = 24;
    let arc = |radius: f64, wall: f64, i: u32| {
        let angle = 1.35 * f64::from(i) / f64::from(STEPS);
        [radius * angle.sin(), wall + radius * (1.0 - angle.cos())]
    };
    let outside = (0..=STEPS).map(|i| arc(0.34, 0.0, i));
    let inside = (0..=STEPS).rev().map(|i| arc(0.29, 0.06, i));
    outside.chain(inside).collect()
}
