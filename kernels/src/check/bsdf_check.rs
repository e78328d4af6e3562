//! Scattering functions on given operands, so that host and device are compared at the ends of the ranges.

use super::Probes;
use super::operands::BsdfOperands;
use restir_shared::bsdf::{Bsdf, Material};
use restir_shared::glam::{UVec4, Vec3};

/// An evaluation, a sample and its inverse.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BsdfResults {
    /// `f |cos_i|` towards `wi`.
    pub value: [f32; 3],
    /// Its density.
    pub pdf: f32,
    /// Of the sample.
    pub direction: [f32; 3],
    /// Of the sample.
    pub weight: [f32; 3],
    /// Of the sample.
    pub sample_pdf: f32,
    /// Of the sample.
    pub lobe: u32,
    /// Whether that lobe is a delta.
    pub delta: u32,
    /// Random words of the sample's lobe and direction; zero if it is absorbed.
    pub inverse: [u32; 4],
}

#[inline(always)]
fn probe(o: &BsdfOperands, features: u32) -> BsdfResults {
    let vector = |v: [f32; 3]| Vec3::new(v[0], v[1], v[2]);
    let words = |w: [u32; 4]| UVec4::new(w[0], w[1], w[2], w[3]);
    let material = Material {
        base_color: vector(o.base_color),
        metallic: o.metallic,
        roughness: o.roughness,
        ior: o.ior,
        specular: o.specular,
        specular_color: vector(o.specular_color),
        transmission: o.transmission,
        diffuse_transmission: o.diffuse_transmission,
        diffuse_transmission_color: vector(o.diffuse_transmission_color),
        thin: o.thin != 0,
    };
    let bsdf = Bsdf::new(&material, vector(o.wo), o.front != 0, features);
    let evaluation = bsdf.evaluate(vector(o.wi));
    let sample = bsdf.sample(words(o.words));
    let back = if sample.pdf > 0.0 { bsdf.invert(sample.lobe, sample.direction, words(o.free)) } else { UVec4::ZERO };
    BsdfResults {
        value: [evaluation.value.x, evaluation.value.y, evaluation.value.z],
        pdf: evaluation.pdf,
        direction: [sample.direction.x, sample.direction.y, sample.direction.z],
        weight: [sample.weight.x, sample.weight.y, sample.weight.z],
        sample_pdf: sample.pdf,
        lobe: sample.lobe,
        delta: if sample.delta { 1 } else { 0 },
        inverse: [back.x, back.y, back.z, back.w],
    }
}

kernel! {
    /// Evaluates one probe an invocation.
    pub fn bsdf_check(64, 1) {
        constants { 0: features = 0xffff_ffff }
        params 0: Probes,
        read { 1: operands: BsdfOperands },
        own { 2: results: BsdfResults },
    }
    |x, _y, at, _p| results[at] = probe(&operands[x as usize], features)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    super::probes(&DESC, [("ends", super::inputs::bsdf_ends()), ("random", super::inputs::random_bsdf_operands(4096))])
}
