//! Resampling of samples whose shift has a Jacobian ([`line`](super::line)), form by form of MIS: measurements and their report.

use super::forms::Form;
use super::line::{ESTIMATES, Jacobian, STAGES, Setting, VALUES, WIDTH};
use super::trials::measure;
use crate::stats::{FAMILY_RATE, Moments, POWER, ZTest, sidak};
use restir_shared::resample::mis::Mis;
use std::fmt::Write;

/// Jacobians that have to be seen.
pub const WRONG: [Jacobian; 2] = [Jacobian::LeftOut, Jacobian::Inverted];

/// What a setting gives, relative to the truth.
pub struct Measured {
    /// How the row was resampled.
    pub setting: Setting,
    /// A test that each value of [`Setting::estimate`] has the mean 1.
    pub tests: [ZTest; ESTIMATES],
}

/// The forms that are unbiased, without and with visibility.
pub fn settings(jacobian: Jacobian) -> Vec<Setting> {
    let forms = Form::ALL.into_iter().filter_map(|form| match form {
        Form::Library(mis) if mis != Mis::ONE_OVER_M && mis != Mis::CONSTANT => Some(mis),
        _ => None,
    });
    forms.flat_map(|form| [false, true].map(|visible| Setting { form, visible, jacobian })).collect()
}

/// What the value `index` of [`Setting::estimate`] is.
pub fn value_name(index: usize) -> String {
    let (stage, pixel) = (STAGES[index / VALUES], index % VALUES);
    if pixel < WIDTH { format!("{stage}, pixel {pixel}") } else { format!("{stage}, row") }
}

impl Measured {
    /// Over independent trials.
    pub fn new(setting: Setting, seed: u64, trials: u64) -> Self {
        let moments = measure(seed, trials, |random| setting.estimate(random));
        Self { setting, tests: moments.map(|moments| ZTest::new(moments, Moments::exact(1.0))) }
    }

    /// How often a right value may be refused, so that some one of all is with [`FAMILY_RATE`].
    pub fn share() -> f64 {
        sidak(FAMILY_RATE, settings(Jacobian::Right).len() * ESTIMATES)
    }

    /// Form of MIS, visibility, and what is wrong.
    pub fn name(&self) -> String {
        let visible = if self.setting.visible { ", visible" } else { "" };
        let jacobian = match self.setting.jacobian {
            Jacobian::Right => "",
            Jacobian::LeftOut => ", Jacobian left out",
            Jacobian::Inverted => ", Jacobian inverted",
        };
        format!("{}{visible}{jacobian}", Form::Library(self.setting.form).name())
    }

    /// The value of each stage that is least like 1.
    pub fn worst(&self) -> [&ZTest; 3] {
        let mut stages =
            self.tests.chunks(VALUES).map(|stage| stage.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())));
        std::array::from_fn(|_| stages.next().flatten().expect("each stage has values"))
    }

    /// Whether each stage has a value that is refused.
    pub fn refused(&self) -> [bool; 3] {
        self.worst().map(|test| test.p < Self::share())
    }
}

/// The report: the right estimates, and the wrong ones of fewer trials.
pub fn markdown(right: &[Measured], wrong: &[Measured], [trials, wrong_trials]: [u64; 2]) -> String {
    let share = Measured::share();
    let detectable =
        right.iter().flat_map(|row| &row.tests).map(|test| test.detectable_bias(share)).fold(0.0, f64::max);
    let [passed, seen] = [right, wrong].map(|rows| rows.iter().flat_map(Measured::refused).filter(|no| *no).count());
    let passed = STAGES.len() * right.len() - passed;
    let mut text = format!(
        "# Resampling of samples with a Jacobian

Six pixels in a row, in two frames, whose samples are bent numbers: a shift from pixel to pixel has a Jacobian other than 1, and
fails where the other pixel does not reach (`tests/src/resampling/line.rs`). The library's merge, in time and then in space, and
its exchange resample them; what each pixel receives has a closed form. The table has, of each stage, the pixel (or the row as a
whole) that is least like 1, in standard errors.

Made by `cargo lab resampling --shifts --trials {trials} --write`; `cargo test` runs the same rows with 50000.

## The right Jacobian

{passed} of {} stages pass: none of their values is refused. Some right value of all {} is refused with probability {FAMILY_RATE}.
A bias of {detectable:.5} of any pixel is noticed with probability {POWER}.

",
        STAGES.len() * right.len(),
        right.len() * ESTIMATES,
    );
    table(&mut text, right);
    let _ = write!(
        text,
        "
## Wrong Jacobians, {wrong_trials} trials

{seen} of {} stages are refused, by the same criterion.

",
        STAGES.len() * wrong.len(),
    );
    table(&mut text, wrong);
    text
}

fn table(text: &mut String, rows: &[Measured]) {
    *text += "| form | in time | in space | exchanged |\n|---|---:|---:|---:|\n";
    for row in rows {
        let [time, space, exchanged] = row.worst().map(|test| format!("{:.2}", test.z));
        let _ = writeln!(text, "| {} | {time} | {space} | {exchanged} |", row.name());
    }
}
