//! Visibility averaged over what competed.

use super::support::near;
use restir_shared::resample::mis::Mis;
use restir_tests::random::SplitMix;
use restir_tests::resampling::averaging::{Carried, Chain, Visibility};
use restir_tests::resampling::forms::{Form, Input};
use restir_tests::resampling::toys::{Claim, SPATIAL, TEMPORAL, Toy, extreme, run, smooth};
use restir_tests::resampling::trials::measure;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest, sidak};

const TRIALS: u64 = 40_000;

/// Unbiased claims by z-tests; of the others, that the same test sees the bias and that it is as large as claimed.
pub(crate) fn averaging_is_unbiased_where_claimed() {
    let toys = run(0, TRIALS);
    let share = sidak(FAMILY_RATE, 2 * toys.len());
    let mut family = Family::new("averaged visibility", FAMILY_RATE);
    let one = |moments| ZTest::new(moments, Moments::exact(1.0));
    let mut worst: f64 = 0.0;
    for Toy { name, selected, averaged, claim } in toys {
        family.z_test(format!("{name}, selected"), one(selected));
        let (mean, test) = (averaged.mean(), one(averaged));
        match claim {
            Claim::Unbiased => {
                worst = worst.max(test.detectable_bias(share));
                family.z_test(name, test);
            }
            Claim::Near(low, high) => assert!((low..high).contains(&mean), "{name}: {mean}"),
            Claim::Biased(low, high) => {
                assert!(test.p < share, "{name} passes as unbiased: {mean}");
                assert!((low..high).contains(&mean), "{name}: {mean}");
            }
        }
    }
    println!("a bias of {worst:.3} is noticed with probability {POWER} in any unbiased row");
    family.assert();
}

/// The samples, weights and confidence are the same, bit by bit, and the averaged visibility varies less.
pub(crate) fn averaging_changes_no_reservoir() {
    let parts = |c: Carried| (c.light, c.weight.to_bits(), c.confidence.to_bits());
    for chain in [TEMPORAL, SPATIAL] {
        for room in [extreme(), smooth()] {
            let selected = Chain { visibility: Visibility::Selected, ..chain };
            let mut moments = [Moments::default(); 2];
            for index in 0..2_000 {
                let runs = [selected, chain].map(|chain| chain.run(&room, &mut SplitMix::new(index)));
                assert!(runs[0].map(parts) == runs[1].map(parts), "run {index}: {runs:?}");
                for (moments, run) in moments.iter_mut().zip(runs) {
                    assert!(run.iter().all(|c| (0.0..=1.0 + 1e-12).contains(&c.visibility)), "{run:?}");
                    moments.push(run[0].visibility);
                }
            }
            let [selected, averaged] = moments.map(|moments| moments.variance());
            assert!(averaged < selected / 1.5, "the variance falls from {selected} to {averaged}");
        }
    }
}

/// The mean over inputs, recomputed in another order; zero where nothing has a weight.
pub(crate) fn the_average_is_the_weighted_mean() {
    for index in 0..10_000 {
        let mut random = SplitMix::new(index);
        let inputs = [(); 5].map(|()| Input {
            confidence: 1.0 + random.below(9) as f32,
            contribution: if random.below(3) == 0 { 0.0 } else { random.unit() as f32 },
        });
        let visibility = [(); 5].map(|()| random.unit() as f32);
        let a = [(); 25].map(|()| random.unit() as f32);
        let form = Form::Library(Mis::PAIRWISE);
        let combined = form.combine(&inputs, |j, i| a[5 * j + i], || random.unit() as f32);
        let weights = combined.weights.map(f64::from);
        let sum: f64 = weights.iter().rev().sum();
        let weighted: f64 = (0..5).rev().map(|i| weights[i] * f64::from(visibility[i])).sum();
        let wanted = if sum > 0.0 { weighted / sum } else { 0.0 };
        let average = f64::from(combined.average(5, |i| visibility[i]));
        assert!(near(average, wanted, 1e-6), "{average} for {wanted}");
    }
}

/// `sum V w / sum w` alone (Bekaert et al. 2000) estimates `integral p V / integral p` with a bias that falls as 1 / n.
pub(crate) fn a_normaliser_alone_is_biased_by_one_over_n() {
    // the weight is 0.1 + x, what is above 1/2 is visible
    let exact = (0.05 + 0.375) / 0.6;
    let bias = |n: u32| {
        let [moments] = measure(u64::from(n), 1_000_000, |random| {
            let (mut sum, mut visible) = (0.0, 0.0);
            for _ in 0..n {
                let x = random.unit();
                sum += 0.1 + x;
                visible += if x > 0.5 { 0.1 + x } else { 0.0 };
            }
            [visible / sum]
        });
        [(moments.mean() - exact) * f64::from(n), moments.standard_error() * f64::from(n)]
    };
    let [few, more] = [bias(4), bias(16)];
    println!("bias times n: {few:.5?} for 4, {more:.5?} for 16");
    assert!(few[0].abs() > 10.0 * few[1], "no bias: {few:?}");
    assert!((more[0] / few[0] - 1.0).abs() < 0.25 + 4.0 * more[1] / few[0].abs(), "{few:?} and {more:?}");
}
