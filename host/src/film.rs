//! The film of a plan: planes of finished blocks of samples, merged pairwise as in a binary counter.

use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};
use restir_kernels::KernelDesc;
use restir_kernels::film::{film_add, film_resolve};
use restir_shared::layout::{FilmParams, FilmPixel};

/// How much a film takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Capacity {
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    /// Most samples.
    pub(crate) samples: u32,
    /// Samples of the largest blocks, as a power of two.
    pub(crate) largest_block: u32,
    /// The mean is shown while samples are still to come.
    pub(crate) progressive: bool,
    /// The image is the sum of the samples instead of their mean.
    pub(crate) is_sum: bool,
}

impl Capacity {
    /// How many planes are ever in use at once: waiting blocks, whose sizes differ, and the one in work.
    pub(crate) fn planes(&self) -> usize {
        (u32::BITS - (self.samples >> self.largest_block).leading_zeros()).max(self.samples.count_ones()) as usize
    }
}

/// A film over planes of its own: each finished block goes into a free plane and is merged with the waiting plane of its
/// size, as often as there is one; for the image, what waits is merged from the smallest up.
#[derive(Clone)]
pub(crate) struct Film {
    size: [u32; 2],
    samples: u32,
    free: Vec<BufferId>,
    /// (log2 of the samples, plane), largest first
    waiting: Vec<(u32, BufferId)>,
    /// where what waits is merged if it has to go on waiting
    scratch: Option<BufferId>,
    is_sum: bool,
    output: BufferId,
}

impl Film {
    /// Adds the planes, and after them the one of the mean, to a plan's buffers.
    pub(crate) fn new(buffers: &mut Vec<Buffer>, capacity: Capacity) -> Self {
        let [width, height] = capacity.size;
        let words = width as usize * height as usize * size_of::<FilmPixel>() / 4;
        let mut add = |name| {
            buffers.push(Buffer { name, words, contents: None });
            buffers.len() - 1
        };
        let mut free: Vec<BufferId> = (0..capacity.planes()).map(|_| add("film")).collect();
        free.reverse();
        let scratch = capacity.progressive.then(|| add("film"));
        let Capacity { size, is_sum, .. } = capacity;
        Self { size, samples: 0, free, waiting: Vec::new(), scratch, is_sum, output: add("mean") }
    }

    /// The plane of the mean.
    pub(crate) fn output(&self) -> BufferId {
        self.output
    }

    /// The samples that it holds.
    pub(crate) fn samples(&self) -> u32 {
        self.samples
    }

    /// Begins anew.
    pub(crate) fn clear(&mut self) {
        self.free.extend(self.waiting.drain(..).map(|(_, plane)| plane));
        self.samples = 0;
    }

    /// A free plane for a block of 2^`log2` samples, which counts as finished.
    pub(crate) fn open(&mut self, log2: u32) -> Option<BufferId> {
        let plane = self.free.pop()?;
        self.waiting.push((log2, plane));
        self.samples += 1 << log2;
        Some(plane)
    }

    /// Merges the two smallest waiting planes if they are of a size.
    pub(crate) fn merge_equal(&mut self) -> Option<Result<Pass, Error>> {
        let &[.., (left, _), (right, _)] = self.waiting.as_slice() else { return None };
        (left == right).then(|| self.merge()).flatten()
    }

    /// The passes that make the mean of all samples. A progressive film goes on after them, any other begins anew.
    pub(crate) fn image(&mut self) -> Vec<Result<Pass, Error>> {
        let samples = if self.is_sum { 1 } else { self.samples };
        let mut passes = Vec::new();
        let sum = match self.scratch {
            Some(scratch) if self.waiting.len() > 1 => self.sum_in(scratch, &mut passes),
            Some(_) => self.waiting.first().map(|&(_, plane)| plane),
            None => {
                passes.extend(std::iter::from_fn(|| self.merge()));
                let sum = self.waiting.first().map(|&(_, plane)| plane);
                self.clear();
                sum
            }
        };
        passes.extend(sum.map(|sum| self.divide(sum, self.output, samples)));
        passes
    }

    /// Sums what waits in a plane of its own, in the order in which [`Self::merge`] would.
    fn sum_in(&self, scratch: BufferId, passes: &mut Vec<Result<Pass, Error>>) -> Option<BufferId> {
        let ((_, smallest), larger) = self.waiting.split_last()?;
        passes.push(self.divide(*smallest, scratch, 1));
        passes.extend(larger.iter().rev().map(|&(_, plane)| self.add(plane, scratch)));
        Some(scratch)
    }

    fn merge(&mut self) -> Option<Result<Pass, Error>> {
        let &[.., (log2, left), (_, right)] = self.waiting.as_slice() else { return None };
        self.waiting.truncate(self.waiting.len() - 2);
        self.waiting.push((log2 + 1, right));
        self.free.push(left);
        Some(self.add(left, right))
    }

    fn add(&self, left: BufferId, right: BufferId) -> Result<Pass, Error> {
        add(self.size, left, right)
    }

    fn divide(&self, sum: BufferId, mean: BufferId, samples: u32) -> Result<Pass, Error> {
        pass(&film_resolve::DESC, self.size, samples, [("sum", sum), ("mean", mean)])
    }
}

/// `samples` samples from `first` on as aligned blocks (first, log2 of the size), of at most 2^`largest` samples each.
pub(crate) fn aligned_blocks(mut first: u32, samples: u32, largest: u32) -> impl Iterator<Item = (u32, u32)> + Send {
    let end = first + samples;
    std::iter::from_fn(move || {
        let left = end - first;
        (left > 0).then(|| {
            let log2 = largest.min(left.ilog2()).min(first.trailing_zeros());
            let block = (first, log2);
            first += 1 << log2;
            block
        })
    })
}

/// The pass that adds the plane `left` to the plane `right`.
pub(crate) fn add(size: [u32; 2], left: BufferId, right: BufferId) -> Result<Pass, Error> {
    pass(&film_add::DESC, size, 1, [("left", left), ("right", right)])
}

fn pass(
    kernel: &'static KernelDesc,
    [width, height]: [u32; 2],
    samples: u32,
    bound: [(&str, BufferId); 2],
) -> Result<Pass, Error> {
    let params = FilmParams { width, height, samples: samples as f32, reserved: 0 };
    Pass::new(kernel, &[], &params, &bound)
}
