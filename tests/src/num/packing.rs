//! Packed formats against their definitions.

use super::accuracy::power_of_two;
use super::sweep::{sweep, sweep_patterns};
use super::{Effort, Tally};
use crate::random::SplitMix;
use glam::DVec3;
use half::f16;
use restir_shared::glam::Vec3;
use restir_shared::pack::{self, RGB9E5_MAX};

/// A prime, so that the subset has no pattern in the low bits.
const REDUCED_STRIDE: u64 = 1_021;
const COLOURS: u64 = 1_000_000;
const DIRECTIONS: u64 = 4_000_000;
/// The angle that [`pack::encode_unit_vector_48`] promises.
pub const MAX_FINE_ANGLE: f64 = 6.0e-7;
/// The angle that [`pack::encode_unit_vector`] promises.
pub const MAX_ANGLE: f64 = 6.6e-5;

/// The value of a half, by an independent implementation without the processor's instructions.
fn half_value(code: u32) -> f64 {
    f16::from_bits(code as u16).to_f64_const()
}

/// Whether the half `code` is the nearest to `x`, the even one of two, by the same implementation.
fn is_nearest(x: f32, code: u32) -> bool {
    let right = f16::from_f32_const(x);
    code == u32::from(right.to_bits()) || (code <= 0xffff && right.is_nan() && half_value(code).is_nan())
}

/// Conversion to half, over all bit patterns (all of a stride) and all midpoints and their neighbours.
pub fn to_half(effort: Effort, convert: impl Fn(f32) -> u32 + Sync) -> Tally {
    let stride = effort.stride(REDUCED_STRIDE);
    let visit = |x: f32, tally: &mut Tally| tally.check(u64::from(x.to_bits()), is_nearest(x, convert(x)));
    sweep((1_u64 << 32).div_ceil(stride), 0.0, |i, tally| {
        visit(f32::from_bits((i * stride) as u32), tally);
        if i < 0x7bff {
            let midpoint = ((half_value(i as u32) + half_value(i as u32 + 1)) * 0.5) as f32;
            [midpoint, -midpoint, midpoint.next_up(), midpoint.next_down()].iter().for_each(|&x| visit(x, tally));
        }
    })
}

/// All halves.
pub fn from_half(convert: impl Fn(u32) -> f32 + Sync) -> Tally {
    sweep(1 << 16, 0.0, |i, tally| {
        let (computed, exact) = (f64::from(convert(i as u32)), half_value(i as u32));
        tally.check(i, computed.to_bits() == exact.to_bits() || (computed.is_nan() && exact.is_nan()));
    })
}

/// EXT_texture_shared_exponent, in real arithmetic.
fn shared_exponent_reference(rgb: [f32; 3]) -> u32 {
    const BIAS: i32 = 15;
    const BITS: i32 = 9;
    let limited = rgb.map(|c| if c > 0.0 { f64::from(c.min(RGB9E5_MAX)) } else { 0.0 });
    let largest = limited.iter().copied().fold(0.0, f64::max);
    // exact, because the numbers are
    let floor_log2 = if largest > 0.0 { ((largest.to_bits() >> 52) as i32) - 1023 } else { i32::MIN };
    let mantissa = |c: f64, e: i32| (c / f64::exp2(f64::from(e - BIAS - BITS)) + 0.5).floor() as u32;
    let preliminary = floor_log2.max(-BIAS - 1) + 1 + BIAS;
    let shared = if mantissa(largest, preliminary) == 1 << BITS { preliminary + 1 } else { preliminary };
    let [r, g, b] = limited.map(|c| mantissa(c, shared));
    r | g << 9 | b << 18 | (shared as u32) << 27
}

/// Shared exponents of random colours of all magnitudes, of ties and of the ends of the range.
pub fn shared_exponent(encode: impl Fn(Vec3) -> u32 + Sync, decode: impl Fn(u32) -> Vec3 + Sync) -> Tally {
    const EDGES: [f32; 10] =
        [0.0, -1.0, 1.0e-30, 0.000_030_5, 0.999_999, 511.5, 65_408.0, 65_500.0, f32::INFINITY, f32::NAN];
    sweep(COLOURS, 0.0, |i, tally| {
        let mut random = SplitMix::new(i);
        let mut channel = || match random.below(16) {
            0 => EDGES[random.below(EDGES.len())],
            // a multiple of half a unit: ties
            1..=4 => random.below(1024) as f32 * power_of_two(random.below(30) as i32 - 20) as f32,
            _ => f32::from_bits(((100 + random.below(45) as u32) << 23) | (random.word() as u32 & 0x007f_ffff)),
        };
        let rgb = [channel(), channel(), channel()];
        let code = encode(Vec3::from_array(rgb));
        let back = decode(code).to_array();
        let unit = f64::exp2(f64::from(code >> 27) - 24.0);
        let exact = [code, code >> 9, code >> 18].map(|m| f64::from(m & 0x1ff) * unit);
        tally.check(i, code == shared_exponent_reference(rgb) && back.map(f64::from) == exact);
    })
}

/// The angle between a vector and what becomes of it, over random directions, a quarter of them close to the edges and
/// corners of the octahedron; the error is the angle. A result that is not a unit vector is a failure.
pub fn unit_vectors<C>(max_angle: f64, encode: impl Fn(Vec3) -> C + Sync, decode: impl Fn(C) -> Vec3 + Sync) -> Tally {
    sweep(DIRECTIONS, max_angle, |i, tally| {
        let mut random = SplitMix::new(i);
        let mut coordinate = || {
            let x = random.range(-1.0, 1.0);
            if i % 4 == 0 && random.below(2) == 0 { x * f64::exp2(-(random.below(40) as f64)) } else { x }
        };
        let given = DVec3::new(coordinate(), coordinate(), coordinate()).normalize().as_vec3();
        let back = decode(encode(given)).as_dvec3();
        let is_unit = (back.length() - 1.0).abs() <= 2.0e-7;
        let angle = given.as_dvec3().cross(back).length().atan2(given.as_dvec3().dot(back));
        tally.record(i, if is_unit { angle } else { f64::INFINITY });
    })
}

/// The code of a decoded vector is the same code; on the border of the square, another one of the same vector.
pub fn unit_vector_codes(effort: Effort) -> Tally {
    sweep_patterns(effort.stride(REDUCED_STRIDE), 0.0, |code, tally| {
        let largest = [code << 16, code].map(|c| ((c as i32) >> 16).abs()).into_iter().fold(0, i32::max);
        let vector = pack::decode_unit_vector(code);
        let back = pack::encode_unit_vector(vector);
        // -32768 is never written
        let same = back == code || (largest == 32_767 && pack::decode_unit_vector(back) == vector);
        if largest <= 32_767 {
            tally.check(u64::from(code), same);
        }
    })
}
