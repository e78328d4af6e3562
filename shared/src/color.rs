//! Colour: luminance and the sRGB transfer function (IEC 61966-2-1). Colours are linear Rec. 709 unless a name says
//! otherwise.

use crate::num;
pub use crate::vec::luminance;

/// One channel of linear light as an sRGB value, to 3 units in the last place on [0, 1]; negative light continues the
/// straight line. From 1 on the error grows, because the exponent is rounded.
pub fn srgb_encode(linear: f32) -> f32 {
    const EXPONENT: f32 = 1.0 / 2.4;
    let straight = linear <= 0.003_130_8;
    let curve = 1.055 * num::pow(if straight { 1.0 } else { linear }, EXPONENT) - 0.055;
    if straight { 12.92 * linear } else { curve }
}

/// The linear light of one sRGB channel, to 6 units in the last place on [0, 1]; negative values continue the straight
/// line. From 1 on the error grows, because the exponent is rounded.
pub fn srgb_decode(encoded: f32) -> f32 {
    const SLOPE: f32 = 1.0 / 12.92;
    const SCALE: f32 = 1.0 / 1.055;
    const OFFSET: f32 = 0.055 / 1.055;
    let straight = encoded <= 0.040_45;
    let curve = num::pow(if straight { 1.0 } else { encoded * SCALE + OFFSET }, 2.4);
    if straight { encoded * SLOPE } else { curve }
}
