//! Scalar functions: the sweeps of `cargo lab num` on a regular subset of their inputs, and proof that they would
//! see a wrong function.

use restir_shared::glam::Vec3;
use restir_shared::num::{self, eft, soft};
use restir_shared::{color, pack};
use restir_tests::num::rounding::Subnormals;
use restir_tests::num::{Effort, MAX_ULP, Tally, accuracy, exact, mantissa, markdown, packing, rounding, sweeps};
use restir_tests::random::SplitMix;
use std::f64::consts::{LN_2, LOG2_E, TAU};
use std::ops::Range;

restir_tests::suite! {
    first {
        functions_that_grow_do_not_fall exact_values_are_exact a_compensated_sum_keeps_what_a_plain_one_loses
        a_sum_and_its_error_are_exact a_product_and_its_error_are_exact every_half_comes_back
        normalised_integers_come_back
    }
    later {
        functions_are_as_good_as_claimed a_quotient_without_its_last_correction_is_seen
        roots_without_their_last_correction_are_seen a_result_off_by_one_in_a_rare_case_is_seen
        a_truncated_polynomial_is_seen a_form_that_cancels_is_seen a_power_by_rounded_logarithm_is_seen
        a_rounded_angle_reduction_is_seen halves_are_rounded_to_nearest a_truncated_half_is_seen
        shared_exponents_follow_the_specification truncated_shared_exponents_are_seen unit_vectors_come_back
        a_coarser_octahedron_is_seen codes_of_unit_vectors_come_back
    }
}

fn functions_are_as_good_as_claimed() {
    let rows: Vec<_> = sweeps().iter().flat_map(|sweep| sweep.rows(Effort::Reduced)).collect();
    println!("{}", markdown(&rows));
    let failed: Vec<_> = rows.into_iter().filter(|row| !row.passed()).collect();
    assert!(failed.is_empty(), "{}", markdown(&failed));
}

fn assert_seen(what: &str, tally: Tally) {
    println!("{what}: {} of {} wrong", tally.failures, tally.inputs);
    assert!(tally.failures > 0, "{what}: nothing was noticed in {} inputs", tally.inputs);
}

/// The nearest integer instead of the floor of the quotient: the last step of `soft::div_mantissa` left out.
fn div_without_floor(a: u32, b: u32, seed: u32, y: f32) -> u32 {
    let shift = if a < b { 25 } else { 24 };
    let residual = (a << shift).wrapping_sub(seed.wrapping_mul(b)) as i32;
    seed.wrapping_add((f64::from(residual) * f64::from(y) / 8_388_608.0).round() as i32 as u32)
}

fn a_quotient_without_its_last_correction_is_seen() {
    assert_seen("div without its floor", mantissa::division(Effort::Reduced, div_without_floor));
    assert_seen("div without its floor at boundaries", mantissa::division_at_boundaries(div_without_floor));
}

fn roots_without_their_last_correction_are_seen() {
    let ceiling = |floor: u32, correct: u32| if floor & 0xff == 0x5a { correct + 1 } else { correct };
    let sqrt = |m, seed, y| ceiling(seed, soft::sqrt_mantissa(m, seed, y));
    let rsqrt = |m, seed, y| ceiling(seed, soft::rsqrt_mantissa(m, seed, y));
    let recip = |m, seed, y| ceiling(seed, soft::recip_mantissa(m, seed, y));
    assert_seen("sqrt wrong for some seeds", mantissa::square_root(Effort::Reduced, sqrt));
    assert_seen("rsqrt wrong for some seeds", mantissa::reciprocal_root(Effort::Reduced, rsqrt));
    assert_seen("recip wrong for some seeds", mantissa::reciprocal(Effort::Reduced, recip));
}

/// What a device does whose division is Newton's iteration without a fix-up.
fn a_result_off_by_one_in_a_rare_case_is_seen() {
    let newton = |x: f32| {
        let y = (1.0 / f64::from(x)) as f32;
        let y = f32::from_bits(y.to_bits() ^ 1);
        y * (2.0 - x * y)
    };
    assert_seen("recip by Newton", rounding::unary(Effort::Reduced, Subnormals::Unspecified, newton, exact::recip));
    let by_recip = |a: f32, b: f32| a * num::recip(b);
    assert_seen("div as a product", rounding::division(Effort::Reduced, Subnormals::Unspecified, by_recip));
    let in_two_roundings = |x: f32| num::recip(num::sqrt(x));
    let rsqrt = rounding::unary(Effort::Reduced, Subnormals::Unspecified, in_two_roundings, exact::rsqrt);
    assert_seen("rsqrt in two roundings", rsqrt);
}

fn unary(function: fn(f32) -> f32, exact: fn(f64) -> f64) -> Tally {
    accuracy::unary(MAX_ULP, f32::INFINITY, function, exact)
}

/// The exponential with a polynomial of degree 5 instead of 7.
fn short_exp(x: f32) -> f32 {
    let k = (f64::from(x) * LOG2_E).round();
    let r = (f64::from(x) - k * LN_2) as f32;
    let y = (((r / 120.0 + 1.0 / 24.0) * r + 1.0 / 6.0) * r + 0.5) * r * r + r + 1.0;
    (f64::from(y) * k.exp2()) as f32
}

fn a_truncated_polynomial_is_seen() {
    assert_seen("exp of degree 5", unary(short_exp, f64::exp));
    assert_seen("ln off by 4e-7", unary(|x| num::ln(x) * (1.0 + 4.0e-7), f64::ln));
    assert_seen("asin of degree 5", unary(|x| (x + x * x * x / 6.0) * (0.5 * num::INV_PI), |x| x.asin() / TAU));
}

fn a_form_that_cancels_is_seen() {
    assert_seen("exp(x) - 1", unary(|x| num::exp(x) - 1.0, f64::exp_m1));
    assert_seen("ln(1 + x)", unary(|x| num::ln(1.0 + x), f64::ln_1p));
    assert_seen("sinh by a difference", unary(|x| 0.5 * (num::exp(x) - num::exp(-x)), f64::sinh));
    assert_seen("asinh by a logarithm", unary(|x| num::ln(x + num::sqrt(x * x + 1.0)), f64::asinh));
    assert_seen("acos by a difference", unary(|x| 0.25 - num::asin(x), |x| x.clamp(-1.0, 1.0).acos() / TAU));
    let naive = |[a, b, c, d]: [f32; 4]| a * b + c * d;
    assert_seen("a b + c d", accuracy::product_sum(Effort::Reduced, naive));
}

/// The error of the logarithm grows with the exponent unless it is carried along.
fn a_power_by_rounded_logarithm_is_seen() {
    assert_seen("exp2(y log2 x)", accuracy::power(Effort::Reduced, |x, y| num::exp2(y * num::log2(x))));
    let third = |x: f32| num::pow(num::abs(x), 0.333_333_34) * if x < 0.0 { -1.0 } else { 1.0 };
    assert_seen("x^(1/3)", unary(third, f64::cbrt));
}

/// Over neighbours and over steps of any size, where the error of the function is larger than its slope.
fn functions_that_grow_do_not_fall() {
    type Growing = (&'static str, fn(f32) -> f32, f32, f32);
    let growing: [Growing; 5] = [
        ("srgb_encode", color::srgb_encode, 0.0, 1.0),
        ("srgb_decode", color::srgb_decode, 0.0, 1.0),
        ("exp2", num::exp2, -126.0, 127.0),
        ("cbrt", num::cbrt, 0.0, 1.0e30),
        ("asinh", num::asinh, 0.0, 1.0e30),
    ];
    for (name, function, from, to) in growing {
        const STEPS: u32 = 20_011;
        let at = |i: u32| from + (to - from) * i as f32 / STEPS as f32;
        let falls = (0..STEPS).find(|&i| function(at(i)) > function(at(i + 1)));
        assert!(falls.is_none(), "{name} falls from {} to {}", at(falls.unwrap_or(0)), at(falls.unwrap_or(0) + 1));
    }
}

fn exact_values_are_exact() {
    for k in -126..128 {
        let power = f32::from_bits(((k + 127) as u32) << 23);
        assert!(num::exp2(k as f32) == power, "exp2({k})");
        assert!(num::log2(power) == k as f32, "log2(2^{k})");
    }
    for n in 0..1024_u32 {
        let x = n as f32;
        assert!(num::cbrt(x * x * x) == x || n > 256, "cbrt({n}^3) = {}", num::cbrt(x * x * x));
        assert!(num::pow(x, 0.0) == 1.0 && num::pow(1.0, x - 512.0) == 1.0, "x^0 or 1^y at {n}");
    }
    assert!([0.0, 0.25, 0.5] == [1.0, 0.0, -1.0].map(num::acos), "acos of the axes");
    assert!([0.0, 0.25, -0.25] == [0.0, 1.0, -1.0].map(num::asin), "asin of the axes");
}

/// 10^5 terms of both signs, sorted against their sum: the plain sum loses a third of its digits.
fn a_compensated_sum_keeps_what_a_plain_one_loses() {
    let mut random = SplitMix::new(0);
    let mut term = || (random.range(-1.0, 1.1) * f64::exp2(random.below(24) as f64)) as f32;
    let terms: Vec<f32> = (0..100_000).map(|_| term()).collect();
    let exact: f64 = terms.iter().map(|&x| f64::from(x)).sum();
    let compensated = terms[2..].iter().fold(eft::Sum::new(terms[0], terms[1]), |sum, &x| sum.plus(x)).total();
    let plain: f32 = terms.iter().sum();
    let [plain, compensated] = [plain, compensated].map(|sum| accuracy::error(sum, exact));
    println!("plain sum: {plain:.1} ulp, compensated: {compensated:.3} ulp");
    assert!(compensated <= 1.0, "a compensated sum is off by {compensated} ulp");
    assert!(plain > 10.0, "a plain sum is off by {plain} ulp only, which tests nothing");
}

/// The angle multiplied by 2 pi in f32 before it is reduced.
fn a_rounded_angle_reduction_is_seen() {
    let radians = |u: f32| {
        let (sin, cos) = f64::from(u * std::f32::consts::TAU).sin_cos();
        (sin as f32, cos as f32)
    };
    let [sin, cos] = accuracy::sine_cosine(Effort::Reduced, radians);
    assert_seen("sin of a rounded angle", sin);
    assert_seen("cos of a rounded angle", cos);
    let tan = |y: f32, x: f32| (f64::from(num::div(y, x)).atan() / TAU) as f32;
    assert_seen("atan2 without quadrants", accuracy::angle(Effort::Reduced, tan));
}

/// Random pairs of numbers with biased exponents of a range.
fn pairs(exponents: Range<u32>) -> impl Iterator<Item = (f32, f32)> {
    (0..20_000).map(move |i| {
        let mut random = SplitMix::new(i);
        let mut number = || {
            let exponent = exponents.start + random.below(exponents.len()) as u32;
            f32::from_bits((random.word() as u32 & 0x807f_ffff) | exponent << 23)
        };
        (number(), number())
    })
}

fn a_sum_and_its_error_are_exact() {
    // the sums are exact in `f64`
    for (a, b) in pairs(115..140) {
        let (s, e) = eft::two_sum(a, b);
        assert_eq!(s, a + b);
        assert_eq!(f64::from(s) + f64::from(e), f64::from(a) + f64::from(b), "{a:e} and {b:e}");
    }
}

fn a_product_and_its_error_are_exact() {
    // the products and their errors are normal numbers
    for (a, b) in pairs(80..175) {
        let (p, e) = eft::two_prod(a, b);
        assert_eq!(p, a * b);
        assert_eq!(f64::from(p) + f64::from(e), f64::from(a) * f64::from(b), "{a:e} and {b:e}");
        let (hi, lo) = eft::split(a);
        assert_eq!(f64::from(hi) + f64::from(lo), f64::from(a), "{a:e}");
    }
}

fn assert_right(what: &str, tally: Tally) {
    println!("{what}: {} inputs, largest error {:.4e}", tally.inputs, tally.worst);
    assert!(tally.failures == 0, "{what}: {} wrong, worst at {:#x}", tally.failures, tally.worst_input);
}

fn halves_are_rounded_to_nearest() {
    assert_right("f32 to half", packing::to_half(Effort::Reduced, pack::half_from_f32));
}

fn a_truncated_half_is_seen() {
    let truncated = |x: f32| pack::half_from_f32(f32::from_bits(x.to_bits() & !0x1fff));
    assert_seen("f32 to half by truncation", packing::to_half(Effort::Reduced, truncated));
    let without_subnormals = |x: f32| if x.abs() < 6.0e-5 { 0 } else { pack::half_from_f32(x) };
    assert_seen("f32 to half without subnormals", packing::to_half(Effort::Reduced, without_subnormals));
}

fn every_half_comes_back() {
    assert_right("half to f32", packing::from_half(pack::f32_from_half));
    for code in 0..=0xffff {
        let x = pack::f32_from_half(code);
        assert!(x.is_nan() || pack::half_from_f32(x) == code, "half {code:#06x} comes back as another");
    }
    let pair = pack::f32_from_half2(pack::half2_from_f32(-1.5, 65_504.0));
    assert!(pair == (-1.5, 65_504.0), "a pair of halves comes back as {pair:?}");
}

fn shared_exponents_follow_the_specification() {
    assert_right("RGB9E5", packing::shared_exponent(pack::rgb9e5_encode, pack::rgb9e5_decode));
}

fn truncated_shared_exponents_are_seen() {
    let darker = |rgb: Vec3| pack::rgb9e5_encode(rgb * 0.999);
    assert_seen("RGB9E5 of a darker colour", packing::shared_exponent(darker, pack::rgb9e5_decode));
}

fn unit_vectors_come_back() {
    assert_right(
        "octahedral",
        packing::unit_vectors(packing::MAX_ANGLE, pack::encode_unit_vector, pack::decode_unit_vector),
    );
    let fine = packing::unit_vectors(packing::MAX_FINE_ANGLE, pack::encode_unit_vector_48, pack::decode_unit_vector_48);
    assert_right("octahedral of 48 bits", fine);
}

fn a_coarser_octahedron_is_seen() {
    let coarse = |v: Vec3| pack::encode_unit_vector(v) & 0xfffe_fffe;
    assert_seen("octahedral with 15 bits", packing::unit_vectors(packing::MAX_ANGLE, coarse, pack::decode_unit_vector));
    let coarse = |v: Vec3| pack::encode_unit_vector_48(v).map(|code| code & 0x00ff_fffc);
    let fine = packing::unit_vectors(packing::MAX_FINE_ANGLE, coarse, pack::decode_unit_vector_48);
    assert_seen("octahedral of 48 bits with 44", fine);
}

fn codes_of_unit_vectors_come_back() {
    assert_right("octahedral codes", packing::unit_vector_codes(Effort::Reduced));
}

fn normalised_integers_come_back() {
    for (max, unorm) in [(255, pack::UNORM8), (65_535, pack::UNORM16)] {
        for code in 0..=max {
            let x = unorm.decode(code);
            assert!(unorm.encode(x) == code, "{code} of {max} comes back as {}", unorm.encode(x));
            let error = accuracy::error(x, f64::from(code) / f64::from(max));
            assert!(error <= 1.5, "{code} of {max} is off by {error} ulp");
        }
        assert!(unorm.decode(max) == 1.0, "{max} of {max} is not 1");
        assert!([-1.0, f32::NAN, 7.0].map(|x| unorm.encode(x)) == [0, 0, max], "limits of a unorm");
    }
}
