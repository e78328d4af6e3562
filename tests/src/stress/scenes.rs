//! The path tracer at the ends of what scenes have: units of length, roughness, angles of the camera.
//!
//! A picture is compared with that of a plainer scene which has the same expectation. A row passes if the difference of each
//! tile's mean, plus what it may be wrong by, is below [`BIAS`](super::comparison::BIAS).

use super::Effort;
use super::comparison::{Comparison, FAMILY_RATE, GRID, SIZE};
use glam::DVec3;
use restir_host::render::Render;
use restir_host::scene::{
    Camera, Environment, Filter, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, Volume, Wrap,
};
use restir_host::technique::path::PathSettings;

const MAX_DEPTH: u32 = 6;
pub(super) const SCALES: [f64; 4] = [1.0e-4, 1.0e-2, 1.0e3, 1.0e5];
/// Pictures at other scales differ by roundings, so few paths tell; for roughness many are needed.
const REDUCED_SCALES: [f64; 2] = [1.0e-4, 1.0e5];
/// From a rough lobe to the last before a delta, and below.
const ROUGHNESSES: [f32; 4] = [0.02, 0.0101, 0.01, 0.0099];

/// What may change without changing the expectation, or by little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variant {
    /// Lengths in units of the plain scene's.
    pub(super) scale: f64,
    /// Of the metal and the glass.
    pub(super) roughness: f32,
    /// The camera looks along the floor, a thousandth above it.
    pub(super) grazing: bool,
    /// All light, in powers of two of the plain scene's.
    pub(super) exposure: i32,
    /// With a point light, a spot light and a sun.
    pub(super) punctual: bool,
}

pub(super) const PLAIN: Variant = Variant { scale: 1.0, roughness: 0.1, grazing: false, exposure: 0, punctual: true };

/// Runs all comparisons.
///
/// # Panics
/// If the host refuses a scene.
pub fn run(effort: Effort) -> Vec<Comparison> {
    let (paths, scales, roughnesses) = match effort {
        Effort::Reduced => (16, &REDUCED_SCALES[..], &[][..]),
        Effort::Full => (2048, &SCALES[..], &ROUGHNESSES[..]),
    };
    let render = Render { count: 1, ..Render::new(SIZE, path()) };
    let compare = |name, tested, reference| Comparison::new(name, &render, paths, [tested, reference]);
    let along_the_floor = Variant { grazing: true, ..PLAIN };
    let lengths =
        [(PLAIN, ""), (along_the_floor, ", camera along the floor")].into_iter().flat_map(|(plain, camera)| {
            scales
                .iter()
                .map(move |&scale| compare(format!("lengths x {scale:e}{camera}"), Variant { scale, ..plain }, plain))
        });
    // what a mirror makes of a punctual light no path finds, and what a rough metal makes of it is found, if rarely
    let smooth = Variant { roughness: 0.0, punctual: false, ..PLAIN };
    let rough = roughnesses
        .iter()
        .map(|&roughness| compare(format!("roughness {roughness} against 0"), Variant { roughness, ..smooth }, smooth));
    lengths.chain(rough).collect()
}

fn path() -> PathSettings {
    PathSettings { max_depth: MAX_DEPTH, jitter: true, ..PathSettings::default() }
}

/// A room that is open to the viewer, with every kind of light and material.
pub(super) fn scene(variant: Variant) -> Scene {
    let Variant { scale, grazing, exposure, .. } = variant;
    let brightness = 2.0_f64.powi(exposure);
    let (eye, target) = if grazing {
        (DVec3::new(0.05, -0.999, 1.4), DVec3::new(0.0, -0.999, -1.0))
    } else {
        (DVec3::new(0.1, 0.05, 3.6), DVec3::new(0.0, -0.05, 0.0))
    };
    let mut scene = Scene {
        name: "stress".to_owned(),
        camera: Some(Camera::pinhole(eye * scale, target * scale, DVec3::Y, 0.7)),
        textures: vec![checks()],
        lights: if variant.punctual { lights(scale, brightness) } else { Vec::new() },
        environment: Some(Environment { scale: brightness as f32, ..sky() }),
        ..Scene::default()
    };
    add_walls(&mut scene, scale, brightness as f32);
    add_things(&mut scene, variant);
    scene
}

fn add_walls(scene: &mut Scene, scale: f64, brightness: f32) {
    let floor = Material { base_color_texture: Some(TextureUse::new(0)), ..Material::diffuse("floor", [0.9; 3]) };
    let plastic = Material { ior: 1.5, roughness: 0.3, ..Material::diffuse("plastic", [0.6, 0.2, 0.15]) };
    let leaf = Material {
        diffuse_transmission: 0.5,
        diffuse_transmission_color: [0.3, 0.7, 0.2],
        ..Material::diffuse("leaf", [0.2, 0.5, 0.25])
    };
    let [floor, plastic, leaf, white] =
        [floor, plastic, leaf, Material::diffuse("white", [0.7; 3])].map(|material| scene.add_material(material));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let corner = DVec3::splat(-1.0);
    for (name, material, corner, edges) in [
        ("floor", floor, corner, [z, x]),
        ("back", white, corner, [x, y]),
        ("left", plastic, corner, [y, z]),
        ("right", leaf, corner + x, [z, y]),
        ("ceiling", white, corner + y, [x, z]),
    ] {
        scene.add_mesh(name, material, Mesh::quad(corner * scale, edges.map(|edge| edge * scale)));
    }
    let edges = [DVec3::X * 0.6, DVec3::Z * 0.6].map(|edge| edge * scale);
    scene.add_quad_light(DVec3::new(-0.3, 0.95, -0.3) * scale, edges, [5.0, 4.5, 4.0].map(|x| x * brightness), false);
}

fn add_things(scene: &mut Scene, Variant { scale, roughness, .. }: Variant) {
    let metal = Material { metallic: 1.0, roughness, ..Material::diffuse("metal", [0.95, 0.8, 0.5]) };
    let volume = Volume::absorbing([0.5, 0.8, 0.9], (0.5 * scale) as f32);
    let clear = Material { ior: 1.5, transmission: 1.0, ..Material::diffuse("clear", [1.0; 3]) };
    let glass = Material { roughness, volume: Some(volume), ..clear.clone() };
    let pane = Material { roughness: 0.0, ..clear };
    let [metal, glass, pane] = [metal, glass, pane].map(|material| scene.add_material(material));
    let sphere = |x: f64, z: f64| Mesh::sphere(DVec3::new(x, -0.6, z) * scale, 0.35 * scale, 2);
    scene.add_mesh("metal", metal, sphere(-0.45, -0.3));
    scene.add_mesh("glass", glass, sphere(0.45, 0.2));
    let edges = [DVec3::X * 0.8, DVec3::Y * 0.6].map(|edge| edge * scale);
    scene.add_mesh("pane", pane, Mesh::quad(DVec3::new(-0.6, 0.0, 0.4) * scale, edges));
}

/// Intensities grow with the square of lengths, so that irradiance stays.
fn lights(scale: f64, brightness: f64) -> Vec<Light> {
    let light = |name: &str, rgb: [f64; 3], kind| Light {
        name: name.to_owned(),
        intensity: rgb.map(|x| (x * brightness * scale * scale) as f32),
        kind,
    };
    let spot = LightKind::Spot {
        position: DVec3::new(-0.6, 0.8, 0.7) * scale,
        direction: DVec3::new(0.5, -1.0, -0.6),
        inner: 0.2,
        outer: 0.6,
    };
    let sun = LightKind::Directional { direction: DVec3::new(-0.2, -0.4, -1.0) };
    vec![
        light("point", [0.4, 0.5, 0.6], LightKind::Point { position: DVec3::new(0.7, 0.6, 0.3) * scale }),
        light("spot", [2.0, 1.8, 1.5], spot),
        Light { intensity: [0.6, 0.5, 0.4].map(|x| (x * brightness) as f32), ..light("sun", [0.0; 3], sun) },
    ]
}

fn sky() -> Environment {
    let pixel = |i: u32| [0.3 + 0.1 * (i % 8) as f32, 0.6, 0.9 - 0.2 * (i / 8) as f32];
    Environment {
        name: "sky".to_owned(),
        size: [8, 4],
        pixels: (0..32).map(pixel).collect::<Vec<_>>().into(),
        scale: 1.0,
        rotation: 30.0,
    }
}

fn checks() -> Texture {
    let texel = |i: u8| if (i + i / 4).is_multiple_of(2) { [230, 220, 200, 255] } else { [90, 110, 140, 255] };
    Texture {
        name: "checks".to_owned(),
        size: [4, 4],
        texels: (0..16).map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    }
}

/// The comparisons as a section of a Markdown document.
pub fn markdown(comparisons: &[Comparison]) -> String {
    let mut text = format!(
        "\n## Path tracer\n
A room with an area light, a point light, a spot light, a directional light, an environment, plastic, metal, glass with a
volume, a pane, a diffuse transmitter and a texture, {} x {} pixels, paths of {MAX_DEPTH} segments. Each picture is
compared with that of the plain scene (roughness without the three punctual lights) path by path, with the same random numbers: the largest difference of a tile's
mean in a channel, relative to it, and an upper bound on the bias, which is too low with probability {FAMILY_RATE}.\n
| variant | paths a pixel | difference | bound | allowed | dropped or not finite |\n|---|---:|---:|---:|---:|---:|\n",
        GRID.width, GRID.height
    );
    text.extend(comparisons.iter().map(|comparison| format!("{comparison}\n")));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light or material that does not scale along.
    #[test]
    fn a_wrong_scene_fails() {
        let render = Render { count: 1, ..Render::new(SIZE, path()) };
        let [rough, smooth] = [0.3, 0.0].map(|roughness| Variant { roughness, ..PLAIN });
        assert!(!Comparison::new("rough".to_owned(), &render, 64, [rough, smooth]).passed());
    }
}
