//! A scene with masks, and the same one with geometry that is cut along them.

use crate::scenes::matte;
use glam::DVec3;
use restir_host::scene::{
    AlphaMode, Camera, Filter, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, Wrap,
};

/// Texels along a side of the mask.
const SIDE: u32 = 8;
const CUTOFF: f32 = 0.5;

/// Alpha of a texel: a pattern without symmetry.
fn code(column: u32, row: u32) -> u8 {
    if (column * column + 3 * row + column * row / 2) % 5 < 2 { 90 } else { 150 }
}

/// Whether there is a surface at a texel.
fn is_there(column: u32, row: u32) -> bool {
    f32::from(code(column, row)) / 255.0 >= CUTOFF
}

/// How the masks are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// By a texture's alpha.
    Masked,
    /// As geometry that is left out.
    Cut,
}

/// A floor before a wall, a screen that throws its pattern on both, a lattice that shines from both sides, a mirror in which both
/// are seen, and a lamp.
pub fn scene(form: Form) -> Scene {
    let eye = DVec3::new(0.2, 1.1, 3.4);
    let mut scene = Scene {
        name: "masks".to_owned(),
        camera: Some(Camera::pinhole(eye, DVec3::new(0.0, 0.7, 0.0), DVec3::Y, 0.75)),
        default_size: Some([16, 16]),
        ..Scene::default()
    };
    let floor = scene.add_material(matte([0.6, 0.5, 0.4]));
    scene.add_mesh("floor", floor, Mesh::quad(DVec3::new(-2.0, 0.0, -1.5), [DVec3::Z * 4.0, DVec3::X * 4.0]));
    scene.add_mesh("wall", floor, Mesh::quad(DVec3::new(-2.0, 0.0, -1.5), [DVec3::X * 4.0, DVec3::Y * 3.0]));
    let mirror = Material { metallic: 1.0, roughness: 0.0, ior: 1.5, ..matte([0.9; 3]) };
    let mirror = scene.add_material(mirror);
    scene.add_mesh("mirror", mirror, Mesh::quad(DVec3::new(0.7, 0.0, -1.2), [DVec3::new(0.8, 0.0, 0.6), DVec3::Y]));
    let screen = matte([0.3, 0.5, 0.2]);
    let edges = [DVec3::new(1.1, 0.1, -0.3), DVec3::new(0.1, 1.1, 0.2)];
    add(&mut scene, form, screen, (DVec3::new(-0.8, 0.2, 0.3), edges));
    let lattice = Material { two_sided_emission: true, ..Material::emitter("", [0.2; 3], [6.0, 5.0, 3.0]) };
    add(&mut scene, form, lattice, (DVec3::new(-0.2, 1.5, -0.6), [DVec3::X, DVec3::new(0.0, 0.4, 0.8)]));
    let kind = LightKind::Point { position: DVec3::new(-0.9, 1.3, 1.6) };
    scene.lights = vec![Light { name: "lamp".to_owned(), intensity: [2.0, 2.5, 3.0], kind }];
    scene
}

/// A parallelogram under the mask.
fn add(scene: &mut Scene, form: Form, material: Material, (corner, edges): (DVec3, [DVec3; 2])) {
    let texels = (0..SIDE * SIDE).map(|i| [255, 255, 255, code(i % SIDE, i / SIDE)]);
    let (material, mesh) = match form {
        Form::Masked => {
            scene.textures.push(Texture {
                name: "mask".to_owned(),
                size: [SIDE; 2],
                texels: texels.collect(),
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Nearest,
            });
            let base_color_texture = Some(TextureUse::new(scene.textures.len() - 1));
            let alpha_mode = AlphaMode::Mask { cutoff: CUTOFF };
            (Material { alpha_mode, base_color_texture, ..material }, Mesh::quad(corner, edges))
        }
        Form::Cut => {
            let [u, v] = edges.map(|edge| edge / f64::from(SIDE));
            let texel = |i: u32| Mesh::quad(corner + u * f64::from(i % SIDE) + v * f64::from(i / SIDE), [u, v]);
            let there = (0..SIDE * SIDE).filter(|i| is_there(i % SIDE, i / SIDE));
            (material, Mesh::union(&there.map(texel).collect::<Vec<_>>()))
        }
    };
    let material = scene.add_material(material);
    scene.add_mesh("", material, mesh);
}
