//! Packed forms.
use crate::num;
use crate::vec::normalize;
use glam::Vec3;
const SCALE: f32 = 32767.0;
/// oct
#[inline(always)]
pub fn encode_unit_vector(v: Vec3) -> u32 {
    let inv = num::recip(num::abs(v.x) + num::abs(v.y) + num::abs(v.z));
    let (x, y) = (v.x * inv, v.y * inv);
    let fold = |a: f32, b: f32| {
        let m = 1.0 - num::abs(b);
        if a < 0.0 { -m } else { m }
    };
    let (x, y) = if v.z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    let q = |a: f32| (num::floor(a * SCALE + 0.5) as i32 as u32) & 0xffff;
    q(x) | (q(y) << 16)
}
/// oct
#[inline(always)]
pub fn decode_unit_vector(word: u32) -> Vec3 {
    const INV: f32 = 1.0 / SCALE;
    let s = |h: u32| ((h << 16) as i32 >> 16) as f32 * INV;
    let (x, y) = (s(word), s(word >> 16));
    let z = 1.0 - num::abs(x) - num::abs(y);
    let t = num::max(-z, 0.0);
    normalize(Vec3::new(if x < 0.0 { x + t } else { x - t }, if y < 0.0 { y + t } else { y - t }, z))
}
