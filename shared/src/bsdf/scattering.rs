//! What techniques ask of scattering, so that a renderer can bring its own.

use super::{Bsdf, BsdfSample, Evaluation, Gloss, Material};
use glam::{UVec4, Vec3};

/// How a point of a surface scatters. [`Material`] does so by glTF's model.
pub trait Scattering: Copy {
    /// The same for one direction.
    type Bsdf: ScatteringFunction;

    /// Prepared for the unit direction `wo` to the viewer, in the frame of the surface: +z is the shading normal on the side of the viewer.
    /// `front` says whether that is the front side, `features` what the scene may have.
    fn bsdf(&self, wo: Vec3, front: bool, features: u32) -> Self::Bsdf;

    /// What passes straight through, of light at the cosine `cos` > 0 to the normal, in [0, 1]: techniques look through such
    /// surfaces for light. Nothing, if not implemented.
    #[inline(always)]
    fn straight(&self, cos: f32) -> Vec3 {
        let _ = cos;
        Vec3::ZERO
    }

    /// The border of a body as a Lambertian surface, of whose light that enters this part comes back, linear RGB. Unchanged, if not implemented: then what enters
    /// is lost.
    #[inline(always)]
    #[must_use]
    fn closed(&self, color: Vec3) -> Self {
        let _ = color;
        *self
    }
}

/// A mixture of lobes, each with a number that only it gives a meaning to, for one direction to the viewer. All directions are unit vectors
/// that point away from the surface, in its frame. Functions of their arguments alone: what is asked twice has the same bits.
pub trait ScatteringFunction {
    /// The value times the cosine, and the density per steradian with which [`Self::sample`] gives the direction: of all lobes but deltas.
    fn evaluate(&self, wi: Vec3) -> Evaluation;

    /// Draws a direction; the first two words, which are spread best, should give it, and the others choose the lobe.
    fn sample(&self, words: UVec4) -> BsdfSample;

    /// What [`Self::evaluate`] gives, and the density of one lobe, the probability of its selection included.
    fn evaluate_with_lobe(&self, lobe: u32, wi: Vec3) -> (Evaluation, f32);

    /// Words of which [`Self::sample`] makes this lobe and direction, up to rounding; what they leave free comes from `gamma`.
    fn invert(&self, lobe: u32, wi: Vec3, gamma: UVec4) -> UVec4;

    /// From 0, a perfect mirror or refraction, to 1, a diffuse lobe.
    fn roughness(&self, lobe: u32) -> f32;

    /// The roughness of the roughest lobe that takes part; 1, if not implemented.
    #[inline(always)]
    fn greatest_roughness(&self) -> f32 {
        1.0
    }

    /// What of it turns with the direction to the viewer, deltas left out; nothing, if not implemented.
    #[inline(always)]
    fn gloss(&self) -> Gloss {
        Gloss::NONE
    }

    /// Whether any lobe is no delta: without one, light that is sampled elsewhere contributes nothing.
    #[inline(always)]
    fn has_smooth_part(&self) -> bool {
        true
    }
}

impl Scattering for Material {
    type Bsdf = Bsdf;

    #[inline(always)]
    fn bsdf(&self, wo: Vec3, front: bool, features: u32) -> Bsdf {
        Bsdf::new(self, wo, front, features)
    }

    #[inline(always)]
    fn straight(&self, cos: f32) -> Vec3 {
        Material::straight(self, cos)
    }

    #[inline(always)]
    fn closed(&self, color: Vec3) -> Self {
        let Self { base_color, metallic, transmission, diffuse_transmission, diffuse_transmission_color, .. } = *self;
        let (metal, diffuse) = (metallic, (1.0 - metallic) * (1.0 - transmission));
        // light passes the border twice
        let passed =
            base_color * transmission + diffuse_transmission_color * ((1.0 - transmission) * diffuse_transmission);
        let inside = passed * passed * color * (1.0 - metallic);
        Self::diffuse(base_color * (metal + diffuse * (1.0 - diffuse_transmission)) + inside)
    }
}

impl ScatteringFunction for Bsdf {
    #[inline(always)]
    fn evaluate(&self, wi: Vec3) -> Evaluation {
        Bsdf::evaluate(self, wi)
    }

    #[inline(always)]
    fn sample(&self, words: UVec4) -> BsdfSample {
        Bsdf::sample(self, words)
    }

    #[inline(always)]
    fn evaluate_with_lobe(&self, lobe: u32, wi: Vec3) -> (Evaluation, f32) {
        Bsdf::evaluate_with_lobe(self, lobe, wi)
    }

    #[inline(always)]
    fn invert(&self, lobe: u32, wi: Vec3, gamma: UVec4) -> UVec4 {
        Bsdf::invert(self, lobe, wi, gamma)
    }

    #[inline(always)]
    fn roughness(&self, lobe: u32) -> f32 {
        Bsdf::roughness(self, lobe)
    }

    #[inline(always)]
    fn greatest_roughness(&self) -> f32 {
        Bsdf::greatest_roughness(self)
    }

    #[inline(always)]
    fn gloss(&self) -> Gloss {
        Bsdf::gloss(self)
    }

    #[inline(always)]
    fn has_smooth_part(&self) -> bool {
        Bsdf::has_smooth_part(self)
    }
}
