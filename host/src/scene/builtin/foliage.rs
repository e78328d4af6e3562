//! A terrace under a pergola of leaves, with a veil and a paper lantern: leaves and the lantern's pattern are masks, the veil is
//! blended.

use std::f64::consts::TAU;

use glam::DVec3;

use super::parts::{ground, sky, stage};
use super::random::Random;
use crate::scene::{AlphaMode, Filter, Material, Mesh, Scene, Texels, Texture, TextureUse, Wrap};

// Lengths are in metres.

/// Texels along a side of the leaves' texture, and how many leaves are on it.
const LEAF_TEXELS: u32 = 256;
const LEAVES: usize = 150;
/// Half the length and half the width of a leaf, in parts of the texture.
const LEAF: [f64; 2] = [0.075, 0.03];
/// Sheets of leaves overhead.
const SHEETS: usize = 34;

pub(super) fn scene() -> Scene {
    let mut scene = stage("foliage", [DVec3::new(1.2, 1.5, 5.6), DVec3::new(-0.1, 1.25, 0.0)], 38.0, [640, 480]);
    let dim = |direction: DVec3| [0.09, 0.12, 0.17].map(|channel| (channel * (1.0 + direction.y)) as f32);
    scene.environment = Some(sky("evening", [32, 16], dim));
    scene.add_sphere_light(DVec3::new(5.0, 9.0, 4.0), 0.15, [3200.0, 2600.0, 1800.0]);
    let stone = scene.add_material(Material::diffuse("stone", [0.5, 0.44, 0.38]));
    scene.add_mesh("terrace", stone, ground(14.0));
    let plaster = scene.add_material(Material::diffuse("plaster", [0.6, 0.54, 0.48]));
    let wall = Mesh::quad(DVec3::new(-4.0, 0.0, -1.6), [DVec3::X * 8.0, DVec3::Y * 3.2]);
    scene.add_mesh("wall", plaster, wall);
    add_leaves(&mut scene);
    add_veil(&mut scene);
    add_lantern(&mut scene);
    scene
}

/// Adds a square texture from its texels, row by row.
fn add_texture(scene: &mut Scene, name: &str, side: u32, filter: Filter, texel: impl Fn(u32, u32) -> [u8; 4]) -> usize {
    let texels: Texels = (0..side * side).map(|i| texel(i % side, i / side)).collect();
    scene.textures.push(Texture { name: name.to_owned(), size: [side; 2], texels, wrap: [Wrap::Repeat; 2], filter });
    scene.textures.len() - 1
}

fn masked(material: Material, texture: usize) -> Material {
    let base_color_texture = Some(TextureUse::new(texture));
    Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, base_color_texture, ..material }
}

/// Sheets of leaves at random over the terrace, and a hedge before the wall.
fn add_leaves(scene: &mut Scene) {
    let random = &mut Random::new(5);
    let leaves: Vec<[f64; 4]> =
        (0..LEAVES).map(|_| [random.unit(), random.unit(), random.range(0.0, TAU), random.range(0.5, 1.0)]).collect();
    let texel = |column: u32, row: u32| {
        let at = [column, row].map(|index| (f64::from(index) + 0.5) / f64::from(LEAF_TEXELS));
        let shade = leaves.iter().find(|leaf| covers(leaf, at)).map(|leaf| leaf[3]);
        let [r, g, b] = [70.0, 125.0, 48.0].map(|code: f64| (code * shade.unwrap_or(0.75)) as u8);
        [r, g, b, if shade.is_some() { 255 } else { 0 }]
    };
    let texture = add_texture(scene, "leaves", LEAF_TEXELS, Filter::Linear, texel);
    let leaf = Material { diffuse_transmission: 0.3, diffuse_transmission_color: [0.3, 0.5, 0.1], ..white("leaves") };
    let leaf = scene.add_material(masked(leaf, texture));
    let overhead = (0..SHEETS).map(|_| {
        let corner = DVec3::new(random.range(-2.9, 1.9), random.range(2.35, 2.7), random.range(-1.6, 1.5));
        let turn = random.range(0.0, TAU);
        let (sin, cos) = turn.sin_cos();
        let tilt = random.range(-0.25, 0.25);
        Mesh::quad(corner, [DVec3::new(cos, tilt, sin), DVec3::new(-sin, tilt, cos)])
    });
    let sheets: Vec<Mesh> = overhead.collect();
    scene.add_mesh("pergola", leaf, Mesh::union(&sheets));
    let hedge: Vec<Mesh> = (0..12)
        .map(|_| {
            let corner = DVec3::new(random.range(-2.4, 1.4), 0.0, random.range(-1.5, -1.0));
            let depth = random.range(-0.3, 0.3);
            Mesh::quad(corner, [DVec3::new(1.0, 0.0, depth), DVec3::new(0.0, random.range(0.6, 0.95), -0.1)])
        })
        .collect();
    scene.add_mesh("hedge", leaf, Mesh::union(&hedge));
}

/// Whether a leaf lies at a point of the texture, which repeats.
fn covers(&[x, y, turn, _]: &[f64; 4], at: [f64; 2]) -> bool {
    let [dx, dy] = [at[0] - x, at[1] - y].map(|d| d - d.round());
    let (sin, cos) = turn.sin_cos();
    let [along, across] = [dx * cos + dy * sin, dy * cos - dx * sin];
    let taper = 1.0 - (along / LEAF[0]).powi(2);
    taper > 0.0 && across.abs() < LEAF[1] * taper
}

fn white(name: &str) -> Material {
    Material::diffuse(name, [1.0; 3])
}

/// A cloth with stripes, through which part of the light goes.
fn add_veil(scene: &mut Scene) {
    let texel = |column: u32, _| [235, 225, 230, if column % 8 < 2 { 190 } else { 90 }];
    let texture = add_texture(scene, "stripes", 64, Filter::Linear, texel);
    let base_color_texture = Some(TextureUse::new(texture));
    let veil = Material { alpha_mode: AlphaMode::Blend, base_color_texture, ..white("veil") };
    let veil = scene.add_material(veil);
    let edges = [DVec3::new(1.1, 0.0, -0.5), DVec3::Y * 2.1];
    scene.add_mesh("veil", veil, Mesh::quad(DVec3::new(0.75, 0.1, 0.7), edges));
}

/// A cube of glowing paper with a pattern cut out.
fn add_lantern(scene: &mut Scene) {
    let edge = |x: u32| x.is_multiple_of(16) || x % 16 == 15;
    let texel = |column: u32, row: u32| {
        let hole = !edge(column) && !edge(row) && (column / 16 + row / 16).is_multiple_of(2);
        [230, 200, 160, if hole { 0 } else { 255 }]
    };
    let texture = add_texture(scene, "pattern", 64, Filter::Nearest, texel);
    let paper = Material { two_sided_emission: true, ..Material::emitter("paper", [0.6; 3], [1.5, 0.95, 0.45]) };
    let paper = scene.add_material(masked(paper, texture));
    scene.add_mesh("lantern", paper, Mesh::cuboid(DVec3::new(-1.35, 0.0, 0.5), DVec3::new(-0.85, 0.5, 1.0)));
}
