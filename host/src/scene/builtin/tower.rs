//! Two towers of bricks and a deck between them at night. The lights of the sky are all behind the towers; the side that
//! faces the camera has its light from the façade behind the camera.

use glam::DVec3;

use super::parts::{plastic, sky, stage};
use super::random::Random;
use crate::scene::{Environment, Material, Mesh, Scene};

// Lengths are in metres.

const BRICK: DVec3 = DVec3::new(1.25, 0.62, 0.36);
/// Gap between bricks.
const JOINT: f64 = 0.015;
/// Each tower: its left, its right and its height in bricks.
const TOWERS: [(f64, f64, usize); 2] = [(-12.0, -2.0, 30), (2.0, 12.0, 37)];
/// Front and back of the towers.
const DEPTH: [f64; 2] = [3.75, -3.75];
/// The deck's lower and upper side.
const DECK: [f64; 2] = [4.34, 12.4];
const ROUGHNESS: [f32; 4] = [0.1, 0.2, 0.3, 0.4];
const COLOURS: [[f32; 3]; 3] = [[0.62, 0.42, 0.33], [0.66, 0.55, 0.45], [0.5, 0.47, 0.46]];

const SKY_SIZE: [u32; 2] = [512, 256];
const LOBES: usize = 200;
/// Standard deviation of a lobe in radians: about a pixel of the sky's.
const LOBE_WIDTH: f64 = 0.012;
/// Irradiance by all lobes on a surface that faces them.
const LOBES_IRRADIANCE: f64 = 4.0;

pub(super) fn scene() -> Scene {
    let mut scene = stage("tower", [DVec3::new(-3.5, 2.0, 32.0), DVec3::new(0.4, 10.6, 0.0)], 44.0, [480, 640]);
    scene.environment = Some(night());
    let first = scene.materials.len();
    for colour in COLOURS {
        scene.materials.extend(ROUGHNESS.map(|roughness| plastic("brick", colour, roughness)));
    }
    let mut bricks = Bricks { random: Random::new(3), by_material: vec![Vec::new(); scene.materials.len()] };
    TOWERS.iter().for_each(|tower| bricks.add_tower(tower));
    bricks.add_deck();
    bricks.add_paving();
    for (index, bricks) in bricks.by_material.iter().enumerate() {
        scene.add_mesh("bricks", first + index, Mesh::union(bricks));
    }
    add_surroundings(&mut scene);
    scene
}

/// What no one looks at: the ground below the paving, the cores of the towers, the façade behind the camera.
fn add_surroundings(scene: &mut Scene) {
    let dark = scene.add_material(Material::diffuse("mortar", [0.25; 3]));
    let bright = scene.add_material(Material::diffuse("facade", [0.78, 0.74, 0.68]));
    let [left, right] = TOWERS.map(|(left, right, layers)| {
        let inset = BRICK.z + 0.01;
        let height = layers as f64 * BRICK.y - 0.02;
        let lo = DVec3::new(left + inset, 0.0, DEPTH[1] + inset);
        Mesh::cuboid(lo, DVec3::new(right - inset, height, DEPTH[0] - inset))
    });
    let ground = Mesh::quad(DVec3::new(-60.0, -0.2, -60.0), [DVec3::Z * 103.0, DVec3::X * 120.0]);
    scene.add_mesh("cores", dark, Mesh::union(&[left, right, ground]));
    scene.add_mesh("facade", bright, Mesh::cuboid(DVec3::new(-34.0, -0.2, 42.0), DVec3::new(34.0, 38.0, 43.0)));
}

/// Boxes, by the index of their material.
struct Bricks {
    random: Random,
    by_material: Vec<Vec<Mesh>>,
}

impl Bricks {
    fn add(&mut self, lo: DVec3, hi: DVec3, colours: std::ops::Range<usize>) {
        let colour = colours.start + self.random.below(colours.len());
        let material = colour * ROUGHNESS.len() + self.random.below(ROUGHNESS.len());
        let joint = DVec3::splat(0.5 * JOINT);
        self.by_material[material].push(Mesh::cuboid(lo + joint, hi - joint));
    }

    /// Four walls of bricks in stretcher bond.
    fn add_tower(&mut self, &(left, right, layers): &(f64, f64, usize)) {
        for layer in 0..layers {
            let [lo, hi] = heights(layer);
            for [from, to] in course(left, right, layer) {
                let out = self.relief(layer, 0.5 * (from + to));
                let front = DVec3::new(to, hi, DEPTH[0] + out);
                self.add(DVec3::new(from, lo, DEPTH[0] - BRICK.z), front, 0..2);
                let back = DVec3::new(from, lo, DEPTH[1] - out);
                self.add(back, DVec3::new(to, hi, DEPTH[1] + BRICK.z), 0..2);
            }
            for [from, to] in course(DEPTH[1] + BRICK.z, DEPTH[0] - BRICK.z, layer) {
                let out = self.relief(layer, 0.5 * (from + to));
                self.add(DVec3::new(left - out, lo, from), DVec3::new(left + BRICK.z, hi, to), 0..2);
                self.add(DVec3::new(right - BRICK.z, lo, from), DVec3::new(right + out, hi, to), 0..2);
            }
        }
    }

    /// How far a brick stands out: windows are recessed, a cornice protrudes, and no brick is laid exactly.
    fn relief(&mut self, layer: usize, along: f64) -> f64 {
        let window = layer % 6 >= 3 && layer > 6 && (along / (3.0 * BRICK.x)).rem_euclid(1.0) < 0.34;
        let cornice = if layer % 12 == 1 { 0.16 } else { 0.0 };
        (if window { -0.27 } else { cornice }) + self.random.range(0.0, 0.07)
    }

    /// Beams from the front to the back, between the towers.
    fn add_deck(&mut self) {
        let layers = ((DECK[1] - DECK[0]) / BRICK.y) as usize;
        for layer in 0..layers {
            for [from, to] in course(TOWERS[0].1 + 0.08, TOWERS[1].0 - 0.08, layer) {
                let out = 0.5 - self.random.range(0.0, 0.12);
                let bottom = DECK[0] + layer as f64 * BRICK.y;
                let lo = DVec3::new(from, bottom, DEPTH[1] + out);
                self.add(lo, DVec3::new(to, bottom + BRICK.y, DEPTH[0] - out), 1..2);
            }
        }
    }

    fn add_paving(&mut self) {
        const SIDE: f64 = 1.4;
        for i in -12..12 {
            for k in -4..22 {
                let top = self.random.range(-0.05, 0.0);
                let lo = DVec3::new(SIDE * f64::from(i), -0.2, SIDE * f64::from(k));
                self.add(lo, DVec3::new(lo.x + SIDE, top, lo.z + SIDE), 2..3);
            }
        }
    }
}

/// Lower and upper side of a layer.
fn heights(layer: usize) -> [f64; 2] {
    [layer as f64, layer as f64 + 1.0].map(|y| y * BRICK.y)
}

/// The bricks between two ends, every other layer with halves at its ends.
fn course(begin: f64, end: f64, layer: usize) -> Vec<[f64; 2]> {
    let offset = if layer % 2 == 1 { 0.5 * BRICK.x } else { 0.0 };
    let count = ((end - begin) / BRICK.x).ceil() as usize + 1;
    (0..count)
        .map(|i| [i, i + 1].map(|i| (begin + i as f64 * BRICK.x - offset).clamp(begin, end)))
        .filter(|[from, to]| to - from > 0.1)
        .collect()
}

/// A dim gradient, and small bright lobes behind the towers whose powers follow a power law.
fn night() -> Environment {
    let mut random = Random::new(4);
    let mut lobes: Vec<(DVec3, [f64; 3])> = (0..LOBES)
        .map(|_| {
            let azimuth = random.range(-0.3, 0.3);
            let elevation = random.range(0.36, 0.6);
            let power = random.power_law(0.8, 1000.0);
            let warmth = random.unit();
            let direction =
                DVec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos());
            let colour = [0.75 + 0.5 * warmth, 1.0, 1.6 - 1.1 * warmth];
            (direction, colour.map(|channel| channel * power))
        })
        .collect();
    let total: f64 = lobes.iter().map(|(_, colour)| colour[1]).sum();
    let peak = LOBES_IRRADIANCE / (total * std::f64::consts::TAU * LOBE_WIDTH * LOBE_WIDTH);
    lobes.iter_mut().for_each(|(_, colour)| *colour = colour.map(|channel| channel * peak));
    sky("night", SKY_SIZE, |direction| {
        let up = 0.5 + 0.5 * direction.y;
        let mut radiance = [0.0009, 0.0011, 0.002].map(|channel| channel * (1.3 - up));
        for (middle, colour) in &lobes {
            let squares = (direction - *middle).length_squared() / (2.0 * LOBE_WIDTH * LOBE_WIDTH);
            // the exponential is zero in f32 well before
            if squares < 40.0 {
                let lobe = (-squares).exp();
                radiance = [0, 1, 2].map(|c| radiance[c] + colour[c] * lobe);
            }
        }
        radiance.map(|channel| channel as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::super::measure::Walks;
    use super::*;

    /// Radiance of the sky in green, at the nearest pixel.
    fn sky_at(sky: &Environment, direction: DVec3) -> f64 {
        let d = direction.normalize();
        let u = (0.5 - d.x.atan2(d.z) / std::f64::consts::TAU).rem_euclid(1.0);
        let v = d.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
        let [x, y] = [u * f64::from(sky.size[0]), v * f64::from(sky.size[1])].map(|x| x as u32);
        f64::from(sky.pixels[(y.min(sky.size[1] - 1) * sky.size[0] + x.min(sky.size[0] - 1)) as usize][1])
    }

    #[test]
    fn bricks_are_many_and_what_the_camera_sees_is_lit_indirectly() {
        let scene = scene();
        let bricks: usize =
            scene.meshes.iter().filter(|mesh| mesh.name == "bricks").map(|mesh| mesh.indices.len() / 12).sum();
        assert!((2000..=5000).contains(&bricks), "{bricks}");
        // as if each surface reflected half of the light diffusely, up to eight vertices
        let mut walks = Walks::new(&scene);
        let sky = scene.environment.as_ref().unwrap();
        let (mut direct, mut indirect) = (0.0, 0.0);
        for _ in 0..60_000 {
            let mut ray = walks.camera_ray();
            let mut throughput = 1.0;
            for bounce in 0..9 {
                let Some(vertex) = walks.trace(&ray) else {
                    let radiance = throughput * sky_at(sky, ray.direction.as_dvec3());
                    match bounce {
                        0 => {}
                        1 => direct += radiance,
                        _ => indirect += radiance,
                    }
                    break;
                };
                throughput *= 0.5;
                ray = walks.bounce(&vertex);
            }
        }
        // measured: 97 % is indirect
        assert!(direct > 0.0 && indirect > 19.0 * direct, "{direct} {indirect}");
    }
}
