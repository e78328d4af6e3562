//! Functions at the ends of their ranges against a shadow in `f64`: what `cargo lab stress` reports.
//!
//! A [`Row`] is a function with its parameters, an independent implementation in `f64` of the same inputs, and how far
//! the two may differ. To add functions, write a module with a list of rows and name it in [`rows`].

mod axis;
mod bsdf;
pub mod comparison;
mod diffusion;
pub mod frames;
mod media;
pub mod profiles;
mod report;
mod samplers;
pub mod scenes;
mod shift;

pub use crate::num::Effort;
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

/// What a row calls.
type Call<In, Out> = Box<dyn Fn(&[In]) -> Vec<Out> + Send + Sync>;

fn call<In, Outs: IntoIterator>(f: impl Fn(&[In]) -> Outs + Send + Sync + 'static) -> Call<In, Outs::Item> {
    Box::new(move |p| f(p).into_iter().collect())
}

/// A function and its parameters, by name. All combinations of their ends are tested, and random ones.
pub struct Function {
    /// Its name.
    pub name: &'static str,
    axes: Vec<(&'static str, Axis)>,
    call: Call<f32, f32>,
}

impl Function {
    /// A function of these parameters.
    pub fn new<Results: IntoIterator<Item = f32>>(
        name: &'static str,
        axes: &[(&'static str, Axis)],
        f: impl Fn(&[f32]) -> Results + Send + Sync + 'static,
    ) -> Self {
        Self { name, axes: axes.to_vec(), call: call(f) }
    }

    /// Tested to within [`TOLERANCE`] against the same in `f64`, on the same arguments: the parameters themselves.
    pub fn against<Results: IntoIterator<Item = Expected>>(
        self,
        shadow: impl Fn(&[f64]) -> Results + Send + Sync + 'static,
    ) -> Row {
        let arguments = call(<[f32]>::to_vec);
        Row { function: self, arguments, shadow: call(shadow), tolerance: TOLERANCE, rounded: 0..0 }
    }
}

/// A function under stress.
pub struct Row {
    /// The function.
    pub function: Function,
    /// Makes the function's arguments of the parameters.
    arguments: Call<f32, f32>,
    /// The function in `f64`.
    shadow: Call<f64, Expected>,
    /// The largest error that is allowed.
    pub tolerance: f64,
    /// The arguments that are themselves results of rounding (see [`Row::near`]).
    rounded: Range<usize>,
}

impl Row {
    /// The same of arguments that are made of the parameters, such as the vectors that a sampler makes.
    #[must_use]
    pub fn of<Arguments: IntoIterator<Item = f32>>(
        self,
        arguments: impl Fn(&[f32]) -> Arguments + Send + Sync + 'static,
    ) -> Self {
        Self { arguments: call(arguments), ..self }
    }

    /// The same where these arguments are themselves results of rounding, such as the components of a unit vector: no
    /// function of them knows them better. Where the error is beyond the tolerance, a result also passes if the shadow's
    /// values for arguments moved by [`ROUNDINGS`], all up or down, surround it to within the tolerance: then it is right
    /// for arguments in between (its backward error is small), and the function as such is ill-conditioned there.
    #[must_use]
    pub fn near(self, rounded: Range<usize>) -> Self {
        Self { rounded, ..self }
    }

    /// Runs the function on all combinations of ends and on random inputs: a few thousand for the test suite, a million for
    /// the report.
    pub fn run(&self, effort: Effort) -> Finding {
        let axes: Vec<_> = self.function.axes.iter().map(|&(_, axis)| (axis, axis.ends())).collect();
        let combinations: u64 = axes.iter().map(|(_, ends)| ends.len() as u64).product();
        let parameters = |index: u64| -> Vec<f32> {
            let (mut rest, mut random) = (index as usize, SplitMix::new(index));
            let mut value = |(axis, ends): &(Axis, Vec<f32>)| {
                if index < combinations {
                    let end = ends[rest % ends.len()];
                    rest /= ends.len();
                    end
                } else if random.below(4) == 0 {
                    // ends meet the inside of other ranges
                    ends[random.below(ends.len())]
                } else {
                    axis.inside(&mut random)
                }
            };
            axes.iter().map(&mut value).collect()
        };
        let random_inputs = if effort == Effort::Full { 1 << 20 } else { 1 << 12 };
        let findings = (0..combinations + random_inputs).into_par_iter().map(|index| self.visit(parameters(index)));
        findings.reduce(Finding::default, Finding::merge)
    }

    fn visit(&self, parameters: Vec<f32>) -> Finding {
        let arguments = (self.arguments)(&parameters);
        let results = (self.function.call)(&arguments);
        let exact = (self.shadow)(&wide(&arguments));
        let same = results.len() == exact.len();
        let errors = exact.iter().zip(&results).map(|(expected, &result)| expected.error(result));
        let worst = errors.fold(if same { 0.0 } else { f64::INFINITY }, f64::max);
        if worst > self.tolerance && worst.is_finite() && self.is_near(&arguments, &results, &exact) {
            return Finding { inputs: 1, near: 1, ..Finding::default() };
        }
        Finding { inputs: 1, near: 0, failures: u64::from(worst > self.tolerance), worst, worst_at: parameters }
    }

    /// Whether values for moved arguments surround the results.
    fn is_near(&self, arguments: &[f32], results: &[f32], exact: &[Expected]) -> bool {
        let mut ranges: Vec<_> = exact.iter().map(|&Expected { value, .. }| (value, value)).collect();
        let corners = if self.rounded.is_empty() { 0 } else { 1_u32 << self.rounded.len() };
        for corner in 0..corners {
            let mut moved = wide(arguments);
            for (bit, argument) in moved[self.rounded.clone()].iter_mut().enumerate() {
                let sign = if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                *argument *= 1.0 + sign * ROUNDINGS * f64::from(UNIT_ROUNDOFF);
            }
            for ((lo, hi), Expected { value, .. }) in ranges.iter_mut().zip((self.shadow)(&moved)) {
                (*lo, *hi) = (lo.min(value), hi.max(value));
            }
        }
        ranges.iter().zip(exact).zip(results).all(|((&(lo, hi), expected), &result)| {
            let (slack, result) = (self.tolerance * expected.scale, f64::from(result));
            (lo - slack..=hi + slack).contains(&result)
        })
    }
}

fn wide(arguments: &[f32]) -> Vec<f64> {
    arguments.iter().copied().map(f64::from).collect()
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
    /// Of two errors of the same size the first counts, so that the report does not depend on the schedule.
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
    vec![
        ("Samplers", samplers::rows()),
        ("Scattering functions", bsdf::rows()),
        ("Media", media::rows()),
        ("Diffusion profiles", diffusion::rows()),
        ("Shifts of paths", shift::rows()),
    ]
}

/// A group's name with what came out of its rows.
pub type Group = (&'static str, Vec<(Finding, Row)>);

/// Runs everything.
pub fn run(effort: Effort) -> Vec<Group> {
    let find = |row: Row| (row.run(effort), row);
    rows().into_iter().map(|(group, rows)| (group, rows.into_iter().map(find).collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(square: fn(&[f32]) -> f32) -> Finding {
        let axes = [("x", Axis::Log(1.0e-4, 1.0e4)), ("s", Axis::Set(&[-1.0, 1.0]))];
        let row = Function::new("square", &axes, move |p| [square(p)]);
        row.against(|p| [Expected::relative(p[0] * p[0] * p[1])]).run(Effort::Reduced)
    }

    #[test]
    fn a_right_function_passes_and_wrong_ones_do_not() {
        let right = run(|p| p[0] * p[0] * p[1]);
        assert!(right.passed() && right.worst > 0.0 && right.worst < 2.0e-7, "{right:?}");
        assert!(!run(|p| p[0] * p[0] * p[1] * 1.000_02).passed());
        assert!(!run(|p| p[0] * p[0] * if p[0] > 9_999.0 { f32::NAN } else { p[1] }).passed());
        assert!(!run(|p| p[1] / 0.0).passed());
        let nothing = Function::new("nothing", &[("x", Axis::Unit)], |_| []).against(|_| [Expected::relative(1.0)]);
        assert!(!nothing.run(Effort::Reduced).passed());
    }

    #[test]
    fn the_largest_error_is_found_where_it_is() {
        let finding = run(|p| p[0] * p[0] * p[1] * if p[0] == 1.0e4 { 1.5 } else { 1.0 });
        assert_eq!((finding.worst_at[0], finding.failures > 0), (1.0e4, true));
        assert!((finding.worst - 0.5).abs() < 1e-6);
    }

    /// A difference, rounded as often as it may be and more often.
    #[test]
    fn roundings_of_arguments_explain_what_cancels_and_no_more() {
        fn row(difference: fn(&[f32]) -> f32) -> Row {
            let axes = [("x", Axis::Log(0.5, 1.0)), ("y", Axis::Set(&[0.5]))];
            let function = Function::new("difference", &axes, move |p| [difference(p)]);
            function.against(|p| [Expected::relative(p[0] - p[1])])
        }
        let rounded: fn(&[f32]) -> f32 = |p| p[0] * (1.0 + 4.0 * UNIT_ROUNDOFF) - p[1];
        let right = row(rounded).near(0..1).run(Effort::Reduced);
        assert!(right.failures == 0 && right.near > 0 && right.near < right.inputs / 2, "{right:?}");
        assert!(row(rounded).run(Effort::Reduced).failures == right.near);
        let more = row(|p| p[0] * (1.0 + 12.0 * UNIT_ROUNDOFF) - p[1]).near(0..1);
        assert!(more.run(Effort::Reduced).failures > 0);
        // far from where it cancels two parts in 10^5 are seen, and so is light that is explained too often
        let off = row(|p| (p[0] - p[1]) * if p[0] > 0.9 { 1.000_02 } else { 1.0 }).near(0..1);
        assert!(off.run(Effort::Reduced).failures > 0);
        assert!(!Finding { inputs: 1_000, near: 10, ..Finding::default() }.passed());
    }
}
