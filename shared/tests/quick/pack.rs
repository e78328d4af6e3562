//! Packed numbers are the nearest there are.

use crate::numbers;
use half::f16;
use restir_shared::glam::Vec3;
use restir_shared::pack::{
    RGB9E5_MAX, UNORM8, UNORM16, decode_unit_vector, encode_unit_vector, f32_from_half, half_from_f32, rgb9e5_decode,
    rgb9e5_encode,
};
use restir_shared::vec::normalize;

/// Subnormal numbers give zero, as the functions promise.
#[test]
fn halves_are_the_nearest() {
    for x in numbers().chain([f32::INFINITY, f32::NEG_INFINITY]) {
        assert_eq!(half_from_f32(x), u32::from(f16::from_f32_const(x).to_bits()), "{x:e}");
    }
    assert!(f32_from_half(half_from_f32(f32::NAN)).is_nan());
}

#[test]
fn every_half_comes_back() {
    for half in 0..=u16::MAX {
        let (x, expected) = (f32_from_half(half.into()), f16::from_bits(half).to_f32_const());
        assert!(x.to_bits() == expected.to_bits() || x.is_nan() && expected.is_nan(), "{half:#06x}");
        assert!(x.is_nan() || half_from_f32(x) == half.into(), "{half:#06x}");
    }
}

#[test]
fn colours_keep_nine_bits() {
    for x in numbers().filter(|x| (0.0..=RGB9E5_MAX).contains(x)) {
        let colour = Vec3::new(x, 0.5 * x, 0.0);
        let off = (rgb9e5_decode(rgb9e5_encode(colour)) - colour).abs().max_element();
        assert!(off <= (x / 512.0).max(1.0 / 33_554_432.0), "{x:e} is off by {off:e}");
    }
}

#[test]
fn normalised_integers_come_back() {
    for (unorm, max) in [(UNORM8, 255), (UNORM16, 65_535)] {
        assert!((0..=max).all(|code| unorm.encode(unorm.decode(code)) == code));
    }
}

#[test]
fn unit_vectors_come_back() {
    for i in 0..4096 {
        let at = |bits: u32| f32::from((i >> bits & 0xf) as u16) - 7.5;
        let v = normalize(Vec3::new(at(0), at(4), at(8)));
        let off = (decode_unit_vector(encode_unit_vector(v)) - v).abs().max_element();
        assert!(off < 1.0e-4, "{v} is off by {off:e}");
    }
}
