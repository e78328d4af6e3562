//! Tails of the normal distribution, and what they say about a test.

use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// The probability with which a test notices the bias that it states as detectable.
pub const POWER: f64 = 0.99;

/// P(Z > z).
pub fn upper_tail(z: f64) -> f64 {
    0.5 * erfc(z * FRAC_1_SQRT_2)
}

/// The z with P(Z > z) = p, for p in (0, 1).
pub fn upper_tail_quantile(p: f64) -> f64 {
    SQRT_2 * erfc_inv(2.0 * p)
}

/// P(|Z| > |z|).
pub fn two_sided_p(z: f64) -> f64 {
    2.0 * upper_tail(z.abs())
}

/// The |z| that is exceeded with probability `rate`.
pub fn two_sided_threshold(rate: f64) -> f64 {
    upper_tail_quantile(0.5 * rate)
}

/// The false-alarm rate of each of `tests` independent tests that gives their family the rate `family_rate`; for
/// dependent ones the family's rate is lower.
pub fn sidak(family_rate: f64, tests: usize) -> f64 {
    -((-family_rate).ln_1p() / tests as f64).exp_m1()
}

/// The bias that a two-sided z-test notices with probability `power`.
pub fn detectable_bias(standard_error: f64, false_alarm: f64, power: f64) -> f64 {
    standard_error * (two_sided_threshold(false_alarm) + upper_tail_quantile(1.0 - power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_quantiles() {
        for (p, z) in [(0.025, 1.959_963_984_540_054), (0.01, 2.326_347_874_040_841), (1e-6, 4.753_424_308_822_899)] {
            assert!((upper_tail_quantile(p) - z).abs() < 1e-10, "{p}");
            assert!((upper_tail(z) / p - 1.0).abs() < 1e-10, "{p}");
        }
        assert!((upper_tail(-1.0) + upper_tail(1.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_family_keeps_its_rate() {
        let each = sidak(1e-3, 50);
        assert!((1.0 - (1.0 - each).powi(50) - 1e-3).abs() < 1e-12);
    }
}
