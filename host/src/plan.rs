//! A frame plan: the buffers of a technique and its passes in order. Executors run it, and know no technique.
//!
//! ```
//! use restir_host::exec::{CpuExecutor, Executor};
//! use restir_host::plan::{Buffer, FramePlan, Pass};
//! use restir_kernels::film::film_add;
//! use restir_shared::layout::{FilmParams, FilmPixel};
//!
//! // two planes of two pixels, the second of which is to become the sum of both
//! let plane = |value: f32| {
//!     let pixels = [FilmPixel { sum: [value; 3], dropped: 0.0 }; 2];
//!     Buffer { name: "film", words: 8, contents: Some(bytemuck::cast_slice(&pixels).into()) }
//! };
//! let params = FilmParams { width: 2, height: 1, ..FilmParams::default() };
//! // buffers are given by their roles in the kernel's declaration
//! let pass = Pass::new(&film_add::DESC, &[], &params, &[("left", 0), ("right", 1)])?;
//! let plan = FramePlan::of(vec![plane(1.0), plane(2.5)], vec![pass], vec![1]);
//!
//! let outputs = CpuExecutor::inline().run(plan)?;
//! let sums: Vec<FilmPixel> = bytemuck::pod_collect_to_vec(&outputs[0]);
//! assert_eq!(sums[1].sum, [3.5; 3]);
//! # Ok::<(), restir_host::Error>(())
//! ```

use crate::{Error, buffers::SceneBuffers};
use bytemuck::Pod;
use restir_kernels::{Access, Binding, KernelDesc};
use restir_shared::layout::Extent;
use std::{fmt, sync::Arc};

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

/// The buffers of a scene's arenas by role, which come first in every plan of a technique.
pub(crate) const ARENAS: [(&str, BufferId); 3] = [("geometry", 0), ("attributes", 1), ("texels", 2)];

impl Buffer {
    /// The [`ARENAS`] of a scene.
    #[doc(hidden)]
    pub fn arenas(scene: &SceneBuffers) -> [Self; 3] {
        let arenas = [("geometry", &scene.geometry), ("attributes", &scene.attributes), ("texels", &scene.texels)];
        arenas.map(|(name, words)| Self { name, words: words.len(), contents: Some(words.clone()) })
    }

    /// The words that it holds at the start: beyond its contents zeros.
    #[doc(hidden)]
    pub fn initial(&self) -> Arc<[u32]> {
        match &self.contents {
            Some(contents) if contents.len() >= self.words => contents.clone(),
            contents => {
                let known = contents.as_deref().unwrap_or_default();
                known.iter().copied().chain(std::iter::repeat(0)).take(self.words).collect()
            }
        }
    }
}

/// Words that are written to a buffer.
#[doc(hidden)]
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
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct SceneFrame {
    /// What differs in the buffers.
    pub uploads: Vec<Upload>,
    /// The scene, and that of the other frame, for executors that have a better structure than the arena to trace rays in.
    pub scenes: Option<[Arc<SceneBuffers>; 2]>,
}

/// Elements of a plane that wait for a pass: those with one of the bits set in one of their words.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Waiting {
    /// The plane, which the pass owns.
    pub buffer: BufferId,
    /// Which word of an element.
    pub word: usize,
    /// Which of its bits.
    pub bits: u32,
}

/// One dispatch.
#[derive(Clone, Debug)]
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
    /// For which elements there is work, if not for all. Where none waits the pass changes nothing, so that an executor that sees the plane may leave
    /// the pass out: how often a sample has to be gone on with is known only when it is done.
    pub waiting: Option<Waiting>,
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
    /// What the words of the last of the outputs count, pixel by pixel four words, if they have names.
    pub counts: [&'static str; 4],
    /// The scene that the passes trace rays in, for executors that have a better structure than the arena.
    pub scene: Option<Arc<SceneBuffers>>,
}

impl fmt::Debug for FramePlan<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffers, pass_count, outputs, .. } = self;
        let mut plan = f.debug_struct("FramePlan");
        plan.field("buffers", buffers).field("pass_count", pass_count).field("outputs", outputs).finish_non_exhaustive()
    }
}

fn misfit(kernel: &KernelDesc, problem: String) -> Error {
    let problem = format!("a pass of the plan {problem}; correct the plan");
    Error::Kernel { kernel: kernel.name.to_owned(), source: problem.into() }
}

/// The value that is given by that name.
fn only<T: Copy>(kernel: &KernelDesc, given: &[(&str, T)], name: &str) -> Result<T, Error> {
    let mut values = given.iter().filter(|(of, _)| *of == name).map(|(_, value)| *value);
    match (values.next(), values.next()) {
        (Some(value), None) => Ok(value),
        (None, _) => Err(misfit(kernel, format!("gives nothing to {name}"))),
        (Some(_), Some(_)) => Err(misfit(kernel, format!("gives two values to {name}"))),
    }
}

impl FramePlan<'_> {
    /// A plan of passes that are all there, which ask no scene but that of their buffers.
    pub fn of(buffers: Vec<Buffer>, passes: Vec<Pass>, outputs: Vec<BufferId>) -> FramePlan<'static> {
        let pass_count = passes.len() as u64;
        FramePlan {
            buffers,
            passes: Box::new(passes.into_iter().map(Ok)),
            pass_count,
            outputs,
            counts: [""; 4],
            scene: None,
        }
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|b| b.words as u64 * 4).sum()
    }
}

impl Pass {
    /// A pass over the extent of its parameters. The values of specialization constants and the buffers are given by name, that
    /// in the kernel's declaration, in any order; those that the kernel has not are left out.
    ///
    /// # Errors
    /// [`Error::Kernel`] if one of the kernel's constants or bindings is given nothing, or two values.
    pub fn new(
        kernel: &'static KernelDesc,
        constants: &[(&str, u32)],
        params: &(impl Pod + Extent),
        bound: &[(&str, BufferId)],
    ) -> Result<Self, Error> {
        let constant_names = kernel.constants.iter().map(|constant| constant.name);
        let roles = kernel.bindings.iter().skip(1).map(|binding| binding.name);
        Ok(Self {
            frame: None,
            kernel,
            constants: constant_names.map(|name| only(kernel, constants, name)).collect::<Result<_, _>>()?,
            params: bytemuck::cast_slice(std::slice::from_ref(params)).to_vec(),
            bindings: roles.map(|role| only(kernel, bound, role)).collect::<Result<_, _>>()?,
            grid: params.extent(),
            waiting: None,
        })
    }

    /// The same pass, which has work for some elements of the plane that is bound to a role: those with one of the bits set in that word.
    ///
    /// # Errors
    /// [`Error::Kernel`] if the kernel has no such binding.
    pub(crate) fn where_waiting(self, role: &str, word: usize, bits: u32) -> Result<Self, Error> {
        let buffer = self.bound(role)?;
        Ok(Self { waiting: Some(Waiting { buffer, word, bits }), ..self })
    }

    /// The kernel's bindings but for its parameters, each with its buffer.
    pub fn bindings(&self) -> impl Iterator<Item = (&'static Binding, BufferId)> {
        self.kernel.bindings.iter().skip(1).zip(self.bindings.iter().copied())
    }

    /// How many workgroups cover the grid.
    #[doc(hidden)]
    pub fn workgroups(&self) -> [u32; 3] {
        let [x, y, _] = self.kernel.workgroup;
        [self.grid[0].div_ceil(x), self.grid[1].div_ceil(y), 1]
    }

    /// Words of an element of a buffer that the pass owns.
    pub(crate) fn own_words(&self, buffer: BufferId) -> Option<usize> {
        let owned = |(binding, id): &(&Binding, BufferId)| binding.access == Access::Own && *id == buffer;
        self.bindings().find(owned).map(|(binding, _)| binding.stride as usize / 4)
    }

    /// The buffer that is bound to a role: to the kernel's binding of that name.
    ///
    /// # Errors
    /// [`Error::Kernel`] if the kernel has no such binding.
    #[doc(hidden)]
    pub fn bound(&self, role: &str) -> Result<BufferId, Error> {
        let found = self.bindings().find(|(binding, _)| binding.name == role).map(|(_, buffer)| buffer);
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
            let end = first + words.len();
            if buffers.get(*id).is_none_or(|buffer| end > buffer.words) {
                return Some(format!("writes words {first} to {end} of buffer {id}, which it has not"));
            }
        }
        if let Some(Waiting { buffer, word, .. }) = self.waiting
            && self.own_words(buffer).is_none_or(|words| word >= words)
        {
            return Some(format!("asks for word {word} of the elements of buffer {buffer}, which it does not own"));
        }
        let invocations = self.grid[0] as usize * self.grid[1] as usize;
        self.bindings().find_map(|(binding, id)| {
            let own = binding.access == Access::Own;
            let needed = if own { invocations * binding.stride as usize / 4 } else { 0 };
            let shared = self.bindings.iter().filter(|&&other| other == id).count() > 1;
            match buffers.get(id) {
                None => Some(format!("binds buffer {id} to {}, which does not exist", binding.name)),
                Some(buffer) if buffer.words < needed => {
                    Some(format!("writes {needed} words of {}, which has {}", buffer.name, buffer.words))
                }
                Some(buffer) if own && shared => Some(format!("writes {} and binds it twice", buffer.name)),
                Some(_) => None,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_kernels::film::film_add;
    use restir_kernels::path::path;
    use restir_shared::layout::FilmParams;
    use restir_shared::technique::path::PathParams;

    #[test]
    fn buffers_are_bound_by_role() {
        let pass = |bound: &[(&str, BufferId)]| Pass::new(&film_add::DESC, &[], &FilmParams::default(), bound);
        let right = pass(&[("right", 7), ("left", 3), ("middle", 4)]).expect("all are bound");
        assert_eq!(right.bindings, [3, 7]);
        assert_eq!((right.bound("left").ok(), right.bound("right").ok()), (Some(3), Some(7)));
        let message = |result: Result<Pass, Error>| result.expect_err("refused").to_string();
        assert!(message(pass(&[("left", 3)])).contains("nothing to right"));
        assert!(message(pass(&[("left", 3), ("right", 7), ("left", 4)])).contains("two values to left"));
        assert!(right.bound("middle").is_err() && right.bound("params").is_err());
    }

    #[test]
    fn constants_are_given_by_name() {
        let bound = [ARENAS.as_slice(), &[("film", 3)]].concat();
        let pass = |constants: &[(&str, u32)]| {
            let constants = [&[("block", 5)], constants].concat();
            Pass::new(&path::DESC, &constants, &PathParams::default(), &bound).map(|pass| pass.constants).ok()
        };
        assert_eq!(pass(&[("settings", 1), ("features", 2)]), Some(vec![2, 1, 5]));
        assert_eq!(pass(&[("settings", 1), ("unknown", 4), ("features", 2)]), Some(vec![2, 1, 5]));
        let [lacks, other, twice] =
            [("settings", 1), ("feature", 2), ("settings", 3)].map(|more| pass(&[("settings", 1), more]));
        assert_eq!((pass(&[]), lacks, other, twice), (None, None, None, None));
    }
}
