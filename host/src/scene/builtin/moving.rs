//! A room in which everything moves that can: a board between the lights and the floor, a lamp that swings and turns, a sign
//! and a bulb that go out and come back, and a ball. The ceiling's light and the walls stay.

use glam::{DAffine3, DQuat, DVec3};

use super::parts::{plastic, stage};
use crate::scene::{Animation, Blackout, Emitter, Light, LightKind, Material, Mesh, Motion, Pose, Scene};

// The room reaches from -1 to 1 along each axis and is open to the viewer; times are in frames.

/// After which everything begins anew.
const PERIOD: f64 = 32.0;

pub(super) fn scene() -> Scene {
    let mut scene = stage("moving", [DVec3::new(0.0, 0.0, 3.9), DVec3::ZERO], 39.0, [512, 512]);
    add_room(&mut scene);
    add_lights(&mut scene);
    add_moving(&mut scene);
    scene
}

fn add_room(scene: &mut Scene) {
    let white = scene.add_material(Material::diffuse("white", [0.7; 3]));
    let red = scene.add_material(Material::diffuse("red", [0.6, 0.15, 0.1]));
    let blue = scene.add_material(Material::diffuse("blue", [0.12, 0.2, 0.55]));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let (lo, hi) = (DVec3::NEG_ONE, DVec3::ONE);
    let shell = [(lo, [z, x]), (lo, [x, y]), (hi, [-x, -z])];
    scene.add_mesh("shell", white, Mesh::union(&shell.map(|(corner, edges)| Mesh::quad(corner, edges))));
    scene.add_mesh("left wall", red, Mesh::quad(lo, [y, z]));
    scene.add_mesh("right wall", blue, Mesh::quad(hi, [-z, -y]));
}

fn add_lights(scene: &mut Scene) {
    let corner = DVec3::new(0.3, 0.99, -0.2);
    scene.add_quad_light(corner, [DVec3::X * 0.4, DVec3::Z * 0.4], [9.0, 8.0, 6.0], false);
    let sign = scene.add_material(Material::emitter("sign", [0.1; 3], [1.0, 3.0, 6.0]));
    scene.add_mesh("sign", sign, Mesh::quad(DVec3::new(-0.8, 0.1, -0.99), [DVec3::X * 0.5, DVec3::Y * 0.3]));
    for (name, position, intensity) in [
        ("bulb", DVec3::new(0.7, -0.3, 0.3), [0.25, 0.15, 0.05]),
        ("night light", DVec3::new(-0.6, -0.5, 0.6), [0.04, 0.08, 0.03]),
    ] {
        scene.lights.push(Light { name: name.to_owned(), intensity, kind: LightKind::Point { position } });
    }
    let out = |emitter, from, until| Blackout { emitter, time: from..until };
    scene.animation = Animation {
        blackouts: vec![
            out(Emitter::Material(sign), 5.0, 9.0),
            out(Emitter::Material(sign), 20.0, 21.0),
            out(Emitter::Light(0), 7.0, 14.0),
            out(Emitter::Light(0), 28.0, 30.0),
        ],
        period: Some(PERIOD),
        ..Animation::default()
    };
}

/// Each on its way and back; at time 0 where its instance is.
fn add_moving(scene: &mut Scene) {
    let block = |half: DVec3| Mesh::cuboid(-half, half);
    let lamp = scene.add_material(Material::emitter("lamp", [0.2; 3], [14.0, 5.0, 3.0]));
    let bar = block(DVec3::new(0.12, 0.03, 0.06));
    add(scene, lamp, bar, DVec3::new(-0.6, 0.6, 0.2), (DVec3::new(0.9, -0.2, -0.4), DVec3::Y, 3.0));
    let wood = scene.add_material(Material::diffuse("board", [0.55, 0.4, 0.25]));
    let board = block(DVec3::new(0.35, 0.02, 0.25));
    add(scene, wood, board, DVec3::new(-0.5, 0.15, 0.0), (DVec3::X * 1.1, DVec3::Z, 0.5));
    let shiny = scene.add_material(plastic("ball", [0.6, 0.6, 0.2], 0.3));
    let ball = Mesh::sphere(DVec3::ZERO, 0.22, 2);
    add(scene, shiny, ball, DVec3::new(0.2, -0.75, 0.4), (DVec3::new(-0.7, 0.4, -0.5), DVec3::X, 2.0));
}

/// A mesh that moves by a way and turns about an axis by an angle in half a period, and then goes back.
fn add(scene: &mut Scene, material: usize, mesh: Mesh, at: DVec3, (way, axis, angle): (DVec3, DVec3, f64)) {
    let name = scene.materials[material].name.clone();
    scene.place_mesh(&name, material, mesh, DAffine3::from_translation(at));
    let key = |part: f64, share: f64| Pose {
        time: part * PERIOD,
        translation: way * share,
        rotation: DQuat::from_axis_angle(axis, angle * share),
    };
    let keys = vec![key(0.0, 0.0), key(0.25, 0.6), key(0.5, 1.0), key(0.75, 0.5), key(1.0, 0.0)];
    scene.animation.motions.push(Motion { instance: scene.instances.len() - 1, keys });
}
