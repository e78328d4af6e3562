//! Colour: luminance and the sRGB transfer function (IEC 61966-2-1). Colours are linear Rec. 709 unless a name says
//! otherwise.
//!
//! ```
//! use restir_shared::color::{luminance, srgb_decode, srgb_encode};
//! use restir_shared::glam::Vec3;
//!
//! // middle grey: a reflectance of 0.18 is the code 118 of 255
//! assert_eq!((srgb_encode(0.18) * 255.0).round(), 118.0);
//! assert!((srgb_decode(srgb_encode(0.18)) - 0.18).abs() < 1e-6);
//!
//! // of white light, green carries most of the luminance
//! assert!((luminance(Vec3::ONE) - 1.0).abs() < 1e-6);
//! assert!(luminance(Vec3::Y) > luminance(Vec3::X) + luminance(Vec3::Z));
//! ```

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
