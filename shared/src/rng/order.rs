//! Orders of the indices of points, by which one sequence serves several dimensions at once.

/// The index that stands at the place of `index` in the order of a dimension; in that of dimension 0 each is at its own place. It is
/// a bijection that reorders every aligned stretch of indices within itself: a linear map of the digits, of which each depends on
/// itself and on higher ones alone.
#[inline(always)]
pub fn reordered(index: u32, dimension: u32) -> u32 {
    let carry = |digits: u32, by: u32, which: u32| digits ^ ((digits & which.wrapping_mul(dimension)) >> by);
    carry(carry(carry(carry(index, 4, 0xa0b3_cd64), 8, 0x3681_34e1), 3, 0xdb72_7a14), 5, 0xe3f4_da64)
}
