//! Diffusion profiles and samples of their points on given operands, so that host and device are compared at the ends of the ranges.

use super::Probes;
use super::operands::DiffusionOperands;
use restir_shared::diffusion::{
    Disk, DiskNumbers, Multiple, Profile, Remainder, Shape, Support, ccdf, cdf, diffuse_albedo, disney_transmission,
    invert_radius, sample_radius, single_profile,
};
use restir_shared::glam::{Vec3, Vec4};
use restir_shared::vec::normalize;

/// Results of a probe.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DiffusionResults {
    /// Distance, its inverse, distribution functions of x.
    pub radial: [f32; 4],
    /// Origin, direction and end of a segment.
    pub segment: [f32; 7],
    /// What a point is worth, and its density.
    pub weight: [f32; 4],
    /// Axis and channel, forth and back.
    pub techniques: [u32; 4],
    /// Numbers that find a point.
    pub numbers: [f32; 3],
    /// Diffuse albedo, first order, share of the rest, transmission.
    pub orders: [f32; 4],
}

#[inline(always)]
fn vector(v: [f32; 3]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

#[inline(always)]
fn fit_of(fit: u32) -> (Remainder, Shape) {
    if fit == 0 {
        (Remainder::Signed, Shape::Searchlight)
    } else if fit == 1 {
        (Remainder::Clamped, Shape::SurfaceLength)
    } else {
        (Remainder::Diffuse, Shape::Diffuse)
    }
}

#[inline(always)]
fn probe(o: DiffusionOperands) -> DiffusionResults {
    let profile = Profile::new(vector(o.albedo), vector(o.distance));
    let (centre, normal) = (vector(o.centre), normalize(vector(o.normal)));
    let support = if o.published != 0 { Support::Published } else { Support::Exact };
    let disk = Disk { support, ..Disk::new(centre, normal, profile) };
    let drawn = DiskNumbers::new(Vec4::new(o.u[0], o.u[1], o.u[2], o.u[3]), &profile);
    let segment = disk.segment(&drawn);
    let point = centre + vector(o.beside);
    let (weight, density) = disk.weight(point, normal);
    let (back, _) = disk.invert(point, normal, o.again);
    let radius = sample_radius(o.u[2]);
    let (remainder, shape) = fit_of(o.fit);
    let (scattered, absorbed) = (o.albedo[0], 1.0 - o.albedo[0]);
    DiffusionResults {
        radial: [radius, invert_radius(radius), cdf(o.x), ccdf(o.x)],
        segment: [
            segment.origin.x,
            segment.origin.y,
            segment.origin.z,
            segment.direction.x,
            segment.direction.y,
            segment.direction.z,
            segment.t_max,
        ],
        weight: [weight.x, weight.y, weight.z, density],
        techniques: [drawn.axis, drawn.channel, back.axis, back.channel],
        numbers: [back.radius, back.turn, drawn.radius],
        orders: [
            diffuse_albedo(scattered, absorbed, o.anisotropy),
            single_profile(o.x, 1.0, scattered, shape),
            Multiple::new(scattered, absorbed, o.anisotropy, remainder).share(o.x),
            disney_transmission(o.u[0]),
        ],
    }
}

kernel! {
    /// Evaluates one probe an invocation.
    pub fn diffusion_check(64, 1) {
        constants {}
        params 0: Probes,
        read { 1: operands: DiffusionOperands },
        own { 2: results: DiffusionResults },
    }
    |x, _y, at, _p| results[at] = probe(operands[x as usize])
}

#[cfg(feature = "cases")]
pub(super) fn cases() -> Vec<crate::Case> {
    use super::inputs::{diffusion_ends, random_diffusion_operands};
    super::probes(&DESC, [("ends", diffusion_ends()), ("random", random_diffusion_operands(4096))])
}
