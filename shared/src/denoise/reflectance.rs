//! The part of light that surfaces give back, which is known without noise.

use crate::bsdf::Material;
use crate::camera::camera_ray;
use crate::layout::CameraParams;
use crate::num;
use crate::rng::{Rng, Sampler};
use crate::scene::{Surface, Trace};
use crate::transport::Vertex;
use crate::vec;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Means over the camera rays of a pixel; of those that meet nothing all is zero.
#[derive(Clone, Copy, Debug)]
pub struct Means {
    /// Colour of the surface in [0, 1], without light: of metal, of the diffuse part, and of what passes through it.
    pub albedo: Vec3,
    /// Shading normal, on the side of the camera.
    pub normal: Vec3,
    /// The part of a collision behind the surface that is scattered.
    pub scattering: Vec3,
}

/// Which camera rays of a pixel are averaged over.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// The camera.
    pub camera: &'a CameraParams,
    /// Rays are spread over the pixel.
    pub jitter: bool,
    /// Seed of the picture.
    pub seed: u32,
    /// Index of the first sample.
    pub first: u32,
    /// How many there are; not zero.
    pub count: u32,
}

/// The means over samples of the pixel (x, y), whose camera rays `place` spreads, and which are those of path tracing's defaults.
#[inline(always)]
pub fn means<S: Trace + Surface<Material = Material>>(
    scene: &S,
    samples: &Samples<'_>,
    place: impl Fn(Vec2) -> Vec2,
    [x, y]: [u32; 2],
) -> Means {
    let features = scene.features();
    let mut sums = Means { albedo: Vec3::ZERO, normal: Vec3::ZERO, scattering: Vec3::ZERO };
    let mut sample = 0;
    while sample < samples.count {
        let rng = Rng::new(x, y, samples.first.wrapping_add(sample), samples.seed, Sampler::Sobol);
        let ray = camera_ray(samples.camera, samples.jitter, &place, features, &rng, x, y);
        let hit = scene.closest(&ray);
        if hit.is_hit() {
            let point = scene.surface(&ray, &hit);
            sums.albedo += albedo(&point.material);
            sums.normal += Vertex::new(&point, &ray, features).frame.n;
            sums.scattering += scene.interior(&hit).albedo;
        }
        sample += 1;
    }
    let scale = num::recip(samples.count as f32);
    Means { albedo: sums.albedo * scale, normal: sums.normal * scale, scattering: sums.scattering * scale }
}

/// The colour that all parts of a material have, as far as it is one.
#[inline(always)]
fn albedo(material: &Material) -> Vec3 {
    let through = (1.0 - material.metallic) * (1.0 - material.transmission) * material.diffuse_transmission;
    let color = material.base_color * (1.0 - through) + material.diffuse_transmission_color * through;
    vec::min(vec::max(color, Vec3::ZERO), Vec3::ONE)
}

/// Surfaces give back at least this part, in the polish of a black one.
const LEAST: f32 = 0.04;
/// Roots of reflectances are rounded to 11, 11 and 10 bits.
const STEPS: [f32; 3] = [2047.0, 2047.0, 1023.0];

/// What light is divided by before it is averaged, and multiplied by afterwards, by channel, in 32 bits. Both use the rounded one, so that it
/// does not matter that it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Reflectance(u32);

impl Reflectance {
    /// Of a pixel with these means; under a surface light is given back by what scatters there, too.
    #[inline(always)]
    pub fn new(means: &Means) -> Self {
        let scatters = vec::max_component(means.scattering) > 0.0;
        let color = if scatters { means.albedo * means.scattering } else { means.albedo };
        let part = |channel: f32, steps: f32| {
            let root = num::sqrt(LEAST + (1.0 - LEAST) * num::clamp(channel, 0.0, 1.0));
            num::nearest(root * steps) as u32
        };
        Self(part(color.x, STEPS[0]) | part(color.y, STEPS[1]) << 11 | part(color.z, STEPS[2]) << 22)
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
