//! The forms at work: initial reservoirs drawn once for all, combined in each way.

use super::expectation::{expectation, truth};
use super::forms::{Form, Input};
use super::setting::Setting;
use super::table::{LIGHTS, PIXELS, radiance, visible};
use crate::random::SplitMix;
use crate::stats::{Moments, moments};
use restir_shared::resample::reservoir::Reservoir;

/// Trials that a thread does at a time.
const BLOCK: u64 = 1 << 13;

/// Moments of `N` values over `trials` independent trials, each with random numbers of its own.
pub fn measure<const N: usize>(
    seed: u64,
    trials: u64,
    trial: impl Fn(&mut SplitMix) -> [f64; N] + Sync,
) -> [Moments; N] {
    let moments = moments(trials, BLOCK, N, |index| trial(&mut SplitMix::new((seed << 40) + index)));
    std::array::from_fn(|i| moments[i])
}

/// What a pixel keeps of its candidates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// The light.
    pub light: usize,
    /// Its contribution weight.
    pub weight: f64,
}

impl Kept {
    /// Resampling of uniformly chosen lights by a target.
    pub fn draw(random: &mut SplitMix, lights: usize, candidates: u32, target: impl Fn(usize) -> f64) -> Self {
        let mut reservoir = Reservoir::empty(0);
        let share = lights as f64 / f64::from(candidates);
        for _ in 0..candidates {
            let light = random.below(lights);
            reservoir.update(light, target(light) * share, 1.0, random.unit());
        }
        let light = reservoir.sample;
        Self { light, weight: reservoir.contribution_weight(1.0, target(light)) }
    }
}

impl Setting {
    /// The initial reservoirs, before visibility reuse.
    pub fn draw(&self, random: &mut SplitMix) -> [Kept; PIXELS] {
        std::array::from_fn(|pixel| {
            Kept::draw(random, LIGHTS, self.confidence[pixel], |light| self.target(pixel, light))
        })
    }

    /// One estimate from initial reservoirs and one uniform number for each; `a(pixel, light)` is what the MIS weights are
    /// told.
    pub fn estimate(
        &self,
        form: Form,
        kept: &[Kept; PIXELS],
        a: impl Fn(usize, usize) -> f64,
        u: &[f64; PIXELS],
    ) -> f64 {
        let inputs: [Input<f64>; PIXELS] = std::array::from_fn(|pixel| {
            let Kept { light, weight } = kept[pixel];
            let lost = self.switches.zero & !visible(pixel, light);
            let contribution = if lost { 0.0 } else { self.target(0, light) * weight };
            Input { confidence: f64::from(self.confidence[pixel]), contribution }
        });
        let mut u = u.iter();
        let next = || *u.next().expect("a number for each input");
        let combined = form.combine(&inputs, |receiver, sample| a(receiver, kept[sample].light), next);
        let light = kept[combined.reservoir.sample].light;
        let weight = combined.reservoir.contribution_weight(combined.share, self.target(0, light));
        radiance(0, light) * weight
    }
}

/// The values of a function of pixel and light.
pub fn table(value: impl Fn(usize, usize) -> f64) -> [[f64; LIGHTS]; PIXELS] {
    std::array::from_fn(|pixel| std::array::from_fn(|light| value(pixel, light)))
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// The form.
    pub form: Form,
    /// Of the estimate relative to the truth.
    pub measured: Moments,
    /// What it should be.
    pub expected: f64,
}

impl Row {
    /// The deviation from the expectation in standard errors.
    pub fn z(&self) -> f64 {
        (self.measured.mean() - self.expected) / self.measured.standard_error()
    }

    /// The standard deviation of one estimate, relative to the truth.
    pub fn relative_deviation(&self) -> f64 {
        self.measured.variance().sqrt()
    }

    /// Whether the form estimates something else than the truth.
    pub fn is_biased(&self) -> bool {
        (self.expected - 1.0).abs() > 1e-12
    }
}

/// Runs all forms in a setting on the same initial reservoirs.
pub fn run(seed: u64, setting: Setting, trials: u64) -> Vec<Row> {
    let told = table(|pixel, light| setting.mis_target(pixel, light));
    let scale = truth().recip();
    let measured = measure(seed, trials, |random| {
        let kept = setting.draw(random);
        let u = std::array::from_fn(|_| random.unit());
        Form::ALL.map(|form| setting.estimate(form, &kept, |pixel, light| told[pixel][light], &u) * scale)
    });
    let row = |(form, measured)| Row { setting, form, measured, expected: expectation(form, &setting) };
    Form::ALL.into_iter().zip(measured).map(row).collect()
}
