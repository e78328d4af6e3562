//! Reuse between mutual pairs of pixels, for samples whose shifts are worth a pass of their own.
//!
//! What a pixel's sample is at a neighbour is both what the neighbour may select and what the pixel weighs its own sample by. So a pair of
//! pixels needs two shifts, and each of them is computed once, in a pass in which nothing else is kept in registers. The passes:
//!
//! | pass | makes |
//! |---|---|
//! | [`pair`], or [`reproject`] with another frame | [`ShiftRequest`]s: which sample is to be shifted to which pixel |
//! | [`answer`], with another frame twice, there and back | a [`ShiftResult`] of 16 bytes for each request |
//! | [`merge`] | one sample of a pixel's own and all others, by pairwise MIS (Lin et al. 2022, eq. 36 to 39) |
//!
//! A technique says what lies in its planes ([`Record`]) and how it is shifted ([`Shift`]). Lin et al. 2026, "ReSTIR PT Enhanced", call such
//! neighbours reciprocal.
//!
//! Two pixels that have a number each, of which the second one wants twice the value:
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::resample::mutual::{Record, Shares, ShiftRequest, ShiftResult, merge, pair};
//! use restir_shared::resample::params::ReuseParams;
//! use restir_shared::resample::similar::PackedSurface;
//!
//! #[derive(Clone, Copy)]
//! struct Number { value: f32, weight: f32, confidence: f32 }
//! impl Record for Number {
//!     fn value(&self) -> Vec3 { Vec3::splat(self.value) }
//!     fn contribution_weight(&self) -> f32 { self.weight }
//!     fn confidence(&self) -> f32 { self.confidence }
//!     fn partial_jacobian(&self) -> f32 { 1.0 }
//!     fn moved(&self, to: &ShiftResult) -> Self { Self { value: to.value[0], ..*self } }
//!     fn weighted(&self, weight: f32, confidence: f32) -> Self { Self { weight, confidence, ..*self } }
//! }
//!
//! // tiles of 2 x 2 pixels, and one pairing
//! let params = ReuseParams { neighbours: 1, tile: 1, ..ReuseParams::new(Default::default(), [2, 1], 1) };
//! let wall = |x: f32| PackedSurface { position: [x, 0.0, 0.0], distance: 1.0, normal: [0.0, 0.0, 1.0], reserved: 0 };
//! let surfaces = [wall(0.0), wall(0.1)];
//! let records = [1.0, 2.0].map(|value| Number { value, weight: 1.0, confidence: 1.0 });
//! let requests = [0, 1].map(|x| pair(&params, &surfaces, [x, 0]));
//! assert_eq!(requests[0], ShiftRequest { sample: 1, pixel: 0 });
//!
//! // both numbers are 1 at the first pixel and 2 at the second one
//! let results = [1.0, 2.0].map(|value| ShiftResult { value: [value; 3], partial_jacobian: 1.0 });
//! let shares = Shares { records: &records, requests: &requests, results: &results, returned: &[] };
//! let merged = [0, 1].map(|x| merge(&params, &shares, records[x as usize], [x, 0]).record);
//! assert_eq!(merged.map(|number| number.value * number.weight), [1.0, 2.0]);
//! assert_eq!(merged[0].confidence, 2.0);
//! ```

use super::mis::{Combine, INPUTS};
use super::packed::MAX_CONFIDENCE;
use super::pairing::Pairing;
use super::params::{Flags, ReuseParams};
use super::reservoir::Reservoir;
pub use super::shifted::{Cause, Shifted};
use super::similar::{GBufferSurface, PackedSurface};
use crate::geometry::{Hit, PackedHit};
use crate::layout::FilmPixel;
use crate::num;
use crate::rng::{self, Rng, Sampler};
use crate::scene::{Frames, Location, Surface};
use crate::vec::{length, luminance};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Where the stream of a frame's merges begins.
const MERGES: u32 = rng::stream(3);
/// Dimensions of a merge.
const INPUTS_OF_MERGE: u32 = 16;
/// Where the stream of the pairings begins: a dimension for each neighbour of each pass of a frame.
const PAIRINGS: u32 = rng::stream(4);

/// The most mutual neighbours of a pass.
pub const MAX_NEIGHBOURS: u32 = 8;
const _: () = assert!((MAX_NEIGHBOURS as usize) < INPUTS && INPUTS <= INPUTS_OF_MERGE as usize);

/// A sample that is to be shifted, and where to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ShiftRequest {
    /// The index of the sample in its plane.
    pub sample: u32,
    /// The index of the pixel that it is shifted to.
    pub pixel: u32,
}

impl ShiftRequest {
    /// No shift is asked for.
    pub const NONE: Self = Self { sample: u32::MAX, pixel: 0 };

    /// Whether a shift is asked for.
    #[doc(hidden)]
    #[inline(always)]
    pub fn exists(&self) -> bool {
        self.sample != Self::NONE.sample
    }

    /// The indices of the sample and of the pixel that it is shifted to; `back` of the pixel's own sample and where the other one is.
    #[inline(always)]
    pub(crate) fn indices(&self, back: bool) -> (u32, u32) {
        if back { (self.pixel, self.sample) } else { (self.sample, self.pixel) }
    }
}

/// What the origins of all techniques begin with: where paths begin, in 32 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AnyOrigin {
    /// The hit there.
    pub hit: PackedHit,
    /// What a technique adds.
    pub rest: [u32; 4],
}

/// What a sample is where it was shifted to, in 16 bytes: zeros if it cannot be shifted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ShiftResult {
    /// The integrand there, linear RGB.
    pub value: [f32; 3],
    /// Its partial Jacobian there; over that of the sample it is the Jacobian of the shift.
    pub partial_jacobian: f32,
}

impl ShiftResult {
    /// What a plane keeps of a shift: all but why there is no sample.
    #[doc(hidden)]
    #[inline(always)]
    pub fn of(shifted: &Shifted) -> Self {
        Self { value: shifted.value.to_array(), partial_jacobian: shifted.term }
    }
}

/// A reservoir as it lies in a plane.
pub trait Record: Copy {
    /// The integrand at the pixel, linear RGB.
    fn value(&self) -> Vec3;
    /// The unbiased contribution weight; zero without a sample.
    fn contribution_weight(&self) -> f32;
    /// Confidence weight in frames, an integer from 0 to [`MAX_CONFIDENCE`].
    fn confidence(&self) -> f32;
    /// The part of the sample's density that a shift changes: the Jacobian is the one after the shift over the one before.
    fn partial_jacobian(&self) -> f32;
    /// The target of samples of such an integrand: its luminance, if not implemented.
    #[inline(always)]
    fn target(value: Vec3) -> f32 {
        luminance(value)
    }
    /// The sample at the pixel that it was shifted to.
    #[must_use]
    fn moved(&self, to: &ShiftResult) -> Self;
    /// The same sample with another contribution weight and confidence; with a weight of zero it is none.
    #[must_use]
    fn weighted(&self, contribution_weight: f32, confidence: f32) -> Self;
}

/// A sample that can be shifted in scenes `F`.
pub trait Shift<F>: Record {
    /// The parameters of a pass.
    type Params: core::ops::Deref<Target = ReuseParams>;
    /// Where the samples of a pixel begin, as it lies in a plane: what they are shifted to.
    type Origin;

    /// The sample at an origin; with [`Flags::BACK`] it is one of this frame, and the origin one of the other frame.
    fn shifted(&self, frames: &F, params: &Self::Params, origin: &Self::Origin) -> Shifted;
}

/// The request of the element (x, row) of a grid with a layer for each neighbour: to take the sample of the pixel's n-th neighbour to the
/// pixel. There is none if either does not find the other alike. The neighbour's request in the same layer is the way back.
#[inline(always)]
pub fn pair(params: &ReuseParams, surfaces: &[PackedSurface], [x, row]: [u32; 2]) -> ShiftRequest {
    let (n, y) = (row / params.height, row % params.height);
    let rng = Rng::new(0, 0, params.frame, params.seed, Sampler::Independent);
    let dimension = PAIRINGS.wrapping_add(params.merge.wrapping_mul(MAX_NEIGHBOURS).wrapping_add(n));
    let pairing = Pairing { grid: params.grid(), tile: params.tile, rng, dimension };
    let (pixel, partner) = (pairing.grid.index([x, y]), pairing.partner([x, y]));
    if partner == ShiftRequest::NONE.sample {
        return ShiftRequest::NONE;
    }
    let (here, there) = (surfaces[pixel as usize], surfaces[partner as usize]);
    let seen = here.exists() & there.exists();
    let (here, there) = (here.unpack(), there.unpack());
    let similarity = params.similarity();
    let alike = similarity.holds(&here, &there) & similarity.holds(&there, &here);
    if seen & alike { ShiftRequest { sample: partner, pixel } } else { ShiftRequest::NONE }
}

/// The request of the pixel `at`, which sees `hit`: to take the sample of the other frame to it that was found where its surface was then.
/// There is none where something else was seen. What moves with its surface is found: the place is that of the same triangle and
/// coordinates.
#[inline(always)]
pub fn reproject<F: Frames>(
    frames: &F,
    params: &ReuseParams,
    hit: &Hit,
    other_surfaces: &[PackedSurface],
    at: [u32; 2],
) -> ShiftRequest {
    if !hit.is_hit() {
        return ShiftRequest::NONE;
    }
    let grid = params.grid();
    let Location { position, normal, .. } = frames.scene(true).location(hit);
    let place = grid.project(&params.other_camera, position);
    let there = grid.index([place.x, place.y]);
    let distance = length(position - Vec3::from_array(params.other_camera.position));
    let here = GBufferSurface { position, normal, distance };
    let seen = other_surfaces[there as usize];
    let alike = seen.exists() & params.similarity().holds(&here, &seen.unpack());
    let request = ShiftRequest { sample: there, pixel: grid.index(at) };
    if place.inside & alike { request } else { ShiftRequest::NONE }
}

/// Does what a request asks for; with [`Flags::BACK`] the way back.
#[doc(hidden)]
#[inline(always)]
pub fn answer<R: Shift<F>, F: Frames>(
    frames: &F,
    params: &R::Params,
    request: ShiftRequest,
    origins: &[R::Origin],
    records: &[R],
) -> ShiftResult {
    if !request.exists() {
        return ShiftResult::default();
    }
    let (from, to) = request.indices(params.flags.contains(Flags::BACK));
    ShiftResult::of(&records[from as usize].shifted(frames, params, &origins[to as usize]))
}

/// What a merge reads: of each pixel the sample that others may take, of each element of the grid of requests the request and its result.
#[derive(Clone, Copy, Debug)]
pub struct Shares<'a, R> {
    /// Samples of neighbours, or of another frame.
    pub records: &'a [R],
    /// Requests of [`pair`] or [`reproject`].
    pub requests: &'a [ShiftRequest],
    /// What became of them.
    pub results: &'a [ShiftResult],
    /// What became of them the other way, with another frame.
    pub returned: &'a [ShiftResult],
}

impl<R> Shares<'_, R> {
    /// Whose sample a request of the pixel is for; in a view that stands still its own.
    #[inline(always)]
    fn partner(&self, still: bool, request: u32, pixel: u32) -> u32 {
        if still { pixel } else { self.requests[request as usize].sample }
    }
}

/// The target of a sample where it was shifted to, in the measure of where it comes from: times the Jacobian.
#[inline(always)]
fn target<R: Record>(shifted: &ShiftResult, record: &R) -> f32 {
    let ShiftResult { value, partial_jacobian } = *shifted;
    let jacobian = if partial_jacobian > 0.0 { num::div(partial_jacobian, record.partial_jacobian()) } else { 0.0 };
    R::target(Vec3::from_array(value)) * jacobian
}

/// What a merge has selected.
#[derive(Clone, Copy, Debug)]
pub struct Merged<R> {
    /// The sample.
    pub record: R,
    /// Whether it is another pixel's, or of another frame.
    pub is_other: bool,
    /// Of another's the element of the grid of requests.
    pub request: u32,
}

/// One sample of a pixel's own and those of its neighbours, or of the other frame's at its place, by pairwise MIS. With
/// [`Flags::OTHER_FRAME`] there is one neighbour. With [`Flags::SUMS`] it is not one that sends light but all of them, each by its weight: the mean
/// over what could have been selected, so that the colours of several samples average out.
#[inline(always)]
pub fn merge<R: Record>(params: &ReuseParams, shares: &Shares<'_, R>, own: R, at: [u32; 2]) -> Merged<R> {
    let (crosses, still) = (params.flags.contains(Flags::OTHER_FRAME), params.flags.contains(Flags::STILL));
    let unshifted = still | params.flags.contains(Flags::KEPT);
    let pixels = params.width * params.height;
    let index = params.grid().index(at);
    let mut combine = Combine::new(params.flags.form(), params.neighbours as f32);
    let mut requests = [0; INPUTS];
    let mut count = 0;
    // the pixel itself, then the others
    let mut i = 0;
    while i <= params.neighbours {
        let n = i.wrapping_sub(1);
        let request = if i == 0 { index } else { n * pixels + index };
        let partner = if i == 0 { index } else { shares.partner(still, request, index) };
        if partner != ShiftRequest::NONE.sample {
            let record = if i == 0 { own } else { shares.records[partner as usize] };
            let at_source = R::target(record.value());
            let unchanged = (i == 0) | unshifted;
            let here = if unchanged { at_source } else { target(&shares.results[request as usize], &record) };
            let most = if crosses & (i != 0) { params.confidence_cap } else { MAX_CONFIDENCE };
            combine.input(num::min(record.confidence(), most), here * record.contribution_weight());
            combine.target(count, count, at_source);
            if i != 0 {
                let back = if unshifted {
                    ShiftResult::default()
                } else if crosses {
                    shares.returned[index as usize]
                } else {
                    shares.results[(n * pixels + partner) as usize]
                };
                combine.target(0, count, here);
                combine.target(count, 0, target(&back, &own));
            }
            requests[count as usize] = request;
            count += 1;
        }
        i += 1;
    }
    let rng = params.rng(at);
    let first = MERGES.wrapping_add(params.merge.wrapping_mul(INPUTS_OF_MERGE));
    let sums = params.flags.contains(Flags::SUMS);
    let mut sum = Vec3::ZERO;
    let mut reservoir = Reservoir::empty(0);
    i = 0;
    while i < count {
        let u = rng::unit(rng.hash(first.wrapping_add(i)).x);
        let weight = combine.weight(i);
        reservoir.update(i, weight, 1.0, u);
        if sums & (weight > 0.0) {
            let request = requests[i as usize];
            let value = if i == 0 {
                own.value()
            } else if unshifted {
                shares.records[shares.partner(still, request, index) as usize].value()
            } else {
                Vec3::from_array(shares.results[request as usize].value)
            };
            sum += value * num::div(weight, R::target(value));
        }
        i += 1;
    }
    let is_other = reservoir.sample != 0;
    let request = requests[reservoir.sample as usize];
    let record = if !is_other {
        own
    } else {
        let other = shares.records[shares.partner(still, request, index) as usize];
        if unshifted { other } else { other.moved(&shares.results[request as usize]) }
    };
    let weight = reservoir.contribution_weight(1.0, R::target(record.value()));
    if sums {
        let together = ShiftResult { value: sum.to_array(), partial_jacobian: record.partial_jacobian() };
        let weight = if weight > 0.0 { 1.0 } else { 0.0 };
        return Merged { record: record.moved(&together).weighted(weight, combine.confidence()), is_other, request };
    }
    Merged { record: record.weighted(weight, combine.confidence()), is_other, request }
}

/// What a pixel's sample sends to the camera, with what is seen without one.
#[inline(always)]
pub fn shade<R: Record>(record: &R, direct: FilmPixel) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + record.value() * record.contribution_weight());
    FilmPixel { dropped: num::min(pixel.dropped + direct.dropped, 1.0), ..pixel }
}
