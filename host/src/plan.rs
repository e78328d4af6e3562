//! A frame plan: the buffers of a technique and its passes in order. Executors run it; they know no technique.

use crate::Error;
use crate::buffers::SceneBuffers;
use restir_kernels::{Access, KernelDesc};
use std::sync::Arc;

/// Index into [`FramePlan::buffers`].
pub type BufferId = usize;

/// A buffer of a plan.
#[derive(Clone, Debug)]
pub struct Buffer {
    /// Name for messages.
    pub name: &'static str,
    /// Size in words of 32 bits; that of the contents if there are any.
    pub words: usize,
    /// What it holds at the start; zeros if `None`.
    pub contents: Option<Arc<[u32]>>,
}

/// The buffers of a scene's arenas, which come first in every plan of a technique: geometry, attributes, texels.
pub const ARENAS: [BufferId; 3] = [0, 1, 2];

impl Buffer {
    /// The [`ARENAS`] of a scene.
    pub fn arenas(scene: &SceneBuffers) -> [Self; 3] {
        let arenas = [("geometry", &scene.geometry), ("attributes", &scene.attributes), ("texels", &scene.texels)];
        arenas.map(|(name, words)| Self { name, words: words.len(), contents: Some(words.clone()) })
    }
}

/// Words that are written to a buffer.
#[derive(Clone, Debug)]
pub struct Upload {
    /// The buffer.
    pub buffer: BufferId,
    /// Index of the first word in it.
    pub first: usize,
    /// The words.
    pub words: Arc<[u32]>,
}

/// The frame of a scene that moves.
#[derive(Clone, Debug)]
pub struct SceneFrame {
    /// What differs in the buffers.
    pub uploads: Vec<Upload>,
    /// The scene, and that of the other frame, for executors that have a better structure than the arena to trace rays in.
    pub scenes: Option<[Arc<SceneBuffers>; 2]>,
}

/// One dispatch.
#[derive(Clone)]
pub struct Pass {
    /// A frame that begins with this pass; the plan's scene until there is one.
    pub frame: Option<SceneFrame>,
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
    pub passes: Box<dyn Iterator<Item = Result<Pass, Error>> + 'a>,
    /// How many passes there are.
    pub pass_count: u64,
    /// The buffers that hold the results.
    pub outputs: Vec<BufferId>,
    /// The scene that the passes trace rays in, for executors that have a better structure than the arena.
    pub scene: Option<&'a SceneBuffers>,
}

impl FramePlan<'_> {
    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|b| b.words as u64 * 4).sum()
    }
}

impl Pass {
    /// Whether the pass fits its kernel and the plan's buffers; executors check before they run it.
    ///
    /// # Errors
    /// [`Error::Kernel`] that says what does not fit.
    pub fn check(&self, buffers: &[Buffer]) -> Result<(), Error> {
        let problem = self.misfit(buffers).map(|problem| format!("a pass of the plan {problem}; correct the plan"));
        problem.map_or(Ok(()), |problem| Err(Error::Kernel { kernel: self.kernel.name.to_owned(), problem }))
    }

    fn misfit(&self, buffers: &[Buffer]) -> Option<String> {
        let (params, bindings) = self.kernel.bindings.split_first()?;
        if self.grid.contains(&0) {
            return Some("has an empty grid".to_owned());
        }
        if self.params.len() * 4 != params.stride as usize || self.constants.len() != self.kernel.constants.len() {
            return Some("has parameters or constants of another size".to_owned());
        }
        if self.bindings.len() != bindings.len() {
            return Some(format!("binds {} buffers instead of {}", self.bindings.len(), bindings.len()));
        }
        for Upload { buffer: id, first, words } in self.frame.iter().flat_map(|frame| &frame.uploads) {
            if buffers.get(*id).is_none_or(|buffer| first + words.len() > buffer.words) {
                return Some(format!(
                    "writes words {first} to {} of buffer {id}, which it has not",
                    first + words.len()
                ));
            }
        }
        let invocations = self.grid[0] as usize * self.grid[1] as usize;
        for (binding, &id) in bindings.iter().zip(&self.bindings) {
            let own = binding.access == Access::Own;
            let needed = if own { invocations * binding.stride as usize / 4 } else { 0 };
            let shared = self.bindings.iter().filter(|&&other| other == id).count() > 1;
            match buffers.get(id) {
                None => return Some(format!("binds buffer {id} to {}, which does not exist", binding.name)),
                Some(buffer) if buffer.words < needed => {
                    return Some(format!("writes {needed} words of {}, which has {}", buffer.name, buffer.words));
                }
                Some(buffer) if own && shared => return Some(format!("writes {} and binds it twice", buffer.name)),
                Some(_) => {}
            }
        }
        None
    }
}
