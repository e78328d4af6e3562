//! The cube root.

use super::{abs, eft, parts};

const ONE: u32 = 0x3f80_0000;
/// Balances the error of the linear seed over a period of the exponent.
const SEED_SHIFT: u32 = 0x0006_0000;
const THIRD: f32 = 1.0 / 3.0;
const FOUR_THIRDS: f32 = 4.0 / 3.0;

/// m^(-1/3) for m in [1/2, 4), to a few units in the last place: Newton's iteration on a seed from the bits.
#[inline(always)]
fn inverse_root(m: f32) -> f32 {
    let distance = m.to_bits().wrapping_sub(ONE) as i32;
    let y = f32::from_bits(ONE.wrapping_sub(SEED_SHIFT).wrapping_sub((distance.wrapping_mul(85) >> 8) as u32));
    let third = m * THIRD;
    let y = y * (FOUR_THIRDS - third * (y * y * y));
    let y = y * (FOUR_THIRDS - third * (y * y * y));
    y * (FOUR_THIRDS - third * (y * y * y))
}

/// The cube root, of the argument's sign. Domain: all numbers; a subnormal counts as zero, infinities and NaN are
/// their own roots.
///
/// The last step takes the residual m - c^3 from error-free products, which leaves little more than one rounding.
pub fn cbrt(x: f32) -> f32 {
    let bits = abs(x).to_bits();
    // the exponent as 3 q + r; 171 / 512 is 1/3 closely enough for 8 bits
    let exponent = bits >> 23;
    let q = exponent.wrapping_mul(171) >> 9;
    let r = exponent.wrapping_sub(q.wrapping_mul(3));
    let m = f32::from_bits((bits & 0x007f_ffff) | (r.wrapping_add(126) << 23));
    let y = inverse_root(m);
    let square = y * y;
    let c = m * square;
    let (p, p_error) = eft::two_prod(c, c);
    let (cube, cube_error) = eft::two_prod(p, c);
    let residual = ((m - cube) - cube_error) - p_error * c;
    let root = c + residual * (square * THIRD);
    let y = parts::scale(root, (q as i32).wrapping_sub(42));
    f32::from_bits(if exponent == 0 {
        parts::sign(x)
    } else if exponent == 255 {
        x.to_bits()
    } else {
        y.to_bits() | parts::sign(x)
    })
}
