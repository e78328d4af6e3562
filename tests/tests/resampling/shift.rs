//! Reuse between domains: shifts with a Jacobian.

use crate::support::{MIS, report};
use libtest_mimic::Failed;
use restir_shared::resample::mis::Mis;
use restir_tests::random::SplitMix;
use restir_tests::resampling::line::{Jacobian, Setting};
use restir_tests::resampling::shifted::{FAMILY_RATE, Measured, WRONG, settings, value_name};
use restir_tests::stats::{Family, POWER};
use restir_tests::suite::ensure;

/// Of a row; `cargo xtask resampling --shifts --write` makes 10^7.
const TRIALS: u64 = 50_000;

/// All forms that are unbiased, without and with visibility: each pixel, after each of three stages.
pub(crate) fn shifts_are_unbiased() -> Result<(), Failed> {
    let mut family = Family::new("shift", FAMILY_RATE);
    let mut worst: f64 = 0.0;
    for setting in settings(Jacobian::Right) {
        let row = Measured::new(setting, 5, TRIALS);
        for (index, test) in row.tests.into_iter().enumerate() {
            worst = worst.max(test.detectable_bias(Measured::share()));
            family.z_test(format!("{}, {}", row.name(), value_name(index)), test);
        }
    }
    println!("a bias of {worst:.4} of any pixel is noticed with probability {POWER}");
    report(&family)
}

/// With half as many trials the same tests refuse estimates without a Jacobian, and with the inverse one, of every form after
/// each stage.
pub(crate) fn shifts_need_their_jacobian() -> Result<(), Failed> {
    for setting in WRONG.into_iter().flat_map(settings) {
        let row = Measured::new(setting, 5, TRIALS / 2);
        ensure(row.refused() == [true; 3], || format!("{} passes: {:?}", row.name(), row.worst()))?;
    }
    Ok(())
}

/// For random confidence and random numbers of neighbours, through the same code. The wrong Jacobian is seen.
pub(crate) fn weights_of_a_shifted_sample_sum_to_one() -> Result<(), Failed> {
    for form in MIS.into_iter().filter(|form| !form.is_after_selection() && *form != Mis::CONSTANT) {
        let worst = |jacobian| {
            let setting = Setting { form, visible: false, jacobian };
            let sums = (0..2_000).map(|index| setting.weight_sums(&mut SplitMix::new(index)));
            sums.fold([0.0_f64; 3], |worst, sums| std::array::from_fn(|i| worst[i].max((sums[i] - 1.0).abs())))
        };
        let right = worst(Jacobian::Right);
        ensure(right.iter().all(|&error| error < 1.0e-4), || format!("{form:?}: off by {right:?}"))?;
        for jacobian in WRONG {
            let wrong = worst(jacobian);
            ensure(wrong.iter().all(|&error| error > 0.01), || {
                format!("{form:?}, {jacobian:?} sums to one: {wrong:?}")
            })?;
        }
    }
    Ok(())
}
