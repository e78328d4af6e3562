//! Shading with neighbours, for any kind of sample.
//!
//! Every neighbour's sample is shaded by its weight in pairwise MIS: the mean over the selection that a combine would make,
//! which has the same expectation and less noise. Neighbours lie in pairs on opposite sides at offsets that all pixels
//! share, so to be neighbours is mutual, and what the weights ask for is worked out once: the target of j's sample at i is
//! both what i shades it by and what j weighs its own sample by (cf. reciprocal neighbours in Lin et al. 2026, "ReSTIR PT
//! Enhanced"). A pass has three parts, between which planes are complete:
//!
//! 1. [`offer`]: what the pixel's own sample is to its neighbours;
//! 2. [`receive`]: the targets of the neighbours' samples at the pixel, and what these samples send by way of it;
//! 3. [`own_share`]: the weight that the neighbours' targets give to the pixel's own sample.
//!
//! Two pixels in a row share samples of the domain that the documentation of [`domain`](super::domain) shows.
//!
//! ```
//! # mod line { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/resample/line.rs")); }
//! # use line::Line;
//! use restir_shared::glam::Vec3;
//! use restir_shared::resample::exchange::{Neighbours, Offers, Uses, offer, own_share, receive};
//! use restir_shared::resample::packed::Stored;
//! use restir_shared::resample::reproject::Grid;
//! use restir_shared::resample::similar::{GBufferSurface, Similarity};
//!
//! struct Plane([Stored<f32>; 2]);
//! impl Offers for Plane {
//!     type Sample = f32;
//!     fn reservoir(&self, pixel: u32) -> Stored<f32> { self.0[pixel as usize] }
//!     fn surface(&self, pixel: u32) -> GBufferSurface {
//!         GBufferSurface { position: Vec3::X * pixel as f32, normal: Vec3::Z, distance: 1.0 }
//!     }
//!     // of the pixel i: the factor i + 1 times the sample
//!     fn target(&self, pixel: u32) -> f32 { (pixel + 1) as f32 * self.0[pixel as usize].sample }
//! }
//! let keeps = |sample| Stored { sample, contribution_weight: 1.0, confidence: 1.0, visibility: Vec3::ONE };
//! let plane = Plane([keeps(0.5), keeps(0.5)]);
//! let similarity = Similarity { max_plane_distance: 0.1, min_normal_cos: 0.9 };
//! // one pair of neighbours, at the offsets (1, 0) and (-1, 0), of which each of the two pixels has one
//! let grid = Grid { width: 2, height: 1 };
//! let neighbours = Neighbours { grid, count: 2, pairs: [1, 0, 0, 0], near_radius: 0.0, similarity };
//! let uses = Uses { mis: false, traced: false };
//!
//! let received = [0, 1].map(|x| receive(&Line, &plane, &neighbours, uses, &((x + 1) as f32), [x, 0]));
//! let pairs = received.map(|(pairs, _)| pairs);
//! let own = offer(&Line, &1.0, &plane.0[0], false, false);
//! let share = own_share(&plane, &neighbours, &pairs, [0, 0]);
//! // both pixels keep the same sample of weight 1, so that the weights of the two have to make the pixel's value of it
//! assert!((received[0].1.x + own.radiance.x * share - 0.5).abs() < 1e-6);
//! ```

use super::domain::{Domain, Shifted, Source};
use super::mis::Pair;
use super::packed::Stored;
use super::reproject::Grid;
use super::similar::{GBufferSurface, Similarity};
use crate::num::{self, Scalar};
use crate::rng;
use crate::sampling::sample_concentric_disk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Pairs of neighbours on opposite sides in a pass of shading.
pub const PAIRS: usize = 4;
/// Neighbours in a pass.
pub(crate) const NEIGHBOURS: usize = 2 * PAIRS;
/// Stands for a neighbour beyond the border.
const NOWHERE: u32 = u32::MAX;
/// Draws for each pair that is asked for, until the disk counts as exhausted.
const DRAWS: u32 = 64;

/// The targets of the samples of a pixel's neighbours in a pass of shading, at the pixel, as MIS weights have them, or
/// [`Self::NONE`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PairTargets {
    /// In the order of [`Neighbours::pairs`], of each pair first the neighbour at the offset, then the one opposite.
    pub targets: [f32; NEIGHBOURS],
}

impl PairTargets {
    /// There is no neighbour, or it is too different.
    pub const NONE: f32 = -1.0;
    /// There are no neighbours.
    pub const ALONE: Self = Self { targets: [Self::NONE; NEIGHBOURS] };
}

const _: () = assert!(size_of::<PairTargets>() == 32);

/// The neighbours that each pixel has in a pass, and how alike they have to be.
#[derive(Clone, Copy, Debug)]
pub struct Neighbours {
    /// The pixels of the image.
    pub grid: Grid,
    /// How many: even, at most 2 [`PAIRS`].
    pub count: u32,
    /// Offsets, of which every pixel has the neighbours on both sides: x in the lower half, y in the upper.
    pub pairs: [u32; PAIRS],
    /// A neighbour nearer than this, in pixels, is believed to have the same visibility.
    pub near_radius: f32,
    /// Two pixels are neighbours only if each finds the other alike.
    pub similarity: Similarity,
}

/// The neighbours that take part.
#[derive(Clone, Copy)]
pub(crate) struct Alike {
    /// In the order of [`Neighbours::pairs`] as [`PairTargets`] has it, or [`NOWHERE`].
    places: [u32; NEIGHBOURS],
    /// The sum of their confidence.
    confidence: f32,
}

impl Alike {
    /// None.
    #[cfg(not(target_arch = "spirv"))]
    pub(crate) const NONE: Self = Self { places: [NOWHERE; NEIGHBOURS], confidence: 0.0 };
}

/// What pixels show their neighbours, in a plane.
pub trait Offers {
    /// A kind of sample.
    type Sample: Copy;
    /// A pixel's reservoir.
    fn reservoir(&self, pixel: u32) -> Stored<Self::Sample>;
    /// What it sees; asked only where the reservoir's confidence is above zero, and of the pixel that looks around.
    fn surface(&self, pixel: u32) -> GBufferSurface;
    /// The target of its sample there, as MIS weights have it.
    fn target(&self, pixel: u32) -> f32;
}

/// Where visibility enters.
#[derive(Clone, Copy, Debug)]
pub struct Uses {
    /// Targets in MIS weights are multiplied by visibility.
    pub mis: bool,
    /// A neighbour's sample is tested by a ray, however near it is; else the near ones have the visibility that is known.
    pub traced: bool,
}

/// A sample at a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Offer {
    /// What it sends by way of the pixel, linear RGB.
    pub radiance: Vec3,
    /// Its target, as MIS weights have it.
    pub target: f32,
}

/// What the sample of a pixel's own reservoir is there; `traced` asks for its visibility anew.
#[inline(always)]
pub fn offer<D: Domain>(
    domain: &D,
    receiver: &D::Receiver,
    stored: &Stored<D::Sample>,
    mis_visibility: bool,
    traced: bool,
) -> Offer {
    let e = domain.evaluate(receiver, stored.sample);
    let visibility = seen(domain, receiver, &e, traced, stored.visibility);
    Offer {
        radiance: sent(domain, &e, visibility, stored.contribution_weight, 1.0),
        target: mis_target(domain, &e, visibility, mis_visibility).within_range(),
    }
}

/// The second part, for the pixel `at`, which is `receiver`: the targets of its neighbours' samples, and what they send.
#[inline(always)]
pub fn receive<D: Domain, O: Offers<Sample = D::Sample>>(
    domain: &D,
    offers: &O,
    neighbours: &Neighbours,
    uses: Uses,
    receiver: &D::Receiver,
    at: [u32; 2],
) -> (PairTargets, Vec3) {
    receive_from(domain, offers, neighbours, &neighbours.alike(offers, at), uses, receiver, at)
}

/// [`receive`] from neighbours that are known.
#[inline(always)]
pub(crate) fn receive_from<D: Domain, O: Offers<Sample = D::Sample>>(
    domain: &D,
    offers: &O,
    neighbours: &Neighbours,
    Alike { places, confidence: all }: &Alike,
    uses: Uses,
    receiver: &D::Receiver,
    at: [u32; 2],
) -> (PairTargets, Vec3) {
    let mut pairs = PairTargets::ALONE;
    let mut radiance = Vec3::ZERO;
    let to = Source { is_other: false, pixel: neighbours.grid.index(at) };
    let own = offers.reservoir(to.pixel);
    let mut n = 0;
    while n < neighbours.count {
        let place = places[n as usize];
        if place != NOWHERE {
            let stored = offers.reservoir(place);
            let shifted = brought(domain, &stored, place, to, receiver);
            let mut target = 0.0;
            if shifted.exists {
                let e = domain.evaluate(receiver, shifted.sample);
                let traced = neighbours.traces(uses, n);
                let visibility = seen(domain, receiver, &e, traced, stored.visibility);
                target = (mis_target(domain, &e, visibility, uses.mis) * shifted.jacobian).within_range();
                let pair = Pair::new(stored.confidence, *all, own.confidence);
                let weight = pair.of_neighbour(offers.target(place), target);
                let contribution_weight = shifted.jacobian * stored.contribution_weight;
                radiance += sent(domain, &e, visibility, contribution_weight, weight);
            }
            pairs.targets[n as usize] = target;
        }
        n = n.wrapping_add(1);
    }
    (pairs, radiance)
}

/// What [`receive_from`] evaluates, in its order: samples at the pixel, and whether a ray tests them.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub(crate) fn evaluated<D: Domain<Receiver = ()>, O: Offers<Sample = D::Sample>>(
    domain: &D,
    offers: &O,
    neighbours: &Neighbours,
    alike: &Alike,
    uses: Uses,
    at: [u32; 2],
    mut evaluate: impl FnMut(D::Sample, bool),
) {
    let to = Source { is_other: false, pixel: neighbours.grid.index(at) };
    for (n, &place) in (0..neighbours.count).zip(&alike.places) {
        if place != NOWHERE {
            let shifted = brought(domain, &offers.reservoir(place), place, to, &());
            if shifted.exists {
                evaluate(shifted.sample, neighbours.traces(uses, n));
            }
        }
    }
}

/// A neighbour's sample at the pixel. One without weight counts as none.
#[inline(always)]
fn brought<D: Domain>(
    domain: &D,
    stored: &Stored<D::Sample>,
    place: u32,
    to: Source,
    receiver: &D::Receiver,
) -> Shifted<D::Sample> {
    let shifted = domain.shift(stored.sample, Source { is_other: true, pixel: place }, to, receiver);
    Shifted { exists: (stored.contribution_weight > 0.0) & shifted.exists, ..shifted }
}

/// The third part: the weight of the own sample of the pixel `at`.
#[inline(always)]
pub fn own_share<O: Offers>(offers: &O, neighbours: &Neighbours, pairs: &[PairTargets], at: [u32; 2]) -> f32 {
    let mut places = [NOWHERE; NEIGHBOURS];
    let mut all = 0.0;
    let mut n = 0;
    while n < neighbours.count {
        // the pixel is its neighbour's neighbour on the other side
        let place = neighbours.partner(at, n);
        if place != NOWHERE && pairs[place as usize].targets[(n ^ 1) as usize] >= 0.0 {
            places[n as usize] = place;
            all += offers.reservoir(place).confidence;
        }
        n = n.wrapping_add(1);
    }
    let own = neighbours.grid.index(at);
    let confidence = offers.reservoir(own).confidence;
    let mut share = if all > 0.0 { 0.0 } else { 1.0 };
    n = 0;
    while n < neighbours.count {
        let place = places[n as usize];
        if place != NOWHERE {
            let pair = Pair::new(offers.reservoir(place).confidence, all, confidence);
            share += pair.of_canonical(offers.target(own), pairs[place as usize].targets[(n ^ 1) as usize]);
        }
        n = n.wrapping_add(1);
    }
    share
}

impl Neighbours {
    /// The n-th offset.
    #[inline(always)]
    fn offset(&self, n: u32) -> [i32; 2] {
        let packed = self.pairs[(n >> 1) as usize];
        let [x, y] = [((packed << 16) as i32) >> 16, (packed as i32) >> 16];
        if n & 1 == 0 { [x, y] } else { [x.wrapping_neg(), y.wrapping_neg()] }
    }

    /// Index of the n-th neighbour of a pixel, `u32::MAX` beyond the image. The pixel is that one's neighbour n ^ 1.
    #[inline(always)]
    pub fn partner(&self, [x, y]: [u32; 2], n: u32) -> u32 {
        let [dx, dy] = self.offset(n);
        // below zero wraps to beyond any image
        let (x, y) = (x.wrapping_add(dx as u32), y.wrapping_add(dy as u32));
        if (x < self.grid.width) & (y < self.grid.height) { self.grid.index([x, y]) } else { NOWHERE }
    }

    /// Whether the n-th neighbour's sample is tested by a ray.
    #[inline(always)]
    fn traces(&self, uses: Uses, n: u32) -> bool {
        let [dx, dy] = self.offset(n);
        let (dx, dy) = (dx as f32, dy as f32);
        uses.traced | (dx * dx + dy * dy >= self.near_radius * self.near_radius)
    }

    /// The neighbours that take part. Each of two pixels has to find the other like itself.
    #[inline(always)]
    pub(crate) fn alike<O: Offers>(&self, offers: &O, at: [u32; 2]) -> Alike {
        let mut places = [NOWHERE; NEIGHBOURS];
        let mut all = 0.0;
        let here = offers.surface(self.grid.index(at));
        let mut n = 0;
        while n < self.count {
            let place = self.partner(at, n);
            if place != NOWHERE {
                let confidence = offers.reservoir(place).confidence;
                if confidence > 0.0 {
                    let there = offers.surface(place);
                    if self.similarity.holds(&here, &there) & self.similarity.holds(&there, &here) {
                        places[n as usize] = place;
                        all += confidence;
                    }
                }
            }
            n = n.wrapping_add(1);
        }
        Alike { places, confidence: all }
    }
}

/// Offsets within `radius` pixels, one of each pair and no two the same: fills `offsets` as far as the disk has that many, and
/// returns how many there are. They are packed as in [`Neighbours::pairs`]; every stretch of them is well spread, and the
/// words, random, decide where the sequence begins.
pub fn pair_offsets(words: [u32; 2], radius: f32, offsets: &mut [u32]) -> usize {
    let draws = (offsets.len() as u32).wrapping_mul(DRAWS);
    let mut count = 0;
    let mut n = 0;
    while (count < offsets.len()) & (n < draws) {
        let u = rng::r2(words, n);
        // of each pair the one in the upper half of the disk
        let offset = sample_concentric_disk(Vec2::new(u.x, 0.5 + 0.5 * u.y)) * radius;
        let (x, y) = (num::nearest(offset.x), num::nearest(offset.y));
        let x = if (y == 0) & (x < 0) { x.wrapping_neg() } else { x };
        let packed = (x as u32 & 0xffff) | ((y as u32) << 16);
        if packed != 0 && !offsets[..count].contains(&packed) {
            offsets[count] = packed;
            count += 1;
        }
        n = n.wrapping_add(1);
    }
    count
}

#[inline(always)]
fn seen<D: Domain>(domain: &D, receiver: &D::Receiver, e: &D::Evaluation, traced: bool, known: Vec3) -> Vec3 {
    if traced & (domain.target(e) > 0.0) { domain.visibility(receiver, e) } else { known }
}

/// What MIS weighs a sample by.
#[inline(always)]
fn mis_target<D: Domain>(domain: &D, e: &D::Evaluation, visibility: Vec3, visible: bool) -> f32 {
    if visible { domain.visible_target(e, visibility) } else { domain.target(e) }
}

/// What a sample sends by way of a pixel, weighted. The product of target and contribution weight is in range where each
/// alone may not be.
#[inline(always)]
fn sent<D: Domain>(domain: &D, e: &D::Evaluation, visibility: Vec3, contribution_weight: f32, weight: f32) -> Vec3 {
    let target = domain.target(e);
    if target > 0.0 {
        let contribution = (weight * (target * contribution_weight).within_range()).within_range();
        domain.value(e) * num::recip(target) * (visibility * contribution)
    } else {
        Vec3::ZERO
    }
}
