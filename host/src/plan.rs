//! A frame plan: the buffers of a technique and its passes in order. Executors run it; they know no technique.

use restir_kernels::KernelDesc;
use std::sync::Arc;

/// Index into [`FramePlan::buffers`].
pub type BufferId = usize;

/// A buffer of a plan.
#[derive(Clone, Debug)]
pub struct Buffer {
    /// Name for messages.
    pub name: &'static str,
    /// Size in words of 32 bits.
    pub words: usize,
    /// What it holds at the start; zeros if `None`.
    pub contents: Option<Arc<[u32]>>,
}

/// One dispatch.
#[derive(Clone)]
pub struct Pass {
    /// The kernel.
    pub kernel: &'static KernelDesc,
    /// Values of its specialization constants, in the order of the descriptor.
    pub constants: Vec<u32>,
    /// Its parameter block.
    pub params: Vec<u32>,
    /// Its further bindings, in the order of the descriptor.
    pub bindings: Vec<BufferId>,
    /// Width and height of the grid in invocations.
    pub grid: [u32; 2],
}

/// The passes of a frame, made one at a time: a long render has millions.
pub struct FramePlan<'a> {
    /// The buffers.
    pub buffers: Vec<Buffer>,
    /// The passes, in order.
    pub passes: Box<dyn Iterator<Item = Pass> + 'a>,
    /// How many passes there are.
    pub pass_count: u64,
    /// The buffers that hold the results.
    pub outputs: Vec<BufferId>,
}

impl FramePlan<'_> {
    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|b| b.words as u64 * 4).sum()
    }
}
