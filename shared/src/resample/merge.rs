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

use super::domain::{Domain, Pixels, ReceiverOf, Reservoirs, SampleOf, Shifted, Source};
use super::mis::{Combine, INPUTS, Mis};
use super::packed::{Stored, dithered};
use super::reproject::Place;
use super::reservoir::Reservoir;
use super::similar::{GBufferSurface, Similarity};
use crate::num::{self, Scalar};
use crate::rng::{self, Rng};
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
    fn choice(&self) -> UVec4 {
        self.rng.hash(self.dimension.wrapping_add(1))
    }
}

impl Rules {
    /// Rows of the matrix, of which there is one for each of `count` inputs, if they are asked for: the pixel itself, the others, and
    /// for the visibility of the selected sample the pixel once more.
    #[inline(always)]
    fn rows(&self, count: u32) -> u32 {
        let all = self.form.asks_for_selected() | self.form.asks_for_pairs();
        if all { count } else { 1 }.wrapping_add(if self.is_asked_again() { 1 } else { 0 })
    }

    /// Whether the visibility of the selected sample at the pixel is asked for when it has been selected.
    #[inline(always)]
    fn is_asked_again(&self) -> bool {
        self.form.asks_for_selected() & self.visibility.mis & !self.visibility.selection
    }

    /// The most that another reservoir counts at the pixel that combines, which is `own`.
    #[inline(always)]
    fn most_confidence<R: Reservoirs>(&self, reservoirs: &R, own: &ReceiverOf<R>) -> f32 {
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
    fn is_for_shading(&self) -> bool {
        self.visibility.shading & !self.visibility.mis
    }

    /// Whether the entry in `row`, whose receiver is the input `receiving`, of the sample of input i is wanted, before the selection.
    #[inline(always)]
    fn wants(&self, row: u32, receiving: u32, i: u32) -> bool {
        (row == 0) | self.form.asks_for(receiving, i)
    }

    /// Whether a ray finds the visibility of that entry, if its target is above zero. `near` inputs are believed.
    #[inline(always)]
    fn traces(&self, row: u32, receiving: u32, i: u32, near: bool) -> bool {
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
    pixel: u32,
    reservoir: R,
    /// The sample, shifted.
    sample: S,
    /// The Jacobian of the shift.
    jacobian: f32,
    /// Target for the selection.
    target: f32,
    /// Visibility, as far as it was asked for.
    visibility: Vec3,
    /// Near enough for its visibility to be believed.
    near: bool,
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
/// each for receiver, evaluation and visibility. #[inline(always)]
pub fn combine<P: Pixels>(
    pixels: &P,
    rules: &Rules,
    canonical: P::Packed,
    at: [u32; 2],
    draws: &Draws,
) -> Combined<P::Packed> {
    let mut inputs = alone::<P>(canonical, pixels.grid().index(at));
    let count = gather(pixels, rules, at, draws.places(), &mut inputs);
    merge(pixels, rules, &mut inputs, count, draws)
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

/// An entry of the matrix: the sample of input `i` at the receiver of a row.
struct Entry<S> {
    row: u32,
    /// The input whose pixel receives.
    receiving: u32,
    i: u32,
    /// The reservoir of the sample.
    stored: Stored<S>,
    shifted: Shifted<S>,
    /// It is asked for since the sample has been selected.
    is_selected: bool,
    /// Somebody asks for it, and the sample exists there.
    exists: bool,
    /// A ray finds its visibility, if its target is above zero.
    traced: bool,
}

/// What is done on the way through the matrix. Reservoirs and rules are arguments and no fields: an optimiser of SPIR-V keeps a structure
/// that points to a variable, and not every device takes one.
trait Visit<R: Reservoirs> {
    /// The input that has been selected, once there is one.
    fn selected(&self) -> u32;
    /// A row begins.
    fn begin(&mut self, reservoirs: &R, rules: &Rules, row: u32, receiver: &ReceiverOf<R>);
    /// An entry of it.
    fn visit(
        &mut self,
        reservoirs: &R,
        rules: &Rules,
        entry: &Entry<SampleOf<R>>,
        receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    );
    /// All its entries have been visited.
    fn end(&mut self, rules: &Rules, row: u32, inputs: &Inputs<R>, count: u32);
}

/// The walk through the matrix: row by row, so that each receiver is made once. Its order is the one in which samples are evaluated, whether
/// they are merged or listed.
#[inline(always)]
fn walk_matrix<R: Reservoirs, V: Visit<R>>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    visitor: &mut V,
) {
    let (late, rows) = (rules.form.asks_for_selected(), rules.rows(count));
    let mut row = 0;
    while row < rows {
        let receiving = if row == count { 0 } else { row };
        let to = Source { is_other: receiving != 0, pixel: inputs[receiving as usize].pixel };
        let receiver = reservoirs.receiver(to);
        visitor.begin(reservoirs, rules, row, &receiver);
        let mut i = 0_u32;
        while i < count {
            let input = inputs[i as usize];
            let stored = reservoirs.unpack(input.reservoir);
            let is_selected = late & (row > 0) & (i == visitor.selected());
            let from = Source { is_other: i != 0, pixel: input.pixel };
            let shifted = reservoirs.domain().shift(stored.sample, from, to, &receiver);
            let wanted = is_selected | rules.wants(row, receiving, i);
            let exists = wanted & (stored.contribution_weight > 0.0) & shifted.exists;
            let traced = rules.traces(row, receiving, i, input.near);
            let entry = Entry { row, receiving, i, stored, shifted, is_selected, exists, traced };
            visitor.visit(reservoirs, rules, &entry, &receiver, inputs);
            i = i.wrapping_add(1);
        }
        visitor.end(rules, row, inputs, count);
        row = row.wrapping_add(1);
    }
}

/// Merges: fills in the matrix, and selects an input after the row in which all is known that the selection asks for.
struct Merger {
    combine: Combine<f32>,
    selection: Selection,
    /// The row.
    selects_at: u32,
    /// The random number of the selection.
    u: f32,
    /// The most that another reservoir counts.
    most: f32,
}

impl<R: Reservoirs> Visit<R> for Merger {
    #[inline(always)]
    fn selected(&self) -> u32 {
        self.selection.input
    }

    #[inline(always)]
    fn begin(&mut self, reservoirs: &R, rules: &Rules, row: u32, receiver: &ReceiverOf<R>) {
        self.most = if row == 0 { rules.most_confidence(reservoirs, receiver) } else { f32::MAX };
    }

    #[inline(always)]
    fn visit(
        &mut self,
        reservoirs: &R,
        rules: &Rules,
        entry: &Entry<SampleOf<R>>,
        receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    ) {
        let Entry { row, receiving, i, stored, shifted, is_selected, exists, traced, .. } = *entry;
        let (domain, uses) = (reservoirs.domain(), rules.visibility);
        let mut target = 0.0;
        let mut visible_target = 0.0;
        let mut visibility = stored.visibility;
        if exists {
            let e = domain.evaluate(receiver, shifted.sample);
            target = domain.target(&e);
            if traced & (target > 0.0) {
                visibility = domain.visibility(receiver, &e);
            }
            visible_target = domain.visible_target(&e, visibility);
        }
        let weighed = if uses.mis { visible_target } else { target };
        let a = weighed * shifted.jacobian;
        if row == 0 {
            let most = if i == 0 { f32::MAX } else { self.most };
            // what is known to be occluded at a pixel is no sample of its own
            let visible = uses.selection | (uses.mis & (rules.others == Others::Unchanged));
            let p = if visible { weighed } else { target };
            let contribution = p * shifted.jacobian * stored.contribution_weight;
            self.combine.input(num::min(stored.confidence, most), contribution.within_range());
            inputs[i as usize].sample = shifted.sample;
            inputs[i as usize].jacobian = shifted.jacobian;
            inputs[i as usize].target = p;
            inputs[i as usize].visibility = visibility;
        }
        if is_selected {
            self.combine.selected_target(receiving, i, a);
            self.selection.visibility = if receiving == 0 { visibility } else { self.selection.visibility };
        } else if rules.form.asks_for(receiving, i) {
            self.combine.target(receiving, i, a);
        }
    }

    #[inline(always)]
    fn end(&mut self, rules: &Rules, row: u32, inputs: &Inputs<R>, count: u32) {
        if row != self.selects_at {
            return;
        }
        self.selection = select::<R>(&self.combine, inputs, count, self.u);
        if rules.form.asks_for_selected() & !rules.is_asked_again() {
            let chosen = inputs[self.selection.input as usize];
            self.combine.selected_target(0, self.selection.input, chosen.target * chosen.jacobian);
        }
    }
}

/// Merges the inputs, of which the first is canonical.
#[inline(always)]
pub(crate) fn merge<R: Reservoirs>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    draws: &Draws,
) -> Combined<R::Packed> {
    if count == 1 {
        // alone it stays as it is, without a rounding
        let Input { pixel, reservoir, .. } = inputs[0];
        return Combined { reservoir, source: Source { is_other: false, pixel } };
    }
    let words = draws.choice();
    let asked = rules.neighbours.wrapping_add(if rules.others == Others::SameFrame { 0 } else { 1 });
    let mut merger = Merger {
        combine: Combine::new(rules.form, asked as f32),
        selection: Selection::NONE,
        selects_at: if rules.form.is_after_selection() { 0 } else { rules.rows(count).wrapping_sub(1) },
        u: rng::unit(words.x),
        most: f32::MAX,
    };
    walk_matrix(reservoirs, rules, inputs, count, &mut merger);
    let Merger { combine, selection, .. } = merger;
    let chosen = inputs[selection.input as usize];
    let reservoir = Reservoir { sample: (), weight_sum: selection.weight_sum, confidence: combine.confidence() };
    let is_mean = rules.is_for_shading() & rules.visibility.mean;
    let visibility = if is_mean { selection.mean_visibility } else { selection.visibility };
    let stored = Stored {
        sample: chosen.sample,
        contribution_weight: reservoir.contribution_weight(combine.share(), chosen.target),
        confidence: reservoir.confidence,
        visibility: dithered(visibility, rng::unit(words.y)),
    };
    let source = Source { is_other: selection.input != 0, pixel: chosen.pixel };
    Combined { reservoir: reservoirs.pack(&stored), source }
}

#[cfg(not(target_arch = "spirv"))]
impl Rules {
    /// The most that one pixel asks [`evaluated`] for.
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

/// Lists what [`merge`] evaluates, by calling a function with each sample where it was shifted to, the pixel there, and whether a ray finds
/// its visibility.
#[cfg(not(target_arch = "spirv"))]
struct Lister<E>(E);

#[cfg(not(target_arch = "spirv"))]
impl<R: Reservoirs, E: FnMut(SampleOf<R>, Source, bool)> Visit<R> for Lister<E> {
    #[inline(always)]
    fn selected(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn begin(&mut self, _reservoirs: &R, _rules: &Rules, _row: u32, _receiver: &ReceiverOf<R>) {}

    #[inline(always)]
    fn visit(
        &mut self,
        _reservoirs: &R,
        _rules: &Rules,
        entry: &Entry<SampleOf<R>>,
        _receiver: &ReceiverOf<R>,
        inputs: &mut Inputs<R>,
    ) {
        if entry.exists {
            let to = Source { is_other: entry.receiving != 0, pixel: inputs[entry.receiving as usize].pixel };
            (self.0)(entry.shifted.sample, to, entry.traced);
        }
    }

    #[inline(always)]
    fn end(&mut self, _rules: &Rules, _row: u32, _inputs: &Inputs<R>, _count: u32) {}
}

/// What [`merge`] evaluates, in its order, of a form that asks for nothing after the selection: each sample where it was shifted to, the
/// pixel there, and whether a ray finds its visibility.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub(crate) fn evaluated<R: Reservoirs>(
    reservoirs: &R,
    rules: &Rules,
    inputs: &mut Inputs<R>,
    count: u32,
    evaluate: impl FnMut(SampleOf<R>, Source, bool),
) {
    if count > 1 {
        walk_matrix(reservoirs, rules, inputs, count, &mut Lister(evaluate));
    }
}

/// The outcome of a selection.
#[derive(Clone, Copy, Debug)]
struct Selection {
    input: u32,
    visibility: Vec3,
    weight_sum: f32,
    /// Of all inputs, by weight (Tokuyoshi, eq. 4).
    mean_visibility: Vec3,
}

impl Selection {
    const NONE: Self = Self { input: 0, visibility: Vec3::ZERO, weight_sum: 0.0, mean_visibility: Vec3::ZERO };
}

/// Selects an input in proportion to its weight by one random number.
#[inline(always)]
fn select<R: Reservoirs>(combine: &Combine<f32>, inputs: &Inputs<R>, count: u32, u: f32) -> Selection {
    let mut weights = [0.0; INPUTS];
    let mut sum = 0.0;
    let mut visible = Vec3::ZERO;
    let mut i = 0;
    while i < count {
        let weight = combine.weight(i);
        weights[i as usize] = weight;
        sum += weight;
        visible += inputs[i as usize].visibility * weight;
        i = i.wrapping_add(1);
    }
    let mut chosen = 0;
    let mut below = 0.0;
    let mut open = true;
    i = 0;
    while i < count {
        below += weights[i as usize];
        let here = open & (u * sum < below);
        chosen = if here { i } else { chosen };
        open &= !here;
        i = i.wrapping_add(1);
    }
    let share = |visible: f32| if sum > 0.0 { num::clamp(num::div(visible, sum), 0.0, 1.0) } else { 0.0 };
    Selection {
        input: chosen,
        visibility: inputs[chosen as usize].visibility,
        weight_sum: sum,
        mean_visibility: Vec3::new(share(visible.x), share(visible.y), share(visible.z)),
    }
}
