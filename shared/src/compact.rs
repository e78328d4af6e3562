//! Compaction and counting sort without barriers or atomics: count, scan, gather.
//!
//! Items have words; [`CompactParams`] says which bucket a word means, if any. The result lists the items that have a
//! bucket, by bucket and within one in their order. With one bucket that is compaction of flags; with more it is a
//! stable counting sort. Everything is `u32` arithmetic in a fixed order, and an invocation writes one element of its
//! own, so results do not depend on device or schedule. [`restir_suffix`](crate::technique::restir_suffix) sorts the points of a hash grid by it.
//!
//! ```text
//! words[items]                             64 items are a block
//!   | count       one invocation a bucket and block: how many of the block are in the bucket
//!   v
//! counts[buckets x blocks]                 bucket by bucket, so their running sum is the order of the output
//!   | sum         one invocation for 64 elements; again until fewer than 64 are left
//!   v
//! sums[n / 64], [n / 64^2] ...
//!   | scan        from the last level up: an element is its parent plus the values before it in its block
//!   v
//! offsets[buckets x blocks + 1]            the last is the number of all kept items
//!   | gather      the k-th output finds its bucket and block by binary search, then its item by counting
//!   v
//! indices[items]                           item of the k-th output, NONE beyond the last
//! ```
//!
//! `offsets[bucket x blocks]` is where a bucket begins, so the same passes make a grid: sort points by cell, and the
//! cell's bucket is its range. The counts take `buckets / 64` words an item; for more cells than some hundred sort by one
//! digit of the cell's number after the other, the least significant first (`shift` and `mask` select it; the order
//! within a bucket is kept), on words that were permuted by the pass before, and find a cell's range by binary search in
//! the sorted words.
//!
//! No invocation has loops of more than some 100 rounds.
//!
//! ```
//! use restir_shared::compact::{CompactParams, count, gather};
//! use restir_shared::layout::NONE;
//!
//! // flags of 0 and 1: one bucket, of the items whose word is 1; few enough items for a single block
//! let flags = [0, 1, 1, 0, 1];
//! let params = CompactParams { items: 5, blocks: 1, buckets: 1, first: 1, mask: u32::MAX, ..CompactParams::default() };
//! let kept = count(&params, &flags, 0, 0);
//! assert_eq!(kept, 3);
//!
//! // where the only cell, of bucket 0 and block 0, begins, and the number of all kept items
//! let offsets = [0, kept];
//! let indices = [0, 1, 2, 3, 4].map(|rank| gather(&params, &flags, &offsets, rank));
//! assert_eq!(indices, [1, 2, 4, NONE, NONE]);
//! ```

use crate::layout::{Extent, NONE};
use bytemuck::{Pod, Zeroable};

/// Items in a block, and elements that one invocation sums.
pub const BLOCK: u32 = 1 << BLOCK_LOG2;
const BLOCK_LOG2: u32 = 6;

/// Parameters of [`count`] and [`gather`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct CompactParams {
    /// Width of the grid: blocks for [`count`], anything for [`gather`].
    pub width: u32,
    /// Height of the grid: buckets for [`count`], for [`gather`] such that all items have an invocation.
    pub height: u32,
    /// Number of items.
    pub items: u32,
    /// Number of blocks: `items / 64`, rounded up.
    pub blocks: u32,
    /// Number of buckets.
    pub buckets: u32,
    /// What a word means in the first bucket; for flags of 0 and 1 it is 1.
    pub first: u32,
    /// A word means `(word >> shift) & mask`.
    pub shift: u32,
    /// What is left of a word behind `shift`: these bits.
    pub mask: u32,
}

crate::fields!(CompactParams: width, height, items, blocks, buckets, first, shift, mask);

impl CompactParams {
    /// The bucket of a word; not below `buckets` if it has none.
    #[inline(always)]
    fn bucket(&self, word: u32) -> u32 {
        ((word >> (self.shift & 31)) & self.mask).wrapping_sub(self.first)
    }
}

impl Extent for CompactParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// Parameters of [`sum`], [`scan`], [`take`] and [`start`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct ScanParams {
    /// Width of the grid.
    pub width: u32,
    /// Height of the grid.
    pub height: u32,
    /// Number of values; of [`start`], of sorted words.
    pub count: u32,
    /// Zero.
    pub reserved: u32,
}

crate::fields!(ScanParams: width, height, count, reserved);

impl Extent for ScanParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// How many items of a block are in a bucket.
#[inline(always)]
pub fn count(p: &CompactParams, words: &[u32], block: u32, bucket: u32) -> u32 {
    let mut item = block << BLOCK_LOG2;
    let end = item.wrapping_add(BLOCK).min(p.items);
    let mut found = 0_u32;
    while item < end {
        if p.bucket(words[item as usize]) == bucket {
            found = found.wrapping_add(1);
        }
        item = item.wrapping_add(1);
    }
    found
}

/// The sum of the values of a block; zero for one that has none.
#[inline(always)]
pub fn sum(p: &ScanParams, values: &[u32], block: u32) -> u32 {
    let first = block << BLOCK_LOG2;
    sum_range(values, first, first.wrapping_add(BLOCK).min(p.count))
}

/// The sum of all values before the element `at`, which is at most their number; `parents` has the same for blocks.
#[inline(always)]
pub fn scan(p: &ScanParams, values: &[u32], parents: &[u32], at: u32) -> u32 {
    if at > p.count {
        // an invocation that only fills the grid
        return 0;
    }
    let block = at >> BLOCK_LOG2;
    parents[block as usize].wrapping_add(sum_range(values, block << BLOCK_LOG2, at))
}

/// The item of the output `rank`, or [`NONE`].
#[inline(always)]
pub fn gather(p: &CompactParams, words: &[u32], offsets: &[u32], rank: u32) -> u32 {
    let cells = p.buckets.wrapping_mul(p.blocks);
    if rank >= offsets[cells as usize] {
        return NONE;
    }
    // the bucket, then the block of it, that begins last at or before the rank: those that are empty begin with the next
    let bucket = last_at_most(rank, offsets, 0, p.blocks, p.buckets);
    let row = bucket.wrapping_mul(p.blocks);
    let block = last_at_most(rank, offsets, row, 1, p.blocks);
    let mut left = rank.wrapping_sub(offsets[row.wrapping_add(block) as usize]);
    let mut item = block << BLOCK_LOG2;
    let end = item.wrapping_add(BLOCK).min(p.items);
    let mut found = NONE;
    while (item < end) & (found == NONE) {
        if p.bucket(words[item as usize]) == bucket {
            if left == 0 {
                found = item;
            }
            left = left.wrapping_sub(1);
        }
        item = item.wrapping_add(1);
    }
    found
}

/// The value of the item of the output `rank`; [`NONE`] beyond the last.
#[inline(always)]
pub fn take(p: &ScanParams, values: &[u32], indices: &[u32], rank: u32) -> u32 {
    if rank < p.count { values[indices[rank as usize] as usize] } else { NONE }
}

/// How many of the sorted words are below `word`: where those begin that are it, or more.
#[inline(always)]
pub fn start(p: &ScanParams, sorted: &[u32], word: u32) -> u32 {
    let (mut low, mut high) = (0_u32, p.count);
    while low < high {
        let middle = low.wrapping_add(high.wrapping_sub(low) >> 1);
        if sorted[middle as usize] < word {
            low = middle.wrapping_add(1);
        } else {
            high = middle;
        }
    }
    low
}

#[inline(always)]
fn sum_range(values: &[u32], mut at: u32, end: u32) -> u32 {
    let mut sum = 0_u32;
    while at < end {
        sum = sum.wrapping_add(values[at as usize]);
        at = at.wrapping_add(1);
    }
    sum
}

/// The last of `count` indices whose value is at most `limit`; the first one's is. Values do not decrease; that of the
/// index i is `values[first + i stride]`.
#[inline(always)]
fn last_at_most(limit: u32, values: &[u32], first: u32, stride: u32, count: u32) -> u32 {
    let mut index = 0_u32;
    let mut end = count;
    while end.wrapping_sub(index) > 1 {
        let middle = index.wrapping_add(end.wrapping_sub(index) >> 1);
        if values[first.wrapping_add(middle.wrapping_mul(stride)) as usize] <= limit {
            index = middle;
        } else {
            end = middle;
        }
    }
    index
}

const _: () = {
    assert!(size_of::<CompactParams>() == 32);
    assert!(size_of::<ScanParams>() == 16);
};
