//! How several reservoirs become one, for any kind of sample: with those of the last frame (temporal reuse), of neighbours
//! (spatial reuse), or of both at once.
//!
//! [`combine`] takes the reservoir of a pixel, which is *canonical*, looks for others by the [`Rules`], and selects one of all their samples by the
//! weights of a form of MIS ([`mis`](super::mis)). Bitterli et al. 2020, Algorithms 4 to 6, are the case of samples that
//! need no Jacobian, Lin et al. 2022 ("Generalized Resampled Importance Sampling") the general one.
//!
//! Three pixels in a row, over the domain that the documentation of [`domain`](super::domain) shows: the first one combines its reservoir with
//! those of the others.
//!
//! ```
//! # mod line { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/resample/line.rs")); }
//! # use line::Line;
//! # use restir_shared::glam::Vec3;
//! # use restir_shared::resample::domain::{Domain, Source};
#![doc = include_str!("row.rs")]
//!
//! use restir_shared::resample::merge::{Draws, Others, Rules, Uses, combine};
//! use restir_shared::resample::mis::Mis;
//! use restir_shared::resample::similar::Similarity;
//! use restir_shared::rng::{Rng, Sampler, unit};
//!
//! let uses = Uses { selection: false, mis: false, forgotten: false, shading: false, mean: false };
//! let rules = Rules {
//!     form: Mis::PAIRWISE_DEFENSIVE,
//!     others: Others::SameFrame,
//!     neighbours: 3,
//!     radius: 2.0,
//!     near_radius: 0.0,
//!     similarity: Similarity { max_plane_distance: 0.1, min_normal_cos: 0.9 },
//!     confidence_cap: 20.0,
//!     visibility: uses,
//! };
//! // each pixel has a uniform number; the pixel 0 wants x, whose integral is 1/2
//! let (mut sum, mut confidence) = (0.0, 0.0);
//! for trial in 0..2000 {
//!     let rng = Rng::new(trial, 0, 0, 7, Sampler::Independent);
//!     let words = rng.hash(0);
//!     let reservoir = |word| Stored { sample: unit(word), contribution_weight: 1.0, confidence: 1.0, visibility: Vec3::ONE };
//!     let reservoirs = [words.x, words.y, words.z].map(reservoir);
//!     let draws = Draws { rng, dimension: 1 };
//!     let combined = combine(&Row(&reservoirs), &rules, reservoirs[0], [0, 0], &draws).reservoir;
//!     confidence += combined.confidence;
//!     sum += combined.sample * combined.contribution_weight;
//! }
//! // the estimate is unbiased, and stands for two pixels and more in the mean
//! assert!((sum / 2000.0 - 0.5).abs() < 0.02 && confidence / 2000.0 > 2.0);
//! ```

use super::domain::{Pixels, ReceiverOf, Reservoirs, SampleOf, Source};
use super::matrix;
use super::mis::{INPUTS, Mis};
use super::reproject::Place;
use super::similar::{GBufferSurface, Similarity};
use crate::num;
use crate::rng::Rng;
use glam::{UVec4, Vec3};

/// What the other reservoirs of a combine are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Others {
    /// Neighbours of the same frame.
    SameFrame,
    /// The reservoirs of another frame: that of the pixel that saw the surface there, and those of its neighbours.
    OtherFrame,
    /// The pixel's own reservoir of another frame, in which every pixel has the same camera ray in the same scene.
    Unchanged,
}

/// Where visibility enters.
#[derive(Clone, Copy, Debug)]
pub struct Uses {
    /// Samples are selected by their target times visibility.
    pub selection: bool,
    /// Targets in MIS weights are multiplied by visibility.
    pub mis: bool,
    /// What a reservoir keeps of a visibility is not good enough for MIS.
    pub forgotten: bool,
    /// Shading will take the visibility that is kept.
    pub shading: bool,
    /// What is kept is the weighted mean over the inputs, not the visibility of the selected one.
    pub mean: bool,
}

/// How reservoirs become one.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// The form of MIS.
    pub form: Mis,
    /// What the others are.
    pub others: Others,
    /// Neighbours asked for, at most [`INPUTS`] - 2.
    pub neighbours: u32,
    /// Largest distance of a neighbour in pixels.
    pub radius: f32,
    /// A neighbour nearer than this, in pixels, is believed to have the same visibility.
    pub near_radius: f32,
    /// Neighbours that are not alike are none.
    pub similarity: Similarity,
    /// Largest confidence of a reservoir of another frame.
    pub confidence_cap: f32,
    /// Where visibility enters.
    pub visibility: Uses,
}

/// Random numbers of a combine: two dimensions from the given one on.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    /// The pixel's random numbers.
    pub rng: Rng,
    /// The first of the dimensions.
    pub dimension: u32,
}

impl Draws {
    /// Where neighbours are looked for.
    #[inline(always)]
    pub(crate) fn places(&self) -> UVec4 {
        self.rng.hash(self.dimension)
    }

    /// One selects, one rounds what is kept of a visibility.
    #[inline(always)]
    pub(super) fn choice(&self) -> UVec4 {
        self.rng.hash(self.dimension.wrapping_add(1))
    }
}

impl Rules {
    /// Rows of the matrix, of which there is one for each of `count` inputs, if they are asked for: the pixel itself, the others, and
    /// for the visibility of the selected sample the pixel once more.
    #[inline(always)]
    pub(super) fn rows(&self, count: u32) -> u32 {
        let all = self.form.asks_for_selected() | self.form.asks_for_pairs();
        if all { count } else { 1 }.wrapping_add(if self.is_asked_again() { 1 } else { 0 })
    }

    /// Whether the visibility of the selected sample at the pixel is asked for when it has been selected.
    #[inline(always)]
    pub(super) fn is_asked_again(&self) -> bool {
        self.form.asks_for_selected() & self.visibility.mis & !self.visibility.selection
    }

    /// The most that another reservoir counts at the pixel that combines, which is `own`.
    #[inline(always)]
    pub(super) fn most_confidence<R: Reservoirs>(&self, reservoirs: &R, own: &ReceiverOf<R>) -> f32 {
        match self.others {
            Others::SameFrame => f32::MAX,
            Others::Unchanged => self.confidence_cap,
            // what fades counts no less than a round of candidates
            Others::OtherFrame => {
                num::max(self.confidence_cap * reservoirs.kept(own), num::min(self.confidence_cap, 1.0))
            }
        }
    }

    /// Whether visibility is kept for shading, which nothing else asks for.
    #[inline(always)]
    pub(super) fn is_for_shading(&self) -> bool {
        self.visibility.shading & !self.visibility.mis
    }

    /// Whether the entry in `row`, whose receiver is the input `receiving`, of the sample of input i is wanted, before the selection.
    #[inline(always)]
    pub(super) fn wants(&self, row: u32, receiving: u32, i: u32) -> bool {
        (row == 0) | self.form.asks_for(receiving, i)
    }

    /// Whether a ray finds the visibility of that entry, if its target is above zero. `near` inputs are believed.
    #[inline(always)]
    pub(super) fn traces(&self, row: u32, receiving: u32, i: u32, near: bool) -> bool {
        let Uses { selection, mis, forgotten, .. } = self.visibility;
        let late = self.form.asks_for_selected();
        let asked = if row == 0 { selection | (mis & !late) | (self.is_for_shading() & !near) } else { mis };
        // of its own sample a pixel knows
        let own = (receiving == i) | (self.others == Others::Unchanged);
        asked & (!own | forgotten)
    }
}

/// An input: a reservoir and what is known of its sample at the pixel that combines.
#[derive(Clone, Copy)]
pub(crate) struct Input<R, S> {
    pub(super) pixel: u32,
    pub(super) reservoir: R,
    /// The sample, shifted.
    pub(super) sample: S,
    /// The Jacobian of the shift.
    pub(super) jacobian: f32,
    /// Target for the selection.
    pub(super) target: f32,
    /// Visibility, as far as it was asked for.
    pub(super) visibility: Vec3,
    /// Near enough for its visibility to be believed.
    pub(super) near: bool,
}

/// The inputs, the canonical one first.
pub(crate) type Inputs<R> = [Input<<R as Reservoirs>::Packed, SampleOf<R>>; INPUTS];

/// What several reservoirs have become.
#[derive(Clone, Copy, Debug)]
pub struct Combined<P> {
    /// The reservoir, as it lies in a plane.
    pub reservoir: P,
    /// Where its sample comes from.
    pub source: Source,
}

/// Combines the canonical reservoir of the pixel `at` with others. The pixel sees something.
///
/// Targets are a matrix a_j(y_i) of receiving pixels j and samples i, of which the form of MIS asks for some entries. There is one call site
/// each for receiver, evaluation and visibility.
pub fn combine<P: Pixels>(
    pixels: &P,
    rules: &Rules,
    canonical: P::Packed,
    at: [u32; 2],
    draws: &Draws,
) -> Combined<P::Packed> {
    let mut inputs = alone::<P>(canonical, pixels.grid().index(at));
    let count = gather(pixels, rules, at, draws.places(), &mut inputs);
    matrix::merge(pixels, rules, &mut inputs, count, draws)
}

/// The canonical reservoir as the first input, and room for others.
#[inline(always)]
pub(crate) fn alone<R: Reservoirs>(canonical: R::Packed, pixel: u32) -> Inputs<R> {
    let none = Input {
        pixel: 0,
        reservoir: R::NO_RESERVOIR,
        sample: R::NO_SAMPLE,
        jacobian: 0.0,
        target: 0.0,
        visibility: Vec3::ZERO,
        near: false,
    };
    let mut inputs = [none; INPUTS];
    inputs[0] = Input { pixel, reservoir: canonical, ..none };
    inputs
}

/// Fills in the inputs after the canonical one, and returns how many there are with it. What is rejected is none of them.
#[inline(always)]
fn gather<P: Pixels>(pixels: &P, rules: &Rules, at: [u32; 2], words: UVec4, inputs: &mut Inputs<P>) -> u32 {
    if rules.others == Others::Unchanged {
        return add::<P>(&rules.unchanged(pixels, at), |pixel| pixels.other(pixel), inputs, 1);
    }
    let here = pixels.own_surface();
    let center = rules.center(pixels, &here, at);
    let mut count = 1_u32;
    let mut n = rules.first_neighbour();
    while n <= rules.neighbours {
        let neighbour = rules.neighbour(pixels, &here, center, n, words);
        count = add::<P>(&neighbour, |pixel| pixels.other(pixel), inputs, count);
        n = n.wrapping_add(1);
    }
    count
}

/// One of the other reservoirs, if it takes part.
#[derive(Clone, Copy)]
pub(crate) struct Neighbour {
    /// Whether it does.
    pub(crate) counts: bool,
    pub(crate) pixel: u32,
    /// Near enough for its visibility to be believed.
    pub(crate) near: bool,
}

impl Neighbour {
    /// None.
    #[cfg(not(target_arch = "spirv"))]
    pub(crate) const NONE: Self = Self { counts: false, pixel: 0, near: false };
}

impl Rules {
    /// The pixel's own reservoir of another frame, where nothing has changed.
    #[inline(always)]
    pub(crate) fn unchanged<P: Pixels>(&self, pixels: &P, at: [u32; 2]) -> Neighbour {
        let pixel = pixels.grid().index(at);
        Neighbour { counts: pixels.unpack(pixels.other(pixel)).confidence > 0.0, pixel, near: true }
    }

    /// Where neighbours lie around: the pixel itself, or the one that saw in another frame what it sees `here`.
    #[inline(always)]
    pub(crate) fn center<P: Pixels>(&self, pixels: &P, here: &GBufferSurface, at: [u32; 2]) -> Place {
        if self.others == Others::OtherFrame {
            pixels.reproject(here)
        } else {
            Place { x: at[0], y: at[1], inside: true }
        }
    }

    /// The index of the first neighbour, up to [`Self::neighbours`]: 0 is the centre, which is one in another frame only.
    #[inline(always)]
    pub(crate) fn first_neighbour(&self) -> u32 {
        if self.others == Others::OtherFrame { 0 } else { 1 }
    }

    /// The n-th neighbour around a centre.
    #[inline(always)]
    pub(crate) fn neighbour<P: Pixels>(
        &self,
        pixels: &P,
        here: &GBufferSurface,
        center: Place,
        n: u32,
        words: UVec4,
    ) -> Neighbour {
        let place = if n == 0 { center } else { pixels.grid().nearby(self.radius, center, n, words) };
        let is_center = (place.x == center.x) & (place.y == center.y);
        let at = [place.x, place.y];
        let mut found =
            Neighbour { counts: false, pixel: 0, near: (n == 0) | place.is_near(&center, self.near_radius) };
        if place.inside & ((n == 0) | !is_center) {
            found.pixel = pixels.grid().index(at);
            found.counts = pixels.sees(at)
                && pixels.unpack(pixels.other(found.pixel)).confidence > 0.0
                && self.similarity.holds(here, &pixels.surface(at));
        }
        found
    }
}

/// Makes a neighbour's reservoir an input, if it takes part: the one after `count` others. Returns how many there are then.
#[inline(always)]
pub(crate) fn add<R: Reservoirs>(
    neighbour: &Neighbour,
    reservoir: impl FnOnce(u32) -> R::Packed,
    inputs: &mut Inputs<R>,
    count: u32,
) -> u32 {
    let Neighbour { counts, pixel, near } = *neighbour;
    if !counts {
        return count;
    }
    let input = &mut inputs[count as usize];
    (input.pixel, input.reservoir, input.near) = (pixel, reservoir(pixel), near);
    count.wrapping_add(1)
}

#[cfg(not(target_arch = "spirv"))]
impl Rules {
    /// The most that one pixel asks [`evaluated`](matrix::evaluated) for.
    #[inline(always)]
    pub(crate) fn most_evaluated(&self) -> usize {
        let inputs = self.neighbours.wrapping_add(2) as usize;
        if self.form.asks_for_third() {
            inputs * inputs
        } else if self.form.asks_for_pairs() {
            3 * inputs - 2
        } else {
            inputs
        }
    }
}
