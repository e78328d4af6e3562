//! Two rooms and a door between them that is ajar: after Veach's scene in "Robust Monte Carlo Methods for Light Transport
//! Simulation" (1997), in the proportions of common rooms. The only emitter is in the far room; the values of the materials
//! are those of the scene's public versions.

use glam::{DAffine3, DVec3};

use super::parts::{checkered_floor, glass, metal, plastic, room, stage};
use crate::scene::{Material, Mesh, Scene};

// Lengths are in metres.

/// Half the width of the rooms.
const HALF_WIDTH: f64 = 2.4;
const HEIGHT: f64 = 2.7;
/// The near room's end behind the camera.
const NEAR: f64 = 3.1;
/// The wall between the rooms: its face in the near room, and its face in the far room.
pub(super) const WALL: [f64; 2] = [-1.6, -1.7];
const FAR: f64 = -5.0;
/// The opening in the wall, left and right, and its height.
const OPENING: [f64; 2] = [0.25, 1.15];
const OPENING_HEIGHT: f64 = 2.1;
/// Between the door and its frame, and the floor.
const GAP: f64 = 0.005;
const DOOR_THICKNESS: f64 = 0.04;
const TABLE_HEIGHT: f64 = 0.74;
const SPHERE_RADIUS: f64 = 0.27;
const RADIANCE: f32 = 1000.0;

/// The scene with the door opened into the near room by this angle in degrees; 0 is closed.
pub(super) fn scene(door_degrees: f64) -> Scene {
    let mut scene = stage("ajar", [DVec3::new(-0.25, 1.45, 2.9), DVec3::new(-0.2, 0.98, -1.6)], 46.0, [640, 480]);
    add_rooms(&mut scene);
    add_door(&mut scene, door_degrees);
    add_still_life(&mut scene);
    let lamp = DVec3::new(0.9, HEIGHT - 0.02, -4.3);
    scene.add_quad_light(lamp, [DVec3::X * 1.2, DVec3::Z * 0.6], [RADIANCE; 3], false);
    scene
}

fn add_rooms(scene: &mut Scene) {
    let wall = scene.add_material(Material::diffuse("wall", [0.8; 3]));
    let squares = checkered_floor(scene, [225, 90], [12.0, 20.0]);
    let [floor, shell] = room(DVec3::new(-HALF_WIDTH, 0.0, FAR), DVec3::new(HALF_WIDTH, HEIGHT, NEAR));
    scene.add_mesh("floor", squares, floor);
    scene.add_mesh("shell", wall, shell);
    let part = |left: f64, right: f64, bottom: f64| {
        Mesh::cuboid(DVec3::new(left, bottom, WALL[1]), DVec3::new(right, HEIGHT, WALL[0]))
    };
    let parts = [
        part(-HALF_WIDTH, OPENING[0], 0.0),
        part(OPENING[1], HALF_WIDTH, 0.0),
        part(OPENING[0], OPENING[1], OPENING_HEIGHT),
    ];
    scene.add_mesh("wall between", wall, Mesh::union(&parts));
}

/// The door turns about its left edge, into the near room; there it reaches into the wall a little, so that no light passes.
fn add_door(scene: &mut Scene, degrees: f64) {
    let wood = scene.add_material(plastic("door", [0.42, 0.23, 0.11], 0.5));
    let handle = scene.add_material(metal("handle", [0.9, 0.8, 0.55], 0.5));
    let hinge = scene.add_material(metal("hinge", [0.7; 3], 0.3162));
    let width = OPENING[1] - OPENING[0] - GAP;
    let pivot = DVec3::new(OPENING[0], 0.0, WALL[0]);
    let turn = DAffine3::from_translation(pivot) * DAffine3::from_rotation_y(-degrees.to_radians());
    let panel = Mesh::cuboid(DVec3::new(-0.002, GAP, -DOOR_THICKNESS), DVec3::new(width, OPENING_HEIGHT - GAP, 0.0));
    scene.place_mesh("door", wood, panel, turn);
    let knob = DVec3::new(width - 0.08, 1.03, 0.06);
    scene.place_mesh("handle", handle, Mesh::sphere(knob, 0.035, 3), turn);
    let stem = Mesh::cuboid(knob - DVec3::new(0.01, 0.01, 0.06), knob + DVec3::new(0.01, 0.01, -0.03));
    scene.place_mesh("stem", handle, stem, turn);
    let pin = [[0.0, -0.06], [0.014, -0.06], [0.014, -0.06], [0.014, 0.06], [0.014, 0.06], [0.0, 0.06]];
    for height in [0.3, 1.8] {
        let at = DAffine3::from_translation(DVec3::new(OPENING[0], height, WALL[0] + 0.01));
        scene.place_mesh("hinge", hinge, Mesh::lathe(&pin, 16), at);
    }
}

/// A table with a sphere of metal, one of glass and a grey one.
fn add_still_life(scene: &mut Scene) {
    let wood = scene.add_material(plastic("table", [0.33, 0.2, 0.12], 0.4));
    let top = |x: f64, z: f64| DVec3::new(x, TABLE_HEIGHT, z);
    let [lo, hi] = [top(-2.2, -0.75), top(-0.15, 0.15)];
    let mut parts = vec![Mesh::cuboid(lo - DVec3::Y * 0.05, hi)];
    for (x, z) in [(lo.x, lo.z), (hi.x - 0.07, lo.z), (lo.x, hi.z - 0.07), (hi.x - 0.07, hi.z - 0.07)] {
        parts.push(Mesh::cuboid(DVec3::new(x, 0.0, z), DVec3::new(x + 0.07, TABLE_HEIGHT - 0.05, z + 0.07)));
    }
    scene.add_mesh("table", wood, Mesh::union(&parts));
    let spheres = [
        ("metal sphere", metal("metal", [0.928, 0.918, 0.919], 0.17), -1.85, -0.3),
        ("glass sphere", glass("glass", 0.0), -1.17, -0.3),
        ("grey sphere", plastic("grey", [0.8; 3], 0.5), -0.5, -0.3),
    ];
    for (name, material, x, z) in spheres {
        let material = scene.add_material(material);
        scene.add_mesh(name, material, Mesh::sphere(top(x, z) + DVec3::Y * (SPHERE_RADIUS + 0.001), SPHERE_RADIUS, 4));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AJAR_DEGREES, measure::light_share};
    use super::*;

    #[test]
    fn little_light_reaches_the_near_room_directly() {
        let near = |p: DVec3| p.z > WALL[0] + 0.001;
        let share = |degrees: f64| light_share(&scene(degrees), 10_000, near);
        let (ajar, open) = (share(AJAR_DEGREES), share(90.0));
        // measured 0.0048 and 0.077, each within 0.0005
        assert!(ajar > 0.0005 && ajar < 0.02, "{ajar}");
        assert!(open > 5.0 * ajar, "{open} {ajar}");
    }
}
