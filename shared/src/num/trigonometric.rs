//! Sine and cosine of an angle in turns, and their inverses: one polynomial for both sides.

use super::{abs, min, parts, round, sqrt};

/// (sin, cos) of an angle in turns: of `2 pi u`. Domain |u| <= [`super::TURNS_MAX`].
/// Below 2^-100 the last bit may differ where subnormal numbers are flushed.
///
/// The reduction to an eighth of a turn is exact, which is why angles are in turns: random numbers already are.
/// Coefficients after Cephes (S. L. Moshier), rescaled to turns.
#[cfg_attr(not(target_arch = "spirv"), inline(always))]
pub fn sin_cos(u: f32) -> (f32, f32) {
    let (k, quadrant) = round(u * 4.0);
    let r = u - k * 0.25;
    let z = r * r;
    let p = -75.445_656;
    let p = p * z + 81.593_766;
    let p = p * z - 41.341_67;
    // 2 pi in two parts
    let sin = r * 6.283_185_5 + (p * (z * r) - r * 1.748_455_5e-7);
    let p = 59.349_7;
    let p = p * z - 85.447_14;
    let p = p * z + 64.939_36;
    let p = p * z - 19.739_208;
    let cos = p * z + 1.0;
    let (a, b) = if quadrant & 1 == 0 { (sin, cos) } else { (cos, sin) };
    (if quadrant & 2 == 0 { a } else { -a }, if quadrant.wrapping_add(1) & 2 == 0 { b } else { -b })
}

/// Whether |x| > 1/2, and the angle of 0 <= t <= 1/2 in turns: arcsin t for t = |x| up to 1/2, and for
/// t = sqrt((1 - |x|) / 2) beyond, where 2 arcsin t = arccos |x|. (1 - |x|) / 2 is exact.
///
/// Coefficients by a minimax fit, relative error 2^-27.6.
#[inline(always)]
fn half_range(x: f32) -> (bool, f32) {
    let a = min(abs(x), 1.0);
    let far = a > 0.5;
    let z = if far { 0.5 - 0.5 * a } else { a * a };
    let t = if far { sqrt(z) } else { a };
    let p = 6.712_678e-3;
    let p = p * z + 3.847_123_1e-3;
    let p = p * z + 7.237_115_4e-3;
    let p = p * z + 1.192_911e-2;
    let p = p * z + 2.652_596_1e-2;
    // 1 / (2 pi) = 1/8 + 0.034...: the larger product is exact
    let p = p * z + 0.034_154_944;
    (far, p * t + t * 0.125)
}

/// The angle in turns, in [0, 1/2], whose cosine is `x`. Arguments beyond -1 and 1 count as these, which a product of
/// unit vectors needs; NaN for NaN.
pub fn acos(x: f32) -> f32 {
    let (far, angle) = half_range(x);
    let y = if far { angle + angle } else { 0.25 - angle };
    let y = if x < 0.0 { 0.5 - y } else { y };
    f32::from_bits(if parts::is_nan(x) { parts::NAN } else { y.to_bits() })
}

/// The angle in turns, in [-1/4, 1/4], whose sine is `x`. Arguments beyond -1 and 1 count as these; NaN for NaN.
/// Below 2^-100 the last bit may differ where subnormal numbers are flushed.
pub fn asin(x: f32) -> f32 {
    let (far, angle) = half_range(x);
    let y = if far { 0.25 - (angle + angle) } else { angle };
    f32::from_bits(if parts::is_nan(x) { parts::NAN } else { y.to_bits() | parts::sign(x) })
}
