//! Every sampler and its inverse on given operands, so that host and device are compared at the ends of the ranges.

use super::operands::SamplerOperands;
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::layout::Extent;
use restir_shared::sampling::*;

/// Parameters of the kernel `sampler_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SamplerCheckParams {
    /// Number of probes.
    pub count: u32,
    /// Length of the distribution function.
    pub items: u32,
}

restir_shared::fields!(SamplerCheckParams: count, items);

impl Extent for SamplerCheckParams {
    fn extent(&self) -> [u32; 2] {
        [self.count, 1]
    }
}

/// Samples, each followed by its inverse, and densities.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SamplerResults {
    /// Cosine hemisphere.
    pub cosine: [f32; 5],
    /// Uniform hemisphere.
    pub hemisphere: [f32; 5],
    /// Uniform sphere.
    pub sphere: [f32; 5],
    /// Cone.
    pub cone: [f32; 5],
    /// Concentric disk.
    pub disk: [f32; 4],
    /// Triangle.
    pub triangle: [f32; 4],
    /// Exponential, unbounded and bounded: distance, density, inverse.
    pub distances: [f32; 6],
    /// Blackman-Harris window: place, density, inverse.
    pub window: [f32; 3],
    /// Densities of cosine, hemisphere, cone and triangle; versine.
    pub densities: [f32; 5],
    /// Index, inverse of the choice; cell of the table, inverse; index by an alias table.
    pub choices: [u32; 7],
    /// Probability and fraction of the choice, probability by index; the same of the table.
    pub probabilities: [f32; 7],
}

#[inline(always)]
fn with_inverse(w: Vec3, u: Vec2) -> [f32; 5] {
    [w.x, w.y, w.z, u.x, u.y]
}

#[inline(always)]
fn point_with_inverse(p: Vec2, u: Vec2) -> [f32; 4] {
    [p.x, p.y, u.x, u.y]
}

#[inline(always)]
fn probe(o: SamplerOperands, items: u32, bounds: &[u32]) -> SamplerResults {
    let u = Vec2::new(o.u[0], o.u[1]);
    let cosine = sample_cosine_hemisphere(u);
    let hemisphere = sample_uniform_hemisphere(u);
    let sphere = sample_uniform_sphere(u);
    let cone = sample_cone(u, o.versine);
    let disk = sample_concentric_disk(u);
    let triangle = sample_triangle(u);
    let t = sample_exponential(u.x, o.rate);
    let s = sample_bounded_exponential(u.y, o.rate, o.t_max);
    let x = sample_blackman_harris(u.x);
    let row = |i: u32| bounds[i as usize];
    let column = |_: u32, i: u32| bounds[i as usize];
    let chosen = sample_discrete(o.words[0], items, row);
    let table = sample_table_2d(o.words, items, items, row, column);
    let back = invert_table_2d(table.cell, table.fraction, items, items, row, column);
    SamplerResults {
        cosine: with_inverse(cosine, invert_cosine_hemisphere(cosine)),
        hemisphere: with_inverse(hemisphere, invert_uniform_hemisphere(hemisphere)),
        sphere: with_inverse(sphere, invert_uniform_sphere(sphere)),
        cone: with_inverse(cone, invert_cone(cone, o.versine)),
        disk: point_with_inverse(disk, invert_concentric_disk(disk)),
        triangle: point_with_inverse(triangle, invert_triangle(triangle)),
        distances: [
            t,
            exponential_pdf(t, o.rate),
            invert_exponential(t, o.rate),
            s,
            bounded_exponential_pdf(s, o.rate, o.t_max),
            invert_bounded_exponential(s, o.rate, o.t_max),
        ],
        window: [x, blackman_harris_pdf(x), invert_blackman_harris(x)],
        densities: [
            cosine_hemisphere_pdf(cosine.z),
            uniform_hemisphere_pdf(cosine.z),
            cone_pdf(o.versine),
            triangle_pdf(o.t_max),
            versine_of_sin2(u.x),
        ],
        choices: [
            chosen.index,
            invert_discrete(chosen.index, chosen.fraction, items, row),
            table.cell[0],
            table.cell[1],
            back[0],
            back[1],
            sample_alias(o.words, items, |i| (o.u[0], i ^ 1)),
        ],
        probabilities: [
            chosen.probability,
            chosen.fraction,
            discrete_probability(chosen.index, items, row),
            table.probability,
            table.fraction.x,
            table.fraction.y,
            table_2d_pdf(table_2d_probability(table.cell, items, items, row, column), items, items),
        ],
    }
}

kernel! {
    /// Evaluates one probe an invocation.
    pub fn sampler_check(64, 1) {
        constants {}
        params 0: SamplerCheckParams,
        read { 1: operands: SamplerOperands, 2: bounds: u32 },
        own { 3: results: SamplerResults },
    }
    |x, _y, at, p| results[at] = probe(operands[x as usize], p.items, bounds)
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    // items with and without probability, large and small, at both ends
    let bounds = [0_u32, 0, 1, 2, 2, 0x4000_0000, 0x4000_0100, 0xc123_4567, 0xc123_4567, 0xffff_fff0, CDF_END];
    [("ends", super::inputs::sampler_ends()), ("random", super::inputs::random_sampler_operands(4096))]
        .map(|(name, operands)| {
            let params = SamplerCheckParams { count: operands.len() as u32, items: bounds.len() as u32 };
            crate::Case::new(&DESC, name, params.count, 1).with(&[params]).with(&operands).with(&bounds).output()
        })
        .into()
}
