//! Halls that a generator makes, one of each seed: 60 to 959 small lights, most of them visible, over glossy and diffuse
//! surfaces. They are what reuse of samples is measured on, and none of them was chosen: whatever a hall has is drawn from
//! the ranges below, by additions, products and quotients alone.

use std::f32::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::parts::{checkered_floor, metal, octahedron, plastic, room, stage};
use super::random::Random;
use super::statue::hare;
use crate::scene::{Light, LightKind, Material, Mesh, Scene};

// Lengths are in metres.

/// What the name of every hall begins with.
pub(super) const PREFIX: &str = "hall-";
/// The fewest lights; twice, four and eight times as many begin the other octaves.
const LIGHTS: f64 = 60.0;
/// Octaves of the number of lights; seeds take turns.
const OCTAVES: u32 = 4;
/// Octaves of a light's power; each is half as frequent as the one below.
const POWER_OCTAVES: u32 = 7;
/// Power of all lights for a square metre of floor.
const POWER: f64 = 10.0;
/// Where the hall begins, behind the camera.
const BEGIN: f64 = 2.0;
/// Length of a bay: between two of them there may be a partition.
const BAY: f64 = 3.0;
const PARTITION: f64 = 0.1;
/// Width and height of the door in the wall to the back room.
const DOOR: [f64; 2] = [1.6, 2.2];
/// What is kept free around lights and things.
const MARGIN: f64 = 0.15;
/// Places that are tried before one that is taken is accepted.
const TRIES: u32 = 64;
/// Side of the cubes that the figure's surface is made from, of its own size: coarse.
const FIGURE_CELL: f64 = 0.04;

/// The hall of a seed; the name ends with it.
pub(super) fn scene(seed: u32) -> Scene {
    let mut hall = Hall::new(seed);
    hall.add_shell();
    hall.add_bays();
    hall.add_back_wall();
    hall.add_things();
    hall.add_lights(seed % OCTAVES);
    hall.scene
}

/// A hall in the making. It reaches from `-half_width` to `half_width`, from the floor to `height` and from [`BEGIN`] to
/// `-length`.
struct Hall {
    random: Random,
    scene: Scene,
    half_width: f64,
    height: f64,
    length: f64,
    /// The wall before the back room.
    back_wall: f64,
    /// Boxes around what is solid.
    solids: Vec<[DVec3; 2]>,
}

impl Hall {
    fn new(seed: u32) -> Self {
        let mut random = Random::new(u64::from(seed));
        let (half_width, height, length) = (random.range(3.5, 6.0), random.range(3.2, 5.0), random.range(12.0, 20.0));
        let eye = DVec3::new(random.range(-0.25, 0.25) * half_width, 1.7, 0.8);
        let target = DVec3::new(random.range(-0.2, 0.2) * half_width, 1.2, -0.5 * length);
        let scene = stage(&format!("{PREFIX}{seed}"), [eye, target], random.range(52.0, 64.0), [640, 480]);
        let back_wall = -length * random.range(0.7, 0.85);
        Self { random, scene, half_width, height, length, back_wall, solids: Vec::new() }
    }

    fn add_shell(&mut self) {
        let floor = match self.random.below(3) {
            0 => {
                let squares = [self.half_width, 0.5 * self.length].map(|side| (side * 2.0).floor() as f32);
                checkered_floor(&mut self.scene, [188, 92], squares)
            }
            1 => self.add_plastic(),
            _ => self.add_diffuse(),
        };
        let walls = if self.random.below(3) == 0 { self.add_plastic() } else { self.add_diffuse() };
        let lo = DVec3::new(-self.half_width, 0.0, -self.length);
        let [ground, shell] = room(lo, DVec3::new(self.half_width, self.height, BEGIN));
        self.scene.add_mesh("floor", floor, ground);
        self.scene.add_mesh("walls", walls, shell);
    }

    /// Pillars in two rows, and partitions from some of them to the wall.
    fn add_bays(&mut self) {
        let (material, half, row) =
            (self.add_surface(), self.random.range(0.12, 0.3), self.random.range(0.5, 0.7) * self.half_width);
        let tall = if self.random.below(2) == 0 { self.height } else { 0.7 * self.height };
        let mut z = -0.5 * BAY;
        while z > self.back_wall + BAY {
            for side in [-1.0, 1.0] {
                let foot = DVec3::new(side * row, 0.0, z);
                let reach = DVec3::new(half, 0.0, half);
                self.add_solid("pillar", material, foot - reach, foot + reach + DVec3::Y * self.height);
                if self.random.below(2) == 0 {
                    let thick = DVec3::Z * (0.5 * PARTITION);
                    let end = DVec3::new(side * self.half_width, tall, z);
                    self.add_solid("partition", material, foot.min(end) - thick, foot.max(end) + thick);
                }
            }
            z -= BAY;
        }
    }

    /// With a door somewhere in it.
    fn add_back_wall(&mut self) {
        let material = self.add_surface();
        let [width, top] = DOOR;
        let left = self.random.range(-0.8, 0.8) * (self.half_width - width) - 0.5 * width;
        let [near, far] = [0.0, -PARTITION].map(|behind| self.back_wall + behind);
        for [from, to, bottom] in
            [[-self.half_width, left, 0.0], [left, left + width, top], [left + width, self.half_width, 0.0]]
        {
            let (lo, hi) = (DVec3::new(from, bottom, far), DVec3::new(to, self.height, near));
            self.add_solid("back wall", material, lo, hi);
        }
    }

    /// Boxes, balls and a figure of metal on the floor.
    fn add_things(&mut self) {
        for _ in 0..6 + self.random.below(12) {
            let (material, half) = (self.add_surface(), self.random.range(0.15, 0.45));
            let tall = 2.0 * half * self.random.range(0.5, 2.0);
            let foot = self.floor_place(half);
            let reach = DVec3::new(half, 0.0, half) / DVec3::splat(1.5);
            let turned = DAffine3::from_translation(foot) * turn(self.random.range(-1.0, 1.0));
            self.scene.place_mesh("box", material, Mesh::cuboid(-reach, reach + DVec3::Y * tall), turned);
            self.occupy(foot, half, tall);
        }
        for _ in 0..6 + self.random.below(12) {
            let (material, radius) = (self.add_surface(), self.random.range(0.12, 0.5));
            let foot = self.floor_place(radius);
            self.scene.add_mesh("ball", material, Mesh::sphere(foot + DVec3::Y * radius, radius, 4));
            self.occupy(foot, radius, 2.0 * radius);
        }
        let (material, size) = (self.add_metal(), self.random.range(0.6, 0.9));
        let foot = self.floor_place(0.8 * size);
        let placed = DAffine3::from_translation(foot) * turn(self.random.range(-1.0, 1.0));
        let scaled = placed * DAffine3::from_scale(DVec3::splat(size));
        self.scene.place_mesh("figure", material, hare(FIGURE_CELL), scaled);
        self.occupy(foot, 0.8 * size, 2.1 * size);
    }

    fn add_lights(&mut self, octave: u32) {
        let count = (LIGHTS * f64::from(1_u32 << octave) * self.random.range(1.0, 2.0)) as usize;
        let hidden = self.random.range(0.0, 0.25);
        let weights: Vec<f64> = (0..count).map(|_| self.power()).collect();
        let floor = 2.0 * self.half_width * self.length;
        let scale = POWER * floor / weights.iter().sum::<f64>();
        for weight in weights {
            let behind = self.random.unit() < hidden;
            let at = self.light_place(behind);
            let colour = self.light_colour().map(|channel| channel * (weight * scale) as f32);
            match self.random.below(10) {
                0 => self.add_point_light(at, colour),
                1 => self.add_spot_light(at, colour),
                2..5 => self.add_panel(at, colour),
                _ => self.add_bulb(at, colour),
            }
        }
    }

    fn power(&mut self) -> f64 {
        let mut octave = 0;
        while octave + 1 < POWER_OCTAVES && self.random.below(2) == 1 {
            octave += 1;
        }
        f64::from(1_u32 << octave) * self.random.range(1.0, 2.0)
    }

    /// White, or of a hue that leaves something of each channel.
    fn light_colour(&mut self) -> [f32; 3] {
        let least = self.random.range(0.1, 1.0);
        [(); 3].map(|()| self.random.range(least, 1.0) as f32)
    }

    /// Somewhere above the heads, in the hall or in the back room.
    fn light_place(&mut self, behind: bool) -> DVec3 {
        let [far, near] = if behind { [-self.length, self.back_wall - PARTITION] } else { [self.back_wall, BEGIN] };
        let (lo, hi) =
            (DVec3::new(-self.half_width, 0.45 * self.height, far), DVec3::new(self.half_width, self.height, near));
        self.free_place(lo + DVec3::splat(2.0 * MARGIN), hi - DVec3::splat(2.0 * MARGIN), MARGIN)
    }

    /// On the floor before the camera, `reach` away from what is there already.
    fn floor_place(&mut self, reach: f64) -> DVec3 {
        let side = self.half_width - reach;
        let lo = DVec3::new(-side, 0.0, self.back_wall + reach);
        self.free_place(lo, DVec3::new(side, 0.0, -1.2 - reach), reach)
    }

    /// Away from all solids, if that is found.
    fn free_place(&mut self, lo: DVec3, hi: DVec3, reach: f64) -> DVec3 {
        let mut place = lo;
        for _ in 0..TRIES {
            place =
                DVec3::new(self.random.range(lo.x, hi.x), self.random.range(lo.y, hi.y), self.random.range(lo.z, hi.z));
            let [from, to] = [-reach, reach].map(|by| place + DVec3::splat(by));
            if self.solids.iter().all(|[lo, hi]| from.cmpgt(*hi).any() || to.cmplt(*lo).any()) {
                break;
            }
        }
        place
    }

    fn occupy(&mut self, foot: DVec3, reach: f64, height: f64) {
        let reach = DVec3::new(reach, 0.0, reach);
        self.solids.push([foot - reach, foot + reach + DVec3::Y * height]);
    }

    fn add_solid(&mut self, name: &str, material: usize, lo: DVec3, hi: DVec3) {
        self.scene.add_mesh(name, material, Mesh::cuboid(lo, hi));
        self.solids.push([lo, hi]);
    }

    fn add_surface(&mut self) -> usize {
        match self.random.below(3) {
            0 => self.add_metal(),
            1 => self.add_plastic(),
            _ => self.add_diffuse(),
        }
    }

    fn add_metal(&mut self) -> usize {
        let reflectance = self.colour(0.5, 0.95);
        let roughness = self.random.range(0.1, 0.5) as f32;
        self.scene.add_material(metal("metal", reflectance, roughness))
    }

    fn add_plastic(&mut self) -> usize {
        let base = self.colour(0.05, 0.7);
        let roughness = self.random.range(0.08, 0.6) as f32;
        self.scene.add_material(plastic("plastic", base, roughness))
    }

    fn add_diffuse(&mut self) -> usize {
        let base = self.colour(0.15, 0.8);
        self.scene.add_material(Material::diffuse("diffuse", base))
    }

    fn colour(&mut self, least: f64, most: f64) -> [f32; 3] {
        [(); 3].map(|()| self.random.range(least, most) as f32)
    }

    fn add_point_light(&mut self, position: DVec3, power: [f32; 3]) {
        let kind = LightKind::Point { position };
        self.add_light("point", kind, power.map(|channel| channel / (4.0 * PI)));
    }

    /// Downwards, more or less.
    fn add_spot_light(&mut self, position: DVec3, power: [f32; 3]) {
        let direction = DVec3::new(self.random.range(-0.5, 0.5), -1.0, self.random.range(-0.5, 0.5));
        let outer = self.random.range(0.4, 1.0);
        let kind = LightKind::Spot { position, direction, inner: 0.5 * outer, outer };
        self.add_light("spot", kind, power.map(|channel| channel / PI));
    }

    fn add_light(&mut self, name: &str, kind: LightKind, intensity: [f32; 3]) {
        self.scene.lights.push(Light { name: name.to_owned(), intensity, kind });
    }

    /// A rectangle that shines downwards.
    fn add_panel(&mut self, at: DVec3, power: [f32; 3]) {
        let (x, z) = (DVec3::X * self.random.range(0.08, 0.5), DVec3::Z * self.random.range(0.08, 0.5));
        self.add_emitter("panel", Mesh::quad(at - 0.5 * (x + z), [x, z]), power);
    }

    fn add_bulb(&mut self, at: DVec3, power: [f32; 3]) {
        let mesh = octahedron(at, self.random.range(0.02, 0.12));
        self.add_emitter("bulb", mesh, power);
    }

    fn add_emitter(&mut self, name: &str, mesh: Mesh, power: [f32; 3]) {
        let radiance = power.map(|channel| channel / (PI * mesh.area() as f32));
        let material = self.scene.add_material(Material::emitter(name, [0.0; 3], radiance));
        self.scene.add_mesh(name, material, mesh);
    }
}

/// About the y axis, by twice the angle whose tangent is `t`.
fn turn(t: f64) -> DAffine3 {
    let scale = 1.0 / (1.0 + t * t);
    let (sin, cos) = (2.0 * t * scale, (1.0 - t * t) * scale);
    let columns = DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos));
    DAffine3::from_mat3(columns)
}

#[cfg(test)]
mod tests {
    use super::super::measure::Walks;
    use super::*;
    use crate::buffers::SceneBuffers;

    /// Panels, bulbs and lights without a surface.
    fn light_count(scene: &Scene) -> usize {
        scene.meshes.iter().filter(|mesh| scene.materials[mesh.material].emission != [0.0; 3]).count()
            + scene.lights.len()
    }

    #[test]
    fn halls_of_all_octaves_are_sound_and_mostly_lit() {
        let mut counts = Vec::new();
        for seed in 1..=5 {
            let scene = scene(seed);
            assert_eq!(scene.name, format!("hall-{seed}"));
            let stats = SceneBuffers::build(&scene).expect("builds").stats();
            assert_eq!(stats.skipped_triangles, 0, "{seed}");
            counts.push(light_count(&scene));
            // the share of the next event estimates at what is seen that are not zero: a panel's back, a spot's outside and
            // what is behind a wall are
            let mut walks = Walks::new(&scene);
            let vertices: Vec<_> =
                (0..4000).filter_map(|_| Some(walks.camera_ray()).and_then(|r| walks.trace(&r))).collect();
            let lit = vertices.iter().filter(|vertex| walks.light_arrives(vertex)).count();
            let share = lit as f64 / vertices.len() as f64;
            println!(
                "hall-{seed}: {} lights, {} triangles, lit {share:.2}",
                counts[seed as usize - 1],
                stats.triangles
            );
            assert!((0.2..0.9).contains(&share), "{seed}: {share}");
        }
        assert!(counts.iter().all(|count| (60..960).contains(count)), "{counts:?}");
        let octaves: std::collections::BTreeSet<u32> =
            counts.iter().map(|count| (*count as u32 / 60).ilog2()).collect();
        assert_eq!(octaves.len(), 4, "{counts:?}");
    }

    #[test]
    fn a_seed_is_one_hall_and_another_seed_another() {
        let [a, b, c] = [9, 9, 10].map(|seed| Scene { name: String::new(), ..scene(seed) });
        let positions = |scene: &Scene| scene.meshes.iter().flat_map(|mesh| mesh.positions.clone()).collect::<Vec<_>>();
        assert!(positions(&a) == positions(&b) && a.materials == b.materials && a.lights == b.lights);
        assert!(a.materials != c.materials);
    }
}
