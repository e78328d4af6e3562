//! Functions at the ends of their ranges against a shadow in `f64`: what `cargo xtask stress` reports.
//!
//! A [`Row`] is a function with its parameters, an independent implementation in `f64` of the same inputs, and how far
//! the two may differ. To add functions, write a module with a list of rows and name it in [`rows`].

mod axis;
mod bsdf;
pub mod frames;
mod report;
mod samplers;
pub mod scenes;

pub use axis::Axis;
pub use report::markdown;

use crate::random::SplitMix;
use rayon::prelude::*;
use restir_shared::num::UNIT_ROUNDOFF;
use std::ops::Range;

/// The relative error that a function may have unless its row says otherwise.
pub const TOLERANCE: f64 = 1.0e-5;
/// Results below this count as zero (see [`restir_shared::num::flush`]), so errors are not relative to less.
const SMALLEST: f64 = restir_shared::num::FLUSH_BELOW as f64;
/// How far, in roundings of each, arguments that are themselves rounded may be moved (see [`Row::near`]): as many as an
/// inner product makes of a term whose factors are rounded to begin with.
pub const ROUNDINGS: f64 = 4.0;
/// The share of inputs that may need it: one in so many.
const NEAR_SHARE: u64 = 500;
/// Inputs that one task visits.
const CHUNK: u64 = 1 << 12;

/// How many random inputs join the ends of all ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// A few thousand, for the test suite.
    Reduced,
    /// A million, for the report.
    Full,
}

impl Effort {
    fn random_inputs(self) -> u64 {
        match self {
            Self::Reduced => 1 << 12,
            Self::Full => 1 << 20,
        }
    }
}

/// What a component of the result should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The exact value for the inputs as they are.
    pub value: f64,
    /// What the error is relative to.
    pub scale: f64,
}

impl Expected {
    /// A value whose error is relative to itself.
    pub fn relative(value: f64) -> Self {
        Self { value, scale: value.abs().max(SMALLEST) }
    }

    /// A component whose error is relative to a whole, such as the length of a vector.
    pub fn against(value: f64, scale: f64) -> Self {
        Self { value, scale: scale.max(SMALLEST) }
    }

    /// The error of a result; infinite for what is no finite number.
    fn error(self, result: f32) -> f64 {
        let error = (f64::from(result) - self.value).abs() / self.scale;
        if result.is_finite() && error.is_finite() { error } else { f64::INFINITY }
    }
}

/// A function under stress.
#[derive(Clone)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// Its parameters, by name. All combinations of their ends are tested, and random ones.
    pub axes: Vec<(&'static str, Axis)>,
    /// Makes the function's arguments of the parameters.
    pub arguments: fn(&[f32]) -> Vec<f32>,
    /// The function.
    pub function: fn(&[f32]) -> Vec<f32>,
    /// The same in `f64`, on the same arguments.
    pub shadow: fn(&[f64]) -> Vec<Expected>,
    /// The largest error that is allowed.
    pub tolerance: f64,
    /// The arguments that are themselves results of rounding (see [`Row::near`]).
    pub rounded: Range<usize>,
}

impl Row {
    /// A function of its parameters themselves, to within [`TOLERANCE`].
    pub fn new(
        name: &'static str,
        axes: &[(&'static str, Axis)],
        function: fn(&[f32]) -> Vec<f32>,
        shadow: fn(&[f64]) -> Vec<Expected>,
    ) -> Self {
        Self {
            name,
            axes: axes.to_vec(),
            arguments: <[f32]>::to_vec,
            function,
            shadow,
            tolerance: TOLERANCE,
            rounded: 0..0,
        }
    }

    /// The same of arguments that are made of the parameters, such as the vectors that a sampler makes.
    #[must_use]
    pub fn of(self, arguments: fn(&[f32]) -> Vec<f32>) -> Self {
        Self { arguments, ..self }
    }

    /// The same where these arguments are themselves results of rounding, such as the components of a unit vector: no
    /// function of them knows them better. Where the error is beyond the tolerance, a result also passes if the shadow's
    /// values for arguments moved by [`ROUNDINGS`], all up or down, surround it to within the tolerance: then it is right
    /// for arguments in between (its backward error is small), and the function as such is ill-conditioned there.
    #[must_use]
    pub fn near(self, rounded: Range<usize>) -> Self {
        Self { rounded, ..self }
    }

    /// Runs the function on all combinations of ends and on random inputs.
    pub fn run(&self, effort: Effort) -> Finding {
        let ends: Vec<Vec<f32>> = self.axes.iter().map(|(_, axis)| axis.ends()).collect();
        let combinations: u64 = ends.iter().map(|ends| ends.len() as u64).product();
        let count = combinations + effort.random_inputs();
        let parameters = |index: u64| -> Vec<f32> {
            if index < combinations {
                let mut rest = index as usize;
                let mut digit = |ends: &Vec<f32>| {
                    let value = ends[rest % ends.len()];
                    rest /= ends.len();
                    value
                };
                return ends.iter().map(&mut digit).collect();
            }
            let mut random = SplitMix::new(index);
            let mut value = |((_, axis), ends): (&(_, Axis), &Vec<f32>)| {
                // a quarter lies at an end, so that ends meet the inside of other ranges
                if random.below(4) == 0 { ends[random.below(ends.len())] } else { axis.inside(&mut random) }
            };
            self.axes.iter().zip(&ends).map(&mut value).collect()
        };
        let chunk = |index: u64| {
            let mut finding = Finding::default();
            for i in index * CHUNK..count.min((index + 1) * CHUNK) {
                self.visit(&parameters(i), &mut finding);
            }
            finding
        };
        // merged in order, so that the report does not depend on the schedule
        let findings: Vec<_> = (0..count.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
        findings.into_iter().fold(Finding::default(), Finding::merge)
    }

    fn visit(&self, parameters: &[f32], finding: &mut Finding) {
        let arguments = (self.arguments)(parameters);
        let results = (self.function)(&arguments);
        let exact = (self.shadow)(&arguments.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
        let same = results.len() == exact.len();
        let errors = exact.iter().zip(&results).map(|(expected, &result)| expected.error(result));
        let error = errors.fold(if same { 0.0 } else { f64::INFINITY }, f64::max);
        finding.inputs += 1;
        if error > self.tolerance && error.is_finite() && self.is_near(&arguments, &results, &exact) {
            finding.near += 1;
            return;
        }
        finding.failures += u64::from(error > self.tolerance);
        if error > finding.worst || finding.worst_at.is_empty() {
            finding.worst = error;
            finding.worst_at = parameters.to_vec();
        }
    }

    /// Whether values for moved arguments surround the results.
    fn is_near(&self, arguments: &[f32], results: &[f32], exact: &[Expected]) -> bool {
        let mut ranges: Vec<_> = exact.iter().map(|&Expected { value, .. }| (value, value)).collect();
        let corners = if self.rounded.is_empty() { 0 } else { 1_u32 << self.rounded.len() };
        for corner in 0..corners {
            let mut moved: Vec<f64> = arguments.iter().map(|&x| f64::from(x)).collect();
            for (bit, argument) in moved[self.rounded.clone()].iter_mut().enumerate() {
                let sign = if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                *argument *= 1.0 + sign * ROUNDINGS * f64::from(UNIT_ROUNDOFF);
            }
            for ((lo, hi), Expected { value, .. }) in ranges.iter_mut().zip((self.shadow)(&moved)) {
                (*lo, *hi) = (lo.min(value), hi.max(value));
            }
        }
        let mut all = ranges.iter().zip(exact).zip(results);
        all.all(|((&(lo, hi), expected), &result)| {
            let (slack, result) = (self.tolerance * expected.scale, f64::from(result));
            (lo - slack..=hi + slack).contains(&result)
        })
    }
}

/// What came out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finding {
    /// How many inputs were tested.
    pub inputs: u64,
    /// How many had an error beyond the tolerance that roundings of their arguments explain.
    pub near: u64,
    /// How many had one that nothing explains, or a result that is no finite number.
    pub failures: u64,
    /// The largest error of the others.
    pub worst: f64,
    /// The parameters that have it.
    pub worst_at: Vec<f32>,
}

impl Finding {
    fn merge(self, other: Self) -> Self {
        let (inputs, near) = (self.inputs + other.inputs, self.near + other.near);
        let failures = self.failures + other.failures;
        let worst = if other.worst > self.worst || self.worst_at.is_empty() { other } else { self };
        Self { inputs, near, failures, ..worst }
    }

    /// Whether anything was tested, nothing failed, and hardly anything needed an explanation.
    pub fn passed(&self) -> bool {
        self.inputs > 0 && self.failures == 0 && self.near * NEAR_SHARE <= self.inputs
    }
}

/// Everything under stress, by the name of its group.
pub fn rows() -> Vec<(&'static str, Vec<Row>)> {
    vec![("Samplers", samplers::rows()), ("Scattering functions", bsdf::rows())]
}

/// A group's name with its rows and what came out of each.
pub type Group = (&'static str, Vec<(Row, Finding)>);

/// Runs everything.
pub fn run(effort: Effort) -> Vec<Group> {
    let find = |row: Row| {
        let finding = row.run(effort);
        (row, finding)
    };
    rows().into_iter().map(|(group, rows)| (group, rows.into_iter().map(find).collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(function: fn(&[f32]) -> Vec<f32>) -> Row {
        Row::new("square", &[("x", Axis::Log(1.0e-4, 1.0e4)), ("s", Axis::Set(&[-1.0, 1.0]))], function, |p| {
            vec![Expected::relative(p[0] * p[0] * p[1])]
        })
    }

    #[test]
    fn a_right_function_passes_and_wrong_ones_do_not() {
        let right = row(|p| vec![p[0] * p[0] * p[1]]).run(Effort::Reduced);
        assert!(right.passed() && right.worst > 0.0 && right.worst < 2.0e-7, "{right:?}");
        assert!(!row(|p| vec![p[0] * p[0] * p[1] * 1.000_02]).run(Effort::Reduced).passed());
        assert!(
            !row(|p| vec![p[0] * p[0] * if p[0] > 9_999.0 { f32::NAN } else { p[1] }]).run(Effort::Reduced).passed()
        );
        assert!(!row(|_| vec![]).run(Effort::Reduced).passed());
        assert!(!row(|p| vec![p[1] / 0.0]).run(Effort::Reduced).passed());
    }

    #[test]
    fn the_largest_error_is_found_where_it_is() {
        let finding = row(|p| vec![p[0] * p[0] * p[1] * if p[0] == 1.0e4 { 1.5 } else { 1.0 }]).run(Effort::Reduced);
        assert_eq!((finding.worst_at[0], finding.failures > 0), (1.0e4, true));
        assert!((finding.worst - 0.5).abs() < 1e-6);
    }

    /// A difference, rounded as often as it may be and more often.
    #[test]
    fn roundings_of_arguments_explain_what_cancels_and_no_more() {
        fn difference(p: &[f32], roundings: f32) -> Vec<f32> {
            vec![p[0] * (1.0 + 2.0 * roundings * UNIT_ROUNDOFF) - p[1]]
        }
        let axes = [("x", Axis::Log(0.5, 1.0)), ("y", Axis::Set(&[0.5]))];
        let of = |function| Row::new("difference", &axes, function, |p| vec![Expected::relative(p[0] - p[1])]);
        let right = of(|p| difference(p, 2.0)).near(0..1).run(Effort::Reduced);
        assert!(right.failures == 0 && right.near > 0 && right.near < right.inputs / 2, "{right:?}");
        assert!(of(|p| difference(p, 2.0)).run(Effort::Reduced).failures == right.near);
        assert!(of(|p| difference(p, 6.0)).near(0..1).run(Effort::Reduced).failures > 0);
        // far from where it cancels two parts in 10^5 are seen, and so is light that is explained too often
        let off = of(|p| vec![(p[0] - p[1]) * if p[0] > 0.9 { 1.000_02 } else { 1.0 }]).near(0..1);
        assert!(off.run(Effort::Reduced).failures > 0);
        assert!(!Finding { inputs: 1_000, near: 10, ..Finding::default() }.passed());
    }
}
