//! A frame plan: the buffers of a technique and its passes in order. Executors run it; they know no technique.

use crate::Error;
use crate::buffers::SceneBuffers;
use bytemuck::Pod;
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

fn misfit(kernel: &KernelDesc, problem: String) -> Error {
    let problem = format!("a pass of the plan {problem}; correct the plan");
    Error::Kernel { kernel: kernel.name.to_owned(), problem }
}

impl FramePlan<'_> {
    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|b| b.words as u64 * 4).sum()
    }
}

impl Pass {
    /// A pass over `grid` with its buffers by role, in any order: `role` is the name of a binding in the kernel's
    /// declaration. `constants` are in the order of the descriptor.
    ///
    /// # Errors
    /// [`Error::Kernel`] if the kernel has no binding of a role, or one gets no buffer, or two.
    pub fn new<P: Pod>(
        kernel: &'static KernelDesc,
        constants: &[u32],
        params: &P,
        bound: &[(&str, BufferId)],
        grid: [u32; 2],
    ) -> Result<Self, Error> {
        let roles = || kernel.bindings.iter().skip(1).map(|binding| binding.name);
        if let Some((unknown, _)) = bound.iter().find(|(role, _)| roles().all(|name| name != *role)) {
            return Err(misfit(kernel, format!("binds {unknown}, which the kernel has not")));
        }
        let buffer_of = |role: &str| {
            let mut buffers = bound.iter().filter(|(name, _)| *name == role).map(|(_, buffer)| *buffer);
            match (buffers.next(), buffers.next()) {
                (Some(buffer), None) => Ok(buffer),
                (None, _) => Err(misfit(kernel, format!("binds nothing to {role}"))),
                (Some(_), Some(_)) => Err(misfit(kernel, format!("binds two buffers to {role}"))),
            }
        };
        Ok(Self {
            frame: None,
            kernel,
            constants: constants.to_vec(),
            params: bytemuck::cast_slice(std::slice::from_ref(params)).to_vec(),
            bindings: roles().map(buffer_of).collect::<Result<_, _>>()?,
            grid,
        })
    }

    /// The buffer that is bound to a role: to the kernel's binding of that name.
    ///
    /// # Errors
    /// [`Error::Kernel`] if the kernel has no such binding.
    pub fn bound(&self, role: &str) -> Result<BufferId, Error> {
        let mut bindings = self.kernel.bindings.iter().skip(1).zip(&self.bindings);
        let found = bindings.find(|(binding, _)| binding.name == role).map(|(_, buffer)| *buffer);
        found.ok_or_else(|| misfit(self.kernel, format!("is asked for {role}, which the kernel has not")))
    }

    /// The parameter block, if it is one of type `P`, by its size.
    pub fn params<P: Pod>(&self) -> Option<P> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.params);
        (bytes.len() == size_of::<P>()).then(|| bytemuck::pod_read_unaligned(bytes))
    }

    /// Whether the pass fits its kernel and the plan's buffers; executors check before they run it.
    ///
    /// # Errors
    /// [`Error::Kernel`] that says what does not fit.
    pub fn check(&self, buffers: &[Buffer]) -> Result<(), Error> {
        self.misfit(buffers).map_or(Ok(()), |problem| Err(misfit(self.kernel, problem)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use restir_kernels::film::film_add::DESC;
    use restir_shared::layout::FilmParams;

    #[test]
    fn buffers_are_bound_by_role() {
        let pass = |bound: &[(&str, BufferId)]| Pass::new(&DESC, &[], &FilmParams::default(), bound, [1, 1]);
        let right = pass(&[("right", 7), ("left", 3)]).expect("all are bound");
        assert_eq!(right.bindings, [3, 7]);
        assert_eq!((right.bound("left").ok(), right.bound("right").ok()), (Some(3), Some(7)));
        let message = |result: Result<Pass, Error>| result.err().expect("refused").to_string();
        assert!(message(pass(&[("left", 3)])).contains("nothing to right"));
        assert!(message(pass(&[("left", 3), ("right", 7), ("left", 4)])).contains("two buffers to left"));
        assert!(message(pass(&[("left", 3), ("right", 7), ("middle", 4)])).contains("middle"));
        assert!(right.bound("middle").is_err() && right.bound("params").is_err());
    }
}
