//! The film of a plan: planes of finished blocks of samples, merged pairwise as in a binary counter.

use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};
use restir_kernels::KernelDesc;
use restir_kernels::film::{film_add, film_resolve};
use restir_shared::layout::{FilmParams, FilmPixel};

/// A film over planes of its own: each finished block goes into a free plane and is merged with the waiting plane of its
/// size, as often as there is one; what waits at the end is merged from the smallest up.
#[derive(Clone)]
pub(crate) struct Film {
    size: [u32; 2],
    samples: u32,
    free: Vec<BufferId>,
    /// (log2 of the samples, plane), largest first
    waiting: Vec<(u32, BufferId)>,
    output: BufferId,
}

impl Film {
    /// How many planes are ever in use at once for blocks of at most 2^`largest` samples: waiting blocks, whose sizes
    /// differ, and the one in work.
    pub(crate) fn plane_count(samples: u32, largest: u32) -> usize {
        (u32::BITS - (samples >> largest).leading_zeros()).max(samples.count_ones()) as usize
    }

    /// Adds the planes, and after them the one of the mean, to a plan's buffers.
    pub(crate) fn new(buffers: &mut Vec<Buffer>, size: [u32; 2], samples: u32, largest: u32) -> Self {
        let first = buffers.len();
        let planes = Self::plane_count(samples, largest);
        let words = size[0] as usize * size[1] as usize * size_of::<FilmPixel>() / 4;
        let plane = |name| Buffer { name, words, contents: None };
        buffers.extend((0..planes).map(|_| plane("film")).chain([plane("mean")]));
        let free = (first..first + planes).rev().collect();
        Self { size, samples, free, waiting: Vec::new(), output: first + planes }
    }

    /// The plane of the mean.
    pub(crate) fn output(&self) -> BufferId {
        self.output
    }

    /// A free plane for a block of 2^`log2` samples, which counts as finished.
    pub(crate) fn open(&mut self, log2: u32) -> Option<BufferId> {
        let plane = self.free.pop()?;
        self.waiting.push((log2, plane));
        Some(plane)
    }

    /// Merges the two smallest waiting planes if they are of a size.
    pub(crate) fn merge_equal(&mut self) -> Option<Result<Pass, Error>> {
        self.merge(|left, right| left == right)
    }

    /// Merges the two smallest waiting planes; divides by the number of samples once only one is left.
    pub(crate) fn finish(&mut self) -> Option<Result<Pass, Error>> {
        self.merge(|_, _| true).or_else(|| {
            let (_, plane) = self.waiting.pop()?;
            Some(self.pass(&film_resolve::DESC, [("sum", plane), ("mean", self.output)]))
        })
    }

    fn merge(&mut self, condition: impl Fn(u32, u32) -> bool) -> Option<Result<Pass, Error>> {
        let &[.., (left_log2, left), (right_log2, right)] = self.waiting.as_slice() else {
            return None;
        };
        condition(left_log2, right_log2).then(|| {
            self.waiting.truncate(self.waiting.len() - 2);
            self.waiting.push((left_log2 + 1, right));
            self.free.push(left);
            self.pass(&film_add::DESC, [("left", left), ("right", right)])
        })
    }

    fn pass(&self, kernel: &'static KernelDesc, bound: [(&str, BufferId); 2]) -> Result<Pass, Error> {
        let [width, height] = self.size;
        let params = FilmParams { width, height, samples: self.samples as f32, reserved: 0 };
        Pass::new(kernel, &[], &params, &bound)
    }
}
