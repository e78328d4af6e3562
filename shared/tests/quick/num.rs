//! Scalar functions beside those of `f64`.

use crate::numbers;
use restir_shared::num;

/// The largest error of a function over numbers, in units of the last place of what is right.
fn worst(range: std::ops::RangeInclusive<f32>, function: fn(f32) -> f32, exact: fn(f64) -> f64) -> f64 {
    let errors =
        numbers().filter(|x| range.contains(x) && (*x == 0.0 || x.abs() >= f32::MIN_POSITIVE)).filter_map(|x| {
            let right = exact(x.into());
            let unit = f64::from((right as f32).abs().next_up()) - f64::from((right as f32).abs());
            // of what the contract leaves open, results that are subnormal, nothing is asked
            let is_normal = (f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX)).contains(&right.abs());
            is_normal.then(|| (f64::from(function(x)) - right).abs() / unit)
        });
    errors.fold(0.0, f64::max)
}

#[test]
fn functions_are_accurate() {
    type Row = (&'static str, fn(f32) -> f32, fn(f64) -> f64, f32, f32);
    let rows: [Row; 12] = [
        ("recip", num::recip, f64::recip, f32::MIN, f32::MAX),
        ("sqrt", num::sqrt, f64::sqrt, 0.0, f32::MAX),
        ("rsqrt", num::rsqrt, |x| x.sqrt().recip(), 0.0, f32::MAX),
        ("exp", num::exp, f64::exp, f32::MIN, f32::MAX),
        ("exp2", num::exp2, f64::exp2, f32::MIN, f32::MAX),
        ("expm1", num::expm1, f64::exp_m1, f32::MIN, f32::MAX),
        ("sinh", num::sinh, f64::sinh, f32::MIN, f32::MAX),
        ("ln", num::ln, f64::ln, 0.0, f32::MAX),
        ("ln_1p", num::ln_1p, f64::ln_1p, -1.0, f32::MAX),
        ("cbrt", num::cbrt, f64::cbrt, f32::MIN, f32::MAX),
        ("asin", num::asin, |x| x.asin() / std::f64::consts::TAU, -1.0, 1.0),
        ("acos", num::acos, |x| x.acos() / std::f64::consts::TAU, -1.0, 1.0),
    ];
    for (name, function, exact, from, to) in rows {
        let worst = worst(from..=to, function, exact);
        assert!(worst <= 4.0, "{name} is off by {worst} units in the last place");
    }
}

/// The forms of the device, which has no such instructions.
#[test]
fn divisions_and_roots_are_those_of_the_processor() {
    let normal = |x: f32| x == 0.0 || x.abs() >= f32::MIN_POSITIVE;
    for x in numbers().filter(|&x| normal(x)) {
        assert!(!normal(1.0 / x) || num::soft::recip(x).to_bits() == (1.0 / x).to_bits(), "1 / {x:e}");
        assert!(x < 0.0 || num::soft::sqrt(x) == num::sqrt(x), "the root of {x:e}");
        for y in [1.0 / 3.0, 3.0, -1.0e-20, 1.0e20] {
            assert!(!normal(x / y) || num::soft::div(x, y) == x / y, "{x:e} / {y:e}");
        }
    }
}

/// Zero has no sign; what has no fraction stays, and what is no number.
#[test]
fn floors_are_those_of_double_precision() {
    for x in numbers().chain([-0.0, -0.5, 8_388_607.5, -8_388_609.0, 4.0e9, f32::INFINITY, f32::NEG_INFINITY]) {
        let floor = f64::from(x).floor() as f32;
        assert_eq!(num::floor(x).to_bits(), if floor == 0.0 { 0 } else { floor.to_bits() }, "{x:e}");
    }
    assert!(num::floor(f32::NAN).is_nan());
}

#[test]
fn quarters_of_a_turn_are_exact() {
    assert_eq!([0.0, 0.25, 0.5, 0.75].map(num::sin_cos), [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]);
}
