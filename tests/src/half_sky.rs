//! Bodies of one medium under half a white sky: from above they show what they reflect, from below what they let through.

use restir_host::Error;
use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Camera, Environment, Material, Mesh, Scene, Volume};
use restir_host::technique::Technique;
use restir_host::technique::path::PathSettings;
use restir_shared::glam::DVec3;

/// The colour of the medium whose collisions scatter `albedo`: van de Hulst's formula.
pub fn color(albedo: f64) -> f32 {
    let s = (1.0 - albedo).sqrt();
    ((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)) as f32
}

/// What enters and leaves by Lambert's law.
pub fn waxy(color: [f32; 3], mean_free_path: [f32; 3]) -> Material {
    let volume = Some(Volume::scattering(color, mean_free_path, 0.0));
    Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("medium", [1.0; 3]) }
}

/// The same without colour.
pub fn gray(albedo: f64, mean_free_path: f64) -> Material {
    waxy([color(albedo); 3], [mean_free_path as f32; 3])
}

/// Bodies under a sky that is white above the horizon and of brightness `below` under it.
///
/// # Panics
/// If the meshes make no scene.
pub fn scene(bodies: Vec<(Material, Mesh)>, from: [f64; 3], at: [f64; 3], below: f32) -> SceneBuffers {
    const ROWS: u32 = 256;
    let camera = Camera::pinhole(DVec3::from(from), DVec3::from(at), DVec3::Z, 40.0_f64.to_radians());
    let mut scene = Scene { name: "bodies".to_owned(), camera: Some(camera), ..Scene::default() };
    let row = |row: u32| [[if 2 * row < ROWS { 1.0 } else { below }; 3]; 4];
    let sky: Vec<[f32; 3]> = (0..ROWS).flat_map(row).collect();
    scene.environment =
        Some(Environment { name: "above".into(), size: [4, ROWS], pixels: sky.into(), scale: 1.0, rotation: 0.0 });
    for (material, mesh) in bodies {
        let material = scene.add_material(material);
        scene.add_mesh("body", material, mesh);
    }
    SceneBuffers::build(&scene).expect("builds")
}

/// A wide slab, seen from above or below.
pub fn slab(material: Material, depth: f64, above: bool) -> SceneBuffers {
    let corner = DVec3::new(150.0, 0.0, 150.0);
    let mesh = Mesh::cuboid(-corner - DVec3::Y * depth, corner);
    let (height, at) = if above { (6.0, 0.0) } else { (-6.0 - depth, -depth) };
    scene(vec![(material, mesh)], [0.0, height, 0.0], [0.3, at, 0.1], 0.0)
}

/// The whole of a body, seen from above or below.
pub fn body(material: Material, mesh: Mesh, above: bool) -> SceneBuffers {
    let [low, high] = bounds(&mesh);
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let from = middle + DVec3::Y * if above { 3.0 * radius } else { -3.0 * radius };
    scene(vec![(material, mesh)], from.to_array(), middle.to_array(), 0.0)
}

/// The part of the picture in which there is a body.
///
/// # Errors
/// If the scene cannot be rendered.
pub fn covered(scene: &SceneBuffers) -> Result<f64, Error> {
    let integral = PathSettings::default().integral();
    let shot = Shot { scene, frame: 0.0, camera: &|_| scene.camera, size: [128, 128], seed: 0, integral, samples: 1 };
    let ids = shot.channels(&[Aov::Id])?;
    let seen = ids[0].values.iter().filter(|&&id| id > 0.0).count();
    Ok(seen as f64 / ids[0].values.len() as f64)
}

/// The corners of a mesh's bounds.
pub fn bounds(mesh: &Mesh) -> [DVec3; 2] {
    let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    mesh.triangles().flatten().fold(start, |[low, high], corner| [low.min(corner), high.max(corner)])
}
