//! How diffuse light leaves a body, and how light from outside becomes diffuse in it.

use crate::bsdf::{BsdfSample, DIFFUSE_TRANSMISSION, Dielectric, Evaluation, Material, Scattering, ScatteringFunction};
use crate::geometry::Ray;
use crate::layout::{FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_GLOSSY, FEATURE_TRANSMISSION};
use crate::num;
use crate::rng::{CELLS, unit};
use crate::sampling::{cosine_hemisphere_pdf, invert_cosine_hemisphere, sample_cosine_hemisphere};
use crate::scene::SurfacePoint;
use crate::transport::Vertex;
use glam::{UVec4, Vec2, Vec3};

/// A surface as diffuse light from inside sees it: Lambert's law times the part `1 - F(cos)` that Fresnel's equations let through, over
/// its mean, so that no light is lost which comes to the surface from inside.
///
/// As [`Scattering`] it is asked for the side of the light, +z: the viewer's direction does not matter.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// Colour over the mean of what is let through.
    color: Vec3,
    interface: Dielectric,
    refracts: bool,
}

/// The part of diffuse light from outside that an interface reflects, a polynomial in `x = (n - 1) / (n + 1)`: to 7e-4 for indices up to 10.
#[inline(always)]
fn mean_reflectance(index: f32) -> f32 {
    let x = num::div(index - 1.0, index + 1.0);
    x * (0.569_954 + x * (-1.186_36 + x * (3.962_972 + x * (-4.306_067 + x * 1.984_927))))
}

impl Exit {
    /// The exit through a material in a scene of these features. What is transmitted by any lobe enters: the tint of specular transmission and the colour
    /// of the diffuse one by their shares.
    #[inline(always)]
    pub fn new(material: &Material, features: u32) -> Self {
        let has = |feature: u32| features & feature != 0;
        let specular = has(FEATURE_GLOSSY | FEATURE_DELTA);
        let dielectric = if specular { 1.0 - material.metallic } else { 1.0 };
        let transmission = if has(FEATURE_TRANSMISSION) { material.transmission } else { 0.0 };
        let diffuse = if has(FEATURE_DIFFUSE_TRANSMISSION) {
            material.diffuse_transmission_color * ((1.0 - transmission) * material.diffuse_transmission)
        } else {
            Vec3::ZERO
        };
        let index = if specular { material.ior } else { 1.0 };
        let per_mean = if specular { num::recip(1.0 - mean_reflectance(index)) } else { 1.0 };
        Self {
            color: (diffuse + material.base_color * transmission) * (dielectric * per_mean),
            interface: Dielectric::new(index, num::recip(index), true),
            // of index 1 everything passes, whatever else the scene has: Fresnel's equations give that up to rounding
            refracts: specular & (index != 1.0),
        }
    }

    /// A point of a surface as light from outside becomes diffuse there.
    #[inline(always)]
    pub(crate) fn vertex(point: &SurfacePoint, features: u32) -> Vertex<Self> {
        let SurfacePoint { position, normal, shading_normal, offset, emission, absorption, .. } = *point;
        let material = Self::new(&point.material, features);
        let exit = SurfacePoint { position, normal, shading_normal, offset, material, emission, absorption };
        Vertex::new(&exit, &Ray { direction: -normal, ..Ray::NONE }, features)
    }

    /// The value for light at the cosine `cos`, over Lambert's density.
    #[inline(always)]
    fn worth(&self, cos: f32) -> Vec3 {
        let passed =
            if self.refracts { self.interface.fresnel(cos, self.interface.bent(cos)).transmitted } else { 1.0 };
        self.color * passed
    }
}

impl Scattering for Exit {
    type Bsdf = Self;

    #[inline(always)]
    fn bsdf(&self, _wo: Vec3, _front: bool, _features: u32) -> Self {
        *self
    }
}

impl ScatteringFunction for Exit {
    #[inline(always)]
    fn evaluate(&self, wi: Vec3) -> Evaluation {
        let pdf = cosine_hemisphere_pdf(num::max(wi.z, 0.0));
        Evaluation { value: self.worth(num::max(wi.z, 0.0)) * pdf, pdf }
    }

    #[inline(always)]
    fn sample(&self, words: UVec4) -> BsdfSample {
        let direction = sample_cosine_hemisphere(Vec2::new(unit(words.x), unit(words.y)));
        let pdf = cosine_hemisphere_pdf(direction.z);
        let weight = self.worth(direction.z);
        BsdfSample { direction, weight, pdf, lobe: DIFFUSE_TRANSMISSION, lobe_pdf: pdf, delta: false }
    }

    #[inline(always)]
    fn evaluate_with_lobe(&self, _lobe: u32, wi: Vec3) -> (Evaluation, f32) {
        let evaluation = self.evaluate(wi);
        (evaluation, evaluation.pdf)
    }

    #[inline(always)]
    fn invert(&self, _lobe: u32, wi: Vec3, gamma: UVec4) -> UVec4 {
        let u = invert_cosine_hemisphere(wi);
        let word = |u: f32, gamma: u32| (((u * CELLS) as u32) << 8) | (gamma & 0xff);
        UVec4::new(word(u.x, gamma.x), word(u.y, gamma.y), gamma.z, gamma.w)
    }

    #[inline(always)]
    fn roughness(&self, _lobe: u32) -> f32 {
        1.0
    }
}
