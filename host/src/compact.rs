//! Passes of a compaction or a counting sort, for plans; [`restir_shared::compact`] describes the data flow.
//!
//! ```
//! use restir_host::compact::{Buckets, compact};
//! use restir_host::exec::{CpuExecutor, Executor};
//! use restir_host::plan::{Buffer, FramePlan};
//! use restir_host::Error;
//! use restir_shared::layout::NONE;
//!
//! // of six items, those whose word is 1
//! let words: [u32; 6] = [0, 1, 1, 0, 1, 0];
//! let mut buffers = vec![Buffer { name: "words", words: 6, contents: Some(words.as_slice().into()) }];
//! let compaction = compact(&mut buffers, 0, 6, Buckets::FLAGS)?;
//! let plan = FramePlan::of(buffers, compaction.passes, vec![compaction.indices]);
//! let results = CpuExecutor::inline().run(plan)?;
//! assert_eq!(results[0][..6], [1, 2, 4, NONE, NONE, NONE]);
//! # Ok::<(), Error>(())
//! ```

use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};
use bytemuck::Pod;
use restir_kernels::KernelDesc;
use restir_kernels::compact::{compact_count, compact_gather, compact_scan, compact_starts, compact_sum, compact_take};
use restir_shared::compact::{BLOCK, CompactParams, ScanParams};
use restir_shared::layout::Extent;

/// The most items.
pub const MAX_ITEMS: u32 = 1 << 24;
/// The most buckets: counting takes a pass over the items for each.
pub const MAX_BUCKETS: u32 = 256;
/// Width of the grids: they have rows, because the native executor runs those in parallel.
const ROW: u32 = 4096;

/// Which bucket a word means: `((word >> shift) & mask) - first`, and none if that is not below `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Buckets {
    /// How many there are.
    pub count: u32,
    /// The meaning of the first.
    pub first: u32,
    /// See above; below 32.
    pub shift: u32,
    /// See above.
    pub mask: u32,
}

impl Buckets {
    /// Keeps items whose word is 1.
    pub const FLAGS: Self = Self { count: 1, first: 1, shift: 0, mask: u32::MAX };

    /// Sorts by the `bits` bits of a word from bit `shift` on, at most 8: a digit of a radix sort.
    pub const fn digit(shift: u32, bits: u32) -> Self {
        Self { count: 1 << bits, first: 0, shift, mask: (1 << bits) - 1 }
    }

    /// Sorts by words below `count`, at most [`MAX_BUCKETS`]; items with other words are dropped.
    pub const fn keys(count: u32) -> Self {
        Self { count, first: 0, shift: 0, mask: u32::MAX }
    }
}

/// The passes, and where they leave their results.
#[derive(Debug)]
pub struct Compaction {
    /// To run in this order after the words were written.
    pub passes: Vec<Pass>,
    /// The item of each output, by bucket and in their order within one; [`restir_shared::layout::NONE`] beyond the last.
    pub indices: BufferId,
    /// Where the outputs of each bucket and block of items begin, bucket by bucket: a bucket begins at
    /// `bucket * blocks`. One more than those is the number of outputs.
    pub offsets: BufferId,
    /// Blocks of items: a bucket's stride in `offsets`.
    pub blocks: u32,
}

/// Makes the passes for the first `items` words of the buffer `words`, and adds the buffers that they need.
///
/// # Errors
/// [`Error::Plan`] for 0 or too many items or buckets, or a buffer that has fewer words.
pub fn compact(buffers: &mut Vec<Buffer>, words: BufferId, items: u32, buckets: Buckets) -> Result<Compaction, Error> {
    let mut maker = Maker { buffers, passes: Vec::new(), used: Vec::new(), free: Vec::new() };
    let Bucketed { indices, offsets, blocks } = maker.compact(words, items, buckets)?;
    Ok(Compaction { passes: maker.passes, indices, offsets, blocks })
}

/// Bits of a digit of [`sort`].
const DIGIT_BITS: u32 = 6;
/// The most digits of a word.
const MAX_DIGITS: u32 = 4;

/// The passes of a sort, and where they leave their results.
#[derive(Debug)]
pub struct Sorting {
    /// To run in this order after the words were written.
    pub passes: Vec<Pass>,
    /// The items by their words; those of equal words in their own order.
    pub order: BufferId,
    /// Where in `order` each word begins, from 0 to [`Self::buckets`], which is where the last one ends.
    pub starts: BufferId,
    /// The number of words that there can be: a power of 64.
    pub buckets: u32,
}

impl Sorting {
    /// Digits of which a word for so many items should be, so that about as many items have a word as words have an item.
    pub fn digits_for(items: u32) -> u32 {
        items.max(2).ilog2().div_ceil(DIGIT_BITS).clamp(1, 3)
    }
}

/// Makes the passes that sort the first `items` words of the buffer `words`, which are of that many digits of 6 bits, the least significant digit first, and adds the buffers that they
/// need.
///
/// # Errors
/// As of [`compact`], and for more than 4 digits, or none.
pub fn sort(buffers: &mut Vec<Buffer>, words: BufferId, items: u32, digits: u32) -> Result<Sorting, Error> {
    if !(1..=MAX_DIGITS).contains(&digits) {
        return Err(Error::Plan { problem: format!("cannot sort by {digits} digits; give 1 to {MAX_DIGITS}") });
    }
    let mut maker = Maker { buffers, passes: Vec::new(), used: Vec::new(), free: Vec::new() };
    let (mut sorted, mut order) = (words, None);
    for digit in 0..digits {
        let indices = maker.compact(sorted, items, Buckets::digit(digit * DIGIT_BITS, DIGIT_BITS))?.indices;
        let moved = maker.taken(sorted, indices, items)?;
        let by_digit = order.map_or(Ok(indices), |before| maker.taken(before, indices, items))?;
        (sorted, order) = (moved, Some(by_digit));
        // what the next digit does not read is written over
        maker.release(&[sorted, by_digit]);
    }
    let buckets = 1 << (DIGIT_BITS * digits);
    let starts = maker.starts(sorted, items, buckets)?;
    Ok(Sorting { passes: maker.passes, order: order.unwrap_or(words), starts, buckets })
}
fn check(buffers: &[Buffer], words: BufferId, items: u32, Buckets { count, .. }: Buckets) -> Result<(), Error> {
    let problem = if items == 0 || items > MAX_ITEMS {
        format!("cannot compact {items} items; give 1 to {MAX_ITEMS}")
    } else if count == 0 || count > MAX_BUCKETS {
        format!("cannot sort into {count} buckets; give 1 to {MAX_BUCKETS}, or sort by one digit after the other")
    } else if buffers.get(words).is_none_or(|buffer| buffer.words < items as usize) {
        format!("cannot compact {items} items of buffer {words}, which has fewer words; correct the plan")
    } else {
        return Ok(());
    };
    Err(Error::Plan { problem })
}

/// A grid of at least `invocations`.
fn grid(invocations: u32) -> [u32; 2] {
    let width = invocations.min(ROW);
    [width, invocations.div_ceil(width)]
}

fn scan_params([width, height]: [u32; 2], count: u32) -> ScanParams {
    ScanParams { width, height, count, reserved: 0 }
}

/// Where a compaction leaves its results, see [`Compaction`].
struct Bucketed {
    indices: BufferId,
    offsets: BufferId,
    blocks: u32,
}

/// Collects passes, each of which writes a buffer that is not in use.
struct Maker<'a> {
    buffers: &'a mut Vec<Buffer>,
    passes: Vec<Pass>,
    /// Buffers that were made here and are in use, and those that are no more.
    used: Vec<BufferId>,
    free: Vec<BufferId>,
}

impl Maker<'_> {
    fn buffer(&mut self, name: &'static str, words: u32) -> BufferId {
        let words = words as usize;
        let fits = |id: &BufferId| self.buffers[*id].name == name && self.buffers[*id].words == words;
        let id = if let Some(at) = self.free.iter().position(fits) {
            self.free.swap_remove(at)
        } else {
            self.buffers.push(Buffer { name, words, contents: None });
            self.buffers.len() - 1
        };
        self.used.push(id);
        id
    }

    /// All buffers but these may be written over.
    fn release(&mut self, kept: &[BufferId]) {
        let (used, released) = self.used.drain(..).partition(|id| kept.contains(id));
        self.used = used;
        self.free.extend::<Vec<_>>(released);
    }

    /// The passes of [`compact`].
    fn compact(&mut self, words: BufferId, items: u32, buckets: Buckets) -> Result<Bucketed, Error> {
        check(self.buffers, words, items, buckets)?;
        let blocks = items.div_ceil(BLOCK);
        let params = |[width, height]: [u32; 2]| CompactParams {
            width,
            height,
            items,
            blocks,
            buckets: buckets.count,
            first: buckets.first,
            shift: buckets.shift,
            mask: buckets.mask,
        };
        let counts =
            self.pass(&compact_count::DESC, "counts", &params([blocks, buckets.count]), &[("words", words)])?;
        let offsets = self.offsets(counts, blocks * buckets.count)?;
        let read = [("words", words), ("offsets", offsets)];
        let indices = self.pass(&compact_gather::DESC, "indices", &params(grid(items)), &read)?;
        Ok(Bucketed { indices, offsets, blocks })
    }

    /// The values of items in another order.
    fn taken(&mut self, values: BufferId, indices: BufferId, items: u32) -> Result<BufferId, Error> {
        let read = [("values", values), ("indices", indices)];
        self.pass(&compact_take::DESC, "taken", &scan_params(grid(items), items), &read)
    }

    /// Where each word begins, of so many sorted ones, and where the last one ends.
    fn starts(&mut self, sorted: BufferId, items: u32, words: u32) -> Result<BufferId, Error> {
        self.pass(&compact_starts::DESC, "starts", &scan_params(grid(words + 1), items), &[("sorted", sorted)])
    }

    /// A pass that reads some buffers; gives the one that it writes, whose role is `made`.
    fn pass(
        &mut self,
        kernel: &'static KernelDesc,
        made: &'static str,
        params: &(impl Pod + Extent),
        read: &[(&str, BufferId)],
    ) -> Result<BufferId, Error> {
        let [width, height] = params.extent();
        let output = self.buffer(made, width * height);
        self.passes.push(Pass::new(kernel, &[], params, &[read, &[(made, output)]].concat())?);
        Ok(output)
    }

    /// The sums before each of `count` values, and the sum of all.
    fn offsets(&mut self, values: BufferId, count: u32) -> Result<BufferId, Error> {
        let params = |grid| scan_params(grid, count);
        let parents = if count < BLOCK {
            // one block, which begins at zero
            self.buffer("zero", 1)
        } else {
            let sums = count.div_ceil(BLOCK);
            let values = self.pass(&compact_sum::DESC, "sums", &params(grid(sums)), &[("values", values)])?;
            self.offsets(values, sums)?
        };
        let read = [("values", values), ("parents", parents)];
        self.pass(&compact_scan::DESC, "offsets", &params(grid(count + 1)), &read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(n: usize) -> Vec<Buffer> {
        vec![Buffer { name: "words", words: n, contents: None }]
    }

    #[test]
    fn passes_fit_their_buffers() {
        for items in [1, 63, 64, 65, 4095, 4096, 4097, 262_144, 300_000, MAX_ITEMS] {
            for buckets in [Buckets::FLAGS, Buckets::digit(4, 4), Buckets::keys(MAX_BUCKETS)] {
                let mut buffers = words(items as usize);
                let compaction = compact(&mut buffers, 0, items, buckets).expect("within limits");
                for pass in &compaction.passes {
                    pass.check(&buffers).expect("fits");
                }
                assert!(buffers[compaction.indices].words >= items as usize);
                assert!(buffers[compaction.offsets].words > (buckets.count * compaction.blocks) as usize);
            }
        }
    }

    #[test]
    fn what_is_out_of_range_is_refused() {
        let refused = |items, buckets| compact(&mut words(100), 0, items, buckets).is_err();
        assert!(!refused(100, Buckets::FLAGS));
        assert!(refused(0, Buckets::FLAGS) && refused(101, Buckets::FLAGS));
        assert!(refused(100, Buckets::keys(0)) && refused(100, Buckets::keys(MAX_BUCKETS + 1)));
        assert!(compact(&mut words(100), 1, 10, Buckets::FLAGS).is_err());
        assert!(compact(&mut words(1 << 25), 0, MAX_ITEMS + 1, Buckets::FLAGS).is_err());
    }
}
