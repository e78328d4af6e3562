//! The arc tangent of two arguments, in turns.

use super::{abs, div};

/// The angle of (x, y) in turns, in [-1/2, 1/2]; zero for the origin. Magnitudes of operands are at most 2^126: the
/// sum of two must be finite.
#[cfg_attr(not(target_arch = "spirv"), inline(always))]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (ay, ax) = (abs(y), abs(x));
    let steep = ay > ax;
    let (lo, hi) = if steep { (ax, ay) } else { (ay, ax) };
    // atan(t) = 1/8 turn + atan((t - 1) / (t + 1)) beyond 1/2, where t - 1 is exact
    let far = lo > 0.5 * hi;
    let (n, d) = if far { (lo - hi, lo + hi) } else { (lo, hi) };
    let t = if d > 0.0 { div(n, d) } else { 0.0 };
    let z = t * t;
    let p = -0.008_168_785;
    let p = p * z + 0.016_170_168;
    let p = p * z - 0.022_560_23;
    let p = p * z + 0.031_821_8;
    let p = p * z - 0.053_051_49;
    // 1 / (2 pi) = 1/8 + 0.034...: the larger product is exact
    let p = p * z + 0.034_154_944;
    let a = p * t + t * 0.125;
    let a = if far { a + 0.125 } else { a };
    let a = if steep { 0.25 - a } else { a };
    let a = if x < 0.0 { 0.5 - a } else { a };
    if y < 0.0 { -a } else { a }
}
