//! The passes of a render with all that they read, so that each pixel of one can be replayed natively, whatever executor ran it.

use super::record::Reused;
use crate::plan::{BufferId, Pass};
use crate::{Error, buffers::SceneBuffers, exec::Step, render::Render, replay::TwoFrames};
use bytemuck::Pod;
use restir_kernels::KernelDesc;
use restir_shared::layout::Extent;
use restir_shared::resample::params::Flags;
use std::{collections::BTreeMap, sync::Arc};

/// Where a pass has a pixel's record from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The pixel has drawn it, if there is a sample in it: which of its candidates, as the technique counts them.
    Candidate(u32),
    /// Another pass has left it.
    Record {
        /// The index of that pass ([`Generation::pass`](super::Generation::pass)).
        made_by: usize,
        /// Index of the pixel.
        pixel: u32,
        /// It is not what the pixel had.
        is_other: bool,
        /// It is of the last frame.
        of_last_frame: bool,
    },
}

/// A kernel whose passes are followed, for a replay reads what they leave.
#[derive(Debug)]
pub struct Kernel {
    pub(crate) desc: &'static KernelDesc,
    /// The role of the plane in which it leaves records, if it does.
    pub(crate) records: Option<&'static str>,
    /// The roles of other planes that it leaves.
    pub(crate) others: &'static [&'static str],
}

impl Kernel {
    fn of<R: Reused>(pass: &Pass) -> Option<&'static Self> {
        R::KERNELS.iter().find(|kernel| kernel.desc.name == pass.kernel.name)
    }
}

/// A plane as a pass left it.
#[derive(Clone, Debug)]
struct Plane {
    words: Arc<[u32]>,
    made_by: usize,
}

/// A pass that was followed.
#[derive(Debug)]
pub struct Followed<R: Reused> {
    kernel: &'static Kernel,
    pub(crate) params: R::Params,
    pub(crate) frames: Arc<TwoFrames>,
    /// What the planes of its roles held before it.
    found: Vec<(&'static str, Plane)>,
    /// Nothing if it leaves no records.
    records: Arc<[u32]>,
}

impl<R: Reused> Followed<R> {
    /// Whether it is of this kernel.
    pub(crate) fn is(&self, kernel: &KernelDesc) -> bool {
        self.kernel.desc.name == kernel.name
    }

    /// Whether it leaves records that no other pass has made.
    pub(crate) fn is_initial(&self) -> bool {
        R::KERNELS.first().is_some_and(|first| self.is(first.desc))
    }

    /// Whether it leaves records that it merges into a plane of their own.
    pub(crate) fn leaves_merged(&self) -> bool {
        self.kernel.records == Some("merged")
    }

    /// Whether it takes records from one frame to the other.
    pub(crate) fn crosses(&self) -> bool {
        self.params.flags.contains(Flags::OTHER_FRAME)
    }

    /// The records that it left.
    pub(crate) fn records(&self) -> &[R] {
        elements(&self.records)
    }

    /// What an earlier pass had left in the plane of a role.
    ///
    /// # Errors
    /// [`Error::Kernel`] if none has.
    pub(crate) fn read<T: Pod>(&self, role: &str) -> Result<&[T], Error> {
        self.plane(role).map(|plane| elements(&plane.words))
    }

    /// The same if the pass reads the plane at all; else nothing.
    pub(crate) fn read_if<T: Pod>(&self, is_read: bool, role: &str) -> Result<&[T], Error> {
        if is_read { self.read(role) } else { Ok(&[]) }
    }

    /// The index of that earlier pass.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub(crate) fn maker(&self, role: &str) -> Result<usize, Error> {
        self.plane(role).map(|plane| plane.made_by)
    }

    /// The place of a pixel.
    pub(crate) fn position(&self, pixel: u32) -> [u32; 2] {
        let [width, _] = self.params.extent();
        [pixel % width, pixel / width]
    }

    fn plane(&self, role: &str) -> Result<&Plane, Error> {
        let found = self.found.iter().find(|(of, _)| *of == role).map(|(_, plane)| plane);
        let problem = || format!("reads {role} that no pass before it has made; show every pass of the render");
        found.ok_or_else(|| Error::Kernel { kernel: self.kernel.desc.name.to_owned(), source: problem().into() })
    }
}

/// The elements of a plane, which consist of words.
fn elements<T: Pod>(words: &[u32]) -> &[T] {
    const { assert!(align_of::<T>() <= align_of::<u32>()) };
    bytemuck::cast_slice(words)
}

/// The passes of a render so far that leave records or what these read, by their index among them.
#[derive(Debug)]
pub struct Lineage<R: Reused> {
    frames: Arc<TwoFrames>,
    features: u32,
    planes: BTreeMap<BufferId, Plane>,
    passes: BTreeMap<usize, Followed<R>>,
    count: usize,
}

impl<R: Reused> Lineage<R> {
    /// No pass yet.
    pub(super) fn new(scene: &SceneBuffers, render: &Render) -> Self {
        let features = render.technique.integral().features(scene.features);
        let frames = Arc::new(TwoFrames::still(scene, features));
        Self { frames, features, planes: BTreeMap::new(), passes: BTreeMap::new(), count: 0 }
    }

    /// Bytes of the planes that all passes of a render leave.
    ///
    /// # Errors
    /// As of making them.
    pub(super) fn bytes(scene: &SceneBuffers, render: &Render) -> Result<u64, Error> {
        let plan = render.plan(scene);
        let mut bytes = 0;
        for pass in plan.passes {
            let pass = pass?;
            for role in Kernel::of::<R>(&pass).into_iter().flat_map(|kernel| kernel.records.iter().chain(kernel.others))
            {
                bytes += 4 * plan.buffers[pass.bound(role)?].words as u64;
            }
        }
        Ok(bytes)
    }

    /// The pass that the step was, if it left records. Every step of the render has to be shown.
    ///
    /// # Errors
    /// What a GPU reports.
    pub(super) fn follow(&mut self, step: &Step<'_>) -> Result<Option<usize>, Error> {
        if let Some(scenes) = step.pass.frame.as_ref().and_then(|frame| frame.scenes.clone()) {
            self.frames = Arc::new(TwoFrames::new(scenes, self.features));
        }
        let (pass, index) = (step.pass, self.count);
        let Some(kernel) = Kernel::of::<R>(pass) else { return Ok(None) };
        self.count += 1;
        let of_role = |(role, buffer)| Some((role, self.planes.get(&buffer)?.clone()));
        let found = pass.bindings().map(|(binding, buffer)| (binding.name, buffer)).filter_map(of_role).collect();
        let mut leave = |role: &&str| {
            let buffer = pass.bound(role)?;
            let words: Arc<[u32]> = step.read(buffer)?.into();
            self.planes.insert(buffer, Plane { words: words.clone(), made_by: index });
            Ok::<_, Error>(words)
        };
        kernel.others.iter().try_for_each(|role| leave(role).map(drop))?;
        let records = kernel.records.as_ref().map(leave).transpose()?;
        if let Some(params) = pass.params() {
            let (frames, records) = (self.frames.clone(), records.clone().unwrap_or_default());
            self.passes.insert(index, Followed { kernel, params, frames, found, records });
        }
        Ok(records.map(|_| index))
    }

    /// A pass that was followed.
    ///
    /// # Errors
    /// [`Error::Setting`] for one that was not, or that was forgotten.
    pub(crate) fn pass(&self, index: usize) -> Result<&Followed<R>, Error> {
        self.passes.get(&index).ok_or_else(|| Error::Setting(format!("pass {index} is not known; follow all of them")))
    }

    /// Whether some plane still holds what the pass left.
    pub(super) fn is_held(&self, index: usize) -> bool {
        self.planes.values().any(|plane| plane.made_by == index)
    }

    /// Forgets the passes that left records, but for the last one, and those of which no plane holds anything.
    pub(super) fn forget_before(&mut self, last: usize) {
        let held: Vec<usize> = self.planes.values().map(|plane| plane.made_by).collect();
        self.passes.retain(|&index, pass| index == last || pass.records.is_empty() && held.contains(&index));
    }
}
