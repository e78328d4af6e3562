//! The stream: what is kept, and how often.

use super::support::LAST;
use restir_shared::resample::reservoir::Reservoir;
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, Family};

const WEIGHTS: [f32; 8] = [3.0, 0.0, 1.0, 0.25, 7.0, 0.001, 2.0, 5.0];
const DRAWS: u64 = 1_000_000;

/// A uniform number of 24 bits.
fn unit(random: &mut SplitMix) -> f32 {
    (random.word() >> 40) as f32 / 16_777_216.0
}

fn stream(items: impl Iterator<Item = usize>, random: &mut SplitMix) -> Reservoir<usize, f32> {
    let mut reservoir = Reservoir::empty(usize::MAX);
    for i in items {
        reservoir.update(i, WEIGHTS[i], 1.0, unit(random));
    }
    reservoir
}

fn share(item: usize) -> f64 {
    f64::from(WEIGHTS[item]) / WEIGHTS.iter().map(|&w| f64::from(w)).sum::<f64>()
}

pub(crate) fn samples_are_kept_by_their_weight() {
    let mut family = Family::new("stream", FAMILY_RATE);
    for seed in 0..5_u64 {
        // each seed has an order of its own
        let items = || (0..8).map(|i| (i * 3 + seed as usize) % 8);
        let kept = |index| stream(items(), &mut SplitMix::new((seed << 40) + index)).sample;
        family.histogram(format!("seed {seed}"), 8, DRAWS, kept, share);
    }
    family.assert();
}

pub(crate) fn merged_streams_are_one() {
    let mut family = Family::new("merged streams", FAMILY_RATE);
    for split in [1, 3, 5] {
        let kept = |index| {
            let mut random = SplitMix::new(index);
            let mut first = stream(0..split, &mut random);
            let second = stream(split..8, &mut random);
            first.update(second.sample, second.weight_sum, second.confidence, unit(&mut random));
            assert_eq!(first.confidence, 8.0, "the confidence is the number of items");
            first.sample
        };
        family.histogram(format!("{split} and the others"), 8, DRAWS, kept, share);
    }
    family.assert();
}

/// At both ends of the numbers, over all magnitudes of weights.
pub(crate) fn weight_zero_is_never_kept_and_the_first_always() {
    for index in 0..DRAWS {
        let mut random = SplitMix::new(index);
        let weight = (random.range(-100.0, 100.0).exp2() as f32).max(7.888_609e-31);
        for u in [0.0, LAST as f32, unit(&mut random)] {
            let mut reservoir = Reservoir::empty(0);
            let before = reservoir.update(1, 0.0, 1.0, u);
            let first = reservoir.update(2, weight, 1.0, u);
            let after = reservoir.update(3, 0.0, 1.0, u);
            let fits = !before & first & !after & (reservoir.sample == 2);
            assert!(fits, "{weight:e} by {u}: {before}, {first}, {after}, {}", reservoir.sample);
            let weight_of_none = Reservoir::<u32, f32>::empty(0).contribution_weight(1.0, weight);
            assert!(weight_of_none == 0.0, "nothing has the weight {weight_of_none}");
        }
    }
}

/// `<=` in place of `<` keeps what has no weight.
pub(crate) fn a_comparison_with_equality_is_seen() {
    let keeps = |weight: f32, sum: f32, u: f32| u * sum <= weight;
    assert!(keeps(0.0, 1.0, 0.0) & keeps(0.0, 0.0, 0.5), "equality would do no harm");
}
