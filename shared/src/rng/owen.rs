//! Owen's scrambling by a hash.

/// Scrambles the binary digits of a word, of which bit 0 is the first: each is flipped or not by a hash of the seed and of the digits
/// before it (nested uniform scrambling, Owen 1995). It is a bijection that keeps the words of an aligned interval together.
///
/// Additions and multiplications carry from lower to higher bits alone, which makes them such a scrambling (Laine and Karras 2011,
/// "Stratified Sampling for Stochastic Transparency"). The constants are those of Vegdahl (2021), found by search for few
/// correlations.
#[inline(always)]
pub fn scramble(digits: u32, seed: u32) -> u32 {
    let x = digits ^ digits.wrapping_mul(0x3d20_adea);
    let x = x.wrapping_add(seed);
    let x = x.wrapping_mul((seed >> 16) | 1);
    let x = x ^ x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}
