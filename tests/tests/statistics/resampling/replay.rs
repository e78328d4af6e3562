//! Auxiliary numbers of a mixture between the weight of a replayed sample and the replay itself, in `f64`: the toy of
//! `restir_shared::sampling::mixture`, of which samples are drawn here, in the order of the sequential shift.
//!
//! The first pixel resamples candidates. The second one takes the first one's distance as it is, and is given numbers for it by drawing gamma and
//! inverting. The third one replays these numbers: once for the weight, which has the Jacobian p2(r) / p3(r'), and once more for the sample that is
//! kept. Between passes a record is all that is left of gamma, so that both have to come of the same draw.

use restir_shared::resample::reservoir::Reservoir;
use restir_shared::sampling::mixture::{Gamma, choose, density, invert};
use restir_tests::random::SplitMix;
use restir_tests::resampling::trials::measure;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest, sidak};

const TRIALS: u64 = 400_000;
/// Of the first pixel.
const CANDIDATES: u32 = 4;
/// Of techniques that draw exponentially distributed distances.
const WEIGHTS: [f64; 2] = [0.25, 0.75];
/// The means of the distances, by pixel.
const SCALES: [[f64; 2]; 3] = [[1.0, 3.0], [0.9, 0.5], [0.4, 2.0]];
/// The integral of [`g`], half of that of e^{-1.7 r} (3 - cos 6 r).
const TRUTH: f64 = 1.5 / 1.7 - 0.5 * 1.7 / (1.7 * 1.7 + 36.0);

fn g(r: f64) -> f64 {
    (-1.7 * r).exp() * (1.0 + (3.0 * r).sin().powi(2))
}

fn densities(pixel: usize, r: f64) -> [f64; 2] {
    SCALES[pixel].map(|scale| (-r / scale).exp() / scale)
}

fn density_at(pixel: usize, r: f64) -> f64 {
    density(&WEIGHTS, &densities(pixel, r))
}

/// The first pixel's distance and its contribution weight.
fn resampled(random: &mut SplitMix) -> (f64, f64) {
    let mut reservoir = Reservoir::empty(0.0);
    for _ in 0..CANDIDATES {
        let technique = choose(&WEIGHTS, random.unit()).technique;
        let r = -SCALES[0][technique as usize] * (-random.unit()).ln_1p();
        reservoir.update(r, g(r) / density_at(0, r), 1.0, random.unit());
    }
    (reservoir.sample, reservoir.contribution_weight(1.0 / f64::from(CANDIDATES), g(reservoir.sample)))
}

/// The third pixel's distance by numbers that are drawn for one of the second pixel.
fn replayed(r: f64, random: &mut SplitMix) -> f64 {
    let gamma = Gamma { technique: random.unit(), place: random.unit() };
    let numbers = invert(&WEIGHTS, &densities(1, r), gamma);
    // all pixels have the same weights, so that the number chooses the same technique
    let technique = choose(&WEIGHTS, numbers.choice).technique as usize;
    r * SCALES[2][technique] / SCALES[1][technique]
}

/// The estimate by the same draw for weight and sample, and by one draw each.
fn estimates(random: &mut SplitMix) -> [f64; 2] {
    let (r, weight) = resampled(random);
    let weighed = replayed(r, random);
    let weight = weight * density_at(1, r) / density_at(2, weighed);
    [weighed, replayed(r, random)].map(|kept| g(kept) * weight)
}

/// What the second estimate is in the mean: of what a distance of the second pixel may become, the mean of weights times the mean of values.
fn mean_if_redrawn() -> f64 {
    let of_distance = |r: f64| {
        let mean = |value: &dyn Fn(f64) -> f64| -> f64 {
            let share = |t: usize| WEIGHTS[t] * densities(1, r)[t] / density_at(1, r);
            (0..2).map(|t| share(t) * value(r * SCALES[2][t] / SCALES[1][t])).sum()
        };
        density_at(1, r) * mean(&|there| 1.0 / density_at(2, there)) * mean(&g)
    };
    // by Simpson's rule; what is beyond falls as e^{-0.7 r}, and derivatives of the fourth order are below 10^5
    let (steps, width) = (200_000_u32, 60.0 / 200_000.0);
    let weight = |i: u32| if i.is_multiple_of(steps) { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    (0..=steps).map(|i| weight(i) * of_distance(f64::from(i) * width)).sum::<f64>() * width / 3.0
}

/// With the same numbers the estimate is the integral; with numbers that are drawn anew it is what such a mixture of two distances is in the mean,
/// which the first test refuses.
pub(crate) fn numbers_are_kept_between_weight_and_replay() {
    let [kept, redrawn] = measure(17, TRIALS, estimates);
    let (expected, share) = (mean_if_redrawn(), sidak(FAMILY_RATE, 2));
    let [right, wrong] = [(kept, TRUTH), (redrawn, expected)].map(|(of, is)| ZTest::new(of, Moments::exact(is)));
    let refused = ZTest::new(redrawn, Moments::exact(TRUTH));
    println!(
        "kept {:.5}, redrawn {:.5}, expected {TRUTH:.5} and {expected:.5}; a bias of {:.2} % is noticed with probability {POWER}, a false alarm has \
         the probability {FAMILY_RATE}; redrawn numbers are {:.0} standard errors off",
        kept.mean(),
        redrawn.mean(),
        100.0 * right.detectable_bias(share) / TRUTH,
        refused.z.abs(),
    );
    let mut family = Family::new("numbers between weight and replay", FAMILY_RATE);
    family.z_test("kept", right);
    family.z_test("redrawn", wrong);
    family.assert();
    assert!(refused.p < share, "numbers that are drawn anew pass: {refused:?}");
}
