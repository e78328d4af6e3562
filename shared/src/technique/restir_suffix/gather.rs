//! The final gather: the suffixes of other pixels, at the end of a pixel's own prefix (Kettunen et al. 2023, eq. 22 and 23).

use super::{Nearest, SuffixParams};
use crate::layout::FilmPixel;
use crate::num;
use crate::resample::mutual::{Record, ShiftRequest, ShiftResult};
use crate::technique::restir_pt::PackedPath;
use crate::vec::luminance;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// What a pixel's integration prefix is worth up to its end, in 16 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Throughput {
    /// See [`Prefix::throughput`](super::Prefix::throughput).
    pub throughput: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

impl Throughput {
    /// For its place in a plane.
    #[inline(always)]
    pub fn new(throughput: Vec3) -> Self {
        Self { throughput: throughput.to_array(), reserved: 0 }
    }

    /// A pixel with more light, which arrives by way of the prefix.
    #[inline(always)]
    pub fn add(&self, pixel: FilmPixel, light: Vec3) -> FilmPixel {
        more(pixel, FilmPixel::from_radiance(Vec3::from_array(self.throughput) * light))
    }
}

/// Which shifts a pass asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Asks(u32);

crate::fields!(Asks);

impl Asks {
    /// Of each borrowed suffix to the integration prefix: a layer for each.
    pub const BORROWED: Self = Self(0);
    /// Of each of k borrowed suffixes to the supporting prefixes of the others: of the n-th one the k - 1 layers from n (k - 1) on.
    pub const CROSSED: Self = Self(1);
    /// Of the canonical suffix to each supporting prefix: a layer for each.
    pub const CANONICAL: Self = Self(2);

    /// How many layers there are.
    #[must_use]
    pub fn layers(self, borrowed: u32) -> u32 {
        if self == Self::CROSSED { borrowed * (borrowed - 1) } else { borrowed }
    }
}

/// The request of the element (x, row) of a grid with the layers of [`Asks`], of which `nearest` are the pixel's neighbours.
#[inline(always)]
pub fn ask(params: &SuffixParams, nearest: &[Nearest], [x, row]: [u32; 2]) -> ShiftRequest {
    let (layer, y) = (row / params.height, row % params.height);
    let pixel = params.grid().index([x, y]);
    let pixels = nearest[pixel as usize].pixels;
    let crosses = params.asks.0 == Asks::CROSSED.0;
    let others = if crosses { params.borrowed - 1 } else { 1 };
    let (from, nth) = (layer / others, layer % others);
    let to = if !crosses {
        from
    } else if nth < from {
        nth
    } else {
        nth + 1
    };
    let (lender, other) = (pixels[from as usize], pixels[to as usize]);
    let exists = (lender != u32::MAX) & (other != u32::MAX);
    if !exists {
        ShiftRequest::NONE
    } else if params.asks.0 == Asks::BORROWED.0 {
        ShiftRequest { sample: lender, pixel }
    } else if crosses {
        ShiftRequest { sample: lender, pixel: other }
    } else {
        ShiftRequest { sample: pixel, pixel: other }
    }
}

/// What a gather reads.
#[derive(Clone, Copy, Debug)]
pub struct Lent<'a> {
    /// The suffixes of all pixels.
    pub records: &'a [PackedPath],
    /// Whose suffixes each pixel borrows.
    pub nearest: &'a [Nearest],
    /// What became of requests for [`Asks::BORROWED`]; of the canonical suffix for [`Asks::CANONICAL`].
    pub results: &'a [ShiftResult],
}

impl Lent<'_> {
    /// The confidence in the n-th lender's suffix: 0 if there is no such lender.
    #[doc(hidden)]
    #[inline(always)]
    pub fn confidence(&self, params: &SuffixParams, pixel: u32, n: u32) -> f32 {
        let lender = self.nearest[pixel as usize].pixels[n as usize];
        if lender == u32::MAX {
            0.0
        } else {
            num::min(self.records[lender as usize].confidence(), params.confidence_cap)
        }
    }

    /// What the suffixes that a pixel borrows send along its prefix, divided by the number of integration prefixes, since the picture is their mean. `crossed` is what became of requests for [`Asks::CROSSED`].
    #[inline(always)]
    pub fn borrowed(&self, params: &SuffixParams, crossed: &[ShiftResult], pixel: u32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        let mut n = 0;
        while n < params.borrowed {
            sum += self.by(params, crossed, pixel, n);
            n += 1;
        }
        sum * num::recip(params.prefixes as f32)
    }

    /// What the suffix of the n-th lender sends along a pixel's prefix, by its weight: eq. 22, with the balance heuristic by confidences, of which
    /// the canonical suffix has 1, whether or not it was traced. Black if there is no such lender, or its suffix cannot be shifted.
    #[inline(always)]
    pub fn by(&self, params: &SuffixParams, crossed: &[ShiftResult], pixel: u32, n: u32) -> Vec3 {
        let pixels = params.width * params.height;
        let confidence = self.confidence(params, pixel, n);
        let result = self.results[(n * pixels + pixel) as usize];
        if !((confidence > 0.0) & (result.partial_jacobian > 0.0)) {
            return Vec3::ZERO;
        }
        let lender = self.nearest[pixel as usize].pixels[n as usize];
        let record = self.records[lender as usize];
        let jacobian = num::div(result.partial_jacobian, record.partial_jacobian());
        let value = Vec3::from_array(result.value);
        let own = confidence * luminance(record.value());
        let mut all = own + luminance(value) * jacobian;
        let mut nth = 0;
        while nth + 1 < params.borrowed {
            let there = crossed[((n * (params.borrowed - 1) + nth) * pixels + pixel) as usize];
            let other = if nth < n { nth } else { nth + 1 };
            all += self.confidence(params, pixel, other) * target(&there, &record);
            nth += 1;
        }
        let share = if all > 0.0 { num::div(own, all) } else { 0.0 };
        value * (jacobian * record.contribution_weight() * share)
    }

    /// What the canonical suffix sends along a pixel's prefix, by its weight.
    #[inline(always)]
    pub fn canonical(&self, params: &SuffixParams, canonical: &PackedPath, pixel: u32) -> Vec3 {
        let pixels = params.width * params.height;
        let own = luminance(canonical.value());
        let mut all = own;
        let mut n = 0;
        while n < params.borrowed {
            let confidence = self.confidence(params, pixel, n);
            if confidence > 0.0 {
                all += confidence * target(&self.results[(n * pixels + pixel) as usize], canonical);
            }
            n += 1;
        }
        let share = if all > 0.0 { num::div(own, all) } else { 0.0 };
        canonical.value() * (canonical.contribution_weight() * share * params.canonical_share)
    }
}

/// The target of a suffix where it was shifted to, in the measure of where it comes from.
#[inline(always)]
fn target(shifted: &ShiftResult, record: &PackedPath) -> f32 {
    let ShiftResult { value, partial_jacobian } = *shifted;
    let jacobian = if partial_jacobian > 0.0 { num::div(partial_jacobian, record.partial_jacobian()) } else { 0.0 };
    luminance(Vec3::from_array(value)) * jacobian
}

/// The picture with the light that the integration prefix of this pass has found: the first one begins it.
#[inline(always)]
pub fn begin(params: &SuffixParams, film: FilmPixel, light: FilmPixel) -> FilmPixel {
    let share = num::recip(params.prefixes as f32);
    let light = FilmPixel { sum: (Vec3::from_array(light.sum) * share).to_array(), ..light };
    if params.prefix == 0 { light } else { more(film, light) }
}

/// The sum of two pixels, of one sample.
#[inline(always)]
fn more(pixel: FilmPixel, light: FilmPixel) -> FilmPixel {
    let sum = Vec3::from_array(pixel.sum) + Vec3::from_array(light.sum);
    FilmPixel { sum: sum.to_array(), dropped: num::min(pixel.dropped + light.dropped, 1.0) }
}

const _: () = assert!(size_of::<Throughput>() == 16);
