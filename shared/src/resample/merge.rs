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
//!     let (combined, _) = combine(&Row(&reservoirs), &rules, reservoirs[0], [0, 0], &Draws { rng, dimension: 1 });
//!     confidence += combined.confidence;
//!     sum += combined.sample * combined.contribution_weight;
//! }
//! // the estimate is unbiased, and stands for two pixels and more in the mean
//! assert!((sum / 2000.0 - 0.5).abs() < 0.02 && confidence / 2000.0 > 2.0);
//! ```

use super::domain::{Domain, Pixels, SampleOf, Source};
use super::mis::{Combine, INPUTS, Mis};
use super::packed::{Stored, dithered};
use super::reproject::Place;
use super::reservoir::Reservoir;
use super::similar::Similarity;
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
#[derive(Clone, Copy)]
pub struct Draws {
    /// The pixel's random numbers.
    pub rng: Rng,
    /// The first of the dimensions.
    pub dimension: u32,
}

/// An input: a reservoir and what is known of its sample at the pixel that combines.
#[derive(Clone, Copy)]
struct Input<R, S> {
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
type Inputs<P> = [Input<<P as Pixels>::Packed, SampleOf<P>>; INPUTS];

/// Combines the canonical reservoir of the pixel `at` with others. The pixel sees something.
///
/// Targets are a matrix a_j(y_i) of receiving pixels j and samples i, of which the form of MIS asks for some entries. It is
/// gone through row by row, so that each receiver is made once, and with one call site each for receiver, evaluation and
/// visibility. Returns the reservoir and where its sample comes from.
#[inline(always)]
pub fn combine<P: Pixels>(
    pixels: &P,
    rules: &Rules,
    canonical: P::Packed,
    at: [u32; 2],
    draws: &Draws,
) -> (P::Packed, Source) {
    let pixel = pixels.grid().index(at);
    let mut inputs = [none::<P>(); INPUTS];
    inputs[0] = Input { pixel, reservoir: canonical, ..none::<P>() };
    let count = gather(pixels, rules, at, draws.rng.hash(draws.dimension), &mut inputs);
    if count == 1 {
        // alone it stays as it is, without a rounding
        return (canonical, Source { is_other: false, pixel });
    }
    merge(pixels, rules, &mut inputs, count, draws.rng.hash(draws.dimension.wrapping_add(1)))
}

#[inline(always)]
fn none<P: Pixels>() -> Input<P::Packed, SampleOf<P>> {
    Input {
        pixel: 0,
        reservoir: P::NO_RESERVOIR,
        sample: P::NO_SAMPLE,
        jacobian: 0.0,
        target: 0.0,
        visibility: Vec3::ZERO,
        near: false,
    }
}

/// Fills in the inputs after the canonical one, and returns how many there are with it. What is rejected is none of them.
#[inline(always)]
fn gather<P: Pixels>(pixels: &P, rules: &Rules, at: [u32; 2], words: UVec4, inputs: &mut Inputs<P>) -> u32 {
    let grid = pixels.grid();
    if rules.others == Others::Unchanged {
        let pixel = grid.index(at);
        let reservoir = pixels.other(pixel);
        inputs[1] = Input { pixel, reservoir, near: true, ..none::<P>() };
        return if pixels.unpack(reservoir).confidence > 0.0 { 2 } else { 1 };
    }
    let of_other_frame = rules.others == Others::OtherFrame;
    let here = pixels.own_facet();
    let center = if of_other_frame { pixels.reproject(&here) } else { Place { x: at[0], y: at[1], inside: true } };
    let mut count = 1_u32;
    // the first place is the centre, which is a neighbour in another frame only
    let mut n = if of_other_frame { 0 } else { 1 };
    while n <= rules.neighbours {
        let place = if n == 0 { center } else { grid.nearby(rules.radius, center, n, words) };
        let is_center = (place.x == center.x) & (place.y == center.y);
        if place.inside & ((n == 0) | !is_center) {
            let at = [place.x, place.y];
            let pixel = grid.index(at);
            let reservoir = pixels.other(pixel);
            let counts = pixels.unpack(reservoir).confidence > 0.0;
            if pixels.sees(at) && counts && rules.similarity.holds(&here, &pixels.facet(at)) {
                let near = (n == 0) | place.is_near(&center, rules.near_radius);
                inputs[count as usize] = Input { pixel, reservoir, near, ..none::<P>() };
                count = count.wrapping_add(1);
            }
        }
        n = n.wrapping_add(1);
    }
    count
}

/// An input's reservoir: one of another frame counts at most as much as the cap says.
#[inline(always)]
fn load<P: Pixels>(pixels: &P, rules: &Rules, reservoir: P::Packed, index: u32) -> Stored<SampleOf<P>> {
    let stored = pixels.unpack(reservoir);
    let capped = (rules.others != Others::SameFrame) & (index != 0);
    let confidence = if capped { num::min(stored.confidence, rules.confidence_cap) } else { stored.confidence };
    Stored { confidence, ..stored }
}

/// The walk through the matrix, and the selection. Of the words one selects, one rounds what is kept of a visibility.
#[inline(always)]
fn merge<P: Pixels>(
    pixels: &P,
    rules: &Rules,
    inputs: &mut Inputs<P>,
    count: u32,
    words: UVec4,
) -> (P::Packed, Source) {
    let domain = pixels.domain();
    let Rules { form, visibility: uses, .. } = *rules;
    let unchanged = rules.others == Others::Unchanged;
    // nothing else asks for what shading takes
    let for_shading = uses.shading & !uses.mis;
    let late = form.asks_for_selected();
    // the pixel itself, the others, and for the visibility of the selected sample the pixel once more
    let again = late & uses.mis & !uses.selection;
    let rows = if late | form.asks_for_pairs() { count } else { 1 }.wrapping_add(if again { 1 } else { 0 });
    let selects_at = if form.is_after_selection() { 0 } else { rows.wrapping_sub(1) };
    let asked = rules.neighbours.wrapping_add(if rules.others == Others::SameFrame { 0 } else { 1 });
    let mut combine = Combine::new(form, asked as f32);
    let mut selection = Selection::NONE;
    let mut row = 0;
    while row < rows {
        let receiving = if row == count { 0 } else { row };
        let to = Source { is_other: receiving != 0, pixel: inputs[receiving as usize].pixel };
        let receiver = pixels.receiver(to);
        let mut i = 0_u32;
        while i < count {
            let input = inputs[i as usize];
            let stored = load(pixels, rules, input.reservoir, i);
            let is_selected = late & (row > 0) & (i == selection.input);
            let from = Source { is_other: i != 0, pixel: input.pixel };
            let shifted = domain.shift(stored.sample, from, to, &receiver);
            let mut target = 0.0;
            let mut visible_target = 0.0;
            let mut visibility = stored.visibility;
            let wanted = (row == 0) | is_selected | form.asks_for(receiving, i);
            if wanted & (stored.contribution_weight > 0.0) & shifted.exists {
                let e = domain.evaluate(&receiver, shifted.sample);
                target = domain.target(&e);
                let asked =
                    if row == 0 { uses.selection | (uses.mis & !late) | (for_shading & !input.near) } else { uses.mis };
                // of its own sample a pixel knows
                let own = (receiving == i) | unchanged;
                if asked & (!own | uses.forgotten) & (target > 0.0) {
                    visibility = domain.visibility(&receiver, &e);
                }
                visible_target = domain.visible_target(&e, visibility);
            }
            let weighed = if uses.mis { visible_target } else { target };
            let a = weighed * shifted.jacobian;
            if row == 0 {
                // what is known to be occluded at a pixel is no sample of its own
                let p = if uses.selection | (uses.mis & unchanged) { weighed } else { target };
                let contribution = p * shifted.jacobian * stored.contribution_weight;
                combine.input(stored.confidence, contribution.within_range());
                inputs[i as usize].sample = shifted.sample;
                inputs[i as usize].jacobian = shifted.jacobian;
                inputs[i as usize].target = p;
                inputs[i as usize].visibility = visibility;
            }
            if is_selected {
                combine.selected_target(receiving, i, a);
                selection.visibility = if receiving == 0 { visibility } else { selection.visibility };
            } else if form.asks_for(receiving, i) {
                combine.target(receiving, i, a);
            }
            i = i.wrapping_add(1);
        }
        if row == selects_at {
            selection = select::<P>(&combine, inputs, count, rng::unit(words.x));
            if late & !again {
                let chosen = inputs[selection.input as usize];
                combine.selected_target(0, selection.input, chosen.target * chosen.jacobian);
            }
        }
        row = row.wrapping_add(1);
    }
    let chosen = inputs[selection.input as usize];
    let reservoir = Reservoir { sample: (), weight_sum: selection.weight_sum, confidence: combine.confidence() };
    let visibility = if for_shading & uses.mean { selection.mean_visibility } else { selection.visibility };
    let stored = Stored {
        sample: chosen.sample,
        contribution_weight: reservoir.contribution_weight(combine.share(), chosen.target),
        confidence: reservoir.confidence,
        visibility: dithered(visibility, rng::unit(words.y)),
    };
    (pixels.pack(&stored), Source { is_other: selection.input != 0, pixel: chosen.pixel })
}

/// The outcome of a selection.
#[derive(Clone, Copy)]
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
fn select<P: Pixels>(combine: &Combine<f32>, inputs: &Inputs<P>, count: u32, u: f32) -> Selection {
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
