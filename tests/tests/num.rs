//! Scalar functions: the sweeps of `cargo xtask num` on a regular subset of their inputs, and proof that they would
//! see a wrong function.

use libtest_mimic::Failed;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use restir_shared::num::{self, eft, soft};
use restir_tests::num::rounding::Subnormals;
use restir_tests::num::{Effort, Tally, accuracy, exact, mantissa, markdown, rounding, rows};
use restir_tests::suite::{ensure, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    run(&[
        ("functions_are_as_good_as_claimed", functions_are_as_good_as_claimed),
        ("a_quotient_without_its_last_correction_is_seen", a_quotient_without_its_last_correction_is_seen),
        ("roots_without_their_last_correction_are_seen", roots_without_their_last_correction_are_seen),
        ("a_result_off_by_one_in_a_rare_case_is_seen", a_result_off_by_one_in_a_rare_case_is_seen),
        ("a_truncated_polynomial_is_seen", a_truncated_polynomial_is_seen),
        ("a_rounded_angle_reduction_is_seen", a_rounded_angle_reduction_is_seen),
        ("a_sum_and_its_error_are_exact", a_sum_and_its_error_are_exact),
        ("a_product_and_its_error_are_exact", a_product_and_its_error_are_exact),
    ])
}

fn functions_are_as_good_as_claimed() -> Result<(), Failed> {
    let rows = rows(Effort::Reduced);
    println!("{}", markdown(&rows));
    let failed: Vec<_> = rows.into_iter().filter(|row| !row.passed()).collect();
    ensure(failed.is_empty(), || markdown(&failed))
}

fn ensure_seen(what: &str, tally: Tally) -> Result<(), Failed> {
    println!("{what}: {} of {} wrong", tally.failures, tally.inputs);
    ensure(tally.failures > 0, || format!("{what}: nothing was noticed in {} inputs", tally.inputs))
}

/// The nearest integer instead of the floor of the quotient: the last step of `soft::div_mantissa` left out.
fn div_without_floor(a: u32, b: u32, seed: u32, y: f32) -> u32 {
    let shift = if a < b { 25 } else { 24 };
    let residual = (a << shift).wrapping_sub(seed.wrapping_mul(b)) as i32;
    seed.wrapping_add((f64::from(residual) * f64::from(y) / 8_388_608.0).round() as i32 as u32)
}

fn a_quotient_without_its_last_correction_is_seen() -> Result<(), Failed> {
    ensure_seen("div without its floor", mantissa::division(Effort::Reduced, div_without_floor))?;
    ensure_seen("div without its floor at boundaries", mantissa::division_at_boundaries(div_without_floor))
}

fn roots_without_their_last_correction_are_seen() -> Result<(), Failed> {
    let ceiling = |floor: u32, correct: u32| if floor & 0xff == 0x5a { correct + 1 } else { correct };
    let sqrt = |m, seed, y| ceiling(seed, soft::sqrt_mantissa(m, seed, y));
    let rsqrt = |m, seed, y| ceiling(seed, soft::rsqrt_mantissa(m, seed, y));
    let recip = |m, seed, y| ceiling(seed, soft::recip_mantissa(m, seed, y));
    ensure_seen("sqrt wrong for some seeds", mantissa::square_root(Effort::Reduced, sqrt))?;
    ensure_seen("rsqrt wrong for some seeds", mantissa::reciprocal_root(Effort::Reduced, rsqrt))?;
    ensure_seen("recip wrong for some seeds", mantissa::reciprocal(Effort::Reduced, recip))
}

/// What a device does whose division is Newton's iteration without a fix-up.
fn a_result_off_by_one_in_a_rare_case_is_seen() -> Result<(), Failed> {
    let newton = |x: f32| {
        let y = (1.0 / f64::from(x)) as f32;
        let y = f32::from_bits(y.to_bits() ^ 1);
        y * (2.0 - x * y)
    };
    ensure_seen("recip by Newton", rounding::unary(Effort::Reduced, Subnormals::Unspecified, newton, exact::recip))?;
    let by_recip = |a: f32, b: f32| a * num::recip(b);
    ensure_seen("div as a product", rounding::division(Effort::Reduced, Subnormals::Unspecified, by_recip))?;
    let in_two_roundings = |x: f32| num::recip(num::sqrt(x));
    let rsqrt = rounding::unary(Effort::Reduced, Subnormals::Unspecified, in_two_roundings, exact::rsqrt);
    ensure_seen("rsqrt in two roundings", rsqrt)
}

/// The exponential with a polynomial of degree 5 instead of 7.
fn short_exp(x: f32) -> f32 {
    let k = (f64::from(x) * std::f64::consts::LOG2_E).round();
    let r = (f64::from(x) - k * std::f64::consts::LN_2) as f32;
    let y = (((r / 120.0 + 1.0 / 24.0) * r + 1.0 / 6.0) * r + 0.5) * r * r + r + 1.0;
    (f64::from(y) * k.exp2()) as f32
}

fn a_truncated_polynomial_is_seen() -> Result<(), Failed> {
    ensure_seen("exp of degree 5", accuracy::exponential(Effort::Reduced, short_exp))?;
    let linear = |x: f32| num::ln(x) * (1.0 + 4.0e-7);
    ensure_seen("ln off by 4e-7", accuracy::logarithm(Effort::Reduced, linear))
}

/// The angle multiplied by 2 pi in f32 before it is reduced.
fn a_rounded_angle_reduction_is_seen() -> Result<(), Failed> {
    let radians = |u: f32| {
        let (sin, cos) = f64::from(u * std::f32::consts::TAU).sin_cos();
        (sin as f32, cos as f32)
    };
    let [sin, cos] = accuracy::sine_cosine(Effort::Reduced, radians);
    ensure_seen("sin of a rounded angle", sin)?;
    ensure_seen("cos of a rounded angle", cos)?;
    let tan = |y: f32, x: f32| (f64::from(num::div(y, x)).atan() / std::f64::consts::TAU) as f32;
    ensure_seen("atan2 without quadrants", accuracy::angle(Effort::Reduced, tan))
}

/// Numbers whose sums are exact in `f64`.
fn summand() -> impl Strategy<Value = f32> {
    (any::<u32>(), 115_u32..140).prop_map(|(bits, e)| f32::from_bits((bits & 0x807f_ffff) | (e << 23)))
}

/// Numbers whose product and its error are normal.
fn factor() -> impl Strategy<Value = f32> {
    (any::<u32>(), 80_u32..175).prop_map(|(bits, e)| f32::from_bits((bits & 0x807f_ffff) | (e << 23)))
}

fn property(
    strategy: impl Strategy<Value = (f32, f32)>,
    test: impl Fn((f32, f32)) -> Result<(), TestCaseError>,
) -> Result<(), Failed> {
    let config = Config { cases: 20_000, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, proptest::test_runner::TestRng::deterministic_rng(Default::default()))
        .run(&strategy, test)
        .map_err(Failed::from)
}

fn a_sum_and_its_error_are_exact() -> Result<(), Failed> {
    property((summand(), summand()), |(a, b)| {
        let (s, e) = eft::two_sum(a, b);
        prop_assert_eq!(s, a + b);
        prop_assert_eq!(f64::from(s) + f64::from(e), f64::from(a) + f64::from(b));
        Ok(())
    })
}

fn a_product_and_its_error_are_exact() -> Result<(), Failed> {
    property((factor(), factor()), |(a, b)| {
        let (p, e) = eft::two_prod(a, b);
        prop_assert_eq!(p, a * b);
        prop_assert_eq!(f64::from(p) + f64::from(e), f64::from(a) * f64::from(b));
        let (hi, lo) = eft::split(a);
        prop_assert_eq!(f64::from(hi) + f64::from(lo), f64::from(a));
        Ok(())
    })
}
