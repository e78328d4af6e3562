//! Meshes for tests of intersection.

use crate::random::SplitMix;
use glam::{DAffine3, DVec3};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{AlphaMode, Camera, Filter, Instance, Material, Mesh, Scene, Texture, TextureUse, Wrap};
use std::f64::consts::{PI, TAU};

fn mesh(name: &str, positions: Vec<[f32; 3]>, indices: Vec<[u32; 3]>) -> Mesh {
    Mesh { name: name.to_owned(), positions, indices, ..Mesh::default() }
}

/// Places of a grid, row by row.
fn grid(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..height).flat_map(move |j| (0..width).map(move |i| (i, j)))
}

/// A closed grid of quads over (turn, height): `at(u, v)` with u in [0, 1) around and v in [0, 1] along.
fn lathe(name: &str, around: u32, along: u32, closed: bool, at: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
    let rows = if closed { along } else { along + 1 };
    let vertex = |i: u32, j: u32| (j % rows) * around + i % around;
    let positions = grid(around, rows)
        .map(|(i, j)| at(f64::from(i) / f64::from(around), f64::from(j) / f64::from(along)).map(|x| x as f32))
        .collect();
    let indices = grid(around, along)
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh(name, positions, indices)
}

/// A closed sphere around the origin; its poles are rings of coinciding vertices, whose triangles have no area.
pub fn sphere(radius: f64, around: u32, along: u32) -> Mesh {
    lathe("sphere", around, along, false, |u, v| {
        // the ends of the sine are not exactly zero
        let ring = if v == 0.0 || v == 1.0 { 0.0 } else { (PI * v).sin() };
        let (sin, cos) = (TAU * u).sin_cos();
        [radius * ring * cos, -radius * (PI * v).cos(), radius * ring * sin]
    })
}

/// A closed ring around the y axis.
pub fn torus(major: f64, minor: f64, around: u32, along: u32) -> Mesh {
    lathe("torus", around, along, true, |u, v| {
        let (sin, cos) = (TAU * u).sin_cos();
        let (height, out) = (TAU * v).sin_cos();
        let radius = major + minor * out;
        [radius * cos, minor * height, radius * sin]
    })
}

/// The cube from -`half` to `half`, front sides out, each face a grid of `n` by `n` quads with exact coordinates.
pub fn cube(half: f32, n: u32) -> Mesh {
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    let step = 2.0 * half / n as f32;
    for face in 0..6_usize {
        let (axis, side) = (face / 2, if face % 2 == 0 { -half } else { half });
        let first = positions.len() as u32;
        positions.extend(grid(n + 1, n + 1).map(|(i, j)| {
            let mut p = [side; 3];
            p[(axis + 1) % 3] = i as f32 * step - half;
            p[(axis + 2) % 3] = j as f32 * step - half;
            p
        }));
        indices.extend(grid(n, n).flat_map(|(i, j)| {
            let a = first + j * (n + 1) + i;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] }
        }));
    }
    mesh("cube", positions, indices)
}

/// Unconnected triangles of all sizes, among them tiny ones.
pub fn soup(count: u32, stream: u64) -> Mesh {
    let mut random = SplitMix::new(stream);
    let triangle = |_| {
        let centre = [0; 3].map(|_| random.range(-1.0, 1.0));
        let size = 10.0_f64.powf(random.range(-5.0, 0.0));
        [0; 3].map(|_| centre.map(|x| (x + size * random.range(-1.0, 1.0)) as f32))
    };
    unconnected("soup", (0..count).flat_map(triangle).collect())
}

/// Long triangles a few units in the last place wide, some along an axis.
pub fn slivers(count: u32) -> Mesh {
    let mut random = SplitMix::new(11);
    let triangle = |i| {
        let a = [0; 3].map(|_| random.range(-1.0, 1.0) as f32);
        let mut b = [0; 3].map(|_| random.range(-1.0, 1.0) as f32);
        if i % 4 == 0 {
            (b[1], b[2]) = (a[1], a[2]);
        }
        let t = random.range(0.0, 1.0);
        let width = 10.0_f64.powf(random.range(-7.0, -3.0));
        let c = [0, 1, 2].map(|k| {
            let along = f64::from(a[k]) + t * (f64::from(b[k]) - f64::from(a[k]));
            (along + width * random.range(-1.0, 1.0)) as f32
        });
        [a, b, c]
    };
    unconnected("slivers", (0..count).flat_map(triangle).collect())
}

/// Layers in one plane: every triangle twice, others overlapping them, some turned over.
pub fn stack(layers: u32) -> Mesh {
    let pair = |layer| {
        let z = (layer / 4) as f32 * 0.125;
        let shift = (layer % 2) as f32 * 0.25;
        let mut corners = [[-1.0, -1.0, z], [1.0 + shift, -1.0, z], [shift, 1.0, z]];
        if layer % 3 == 0 {
            corners.reverse();
        }
        [corners; 2].concat()
    };
    unconnected("stack", (0..layers).flat_map(pair).collect())
}

/// The mesh under another name, with each coordinate mapped.
fn mapped(mut mesh: Mesh, name: String, map: impl Fn(f32) -> f32) -> Mesh {
    mesh.positions.as_flattened_mut().iter_mut().for_each(|x| *x = map(*x));
    Mesh { name, ..mesh }
}

/// [`cube`], far from the origin along all axes.
pub fn far_grid(half: f32, n: u32, offset: f32) -> Mesh {
    mapped(cube(half, n), "far grid".to_owned(), |x| x + offset)
}

/// The mesh, scaled about the origin.
pub fn scaled(mesh: Mesh, factor: f32) -> Mesh {
    let name = format!("{} x {factor:e}", mesh.name);
    mapped(mesh, name, |x| x * factor)
}

fn unconnected(name: &str, positions: Vec<[f32; 3]>) -> Mesh {
    let indices = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(name, positions, indices)
}

/// The mesh alone, in the kernels' form.
///
/// # Panics
/// If the host refuses it.
pub fn buffers(mesh: Mesh) -> SceneBuffers {
    alone(mesh, Material::emitter("", [0.5; 3], [1.0; 3]), Vec::new())
}

/// As [`buffers`], with a texture of random alpha that lies at random on the triangles.
///
/// # Panics
/// If the host refuses it.
pub fn with_alpha(mesh: Mesh, alpha_mode: AlphaMode, filter: Filter) -> SceneBuffers {
    let (material, noise) = noisy(alpha_mode, filter);
    alone(with_random_uvs(mesh), material, vec![noise])
}

/// A material of random alpha.
fn noisy(alpha_mode: AlphaMode, filter: Filter) -> (Material, Texture) {
    const SIDE: u32 = 8;
    let mut random = SplitMix::new(17);
    let texels = (0..SIDE * SIDE).map(|_| [255, 255, 255, random.below(256) as u8]).collect();
    let noise =
        Texture { name: "noise".to_owned(), size: [SIDE; 2], texels, wrap: [Wrap::Repeat, Wrap::Mirror], filter };
    let base_color_texture = Some(TextureUse::new(0));
    (Material { alpha_mode, base_color_texture, ..Material::diffuse("", [0.5; 3]) }, noise)
}

fn with_random_uvs(mesh: Mesh) -> Mesh {
    let mut random = SplitMix::new(18);
    let mut place = || random.range(-2.0, 2.0) as f32;
    let uvs = mesh.positions.iter().map(|_| [place(), place()]).collect();
    Mesh { uvs, ..mesh }
}

/// As [`buffers`], of several meshes, each with its group.
///
/// # Panics
/// If the host refuses them.
pub fn together(parts: Vec<(Mesh, Option<u32>)>) -> SceneBuffers {
    placed(parts, Material::diffuse("", [0.5; 3]), Vec::new())
}

/// As [`with_alpha`], of several meshes, each with its group.
///
/// # Panics
/// If the host refuses them.
pub fn together_with_alpha(parts: Vec<(Mesh, Option<u32>)>, alpha_mode: AlphaMode, filter: Filter) -> SceneBuffers {
    let (material, noise) = noisy(alpha_mode, filter);
    let parts = parts.into_iter().map(|(mesh, group)| (with_random_uvs(mesh), group)).collect();
    placed(parts, material, vec![noise])
}

fn alone(mesh: Mesh, material: Material, textures: Vec<Texture>) -> SceneBuffers {
    placed(vec![(mesh, None)], material, textures)
}

fn placed(parts: Vec<(Mesh, Option<u32>)>, material: Material, textures: Vec<Texture>) -> SceneBuffers {
    let name = parts.first().map(|(mesh, _)| mesh.name.clone()).unwrap_or_default();
    let instance = |(index, &(_, group))| Instance { group, ..Instance::new(index, DAffine3::IDENTITY) };
    let scene = Scene {
        name,
        instances: parts.iter().enumerate().map(instance).collect(),
        meshes: parts.into_iter().map(|(mesh, _)| mesh.into()).collect(),
        materials: vec![material],
        textures,
        // no test looks through it; one that frames a huge mesh would be beyond the host's limit
        camera: Some(Camera::pinhole(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0)),
        ..Scene::default()
    };
    SceneBuffers::build(&scene).expect("a test mesh is valid")
}
