//! Packing into 32-bit words: unit vectors, half floats, shared-exponent colours, normalised integers.
//!
//! Everything is rounded in integers or by exact steps, so host and device give the same bits.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::pack::{UNORM8, decode_unit_vector, encode_unit_vector, f32_from_half, half_from_f32};
//! use restir_shared::pack::{rgb9e5_decode, rgb9e5_encode};
//!
//! // a unit normal in 32 bits, to less than 7e-5 radians
//! let normal = Vec3::new(0.36, -0.48, 0.8);
//! assert!((decode_unit_vector(encode_unit_vector(normal)) - normal).length() < 7e-5);
//!
//! // radiance in 32 bits, to 2^-9 of its largest channel
//! let radiance = Vec3::new(12.0, 3.5, 0.25);
//! assert!((rgb9e5_decode(rgb9e5_encode(radiance)) - radiance).abs().max_element() <= 12.0 / 512.0);
//!
//! assert_eq!(f32_from_half(half_from_f32(0.5)), 0.5);
//! assert_eq!((UNORM8.encode(1.0), UNORM8.decode(255)), (255, 1.0));
//! ```

use crate::num;
use crate::vec::normalize;
use glam::{UVec4, Vec3};

/// An element of an arena or a plane.
#[cfg(target_arch = "spirv")]
#[inline(always)]
pub(crate) fn element<T: Copy>(of: &[T], index: usize) -> T {
    of[index]
}

/// An element of an arena or a plane, beyond whose end all is zero: a panic would keep compilers from vectorising.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub(crate) fn element<T: Copy + Default>(of: &[T], index: usize) -> T {
    match of.get(index) {
        Some(element) => *element,
        None => T::default(),
    }
}

const SIGN: u32 = 0x8000_0000;
const INFINITY: u32 = 0x7f80_0000;
const SNORM16: i32 = 32_767;
const SNORM16_F32: f32 = 32_767.0;
const SNORM24: i32 = 8_388_607;
const SNORM24_F32: f32 = 8_388_607.0;

/// A unit vector as two 16-bit coordinates on the octahedron |x| + |y| + |z| = 1 (Meyer et al. 2010, "On
/// Floating-Point Normal Vectors"; Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit
/// Vectors").
///
/// The angle to the decoded vector is at most 6.6e-5 radians. Any length from 2^-100 to 2^100 will do; the zero vector
/// and NaN give some unit vector. The code of a decoded vector is the same code, except on the square's border, where
/// two codes stand for a vector (all four corners for -z) and one of them is returned.
pub fn encode_unit_vector(v: Vec3) -> u32 {
    let length = num::abs(v.x) + num::abs(v.y) + num::abs(v.z);
    let scale = num::div(SNORM16_F32, length);
    let (x, y) = (nearest_snorm16(v.x * scale), nearest_snorm16(v.y * scale));
    let (x, y) = if v.z < 0.0 { fold(SNORM16, x, y) } else { (x, y) };
    (x as u32 & 0xffff) | ((y as u32) << 16)
}

/// The vector of a code of [`encode_unit_vector`], of length 1 to 2e-7; any word is a code.
#[cfg_attr(not(target_arch = "spirv"), inline(always))]
pub fn decode_unit_vector(code: u32) -> Vec3 {
    let (x, y) = (((code << 16) as i32) >> 16, (code as i32) >> 16);
    let z = SNORM16.wrapping_sub(magnitude(x)).wrapping_sub(magnitude(y));
    let (x, y) = if z < 0 { fold(SNORM16, x, y) } else { (x, y) };
    normalize(Vec3::new(x as f32, y as f32, z as f32))
}

/// As [`encode_unit_vector`], with 24-bit coordinates in two words: the angle to the decoded vector is at most 6e-7 radians. A decoded
/// vector may have another code, of the same vector up to that.
pub fn encode_unit_vector_48(v: Vec3) -> [u32; 2] {
    let length = num::abs(v.x) + num::abs(v.y) + num::abs(v.z);
    let scale = num::div(SNORM24_F32, length);
    let nearest = |x: f32| num::floor(num::clamp(x * scale, -SNORM24_F32, SNORM24_F32) + 0.5) as i32;
    let (x, y) = (nearest(v.x), nearest(v.y));
    let (x, y) = if v.z < 0.0 { fold(SNORM24, x, y) } else { (x, y) };
    [x as u32 & 0x00ff_ffff, y as u32 & 0x00ff_ffff]
}

/// The vector of a code of [`encode_unit_vector_48`], of length 1 to 2e-7; the upper bytes do not count.
pub fn decode_unit_vector_48([x, y]: [u32; 2]) -> Vec3 {
    let (x, y) = (((x << 8) as i32) >> 8, ((y << 8) as i32) >> 8);
    let z = SNORM24.wrapping_sub(magnitude(x)).wrapping_sub(magnitude(y));
    let (x, y) = if z < 0 { fold(SNORM24, x, y) } else { (x, y) };
    normalize(Vec3::new(x as f32, y as f32, z as f32))
}

/// The lower 24 bits of a word.
pub(crate) const LOW_24: u32 = 0x00ff_ffff;
const CELLS: f32 = 16_777_216.0;

/// A number in [0, 1) as the nearest multiple of 2^-24, in the lower 24 bits.
#[inline(always)]
pub(crate) fn unit_24(x: f32) -> u32 {
    let nearest = (num::clamp(x, 0.0, 1.0 - num::UNIT_ROUNDOFF) * CELLS + 0.5) as u32;
    // the sum is rounded as well: beyond the last cell lie the bits of another field
    if nearest > LOW_24 { LOW_24 } else { nearest }
}

/// A number in [0, 1) as the multiple of 2^-24 below it, in the lower 24 bits: what is such a multiple stays what it is.
#[inline(always)]
pub(crate) fn floor_24(x: f32) -> u32 {
    (num::clamp(x, 0.0, 1.0 - num::UNIT_ROUNDOFF) * CELLS) as u32
}

/// The inverse of [`unit_24`] and [`floor_24`]; the upper bits do not count.
#[inline(always)]
pub(crate) fn unit_from_24(word: u32) -> f32 {
    (word & LOW_24) as f32 * num::UNIT_ROUNDOFF
}

/// The floats in the components x, y, z of a word.
#[inline(always)]
pub fn xyz(word: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(word.x), f32::from_bits(word.y), f32::from_bits(word.z))
}

/// Between the inner diamond (z >= 0) and the corners (z <= 0) of a square of half the side `one`.
#[inline(always)]
fn fold(one: i32, x: i32, y: i32) -> (i32, i32) {
    let (fx, fy) = (one.wrapping_sub(magnitude(y)), one.wrapping_sub(magnitude(x)));
    (if x < 0 { fx.wrapping_neg() } else { fx }, if y < 0 { fy.wrapping_neg() } else { fy })
}

#[inline(always)]
fn magnitude(x: i32) -> i32 {
    if x < 0 { x.wrapping_neg() } else { x }
}

#[inline(always)]
fn nearest_snorm16(x: f32) -> i32 {
    num::nearest(num::clamp(x, -SNORM16_F32, SNORM16_F32))
}

/// The IEEE 754 half nearest to `x`, ties to even, in the low 16 bits. From 65 520 on infinity; subnormal halves are
/// formed; subnormal `x` give zero, NaN one quiet NaN.
pub fn half_from_f32(x: f32) -> u32 {
    let a = x.to_bits() & !SIGN;
    let exponent = a >> 23;
    // normal halves: 13 bits of the mantissa go
    let rebiased = a.wrapping_sub(0x3800_0000);
    let normal = rebiased.wrapping_add(0xfff).wrapping_add((a >> 13) & 1) >> 13;
    // subnormal halves: units of 2^-24; beyond 25 bits nothing is left in any case
    let shift = if exponent > 101 { 126_u32.wrapping_sub(exponent) & 31 } else { 25 };
    let subnormal = shift_to_nearest((a & 0x007f_ffff) | 0x0080_0000, shift);
    let half = if a > INFINITY {
        0x7e00
    } else if a >= 0x477f_f000 {
        0x7c00
    } else if exponent >= 113 {
        normal
    } else {
        subnormal
    };
    ((x.to_bits() & SIGN) >> 16) | half
}

/// m / 2^shift, rounded to nearest, ties to even, for shift in [1, 31].
#[inline(always)]
fn shift_to_nearest(m: u32, shift: u32) -> u32 {
    let floor = m >> shift;
    let rest = m.wrapping_sub(floor << shift);
    let tie = 1_u32.wrapping_shl(shift.wrapping_sub(1));
    let up = (rest > tie) | ((rest == tie) & (floor & 1 == 1));
    if up { floor.wrapping_add(1) } else { floor }
}

/// The number that the low 16 bits stand for as an IEEE 754 half; exact.
pub fn f32_from_half(half: u32) -> f32 {
    const UNIT: f32 = 1.0 / 16_777_216.0;
    let a = half & 0x7fff;
    let subnormal = (a as f32 * UNIT).to_bits();
    let bits = if a < 0x0400 {
        subnormal
    } else if a < 0x7c00 {
        (a << 13).wrapping_add(0x3800_0000)
    } else {
        (a << 13) | INFINITY
    };
    f32::from_bits(bits | ((half & 0x8000) << 16))
}

/// Two halves in a word, the first in the low bits.
pub fn half2_from_f32(a: f32, b: f32) -> u32 {
    half_from_f32(a) | (half_from_f32(b) << 16)
}

/// The two numbers of [`half2_from_f32`].
pub fn f32_from_half2(word: u32) -> (f32, f32) {
    (f32_from_half(word), f32_from_half(word >> 16))
}

/// The largest channel that RGB9E5 holds.
pub const RGB9E5_MAX: f32 = 65_408.0;

/// Mantissas of 9 bits from the low bits on, red first, and a shared exponent of 5 bits, as the OpenGL extension
/// EXT_texture_shared_exponent defines it, which Vulkan's E5B9G9R9_UFLOAT follows. Channels are limited to
/// [0, [`RGB9E5_MAX`]], NaN counts as zero. Each is off by at most 2^-9 of the largest channel, or 2^-25.
pub fn rgb9e5_encode(rgb: Vec3) -> u32 {
    let limited = |c: f32| num::clamp(c, 0.0, RGB9E5_MAX);
    let (r, g, b) = (limited(rgb.x), limited(rgb.y), limited(rgb.z));
    let largest = num::max(num::max(r, g), b);
    // floor(log2) + 16, at least 0
    let biased = largest.to_bits() >> 23;
    let shared = if biased > 111 { biased.wrapping_sub(111) } else { 0 };
    let overflows = round_half_up(largest * rgb9e5_unit_recip(shared)) == 512;
    let shared = if overflows { shared.wrapping_add(1) } else { shared };
    let scale = rgb9e5_unit_recip(shared);
    let mantissa = |c: f32| round_half_up(c * scale);
    mantissa(r) | (mantissa(g) << 9) | (mantissa(b) << 18) | (shared << 27)
}

/// The colour of an RGB9E5 word; exact.
pub fn rgb9e5_decode(word: u32) -> Vec3 {
    let unit = f32::from_bits((word >> 27).wrapping_add(103) << 23);
    let channel = |bits: u32| (bits & 0x1ff) as f32 * unit;
    Vec3::new(channel(word), channel(word >> 9), channel(word >> 18))
}

/// 2^(24 - e): one over the value of a mantissa's last bit.
#[inline(always)]
fn rgb9e5_unit_recip(shared: u32) -> f32 {
    f32::from_bits(151_u32.wrapping_sub(shared) << 23)
}

/// floor(x + 1/2) without the rounding of that sum, for x in [0, 2^22).
#[inline(always)]
fn round_half_up(x: f32) -> u32 {
    let n = num::nearest(x);
    (if x - n as f32 >= 0.5 { n.wrapping_add(1) } else { n }) as u32
}

/// Unsigned normalised integers: [0, 1] in steps of 1 / max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unorm {
    max: f32,
    step: f32,
}

/// 8 bits: [0, 255].
pub const UNORM8: Unorm = Unorm { max: 255.0, step: 1.0 / 255.0 };
/// 16 bits: [0, 65 535].
pub const UNORM16: Unorm = Unorm { max: 65_535.0, step: 1.0 / 65_535.0 };

impl Unorm {
    /// The nearest code; numbers outside [0, 1] are limited to it, NaN gives zero.
    #[inline(always)]
    pub fn encode(self, x: f32) -> u32 {
        num::nearest(num::clamp(x, 0.0, 1.0) * self.max) as u32
    }

    /// The number of a code, to 1.5 units in the last place; 0 and 1 exactly.
    #[inline(always)]
    pub fn decode(self, code: u32) -> f32 {
        code as f32 * self.step
    }
}
