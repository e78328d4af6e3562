//! The part of light that surfaces give back, which is known without noise.

use crate::bsdf::Material;
use crate::camera::{about_pixel, camera_ray};
use crate::geometry::Ray;
use crate::layout::CameraParams;
use crate::num;
use crate::rng::{Rng, Sampler};
use crate::scene::{Surface, Trace};
use crate::transport::Vertex;
use crate::vec::{self, max_component};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Means over the camera rays of a pixel; of those that meet nothing all but the last is zero.
#[derive(Clone, Copy, Debug)]
pub struct Means {
    /// Colour of the surface in [0, 1], without light: of metal, of the diffuse part, and of what passes through it.
    pub albedo: Vec3,
    /// Shading normal, on the side of the camera.
    pub normal: Vec3,
    /// The part of a collision behind the surface that is scattered.
    pub scattering: Vec3,
    /// What polish gives back of light along the normal, of what is no metal, in [0, 1].
    pub polish: f32,
    /// How many of the rays meet a lamp or nothing.
    pub lights: u32,
}

/// Which camera rays of a pixel are averaged over.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// The camera.
    pub camera: &'a CameraParams,
    /// Rays are spread over the pixel.
    pub jitter: bool,
    /// They are spread about it by the Blackman-Harris filter.
    pub wide: bool,
    /// How random numbers of the picture are spread.
    pub sampler: Sampler,
    /// Seed of the picture.
    pub seed: u32,
    /// Index of the first sample.
    pub first: u32,
    /// How many there are; not zero.
    pub count: u32,
}

impl Samples<'_> {
    /// The ray of a sample of the pixel (x, y), counted from the first one.
    #[inline(always)]
    pub(super) fn ray(&self, features: u32, sample: u32, [x, y]: [u32; 2]) -> Ray {
        let rng = Rng::new(x, y, self.first.wrapping_add(sample), self.seed, self.sampler);
        let place = |u| if self.wide { about_pixel(u) } else { u };
        camera_ray(self.camera, self.jitter, place, features, &rng, x, y)
    }
}

/// The means over samples of a pixel.
#[inline(always)]
pub fn means<S: Trace + Surface<Material = Material>>(scene: &S, samples: &Samples<'_>, at: [u32; 2]) -> Means {
    let features = scene.features();
    let mut sums = Means { albedo: Vec3::ZERO, normal: Vec3::ZERO, scattering: Vec3::ZERO, polish: 0.0, lights: 0 };
    let mut sample = 0;
    while sample < samples.count {
        let ray = samples.ray(features, sample, at);
        let hit = scene.closest(&ray);
        if hit.is_hit() {
            let point = scene.surface(&ray, &hit);
            sums.albedo += albedo(&point.material);
            sums.polish += polish(&point.material);
            sums.normal += Vertex::new(&point, &ray, features).frame.n;
            sums.scattering += scene.interior(&hit).albedo;
            sums.lights += u32::from(max_component(point.emission) > 0.0);
        } else {
            sums.lights += 1;
        }
        sample += 1;
    }
    let Means { albedo, normal, scattering, polish, lights } = sums;
    let scale = num::recip(samples.count as f32);
    Means {
        albedo: albedo * scale,
        normal: normal * scale,
        scattering: scattering * scale,
        polish: polish * scale,
        lights,
    }
}

/// The colour that all parts of a material have, as far as it is one.
#[inline(always)]
fn albedo(material: &Material) -> Vec3 {
    let through = (1.0 - material.metallic) * (1.0 - material.transmission) * material.diffuse_transmission;
    let color = material.base_color * (1.0 - through) + material.diffuse_transmission_color * through;
    vec::min(vec::max(color, Vec3::ZERO), Vec3::ONE)
}

/// See [`Means::polish`].
#[inline(always)]
fn polish(material: &Material) -> f32 {
    let root = num::div(material.ior - 1.0, material.ior + 1.0);
    root * root * material.specular * (1.0 - material.metallic)
}

impl Means {
    /// Under a surface light is given back by what scatters there, too.
    #[inline(always)]
    pub(super) fn reflectance(&self) -> Reflectance {
        let scatters = max_component(self.scattering) > 0.0;
        let color = if scatters { self.albedo * self.scattering } else { self.albedo };
        Reflectance::new(color * (1.0 - self.polish) + Vec3::splat(self.polish))
    }
}

/// No reflectance is less, so that light over it has a size.
const LEAST: f32 = 1.0 / 512.0;
/// Roots of reflectances are rounded to 11, 11 and 10 bits.
const STEPS: [f32; 3] = [2047.0, 2047.0, 1023.0];

/// What light is divided by before it is averaged, and multiplied by afterwards, by channel, in 32 bits. Both use the rounded one, so that it
/// does not matter that it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Reflectance(u32);

impl Reflectance {
    /// By channel, in [0, 1].
    #[inline(always)]
    pub fn new(part: Vec3) -> Self {
        let code = |part: f32, steps: f32| num::nearest(num::sqrt(num::clamp(part, LEAST, 1.0)) * steps) as u32;
        Self(code(part.x, STEPS[0]) | code(part.y, STEPS[1]) << 11 | code(part.z, STEPS[2]) << 22)
    }

    /// By channel; not zero, unless it is the default, of a pixel that sees nothing.
    #[inline(always)]
    pub fn channels(self) -> Vec3 {
        let square = |code: u32, steps: f32| {
            let root = code as f32 * num::recip(steps);
            root * root
        };
        let Self(word) = self;
        Vec3::new(square(word & 0x7ff, STEPS[0]), square(word >> 11 & 0x7ff, STEPS[1]), square(word >> 22, STEPS[2]))
    }
}
