//! Ranges of parameters.

use crate::random::SplitMix;
use std::collections::BTreeSet;
use std::fmt;

/// The step of random numbers.
const STEP: f32 = restir_shared::num::UNIT_ROUNDOFF;
/// Ends of a logarithmic range, its own and others between.
const LOG_ENDS: i32 = 7;

/// A parameter's range, with the values at which functions tend to fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Axis {
    /// A random number: a multiple of 2^-24 in [0, 1).
    Unit,
    /// The same, of which few ends are tested, for functions of many.
    Coarse,
    /// What an inverse may give: random numbers, and any below them down to 2^-40.
    Fine,
    /// From the first to the second, both positive, by their logarithm.
    Log(f32, f32),
    /// Zero, and what [`Axis::Log`] has.
    ZeroLog(f32, f32),
    /// An integer below this.
    Below(u32),
    /// These values.
    Set(&'static [f32]),
}

impl Axis {
    /// Values that are always tested.
    pub(super) fn ends(self) -> Vec<f32> {
        let unit =
            [0.0, STEP, 2.0 * STEP, 1.0e-3, 0.25, 0.5 - STEP, 0.5, 0.5 + STEP, 0.75, 1.0 - 2.0 * STEP, 1.0 - STEP];
        match self {
            Self::Unit => unit.to_vec(),
            Self::Coarse => vec![0.0, 0.5, 1.0 - STEP],
            Self::Fine => [&unit[..], &[STEP * STEP, 1.0e-10, 1.0e-8]].concat(),
            Self::Log(lo, hi) => {
                let between = (1..LOG_ENDS - 1).map(|i| between(lo, hi, f64::from(i) / f64::from(LOG_ENDS - 1)));
                between.chain([lo, hi]).collect()
            }
            Self::ZeroLog(lo, hi) => [&[0.0], &Self::Log(lo, hi).ends()[..]].concat(),
            Self::Below(n) => {
                let ends: BTreeSet<_> = [0, 1, n / 2, n.saturating_sub(2), n - 1].into();
                ends.range(..n).map(|&i| i as f32).collect()
            }
            Self::Set(values) => values.to_vec(),
        }
    }

    /// A random value.
    pub(super) fn inside(self, random: &mut SplitMix) -> f32 {
        let mut unit = || random.below(1 << 24) as f32 * STEP;
        match self {
            Self::Unit | Self::Coarse => unit(),
            Self::Fine => {
                let (u, scale) = (unit(), unit());
                // half of them on the grid
                if scale < 0.5 { u } else { u * (f64::from(scale - 0.75) * 160.0).min(0.0).exp2() as f32 }
            }
            Self::Log(lo, hi) | Self::ZeroLog(lo, hi) => between(lo, hi, f64::from(unit())).max(lo).min(hi),
            Self::Below(n) => random.below(n as usize) as f32,
            Self::Set(values) => values[random.below(values.len())],
        }
    }
}

/// From `lo` at 0 to `hi` at 1, by the logarithm.
fn between(lo: f32, hi: f32, t: f64) -> f32 {
    ((1.0 - t) * f64::from(lo).ln() + t * f64::from(hi).ln()).exp() as f32
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unit | Self::Coarse => f.write_str("[0, 1)"),
            Self::Fine => f.write_str("[0, 1), also below 2⁻²⁴"),
            Self::Log(lo, hi) => write!(f, "{lo:e} .. {hi:e}"),
            Self::ZeroLog(lo, hi) => write!(f, "0, {lo:e} .. {hi:e}"),
            Self::Below(n) => write!(f, "0 .. {}", n - 1),
            Self::Set(values) => {
                let values: Vec<String> = values.iter().map(f32::to_string).collect();
                f.write_str(&values.join(", "))
            }
        }
    }
}
