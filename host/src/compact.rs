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
use restir_kernels::compact::{compact_count, compact_gather, compact_scan, compact_sum};
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
    check(buffers, words, items, buckets)?;
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
    let mut maker = Maker { buffers, passes: Vec::new() };
    let counts = maker.pass(&compact_count::DESC, "counts", &params([blocks, buckets.count]), &[("words", words)])?;
    let offsets = maker.offsets(counts, blocks * buckets.count)?;
    let read = [("words", words), ("offsets", offsets)];
    let indices = maker.pass(&compact_gather::DESC, "indices", &params(grid(items)), &read)?;
    Ok(Compaction { passes: maker.passes, indices, offsets, blocks })
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

/// Collects passes, each of which writes a new buffer.
struct Maker<'a> {
    buffers: &'a mut Vec<Buffer>,
    passes: Vec<Pass>,
}

impl Maker<'_> {
    fn buffer(&mut self, name: &'static str, words: u32) -> BufferId {
        self.buffers.push(Buffer { name, words: words as usize, contents: None });
        self.buffers.len() - 1
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
        let params = |[width, height]: [u32; 2]| ScanParams { width, height, count, reserved: 0 };
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
