//! Reuse between domains: shifts with a Jacobian.

use super::support::MIS;
use restir_shared::resample::mis::Mis;
use restir_tests::random::SplitMix;
use restir_tests::resampling::line::{Jacobian, Setting};
use restir_tests::resampling::shifted::{Measured, WRONG, settings, value_name};
use restir_tests::stats::{FAMILY_RATE, Family, POWER};

/// Of a row; `cargo lab resampling --shifts` makes more.
const TRIALS: u64 = 50_000;

/// All forms that are unbiased, without and with visibility: each pixel, after each of three stages.
pub(crate) fn shifts_are_unbiased() {
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
    family.assert();
}

/// With half as many trials the same tests refuse estimates without a Jacobian, and with the inverse one, of every form after
/// each stage.
pub(crate) fn shifts_need_their_jacobian() {
    for setting in WRONG.into_iter().flat_map(settings) {
        let row = Measured::new(setting, 5, TRIALS / 2);
        assert_eq!(row.refused(), [true; 3], "{} passes: {:?}", row.name(), row.worst());
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
