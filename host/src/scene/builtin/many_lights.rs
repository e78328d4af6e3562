//! A hall of stalls, each hung with strings of small coloured lamps. Partitions hide most of the lamps from any one
//! place, and their powers follow a power law: neither choosing lights by power nor choosing them uniformly does well.

use glam::{DAffine3, DVec3};

use super::parts::{metal, octahedron, plastic, room, stage};
use super::random::Random;
use crate::scene::{Material, Mesh, Scene};

// Lengths are in metres.

/// Stalls on either side of the aisle, across and along.
const STALLS: [usize; 2] = [4, 9];
const STALL: f64 = 2.6;
const HALF_AISLE: f64 = 1.3;
const HEIGHT: f64 = 3.6;
const PARTITION_HEIGHT: f64 = 2.7;
const LAMPS_PER_STRING: usize = 10;
/// How far the middle of a string hangs below its ends.
const SAG: f64 = 0.35;
/// Distance of a lamp's corners from its middle.
const LAMP_RADIUS: f64 = 0.022;
/// Radiance of the weakest lamp; the strongest has `2^(POWERS - 1)` times as much.
const WEAKEST: f32 = 60.0;
const POWERS: usize = 9;
/// The power law's exponent: each doubling of power is this many powers of two rarer.
const EXPONENT: f64 = 1.0;
const HUES: [[f32; 3]; 6] =
    [[1.0, 0.62, 0.25], [1.0, 0.82, 0.58], [1.0, 0.22, 0.12], [0.2, 0.75, 0.3], [0.18, 0.4, 1.0], [0.85, 0.2, 0.8]];

pub(super) fn scene() -> Scene {
    let mut scene = stage("many-lights", [DVec3::new(0.3, 1.7, 2.4), DVec3::new(-0.15, 1.35, -6.0)], 55.0, [640, 480]);
    add_hall(&mut scene);
    add_partitions(&mut scene);
    add_goods(&mut scene);
    add_lamps(&mut scene);
    scene
}

/// Half the width of the hall, and its length.
fn extent() -> [f64; 2] {
    [HALF_AISLE + STALL * STALLS[0] as f64, STALL * STALLS[1] as f64]
}

/// The middle of each stall's floor, and whether it is to the left (-1) or to the right (1) of the aisle.
fn stalls() -> impl Iterator<Item = (DVec3, f64)> {
    let along = (0..STALLS[1]).map(|k| -STALL * (k as f64 + 0.5));
    along.flat_map(|z| {
        let across = (0..STALLS[0]).map(|i| HALF_AISLE + STALL * (i as f64 + 0.5));
        across.flat_map(move |x| [-1.0, 1.0].map(|side| (DVec3::new(side * x, 0.0, z), side)))
    })
}

fn add_hall(scene: &mut Scene) {
    let [half, length] = extent();
    let grey = scene.add_material(plastic("floor", [0.42, 0.4, 0.38], 0.3));
    let wall = scene.add_material(Material::diffuse("hall", [0.5; 3]));
    let [floor, hall] = room(DVec3::new(-half, 0.0, -length), DVec3::new(half, HEIGHT, 3.0));
    scene.add_mesh("floor", grey, floor);
    scene.add_mesh("hall", wall, hall);
}

/// Each stall has a back and two sides; it opens to its neighbour nearer to the aisle by a door.
fn add_partitions(scene: &mut Scene) {
    const THICKNESS: f64 = 0.06;
    const DOOR: f64 = 0.9;
    let wood = scene.add_material(Material::diffuse("partition", [0.6, 0.5, 0.4]));
    let mut parts = Vec::new();
    let mut slab = |a: DVec3, b: DVec3| {
        let half = DVec3::new(0.5 * THICKNESS, 0.0, 0.5 * THICKNESS);
        parts.push(Mesh::cuboid(a.min(b) - half, a.max(b) + half + DVec3::Y * PARTITION_HEIGHT));
    };
    for (middle, side) in stalls() {
        let to_back = DVec3::X * side * 0.5 * STALL;
        let along = DVec3::Z * 0.5 * STALL;
        slab(middle - to_back + along, middle + to_back + along);
        // the wall to the aisle side has an opening next to the side wall
        let front = middle - to_back;
        slab(front - along, front + along - DVec3::Z * DOOR);
    }
    scene.add_mesh("partitions", wood, Mesh::union(&parts));
}

/// Something for the light to fall on: crates and balls in the aisle and in the stalls.
fn add_goods(scene: &mut Scene) {
    let mut random = Random::new(2);
    let crates = scene.add_material(plastic("crate", [0.55, 0.38, 0.2], 0.5));
    let balls = [
        plastic("white ball", [0.75; 3], 0.3),
        metal("copper ball", [0.95, 0.64, 0.54], 0.2),
        plastic("blue ball", [0.15, 0.25, 0.6], 0.2),
    ]
    .map(|material| scene.add_material(material));
    let aisle = (0..STALLS[1]).map(|k| (DVec3::new(0.0, 0.0, -STALL * (k as f64 + 0.2)), 0.8));
    let places: Vec<_> = aisle.chain(stalls().map(|(middle, _)| (middle, 0.5))).collect();
    for (index, (middle, reach)) in places.into_iter().enumerate() {
        let side = if index % 2 == 0 { 1.0 } else { -1.0 };
        let at = middle + DVec3::new(side * reach * random.range(0.75, 1.0), 0.0, random.range(-0.5, 0.5));
        let half = random.range(0.18, 0.3);
        let turn = DAffine3::from_translation(at) * DAffine3::from_rotation_y(random.range(0.0, 1.5));
        let size = DVec3::new(half, 0.0, half);
        scene.place_mesh("crate", crates, Mesh::cuboid(-size, size + DVec3::Y * 2.0 * half), turn);
        let ball = Mesh::sphere(at + DVec3::Y * (2.0 * half + 0.161), 0.16, 3);
        scene.add_mesh("ball", balls[random.below(balls.len())], ball);
    }
}

/// The ends of the strings: two in each stall, along it, and two across the aisle.
fn strings() -> Vec<[DVec3; 2]> {
    let along = DVec3::Z * 0.44 * STALL;
    let hung = stalls().flat_map(|(middle, side)| {
        [-0.6, 0.45].map(|x| middle + DVec3::new(side * x, 2.45, 0.0)).map(|middle| [middle - along, middle + along])
    });
    let half = DVec3::X * (HALF_AISLE - 0.1);
    let across = [1.0, 5.0].map(|k| DVec3::new(0.0, 2.62, -STALL * k)).map(|middle| [middle - half, middle + half]);
    hung.chain(across).collect()
}

/// Octahedra on sagging strings. Lamps of a hue and power are one mesh.
fn add_lamps(scene: &mut Scene) {
    let mut random = Random::new(1);
    let mut lamps = vec![Vec::new(); HUES.len() * POWERS];
    for [begin, end] in strings() {
        let hue = random.below(HUES.len());
        for lamp in 0..LAMPS_PER_STRING {
            let t = lamp as f64 / (LAMPS_PER_STRING - 1) as f64;
            let sag = 4.0 * SAG * t * (1.0 - t) + random.range(-0.03, 0.06);
            let at = begin.lerp(end, t) - DVec3::Y * sag;
            let strongest = f64::from(1_u32 << (POWERS - 1));
            let power = random.power_law(EXPONENT, strongest).log2().round() as usize;
            // one lamp in five is of another hue than its string's
            let hue = if random.below(5) == 0 { random.below(HUES.len()) } else { hue };
            lamps[hue * POWERS + power.min(POWERS - 1)].push(octahedron(at, LAMP_RADIUS));
        }
    }
    for (index, lamps) in lamps.iter().enumerate().filter(|(_, lamps)| !lamps.is_empty()) {
        let radiance = WEAKEST * f32::from(1_u16 << (index % POWERS));
        let hue = HUES[index / POWERS].map(|channel| channel * radiance);
        let material = scene.add_material(Material::emitter("lamp", [0.0; 3], hue));
        scene.add_mesh("lamps", material, Mesh::union(lamps));
    }
}

#[cfg(test)]
mod tests {
    use super::super::measure::light_share;
    use super::*;

    #[test]
    fn there_are_ten_thousand_emissive_triangles_and_most_are_hidden() {
        let scene = scene();
        let emissive = scene.meshes.iter().filter(|mesh| scene.materials[mesh.material].emission != [0.0; 3]);
        assert!(emissive.map(|mesh| mesh.indices.len()).sum::<usize>() >= 10_000);
        let share = light_share(&scene, 10_000, |_| true);
        // measured 0.020
        assert!(share > 0.001 && share < 0.1, "{share}");
    }
}
