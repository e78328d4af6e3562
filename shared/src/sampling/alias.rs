//! Choice among n outcomes in constant time (Walker 1977; Vose 1991 for the table).

use crate::num::mul_wide;
use crate::rng;

/// Chooses an index below `count` from two random words. `entry(i)` gives the table's (threshold, alias).
///
/// The index comes from all 32 bits of the first word, so its probability is exact to `count` 2^-32. The map is
/// many-to-one, hence there is no inverse: replay keeps the words.
#[inline(always)]
pub fn sample_alias(words: [u32; 2], count: u32, entry: impl Fn(u32) -> (f32, u32)) -> u32 {
    let (index, _) = mul_wide(words[0], count);
    let (threshold, alias) = entry(index);
    if rng::unit(words[1]) < threshold { index } else { alias }
}
