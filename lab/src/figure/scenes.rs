//! A scene and a sky that figures need beside the built-in ones.

use restir::scene::{Camera, Environment, Material, Mesh, Scene};
use restir_shared::glam::DVec3;

/// Lights of [`wall`].
const LIGHTS: u32 = 24;
/// Half the side of the wall.
const HALF: f64 = 2.0;
const ALBEDO: f32 = 0.7;

/// A wall, lit past a board by a row of small lights, whose radiance is a function of the place along the row from 0 to
/// 1: hard shadows with narrow penumbras, and each part of the wall sees another part of the row. The wall has vertical
/// stripes of equal width, whose albedos are those of the others times the given factors, in turn.
pub(crate) fn wall(name: &str, stripes: &[f32], radiance: impl Fn(f32) -> [f32; 3]) -> Scene {
    let mut scene = Scene {
        name: name.to_owned(),
        camera: Some(Camera::pinhole(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 2.0 * (1.0_f64 / 3.0).atan())),
        ..Scene::default()
    };
    let width = 2.0 * HALF / stripes.len() as f64;
    for (i, &factor) in stripes.iter().enumerate() {
        let material = scene.add_material(Material::diffuse("wall", [factor * ALBEDO; 3]));
        let corner = DVec3::new(i as f64 * width - HALF, -HALF, 0.0);
        scene.add_mesh("wall", material, Mesh::quad(corner, [DVec3::X * width, DVec3::Y * (2.0 * HALF)]));
    }
    let board = scene.add_material(Material::diffuse("board", [ALBEDO; 3]));
    let edges = [DVec3::X * 0.7, DVec3::Y * 0.4];
    scene.add_mesh("board", board, Mesh::quad(DVec3::new(-0.35, 0.25, 0.45), edges));
    for i in 0..LIGHTS {
        let place = (f64::from(i) + 0.5) / f64::from(LIGHTS);
        let half = [DVec3::X * 0.03, DVec3::new(0.0, -0.6, 0.8) * 0.03];
        let middle = DVec3::new(2.4 * place - 1.2, 1.6, 1.2);
        scene.add_quad_light(middle - half[0] - half[1], half.map(|edge| 2.0 * edge), radiance(place as f32), false);
    }
    scene
}

/// White, for [`wall`].
pub(crate) fn white(_: f32) -> [f32; 3] {
    [40.0; 3]
}

/// From red by way of green to blue, each light with some white in it, for [`wall`].
pub(crate) fn coloured(place: f32) -> [f32; 3] {
    let near = |center: f32| 10.0 + 60.0 * (1.0 - 2.0 * (place - center).abs()).max(0.0);
    [near(0.0), near(0.5), near(1.0)]
}

/// A sky of one radiance.
pub(crate) fn dome(radiance: [f32; 3]) -> Environment {
    Environment { name: "dome".to_owned(), size: [4, 2], pixels: [radiance; 8].into(), scale: 1.0, rotation: 0.0 }
}
