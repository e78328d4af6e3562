//! The table of forms and settings, in the reduced form of `cargo lab resampling`.

use super::support::near;
use restir_tests::random::SplitMix;
use restir_tests::resampling::expectation::expectation;
use restir_tests::resampling::forms::Form;
use restir_tests::resampling::report::published;
use restir_tests::resampling::setting::{EQUAL, Setting};
use restir_tests::resampling::table::{FULL, LIGHTS, PIXELS, SEED, VISIBLE, ZEROED};
use restir_tests::resampling::trials::{Row, run};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest, sidak};
use std::sync::OnceLock;

fn rows() -> &'static [Row] {
    static ROWS: OnceLock<Vec<Row>> = OnceLock::new();
    ROWS.get_or_init(|| (101..).zip(Setting::ALL).flat_map(|(seed, setting)| run(seed, setting, 400_000)).collect())
}

pub(crate) fn the_table_is_what_its_seed_makes() {
    let mut random = SplitMix::new(SEED);
    for pixel in 0..PIXELS {
        for light in 0..LIGHTS {
            let u = random.unit();
            let target = ((u * u + 0.02) * 1e4).round() / 1e4;
            let is_zeroed = (random.unit() < 0.15) & (pixel > 0);
            let is_visible = random.unit() < 0.7;
            let drawn = (target, u8::from(is_zeroed), u8::from(is_visible));
            let kept = (FULL[pixel][light], ZEROED[pixel][light], VISIBLE[pixel][light]);
            assert!(drawn == kept, "pixel {pixel}, light {light}: {drawn:?} and {kept:?}");
        }
    }
}

/// Unbiased rows at 1, biased and literal ones at the value that is computed for them; and the same test refuses each
/// biased row at 1.
pub(crate) fn forms_have_their_expectation() {
    let mut family = Family::new("forms", FAMILY_RATE);
    for row in rows() {
        let name = format!("{}, {}", row.form.name(), row.setting.name());
        family.z_test(name, ZTest::new(row.measured, Moments::exact(row.expected)));
    }
    let share = sidak(FAMILY_RATE, rows().len());
    let bias = |row: &Row| ZTest::new(row.measured, Moments::exact(row.expected)).detectable_bias(share);
    let unbiased = rows().iter().filter(|row| !row.is_biased());
    let worst = unbiased.map(bias).fold(0.0, f64::max);
    println!("a bias of {worst:.4} in any of the unbiased rows is noticed with probability {POWER}");
    for row in rows().iter().filter(|row| row.is_biased()) {
        let as_unbiased = ZTest::new(row.measured, Moments::exact(1.0));
        assert!(as_unbiased.p < share, "{} passes as unbiased: {as_unbiased:?}", row.form.name());
    }
    family.assert();
}

/// Which rows are biased at all, by computation: those of 1/M and constant weights; contribution MIS and Talbot's as
/// printed; and all, darker, where the MIS weights do not know of the visibility reuse.
pub(crate) fn unbiased_forms_are_as_stated() {
    for setting in Setting::ALL {
        let is_informed = setting.switches.mis | !setting.switches.zero;
        for form in Form::ALL {
            let name = form.name();
            let expected = expectation(form, &setting);
            let wanted = match form {
                Form::LiteralContribution if is_informed & (setting.confidence == EQUAL) => near(expected, 4.0, 1e-12),
                Form::LiteralContribution => expected > 3.0,
                Form::LiteralTalbot if is_informed & (setting.confidence == EQUAL) => near(expected, 1.0, 1e-12),
                Form::LiteralTalbot => expected < 0.9,
                _ if ["1/M", "constant"].contains(&name) => expected < 0.9,
                _ if is_informed => near(expected, 1.0, 1e-12),
                _ => expected < 0.95,
            };
            assert!(wanted, "{name}, {}: {expected}", setting.name());
        }
    }
    let deviation = |name: &str, setting: usize| {
        let row = rows().iter().find(|row| (row.form.name() == name) & (row.setting == Setting::ALL[setting]));
        row.expect("all forms are there").relative_deviation()
    };
    for setting in [0, 1] {
        let (z, contribution) = (deviation("1/Z", setting), deviation("contribution", setting));
        assert!(z > contribution, "1/Z has the deviation {z}, contribution MIS {contribution}");
    }
}

pub(crate) fn biased_rows_are_those_of_the_published_toy() {
    for row in rows() {
        if let Some([mean, deviation]) = published(row) {
            // the published mean has an error of its own
            let allowed = 0.01 + 3.0 * deviation / 400_000.0_f64.sqrt();
            assert!(
                (row.expected - mean).abs() <= allowed,
                "{}, {}: {} and {mean}",
                row.form.name(),
                row.setting.name(),
                row.expected
            );
        }
    }
}
