//! Reuse between domains: shifts with a Jacobian.

use crate::support::{MIS, is_unbiased};
use restir_shared::resample::mis::Mis;
use restir_tests::random::SplitMix;
use restir_tests::resampling::line::{Jacobian, Setting, run};
use restir_tests::resampling::trials::measure;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest, sidak};

/// Of a row; `cargo xtask resampling --write` makes 10^7.
const TRIALS: u64 = 50_000;
const WRONG: [Jacobian; 2] = [Jacobian::LeftOut, Jacobian::Inverted];

/// All forms that are unbiased, without and with visibility, after each of three stages.
pub(crate) fn shifts_are_unbiased() {
    let mut family = Family::new("shift", FAMILY_RATE);
    let rows = run(5, TRIALS);
    let share = sidak(FAMILY_RATE, rows.len());
    let mut worst: f64 = 0.0;
    for (name, measured) in rows {
        let test = ZTest::new(measured, Moments::exact(1.0));
        worst = worst.max(test.detectable_bias(share));
        family.z_test(name, test);
    }
    println!("a bias of {worst:.4} is noticed with probability {POWER} in any row");
    family.assert();
}

/// With half as many trials the same tests refuse estimates without a Jacobian, and with the inverse one, of every form after
/// two of the stages or more: where they are off in either direction, errors of pixels may cancel.
pub(crate) fn shifts_need_their_jacobian() {
    let share = sidak(FAMILY_RATE, 42);
    for form in MIS.into_iter().filter(|&form| is_unbiased(form)) {
        for (visible, jacobian) in
            [false, true].into_iter().flat_map(|visible| WRONG.map(|jacobian| (visible, jacobian)))
        {
            let setting = Setting { form, visible, jacobian };
            let wrong = measure(5, TRIALS / 2, |random| setting.estimate(random));
            let wrong = wrong.map(|measured| ZTest::new(measured, Moments::exact(1.0)));
            let refused = wrong.iter().filter(|test| test.p < share / 10.0).count();
            assert!(refused >= 2, "{form:?}, visible {visible}, {jacobian:?} passes: {wrong:?}");
        }
    }
}

/// For random confidence and random numbers of neighbours, through the same code. The wrong Jacobian is seen.
pub(crate) fn weights_of_a_shifted_sample_sum_to_one() {
    for form in MIS.into_iter().filter(|form| !form.is_after_selection() && *form != Mis::CONSTANT) {
        let worst = |jacobian| {
            let setting = Setting { form, visible: false, jacobian };
            let sums = (0..2_000).map(|index| setting.weight_sums(&mut SplitMix::new(index)));
            sums.fold([0.0_f64; 3], |worst, sums| std::array::from_fn(|i| worst[i].max((sums[i] - 1.0).abs())))
        };
        let right = worst(Jacobian::Right);
        assert!(right.iter().all(|&error| error < 1.0e-4), "{form:?}: off by {right:?}");
        for jacobian in WRONG {
            let wrong = worst(jacobian);
            assert!(wrong.iter().all(|&error| error > 0.01), "{form:?}, {jacobian:?} sums to one: {wrong:?}");
        }
    }
}
