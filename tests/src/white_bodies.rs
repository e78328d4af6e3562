//! White bodies under a white sky, which nobody can see: what is darker than the sky was lost on the way.

use crate::stats::Moments;

use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::{Camera, Environment, Material, Mesh, Scene, Volume};
use restir_host::technique::path::PathSettings;
use restir_shared::glam::DVec3;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::media::MAX_WALK;

/// Width and height of the pictures in pixels.
pub const SIZE: u32 = 64;

/// What became of walks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lost {
    /// Walks.
    pub walks: u64,
    /// Collisions.
    pub scatterings: u64,
    /// Walks that were too long.
    pub cut: u64,
    /// Walks that came back from outside.
    pub leaked: u64,
    /// Samples that found no light at all.
    pub lost: u64,
    /// Radiance of all samples; that of the sky is 1.
    pub radiance: Moments,
}

impl Lost {
    /// Of both.
    #[must_use]
    pub fn merge(self, other: Self) -> Self {
        Self {
            walks: self.walks + other.walks,
            scatterings: self.scatterings + other.scatterings,
            cut: self.cut + other.cut,
            leaked: self.leaked + other.leaked,
            lost: self.lost + other.lost,
            radiance: self.radiance.merge(other.radiance),
        }
    }
}

/// How light passes the surface of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Border {
    /// By Lambert's law.
    Lambert,
    /// As that of a smooth dielectric of an index above 1.
    Dielectric(f32),
    /// Straight.
    Clear,
}

/// A mesh of a white medium, of a mean free path, that fills the picture. What is around scatters nothing.
pub fn scene(mesh: Mesh, mean_free_path: f32, border: Border) -> Result<SceneBuffers, Error> {
    let volume = Some(Volume::scattering([1.0; 3], [mean_free_path; 3], 0.2));
    let white = Material { volume, ..Material::diffuse("white", [1.0; 3]) };
    let glass = |ior| Material { transmission: 1.0, roughness: 0.0, ior, ..white.clone() };
    let material = match border {
        Border::Lambert => Material { diffuse_transmission: 1.0, ..white },
        Border::Dielectric(ior) => glass(ior),
        Border::Clear => glass(1.0),
    };
    let (lo, hi) = mesh
        .positions
        .iter()
        .map(|p| DVec3::from(p.map(f64::from)))
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi): (DVec3, DVec3), p| (lo.min(p), hi.max(p)));
    let (centre, reach) = (0.5 * (lo + hi), (hi - lo).length());
    let camera = Camera::pinhole(centre + DVec3::new(1.1, 0.6, 0.9) * reach, centre, DVec3::Y, 0.5);
    let mut scene = Scene { name: "white body".into(), camera: Some(camera), ..Scene::default() };
    let pixels = vec![[1.0; 3]; 2].into();
    scene.environment = Some(Environment { name: "white".into(), size: [2, 1], pixels, scale: 1.0, rotation: 0.0 });
    let material = scene.add_material(material);
    scene.add_mesh("body", material, mesh);
    SceneBuffers::build(&scene)
}

/// Renders pictures of one sample a pixel.
///
/// # Errors
/// As of renders.
pub fn lost(scene: &SceneBuffers, pictures: u32, seed: u32) -> Result<Lost, Error> {
    let settings = PathSettings {
        max_depth: 256,
        sampler: Sampler::Independent,
        longest_walk: MAX_WALK,
        ..PathSettings::default()
    };
    let mut sum = Lost::default();
    for picture in 0..pictures {
        let render = Render { count: 1, seed: seed + picture, ..Render::new([SIZE; 2], settings.clone()) };
        let rendered = render.render(scene, &mut CpuExecutor::inline())?;
        let count = |name: &str| rendered.counts.iter().find(|(of, _)| *of == name).map_or(0, |(_, count)| *count);
        sum.walks += count("walks");
        sum.scatterings += count("scatterings");
        sum.cut += count("cut_walks");
        sum.leaked += count("leaked_walks");
        sum.lost += rendered.image.pixels.iter().filter(|pixel| pixel[1] <= 0.0).count() as u64;
        let green: Moments = rendered.image.pixels.iter().map(|pixel| f64::from(pixel[1])).collect();
        sum.radiance = sum.radiance.merge(green);
    }
    Ok(sum)
}
