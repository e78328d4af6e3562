//! Sessions on the CPU.

use super::{ATTRIBUTES, Begun, Device, Frozen, Session, Setup, View};
use crate::exec::{Course, CpuExecutor, Dispatches, check_probes};
use crate::image::Image;
use crate::plan::{Buffer, Pass};
use crate::scene::Camera;
use crate::{Error, buffers::SceneBuffers, memory};
use restir_shared::geometry::PackedHit;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::{AnyFrames, GivenSurface};
use std::sync::Arc;

/// A session that runs natively.
///
/// ```
/// use restir_host::session::{CpuSession, Setup, View};
/// use restir_host::technique::restir_di::DiSettings;
/// use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
///
/// let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
/// let mut session = CpuSession::new(Setup::new(scene, DiSettings::default(), [32, 24]), CpuExecutor::new()?)?;
/// for _ in 0..4 {
///     session.frame(&View::default())?;
/// }
/// let mean: f32 = session.pixels().iter().map(|pixel| pixel.sum[1]).sum::<f32>() / (32.0 * 24.0);
/// assert!(mean > 0.0 && mean < 1.0);
/// # Ok::<(), Error>(())
/// ```
pub type CpuSession = Session<Cpu>;

/// The CPU as the device of a session.
#[derive(Debug)]
pub struct Cpu {
    executor: CpuExecutor,
    buffers: Vec<Arc<[u32]>>,
    /// Of this frame and of the last one.
    scenes: [Option<Arc<SceneBuffers>>; 2],
}

impl Device for Cpu {
    const DISPATCHES: Dispatches = Dispatches::Long;

    fn allocate(&mut self, buffers: &[Buffer], keep_arenas: bool, scene: &Arc<SceneBuffers>) -> Result<(), Error> {
        let bytes = buffers.iter().map(|buffer| 4 * buffer.words as u64).sum();
        memory::check(bytes, "this session", "choose a smaller size or settings that keep less")?;
        let kept = if keep_arenas { scene_arenas(&self.buffers) } else { &[] }.to_vec();
        self.buffers.clear();
        self.buffers.extend(kept);
        self.buffers.extend(buffers[self.buffers.len()..].iter().map(Buffer::initial));
        // of a foreign scene there is nothing to trace rays in
        self.scenes = [(); 2].map(|()| (!scene.is_foreign()).then(|| scene.clone()));
        Ok(())
    }

    fn prepare(&mut self, _kernels: &[Frozen]) -> Result<(), Error> {
        Ok(())
    }
}

fn scene_arenas(buffers: &[Arc<[u32]>]) -> &[Arc<[u32]>] {
    &buffers[..crate::plan::ARENAS.len().min(buffers.len())]
}

impl CpuSession {
    /// A session whose passes run on `executor`.
    ///
    /// # Errors
    /// [`Error::InvalidValue`] and [`Error::ConflictingSettings`] for settings out of range, [`Error::Memory`] if the planes do not fit.
    pub fn new(setup: Setup, executor: CpuExecutor) -> Result<Self, Error> {
        Self::over(setup, Cpu { executor, buffers: Vec::new(), scenes: [None, None] })
    }

    /// Renders the next frame.
    ///
    /// # Errors
    /// [`Error::Camera`] for a camera and [`Error::InvalidValue`] for a frame that is not finite, [`Error::Scene`] if an edited scene is broken; the session is then as it
    /// was. [`Error::Memory`] if it does not fit.
    pub fn frame(&mut self, view: &View<'_>) -> Result<Begun, Error> {
        if self.setup().scene.is_foreign() {
            let problem = "a session over a foreign scene is given that scene with each frame; call frame_over";
            return Err(Error::ForeignScene { problem });
        }
        let (passes, begun) = self.passes(view, false)?;
        self.run(&passes, None);
        Ok(begun)
    }

    /// Renders the next frame of a scene of other types than this library's ([`Setup::foreign`]): `frames` is the scene in this frame and in
    /// the last one, which differ if `moved`. One that stands still is [`restir_shared::scene::Still`].
    ///
    /// # Errors
    /// [`Error::ForeignScene`] for a session that has a scene of its own.
    pub fn frame_over(&mut self, frames: &(dyn AnyFrames + Sync), camera: Camera, moved: bool) -> Result<Begun, Error> {
        if !self.setup().scene.is_foreign() {
            let problem = "the session has a scene of its own; make one by Setup::foreign";
            return Err(Error::ForeignScene { problem });
        }
        let (passes, begun) = self.passes(&View { camera: Some(camera), ..View::default() }, moved)?;
        passes.iter().try_for_each(|pass| check_probes(pass, frames))?;
        self.run(&passes, Some(frames));
        Ok(begun)
    }

    fn run(&mut self, passes: &[Pass], frames: Option<&(dyn AnyFrames + Sync)>) {
        let Cpu { executor, buffers, scenes } = &mut self.device;
        let mut course = Course::new(std::mem::take(scenes));
        passes.iter().for_each(|pass| executor.run_pass(pass, buffers, &mut course, frames));
        *scenes = course.scenes;
    }

    /// The image after the last frame, rows from top to bottom: linear RGB radiance in `sum`, and in `dropped` how many samples were
    /// not finite. Zeros before the first.
    pub fn pixels(&self) -> &[FilmPixel] {
        bytemuck::cast_slice(&self.device.buffers[self.sequence.output()])
    }

    /// The same as an image, ready for [`crate::tonemap`] and for files.
    pub fn image(&self) -> Image {
        let [width, height] = self.setup().size;
        Image { width, height, pixels: self.pixels().iter().map(|pixel| pixel.sum).collect() }
    }

    /// The plane of what the camera sees in the next frame, rows from top to bottom, for a renderer that knows it: who fills it gives
    /// [`View::primary_given`]. None, if the technique has no such plane.
    pub fn primary_mut(&mut self) -> Option<&mut [PackedHit]> {
        let plane = self.primary_plane()?;
        Some(bytemuck::cast_slice_mut(Arc::make_mut(&mut self.device.buffers[plane])))
    }

    /// The plane of the next frame's surfaces, of a session whose [surfaces are given](Setup::surfaces_given), rows from top to bottom. The hit of
    /// pixel i in [`Self::primary_mut`] has the number that stands beside it, plus i, or that of a miss.
    pub fn surfaces_mut(&mut self) -> Option<(&mut [GivenSurface], u32)> {
        let (first, words, first_id) = self.surface_plane()?;
        let arena = Arc::make_mut(&mut self.device.buffers[ATTRIBUTES]);
        Some((bytemuck::cast_slice_mut(&mut arena[first..first + words]), first_id))
    }
}
