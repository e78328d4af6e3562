//! Merges of merges.

use restir_shared::num::Scalar;
use restir_shared::resample::mis::Mis;
use restir_shared::resample::reservoir::Reservoir;
use restir_tests::random::SplitMix;
use restir_tests::resampling::expectation::truth;
use restir_tests::resampling::forms::{Form, Input, Real};
use restir_tests::resampling::table::{LIGHTS, radiance, target};
use restir_tests::resampling::trials::{Kept, measure};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};

const MERGES: u64 = 1_000_000;
/// Merges whose mean counts as one value: many times as many as the history remembers.
const BLOCK: u64 = 2_000;
const CAP: f64 = 20.0;
const FORMS: [Mis; 3] = [Mis::TALBOT, Mis::PAIRWISE_DEFENSIVE, Mis::CONTRIBUTION];

/// Means, relative to the truth, over the blocks of one chain whose history counts for at most [`CAP`] frames.
fn block_means<T: Real>(form: Mis) -> Vec<f64> {
    let mut random = SplitMix::new(11);
    let mut history = (0, T::ZERO, T::ZERO);
    let mut blocks = Vec::new();
    let mut sum = 0.0;
    for merge in 1..=MERGES {
        let fresh = Kept::draw(&mut random, LIGHTS, 4, |light| target(0, light));
        let (light, weight, confidence) = history;
        let capped: f64 = confidence.into();
        let carried = [(fresh.light, T::of(fresh.weight), T::ONE), (light, weight, T::of(capped.min(CAP)))];
        let p = |i: usize| T::of(target(0, carried[i].0));
        let inputs = [0, 1].map(|i| Input { confidence: carried[i].2, contribution: p(i) * carried[i].1 });
        let u = || T::of((random.word() >> 40) as f64 / 16_777_216.0);
        let combined = Form::Library(form).combine(&inputs, |_, i| p(i), u);
        let selected = combined.reservoir.sample;
        let weight = combined.reservoir.contribution_weight(combined.share, p(selected));
        let light = carried[selected].0;
        history = (light, weight, combined.reservoir.confidence);
        let confidence: f64 = history.2.into();
        let expected = (merge as f64).min(CAP + 1.0);
        assert!(confidence == expected, "merge {merge}: the confidence is {confidence}");
        let weight: f64 = weight.into();
        assert!(weight.is_finite(), "merge {merge}: the weight is {weight}");
        sum += radiance(0, light) * weight / truth();
        if merge % BLOCK == 0 {
            blocks.push(std::mem::take(&mut sum) / BLOCK as f64);
        }
    }
    blocks
}

/// The mean is the truth, and that of the first half is that of the second.
pub(crate) fn a_million_merges_do_not_drift() {
    let mut family = Family::new("a million merges", FAMILY_RATE);
    for form in FORMS {
        for (name, blocks) in [("f32", block_means::<f32>(form)), ("f64", block_means::<f64>(form))] {
            let (first, second) = blocks.split_at(blocks.len() / 2);
            let [all, first, second] = [&blocks[..], first, second].map(|b| b.iter().copied().collect::<Moments>());
            let name = format!("{form:?} in {name}");
            family.z_test(format!("{name}, mean"), ZTest::new(all, Moments::exact(1.0)));
            family.z_test(format!("{name}, drift"), ZTest::new(first, second));
        }
    }
    family.assert();
}

const DEPTH: usize = 8;
type Function = fn(f64) -> f64;
/// Functions and their integrals over [0, 1].
const FUNCTIONS: [(Function, f64); 5] = [
    (|_| 1.0, 1.0),
    (|x| x, 0.5),
    (|x| x * x * x, 0.25),
    (|x| (std::f64::consts::TAU * x).sin(), 0.0),
    (|x| if x < 0.3 { 1.0 } else { 0.0 }, 0.3),
];

/// The target of a merge.
fn p(merge: usize, x: f64) -> f64 {
    match merge % 3 {
        0 => 0.2 + x,
        1 => 1.1 - x,
        _ => 0.3 + 4.0 * (x - 0.5) * (x - 0.5),
    }
}

/// `g(X) W` for all functions after each of the merges with a pixel of another target.
fn chain(form: Mis, random: &mut SplitMix) -> [f64; 5 * DEPTH] {
    let mut carried = (0.0, 0.0, 0.0);
    let mut values = [0.0; 5 * DEPTH];
    for merge in 0..DEPTH {
        let mut fresh = Reservoir::empty(0.0);
        for _ in 0..3 {
            let x = random.unit();
            fresh.update(x, p(merge, x) * (1.0 / 3.0), 1.0, random.unit());
        }
        let weight = fresh.contribution_weight(f64::ONE, p(merge, fresh.sample));
        let both = [(fresh.sample, weight, fresh.confidence), carried];
        let inputs = both.map(|(x, weight, confidence)| Input { confidence, contribution: p(merge, x) * weight });
        // input 1 comes from the pixel of the merge before
        let a = |j: usize, i: usize| p(merge + 2 * j, both[i].0);
        let combined = Form::Library(form).combine(&inputs, a, || random.unit());
        let x = both[combined.reservoir.sample].0;
        let weight = combined.reservoir.contribution_weight(combined.share, p(merge, x));
        carried = (x, weight, combined.reservoir.confidence);
        for (i, (g, _)) in FUNCTIONS.iter().enumerate() {
            values[5 * merge + i] = g(x) * weight;
        }
    }
    values
}

/// E[g(X) W] is the integral of g after any number of merges.
pub(crate) fn chains_integrate_any_function() {
    let mut family = Family::new("functions and chains", FAMILY_RATE);
    for form in FORMS {
        let moments = measure(3, 60_000, |random| chain(form, random));
        for (at, moments) in moments.into_iter().enumerate() {
            let exact = Moments::exact(FUNCTIONS[at % 5].1);
            family.z_test(format!("{form:?}, function {}, merge {}", at % 5, at / 5 + 1), ZTest::new(moments, exact));
        }
    }
    family.assert();
}
