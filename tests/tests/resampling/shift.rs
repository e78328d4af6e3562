//! Reuse between domains: a neighbour on [0, 2], the canonical pixel on [0, 1], and the shift x -> x / 2 between them.

use crate::support::{FAMILY_RATE, MIS, family, is_unbiased, report};
use libtest_mimic::Failed;
use restir_shared::resample::mis::Mis;
use restir_shared::resample::reservoir::Reservoir;
use restir_tests::random::SplitMix;
use restir_tests::resampling::forms::{Form, Input};
use restir_tests::resampling::trials::measure;
use restir_tests::stats::{Moments, ZTest};
use restir_tests::suite::ensure;

const JACOBIAN: f64 = 0.5;

/// The integrand and target of the canonical pixel; its integral over [0, 1] is 1.5.
fn canonical(x: f64) -> f64 {
    1.0 + x
}

/// The target of the neighbour on [0, 2], zero on half of it.
fn neighbour(x: f64) -> f64 {
    if x < 1.0 { 0.5 + x } else { 0.0 }
}

/// Resampling of three uniform points on [0, length].
fn draw(random: &mut SplitMix, length: f64, target: fn(f64) -> f64) -> (f64, f64) {
    let mut reservoir = Reservoir::empty(0.0);
    for _ in 0..3 {
        let x = length * random.unit();
        reservoir.update(x, target(x) * length / 3.0, 1.0, random.unit());
    }
    (reservoir.sample, reservoir.contribution_weight(1.0, target(reservoir.sample)))
}

/// One estimate relative to the truth, the contribution weight of the shifted sample being multiplied by `jacobian`.
fn estimate(form: Mis, jacobian: f64, random: &mut SplitMix) -> f64 {
    let (own, other) = (draw(random, 1.0, canonical), draw(random, 2.0, neighbour));
    let y = [own.0, JACOBIAN * other.0];
    let inputs = [
        Input { confidence: 1.0, contribution: canonical(y[0]) * own.1 },
        Input { confidence: 2.0, contribution: canonical(y[1]) * other.1 * jacobian },
    ];
    // the neighbour's target pulled into the canonical domain
    let a = |j: usize, i: usize| if j == 0 { canonical(y[i]) } else { neighbour(y[i] / JACOBIAN) / JACOBIAN };
    let combined = Form::Library(form).combine(&inputs, a, || random.unit());
    let x = y[combined.reservoir.sample];
    canonical(x) * combined.reservoir.contribution_weight(combined.share, canonical(x)) / 1.5
}

/// Unbiased with the Jacobian; the same test refuses the estimate without.
pub(crate) fn shifts_need_their_jacobian() -> Result<(), Failed> {
    let mut family = family("shift");
    for mis in MIS.into_iter().filter(|&mis| is_unbiased(mis)) {
        let [right, wrong] =
            measure(5, 100_000, |random| [JACOBIAN, 1.0].map(|jacobian| estimate(mis, jacobian, random)));
        family.z_test(format!("{mis:?}"), ZTest::new(right, Moments::exact(1.0)));
        let wrong = ZTest::new(wrong, Moments::exact(1.0));
        ensure(wrong.p < FAMILY_RATE / 10.0, || format!("{mis:?} without the Jacobian passes: {wrong:?}"))?;
    }
    report(&family)
}
