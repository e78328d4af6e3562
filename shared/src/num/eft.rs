//! Error-free transforms: the rounding error of a sum or product as a second number.
//!
//! They hold only where nothing is contracted or reassociated, so a build that breaks the contract shows in them
//! first.

/// `(s, e)` with `s = fl(a + b)` and `s + e = a + b` (Knuth).
#[inline(always)]
pub fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// `(hi, lo)` of 12 bits each with `hi + lo = a` (Veltkamp), for |a| < 2^115.
#[inline(always)]
pub fn split(a: f32) -> (f32, f32) {
    let c = 4097.0 * a;
    let hi = c - (c - a);
    (hi, a - hi)
}

/// `(p, e)` with `p = fl(a b)` and `p + e = a b` (Dekker), while neither p nor e leaves the range of normal numbers.
#[inline(always)]
pub fn two_prod(a: f32, b: f32) -> (f32, f32) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}
