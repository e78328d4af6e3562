//! A wall lit through panes of coloured glass, and its light by integration in `f64` that shares no code with the kernels.

use crate::random::SplitMix;
use crate::scenes::{Quad, Setting, matte, quad};
use crate::stats::{Moments, TileGrid};
use glam::DVec3;
use restir_host::scene::{Light, LightKind, Material, Mesh, Scene};
use std::f64::consts::PI;

/// Reflectance of the wall.
pub(crate) const WALL: f32 = 0.7;
/// Camera's distance from the wall, and half the side of what it sees of it.
pub(crate) const EYE: f32 = 0.25;
pub(crate) const SEEN: f64 = 1.0;
/// Half the side of a light.
const HALF: f32 = 0.15;
const LIGHT_HEIGHT: f32 = 1.6;

/// A rectangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) corner: [f64; 3],
    pub(crate) sides: [[f64; 3]; 2],
}

/// A sheet of smooth glass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pane {
    rectangle: Rectangle,
    color: [f32; 3],
    ior: f32,
}

/// The panes overlap before a part of the wall, and leave another one free; the second is tilted.
pub(crate) const PANES: [Pane; 2] = [
    Pane {
        rectangle: Rectangle { corner: [-1.5, -1.5, 0.45], sides: [[1.7, 0.0, 0.0], [0.0, 3.0, 0.0]] },
        color: [0.9, 0.5, 0.2],
        ior: 1.5,
    },
    Pane {
        rectangle: Rectangle { corner: [-0.3, -1.5, 0.55], sides: [[1.8, 0.0, 0.2], [0.0, 1.3, 0.0]] },
        color: [0.3, 0.6, 0.95],
        ior: 1.33,
    },
];
/// What lets nothing through.
pub(crate) const BOARD: Rectangle = Rectangle { corner: [-0.15, -0.3, 0.9], sides: [[0.5, 0.0, 0.0], [0.0, 0.4, 0.0]] };
/// Middle and colour of the lights.
const LIGHTS: [([f32; 2], [f32; 3]); 4] = [
    ([-0.6, -0.5], [40.0, 8.0, 8.0]),
    ([0.6, -0.5], [8.0, 40.0, 8.0]),
    ([0.6, 0.5], [8.0, 8.0, 40.0]),
    ([-0.6, 0.5], [30.0, 30.0, 10.0]),
];

/// A wall under four lights behind panes of coloured glass and a board. The camera stands before the panes and sees nothing
/// but the wall.
#[derive(Clone, Copy, Debug)]
pub struct Panes {
    /// The lights have colours; otherwise they are white.
    pub coloured: bool,
    /// How many panes there are, at most two.
    pub count: usize,
}

impl Panes {
    /// As a user would write it.
    pub fn scene(self) -> Scene {
        let mut quads = vec![wall(), board()];
        let mut materials = vec![matte([WALL; 3]), matte([0.0; 3])];
        for (i, ([x, y], _)) in LIGHTS.into_iter().enumerate() {
            let corner = |across: f32, along: f32| [x + HALF * across, y + HALF * along, LIGHT_HEIGHT];
            // they face the wall
            quads.push(quad(2 + i, [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)]));
            materials.push(Material::emitter("", [0.0; 3], self.emission(i)));
        }
        let mut scene = before_wall(quads, materials);
        PANES[..self.count].iter().for_each(|pane| add_pane(&mut scene, pane));
        scene
    }

    /// Moments of the wall's radiance over images of one random point on a light a pixel.
    pub fn reference(self, grid: TileGrid, images: u32) -> Vec<Moments> {
        let area = (2.0 * f64::from(HALF)).powi(2) * LIGHTS.len() as f64;
        grid.moments(images, |image, x, y| {
            let mut random = SplitMix::new(u64::from((image * grid.height + y) * grid.width + x));
            let place = |index: u32, size: u32| SEEN * (2.0 * (f64::from(index) + 0.5) / f64::from(size) - 1.0);
            let wall = DVec3::new(place(x, grid.width), -place(y, grid.height), 0.0);
            let light = random.below(LIGHTS.len());
            let mut on_light = |middle: f32| f64::from(middle) + f64::from(HALF) * random.range(-1.0, 1.0);
            let point = DVec3::new(on_light(LIGHTS[light].0[0]), on_light(LIGHTS[light].0[1]), f64::from(LIGHT_HEIGHT));
            let way = point - wall;
            // both surfaces are parallel
            let cos = way.normalize().z;
            let factor = f64::from(WALL) / PI * cos * cos / way.length_squared() * area;
            let through = self.transmittance(wall, point);
            std::array::from_fn(|k| factor * f64::from(self.emission(light)[k]) * through[k])
        })
    }

    fn emission(self, light: usize) -> [f32; 3] {
        if self.coloured { LIGHTS[light].1 } else { [10.0 + 10.0 * light as f32; 3] }
    }

    pub(crate) fn transmittance(self, from: DVec3, to: DVec3) -> [f64; 3] {
        if BOARD.crossed(from, to).is_some() {
            return [0.0; 3];
        }
        PANES[..self.count].iter().fold([1.0; 3], |through, pane| match pane.rectangle.crossed(from, to) {
            Some(cos) => {
                let passed = 1.0 - reflectance(cos, f64::from(pane.ior));
                std::array::from_fn(|k| through[k] * f64::from(pane.color[k]) * passed)
            }
            None => through,
        })
    }
}

pub(crate) fn wall() -> Quad {
    quad(0, [[-1.2, -1.2, 0.0], [1.2, -1.2, 0.0], [1.2, 1.2, 0.0], [-1.2, 1.2, 0.0]])
}

pub(crate) fn before_wall(quads: Vec<Quad>, materials: Vec<Material>) -> Scene {
    let half_height = SEEN as f32 / EYE;
    let eye = [0.0, 0.0, EYE];
    Setting { name: "panes", quads, materials, eye, half_height, size: [16, 16], max_depth: 3 }.scene()
}

pub(crate) fn board() -> Quad {
    let Rectangle { corner, sides: [across, along] } = BOARD;
    let at = |u: f64, v: f64| std::array::from_fn(|k| (corner[k] + u * across[k] + v * along[k]) as f32);
    quad(1, [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)])
}

pub(crate) fn add_pane(scene: &mut Scene, pane: &Pane) {
    let glass = scene.add_material(Material {
        roughness: 0.0,
        ior: pane.ior,
        transmission: 1.0,
        ..Material::diffuse("pane", pane.color)
    });
    let Rectangle { corner, sides } = pane.rectangle;
    scene.add_mesh("pane", glass, Mesh::quad(corner.into(), sides.map(DVec3::from)));
}

/// A wall under a point light behind a stack of panes, each with the colour and the index of the first of [`Panes`].
pub fn stack(count: u32) -> Scene {
    let mut scene = before_wall(vec![wall()], vec![matte([WALL; 3])]);
    let kind = LightKind::Point { position: DVec3::new(0.0, 0.0, f64::from(LIGHT_HEIGHT)) };
    scene.lights = vec![Light { name: "lamp".to_owned(), intensity: [1.0; 3], kind }];
    for i in 0..count {
        let sides = [[3.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        let rectangle = Rectangle { corner: [-1.5, -1.5, 0.4 + 0.05 * f64::from(i)], sides };
        add_pane(&mut scene, &Pane { rectangle, ..PANES[0] });
    }
    scene
}

impl Rectangle {
    fn normal(&self) -> DVec3 {
        let [u, v] = self.sides.map(DVec3::from);
        u.cross(v).normalize()
    }

    /// The point of the unit square along its sides.
    pub(crate) fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let [along, across] = self.sides.map(DVec3::from);
        DVec3::from(self.corner) + along * u + across * v
    }

    /// The cosine at which the segment passes it, if it does.
    pub(crate) fn crossed(&self, from: DVec3, to: DVec3) -> Option<f64> {
        self.place(from, to).map(|_| self.normal().dot((to - from).normalize()).abs())
    }

    /// Where along its sides the segment passes it, if it does.
    pub(crate) fn place(&self, from: DVec3, to: DVec3) -> Option<[f64; 2]> {
        let (normal, way) = (self.normal(), to - from);
        let t = normal.dot(DVec3::from(self.corner) - from) / normal.dot(way);
        let at = from + way * t - DVec3::from(self.corner);
        let place = self.sides.map(|side| at.dot(side.into()) / DVec3::from(side).length_squared());
        let inside = place.iter().all(|x| (0.0..=1.0).contains(x));
        (t > 0.0 && t < 1.0 && inside).then_some(place)
    }
}

/// Fresnel's reflectance of unpolarised light, from Snell's law.
fn reflectance(cos: f64, index: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos * cos) / (index * index)).sqrt();
    let across = (cos - index * cos_t) / (cos + index * cos_t);
    let along = (cos_t - index * cos) / (cos_t + index * cos);
    0.5 * (across * across + along * along)
}

/// What passes straight through the first pane at normal incidence, by channel.
pub fn through_first() -> [f64; 3] {
    PANES[0].color.map(|color| f64::from(color) * (1.0 - reflectance(1.0, f64::from(PANES[0].ior))))
}
