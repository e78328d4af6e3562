//! Where averaging visibility is unbiased and where not, each claim on a small table.
//!
//! The average is exact only if what multiplies it afterwards does not vary with the sample that was selected. A weight
//! applied after the selection varies, so does the colour of the light, and so do, in a chain, the MIS weights of the
//! next merge.

use super::averaging::{Chain, LAMPS, RING, Room, Visibility, shade};
use super::expectation::factor;
use super::forms::{Form, Input};
use super::setting::UNEQUAL;
use super::table::{FULL, LIGHTS, PIXELS, VISIBLE};
use super::trials::{Kept, measure};
use crate::random::SplitMix;
use crate::stats::Moments;
use restir_shared::resample::mis::Mis;

/// What is claimed of the averaged estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Claim {
    /// It is 1.
    Unbiased,
    /// It is biased, by which it is in this range.
    Biased(f64, f64),
    /// It is nearly 1: in this range.
    Near(f64, f64),
}

/// A claim and what was measured, relative to the truth.
#[derive(Clone, Debug)]
pub struct Toy {
    /// What is merged how.
    pub name: String,
    /// Shaded by the selected sample's own visibility, which is unbiased.
    pub selected: Moments,
    /// Shaded by the average.
    pub averaged: Moments,
    /// Of the average.
    pub claim: Claim,
}

/// Of the twelve lights without zeros: the estimate by the selected sample's visibility and by the average; contribution MIS
/// a third time, with its weights in the average.
fn one_combine(form: Form, random: &mut SplitMix) -> [f64; 3] {
    let kept: [Kept; PIXELS] =
        std::array::from_fn(|pixel| Kept::draw(random, LIGHTS, UNEQUAL[pixel], |light| FULL[pixel][light]));
    let light = kept.map(|kept| kept.light);
    let inputs: [Input<f64>; PIXELS] = std::array::from_fn(|i| Input {
        confidence: f64::from(UNEQUAL[i]),
        contribution: FULL[0][light[i]] * kept[i].weight,
    });
    let a = |receiver: usize, sample: usize| FULL[receiver][light[sample]];
    let combined = form.combine(&inputs, a, || random.unit());
    let sees = |i: usize| f64::from(VISIBLE[0][light[i]]);
    let selected = combined.reservoir.sample;
    let target = FULL[0][light[selected]];
    let unshadowed = target * combined.reservoir.contribution_weight(combined.share, target);
    let truth: f64 = (0..LIGHTS).map(|light| FULL[0][light] * f64::from(VISIBLE[0][light])).sum();
    let weight = |i: usize| {
        let at: [f64; PIXELS] = std::array::from_fn(|receiver| a(receiver, i));
        factor(form, &UNEQUAL.map(f64::from), &at, i) * inputs[i].contribution
    };
    let weighted: f64 = (0..PIXELS).map(|i| sees(i) * weight(i)).sum();
    let all: f64 = (0..PIXELS).map(weight).sum();
    [sees(selected), combined.average(PIXELS, sees), weighted / all].map(|visibility| visibility * unshadowed / truth)
}

fn combines(seed: u64, trials: u64) -> Vec<Toy> {
    let unbiased = [Mis::ONE_OVER_M, Mis::CONSTANT, Mis::TALBOT, Mis::PAIRWISE, Mis::PAIRWISE_DEFENSIVE];
    let measured = |form| measure(seed, trials, |random| one_combine(form, random));
    let toy =
        |name: &str, selected, averaged, claim| Toy { name: format!("one combine, {name}"), selected, averaged, claim };
    let mut toys = Vec::from(unbiased.map(Form::Library).map(|form| {
        let [selected, averaged, _] = measured(form);
        toy(form.name(), selected, averaged, Claim::Unbiased)
    }));
    let [selected, averaged, weighted] = measured(Form::Library(Mis::CONTRIBUTION));
    toys.push(toy("contribution", selected, averaged, Claim::Biased(1.03, 1.15)));
    toys.push(toy("contribution, its weights in the average", selected, weighted, Claim::Unbiased));
    toys
}

/// A temporal chain by Talbot's weights.
pub const TEMPORAL: Chain =
    Chain { frames: 8, candidates: 4, spatial: false, form: Mis::TALBOT, visibility: Visibility::Averaged };
/// The same with a neighbour, half as long.
pub const SPATIAL: Chain = Chain { frames: 4, spatial: true, ..TEMPORAL };

/// Pixels that differ as far as they may.
pub fn extreme() -> Room {
    Room::random(5, 1.0)
}

/// Pixels that are nearly alike.
pub fn smooth() -> Room {
    Room::random(5, 0.1)
}

/// Moments of what all pixels receive by the selected sample's visibility and by the chain's own.
fn both(seed: u64, trials: u64, room: &Room, chain: Chain) -> [Moments; 2] {
    [Visibility::Selected, chain.visibility].map(|visibility| {
        let chain = Chain { visibility, ..chain };
        let [moments] = measure(seed, trials, |random| [shade(room, &chain.run(room, random), |_| 1.0)]);
        moments
    })
}

fn chains(seed: u64, trials: u64) -> Vec<Toy> {
    let one = Chain { frames: 1, ..SPATIAL };
    let constant = Chain { form: Mis::CONSTANT, ..SPATIAL };
    let last = Chain { visibility: Visibility::AveragedLast, ..SPATIAL };
    let leak = |frames| Chain { frames, ..SPATIAL };
    let list = [
        ("temporal, 8 frames", TEMPORAL, extreme(), Claim::Unbiased),
        ("temporal and spatial, 1 frame, pixels far apart", one, extreme(), Claim::Unbiased),
        ("temporal and spatial, 4 frames, pixels far apart", leak(4), extreme(), Claim::Biased(0.90, 0.97)),
        ("temporal and spatial, 8 frames, pixels far apart", leak(8), extreme(), Claim::Biased(0.85, 0.96)),
        ("the same, 4 frames, constant MIS", constant, extreme(), Claim::Unbiased),
        ("the same, 4 frames, averaged in the last merge only", last, extreme(), Claim::Unbiased),
        ("temporal and spatial, 4 frames, pixels nearly alike", leak(4), smooth(), Claim::Near(0.985, 1.015)),
    ];
    let toy = |(name, chain, room, claim): (&str, Chain, Room, Claim)| {
        let [selected, averaged] = both(seed, trials, &room, chain);
        Toy { name: name.to_owned(), selected, averaged, claim }
    };
    list.into_iter().map(toy).collect()
}

const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Colours of the lamps.
const COLOURS: [[f64; 3]; LAMPS] =
    [[1.0, 0.4, 0.3], [0.4, 1.0, 0.4], [0.3, 0.5, 1.0], [1.0, 0.6, 0.3], [0.3, 1.0, 0.6], [0.5, 0.4, 1.0]];

/// Radiance of a light in a channel relative to its luminance.
fn colour(light: usize, channel: usize) -> f64 {
    let luminance: f64 = COLOURS[light].iter().zip(LUMINANCE).map(|(c, l)| c * l).sum();
    COLOURS[light][channel] / luminance
}

/// Pixels of nearly the same targets under coloured lamps.
fn coloured(seed: u64, trials: u64) -> Vec<Toy> {
    let room = smooth();
    let run = |visibility| {
        let chain = Chain { visibility, ..TEMPORAL };
        measure(seed, trials, |random| {
            let carried = chain.run(&room, random);
            let channel = |channel| shade(&room, &carried, |light| colour(light, channel));
            [channel(0), channel(1), channel(2), shade(&room, &carried, |_| 1.0)]
        })
    };
    let (selected, averaged) = (run(Visibility::Selected), run(Visibility::Averaged));
    let names = [
        ("red", Claim::Biased(0.8, 0.99)),
        ("green", Claim::Biased(1.005, 1.05)),
        ("blue", Claim::Biased(1.01, 1.5)),
        ("luminance", Claim::Unbiased),
    ];
    let shared = names.into_iter().enumerate().map(|(i, (name, claim))| Toy {
        name: format!("coloured lights, temporal, {name}"),
        selected: selected[i],
        averaged: averaged[i],
        claim,
    });
    let own = (0..3).map(|channel| {
        let mut room = room.clone();
        for pixel in 0..RING {
            (0..LAMPS).for_each(|light| room.target[pixel][light] *= colour(light, channel));
        }
        let [selected, averaged] = both(seed, trials, &room, TEMPORAL);
        let name = format!("the same, a chain for {} alone", names[channel].0);
        Toy { name, selected, averaged, claim: Claim::Unbiased }
    });
    shared.chain(own).collect()
}

/// All of them.
pub fn run(seed: u64, trials: u64) -> Vec<Toy> {
    [combines(seed, trials), chains(seed, trials), coloured(seed, trials)].concat()
}
