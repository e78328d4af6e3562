//! Pictures of profiles of any length: a sphere under a white sky, of which the light that comes back is known.

use super::Effort;
use super::comparison::{BIAS, FAMILY_RATE, SIZE, pictures};
use crate::stats::{Moments, sidak, two_sided_threshold};
use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::scene::{Camera, Environment, Material, Mesh, Scene, Volume};
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_shared::diffusion::{REACH, Shape, TAIL, diffuse_albedo};
use restir_shared::medium::Medium;
use std::fmt;

/// Lengths of profiles in radii of the sphere.
const LENGTHS: [f64; 9] = [1.0e-5, 1.0e-4, 1.0e-3, 1.0e-2, 0.1, 1.0, 10.0, 100.0, 1.0e3];
const REDUCED: [f64; 3] = [1.0e-5, 0.1, 1.0e3];
/// Longer ones have to be finite and no more: nearly all of their segments miss the sphere.
const LONGEST: f64 = 10.0;
/// Shorter ones are Lambertian: a mean free path is less than eight offsets of rays, which are 2^-18 of a coordinate.
const SHORTEST: f64 = 3.0e-5;
const COLOR: f32 = 0.8;
const SAMPLES: u32 = 64;

/// The middle of a sphere's picture.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// The length `d` of the profile.
    pub length: f64,
    /// The radiance that is known.
    pub expected: f64,
    /// The radiance of samples.
    pub found: Moments,
    /// Samples that were dropped or are no finite numbers, also of the hybrid.
    pub broken: u64,
}

impl Tile {
    fn new(length: f64, restarts: u32) -> Self {
        let buffers = SceneBuffers::build(&scene(length)).expect("the scene is valid");
        let shown = |subsurface, restarts| {
            let settings = PathSettings { subsurface, max_depth: 3, ..PathSettings::default() };
            pictures(&buffers, &Render { count: SAMPLES, ..Render::new(SIZE, settings) }, restarts)
        };
        let (shown_alone, broken) = shown(Subsurface::Diffusion, restarts);
        let (_, of_hybrid) = shown(Subsurface::Hybrid, restarts.div_ceil(8));
        let mut found = Moments::default();
        for picture in &shown_alone {
            found.push(picture.iter().map(|pixel| pixel[1]).sum::<f64>() / picture.len() as f64);
        }
        Self { length, expected: expected(length), found, broken: broken + of_hybrid }
    }

    /// The difference, relative to what is known.
    fn difference(&self) -> f64 {
        self.found.mean() / self.expected - 1.0
    }

    /// The largest that it may be.
    fn bound(&self) -> f64 {
        let reach = two_sided_threshold(sidak(FAMILY_RATE, LENGTHS.len()));
        self.difference().abs() + reach * self.found.standard_error() / self.expected
    }

    /// Whether nothing but that no sample is lost is asked of it.
    pub fn is_too_long(&self) -> bool {
        self.length > LONGEST
    }

    /// Whether no sample is lost, and the bias of profiles that are not too long is known to be below [`BIAS`].
    pub fn passed(&self) -> bool {
        self.broken == 0 && (self.is_too_long() || self.bound() <= BIAS)
    }
}

impl fmt::Display for Tile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, allowed) = (self.found.parts()[0] as u64 * u64::from(SAMPLES) * u64::from(SIZE[0] * SIZE[1]), BIAS);
        let allowed = if self.is_too_long() { "finite".to_owned() } else { format!("{allowed:.0e}") };
        let (difference, bound) = (self.difference(), self.bound());
        write!(
            f,
            "| {:e} | {count} | {:.5} | {difference:+.1e} | {bound:.1e} | {allowed} |",
            self.length, self.expected
        )?;
        write!(f, " {} |", self.broken)
    }
}

/// Renders a sphere for each length.
///
/// # Panics
/// If the host refuses a scene.
pub fn run(effort: Effort) -> Vec<Tile> {
    match effort {
        Effort::Reduced => REDUCED.map(|length| Tile::new(length, 16)).to_vec(),
        // of the longest that is judged nine segments of ten miss the sphere
        Effort::Full => LENGTHS.map(|length| Tile::new(length, if length == LONGEST { 2048 } else { 256 })).to_vec(),
    }
}

/// What a half space of the medium reflects, by the fit.
fn albedo(medium: &Medium) -> f32 {
    diffuse_albedo(medium.albedo.x, medium.absorbed.x, medium.anisotropy)
}

fn medium() -> Medium {
    Medium::of_color(glam::Vec3::splat(COLOR), glam::Vec3::ONE, 0.0)
}

/// The area of a sphere within a chord c is pi c^2, so that all of a profile counts up to the diameter.
fn expected(length: f64) -> f64 {
    if length < SHORTEST {
        return f64::from(COLOR);
    }
    let x = 2.0 / length;
    let far = if x < f64::from(REACH) { 0.25 * (-x).exp() + 0.75 * (-x / 3.0).exp() } else { f64::from(TAIL) };
    f64::from(albedo(&medium())) * (1.0 - far)
}

fn scene(length: f64) -> Scene {
    let mean_free_path = length as f32 * Shape::Diffuse.factor(albedo(&medium()));
    let camera = Camera::pinhole(DVec3::new(1.5, 1.0, 3.0), DVec3::ZERO, DVec3::Y, 0.06);
    let mut scene = Scene { name: "sphere".to_owned(), camera: Some(camera), ..Scene::default() };
    let pixels = vec![[1.0; 3]; 2].into();
    scene.environment = Some(Environment { name: "white".into(), size: [2, 1], pixels, scale: 1.0, rotation: 0.0 });
    let volume = Some(Volume::scattering([COLOR; 3], [mean_free_path; 3], 0.0));
    let waxy = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("medium", [1.0; 3]) };
    let waxy = scene.add_material(waxy);
    scene.add_mesh("sphere", waxy, Mesh::sphere(DVec3::ZERO, 1.0, 6));
    scene
}

/// The tiles as a section of a Markdown document.
pub fn markdown(tiles: &[Tile]) -> String {
    let mut text = format!(
        "\n## Diffusion profiles\n
A sphere of radius 1 and colour {COLOR} under a white sky, by `subsurface=diffusion`: the mean of {} x {} pixels of its middle beside what is
known, `A (1 - u(2 / d))` with `u` the part of a profile that comes out beyond a distance; profiles shorter than {SHORTEST:e} are
Lambertian in the medium's colour. The bound is too low with probability {FAMILY_RATE}. Of profiles longer than {LONGEST} nearly all
segments miss the sphere: their samples are finite. The last column counts those of `subsurface=hybrid`, too.\n
| d | samples | known | difference | bound | allowed | dropped or not finite |\n|---|---:|---:|---:|---:|---:|---:|\n",
        SIZE[0], SIZE[1]
    );
    text.extend(tiles.iter().map(|tile| format!("{tile}\n")));
    text
}
