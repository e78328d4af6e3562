//! Renders that can be interrupted and go on later, with the bits of one that was not.
//!
//! A file keeps how many passes are done, and the planes as they left them. The passes themselves are a function of scene and settings, so
//! nothing else has to be kept.
//!
//! ```
//! use restir_host::checkpoint::{Checkpoint, render_resumed};
//! use restir_host::render::Render;
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//! use std::time::Duration;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 3, ..Render::new([16, 16], DiSettings::default()) };
//! let cpu = &mut CpuExecutor::new()?;
//! let path = &std::env::temp_dir().join(format!("restir-checkpoint-{}", std::process::id()));
//! let checkpoint = Checkpoint { path, every: Duration::from_secs(60) };
//!
//! // the first half of the passes, then the rest
//! let half = &mut |step: &restir_host::exec::Step<'_>| {
//!     if step.progress.done * 2 < step.progress.total { Ok(()) } else { Err(Error::Interrupted) }
//! };
//! assert!(matches!(render_resumed(cpu, &scene, &job, checkpoint, half), Err(Error::Interrupted)));
//! let resumed = render_resumed(cpu, &scene, &job, checkpoint, &mut |_| Ok(()))?;
//! assert_eq!(resumed.image, job.render(&scene, cpu)?.image);
//! assert!(!path.exists());
//! # Ok::<(), Error>(())
//! ```

use crate::exec::{Description, Executor, Observer, Progress, Step};
use crate::output::write_hashed;
use crate::plan::{BufferId, FramePlan, Pass, SceneFrame};
use crate::render::{Images, Render, Rendered, Shows};
use crate::{Error, buffers::SceneBuffers};
use std::fs;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

/// The file begins with this, and with the [`digest`].
const MAGIC: &[u8; 20] = b"restir checkpoint 1\n";
const HASH: usize = blake3::OUT_LEN;

/// Where a render is kept while it is not done.
#[derive(Clone, Copy, Debug)]
pub struct Checkpoint<'a> {
    /// The file. It need not be there; it is deleted once the render is done.
    pub path: &'a Path,
    /// How often it is written, beside when the render is interrupted.
    pub every: Duration,
}

/// As [`Render::render`], from where the file leaves off, if it is there.
///
/// # Errors
/// As of [`Render::render`]; where its observer ends it by [`Error::Interrupted`], the file keeps what is done. [`Error::File`] if
/// the file cannot be read or written, is damaged, or is of another render.
pub fn render_resumed(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    checkpoint: Checkpoint<'_>,
    observe: &mut Observer<'_>,
) -> Result<Rendered, Error> {
    render.check(scene)?;
    let digest = digest(scene, render, &executor.describe());
    let mut plan = render.plan(scene);
    let planes = planes_of(&plan);
    let done = Kept::read(checkpoint.path, &|_| digest)?
        .map_or(Ok(0), |kept| kept.restore(checkpoint.path, &planes, &mut plan, &|_| true))?;
    let (dispatches, counts) = (plan.pass_count, plan.counts);
    let mut written = Instant::now();
    let outputs = executor.run_observed(plan, &mut |step| {
        let progress = Progress { done: done + step.progress.done, total: dispatches };
        let seen = observe(&Step::new(progress, step.pass, &|id| step.read(id)));
        if matches!(seen, Err(Error::Interrupted)) || written.elapsed() >= checkpoint.every {
            Kept::of(step, progress.done, &planes)?.write(checkpoint.path, &digest)?;
            written = Instant::now();
        }
        seen
    })?;
    match fs::remove_file(checkpoint.path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::cannot_write(checkpoint.path, error)),
        _ => Ok(render.rendered(&outputs, dispatches, counts)),
    }
}

/// The planes of a plan: arenas with contents are those of the scene.
fn planes_of(plan: &FramePlan<'_>) -> Vec<BufferId> {
    (0..plan.buffers.len()).filter(|&id| plan.buffers[id].contents.is_none()).collect()
}

/// What [`render_frames`] shows of its work.
pub trait Watch {
    /// A pass is done.
    ///
    /// # Errors
    /// Ends the work.
    fn progress(&mut self, progress: Progress) -> Result<(), Error>;

    /// A frame that was asked for is done; `images` reads it.
    ///
    /// # Errors
    /// Ends the work.
    fn frame(&mut self, frame: u32, images: &Images<'_>, step: &Step<'_>) -> Result<(), Error>;
}

/// Renders frames of a chain, each of which reuses what those before it have found: these are rendered too, from the frame on that the
/// file `state` leaves off at, or from frame 0 where there is none. Once all are done, and not before, the file has the state after the last frame, for
/// who renders the next ones, here or on another machine: what is interrupted can be done again from where it began. The count of the render, and whether it accumulates, do not matter. Gives the first frame
/// that had to be rendered.
///
/// # Errors
/// As of [`Render::render`], and what `watch` ends the work by; [`Error::File`] if the file cannot be read or written, is damaged, is of another
/// chain, or is of a later frame than the first one.
pub fn render_frames(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    frames: Range<u32>,
    state: Option<&Path>,
    watch: &mut dyn Watch,
) -> Result<u32, Error> {
    // one more than is rendered, so that the planes are those of frames that go on
    let count = frames.end.saturating_add(1);
    let render = &Render { count, accumulate: false, shows: Shows::Each, ..render.clone() };
    render.check(scene)?;
    let (images, description) = (Images::new(scene, render), executor.describe());
    let mut plan = render.plan(scene);
    let (planes, mut kept) = (planes_of(&plan), None);
    if let Some(path) = state {
        kept = Kept::read(path, &|done| digest(scene, &render.until(done), &description))?;
    }
    let (first, mut skipped) = (kept.as_ref().map_or(0, |kept| kept.done as u32), 0);
    if let (Some(path), Some(kept)) = (state, kept) {
        if first > frames.start {
            let problem = format!(
                "it is the state before frame {first}, and frame {} is asked for; name another file, or none to begin at frame 0",
                frames.start
            );
            return Err(Error::cannot_read(path, problem));
        }
        skipped = kept.restore(path, &planes, &mut plan, &|pass| images.is_made_by(pass))?;
    }
    let total = (plan.pass_count - plan.pass_count / u64::from(count)).saturating_sub(skipped).max(1);
    let mut frame = first;
    let done = executor.run_observed(plan, &mut |step| {
        watch.progress(Progress { done: step.progress.done.min(total), total })?;
        if !images.is_finished(step) {
            return Ok(());
        }
        if frames.contains(&frame) {
            watch.frame(frame, &images, step)?;
        }
        frame += 1;
        if frame < frames.end {
            return Ok(());
        }
        if let Some(path) = state {
            let digest = digest(scene, &render.until(u64::from(frame)), &description);
            Kept::of(step, u64::from(frame), &planes)?.write(path, &digest)?;
        }
        Err(Error::Interrupted)
    });
    match done {
        Err(Error::Interrupted) if frame == frames.end => Ok(first),
        done => done.map(|_| first),
    }
}

impl Render {
    /// What frames before this one depend on.
    fn until(&self, frame: u64) -> Self {
        let cameras = (0..frame as usize).map_while(|frame| self.cameras.get(frame).or(self.cameras.last()));
        Self { count: 0, cameras: cameras.copied().collect(), ..self.clone() }
    }
}

/// A name for all that the bits of a render depend on: renders with the same name have the same image.
#[doc(hidden)]
pub fn name_of(scene: &SceneBuffers, render: &Render, description: &Description) -> String {
    digest(scene, render, description).to_hex().to_string()
}

/// All that the bits depend on.
fn digest(scene: &SceneBuffers, render: &Render, description: &Description) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let Render { width, height, count, accumulate, seed, cameras, shows, technique, denoise, _more: _ } = render;
    hash_scene(scene, &mut hasher);
    let described = (width, height, count, accumulate, seed, shows, technique.about().name);
    hasher.update(format!("{described:?} {:?}", (cameras, scene.camera, technique.entries(), denoise)).as_bytes());
    hasher.update(description.origin().as_bytes());
    hash_code(&mut hasher);
    hasher.finalize()
}

/// What a scene is made of, but for its camera.
pub(crate) fn hash_scene(scene: &SceneBuffers, hasher: &mut blake3::Hasher) {
    for arena in [&scene.geometry, &scene.attributes, &scene.texels] {
        hasher.update(&(arena.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(arena));
    }
    hasher.update(scene.motion().as_bytes());
}

/// The version of the code that makes the bits. The manifest of the compiled kernels holds the digest of their sources, from which the native
/// ones are built, too.
pub(crate) fn hash_code(hasher: &mut blake3::Hasher) {
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(restir_kernels::spirv::file("manifest.json").unwrap_or_default());
}

/// What a checkpoint keeps.
struct Kept {
    /// How many passes are done, or frames.
    done: u64,
    /// The words of each plane.
    planes: Vec<Vec<u32>>,
}

impl Kept {
    fn of(step: &Step<'_>, done: u64, planes: &[BufferId]) -> Result<Self, Error> {
        Ok(Self { done, planes: planes.iter().map(|&id| step.read(id)).collect::<Result<_, _>>()? })
    }

    /// The digest, how much is done, each plane with its length, and a hash of all that.
    fn write(&self, path: &Path, digest: &blake3::Hash) -> Result<(), Error> {
        write_hashed(path, |put| {
            put(MAGIC)?;
            put(digest.as_bytes())?;
            put(&self.done.to_le_bytes())?;
            self.planes.iter().try_for_each(|plane| {
                put(&(plane.len() as u64).to_le_bytes())?;
                put(bytemuck::cast_slice(plane))
            })
        })
    }

    /// Nothing, if there is no file. The digest may depend on how much is done.
    fn read(path: &Path, digest: &dyn Fn(u64) -> blake3::Hash) -> Result<Option<Self>, Error> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::cannot_read(path, error)),
        };
        let refused =
            |why: &str| Error::cannot_read(path, format!("{why}; delete it to begin anew, or name another file"));
        let damaged = || refused("it is no whole checkpoint of a render");
        let (kept, hash) = bytes.split_last_chunk::<HASH>().ok_or_else(damaged)?;
        let kept = kept.strip_prefix(MAGIC).filter(|_| blake3::hash(kept) == *hash).ok_or_else(damaged)?;
        let (of, mut kept) = kept.split_first_chunk::<HASH>().ok_or_else(damaged)?;
        let (done, rest) = kept.split_first_chunk::<8>().ok_or_else(damaged)?;
        let done = u64::from_le_bytes(*done);
        kept = rest;
        if digest(done) != *of {
            return Err(refused("it is of another scene, of other settings, of another device or of another version"));
        }
        let mut planes = Vec::new();
        while !kept.is_empty() {
            let (length, rest) = kept.split_first_chunk::<8>().ok_or_else(damaged)?;
            let bytes = u64::from_le_bytes(*length).checked_mul(4).and_then(|bytes| usize::try_from(bytes).ok());
            let (plane, rest) = bytes.and_then(|bytes| rest.split_at_checked(bytes)).ok_or_else(damaged)?;
            planes.push(bytemuck::pod_collect_to_vec(plane));
            kept = rest;
        }
        Ok(Some(Self { done, planes }))
    }

    /// Puts the planes into the plan, whose passes go on after those that are done: as many as count. Gives how many passes these are.
    fn restore(
        self,
        path: &Path,
        planes: &[BufferId],
        plan: &mut FramePlan<'_>,
        counts: &dyn Fn(&Pass) -> bool,
    ) -> Result<u64, Error> {
        let fits = |(&id, words): (&BufferId, &Vec<u32>)| plan.buffers[id].words == words.len();
        if planes.len() != self.planes.len()
            || !planes.iter().zip(&self.planes).all(fits)
            || self.done > plan.pass_count
        {
            return Err(Error::cannot_read(path, "it does not fit the render; delete it to begin anew"));
        }
        for (&id, words) in planes.iter().zip(self.planes) {
            plan.buffers[id].contents = Some(words.into());
        }
        let mut passes = std::mem::replace(&mut plan.passes, Box::new(std::iter::empty()));
        let (mut begun, mut left, mut skipped) = (None, self.done, 0);
        while left > 0 {
            let Some(pass) = passes.next().transpose()? else { break };
            left -= u64::from(counts(&pass));
            skipped += 1;
            begun = pass.frame.or(begun);
        }
        // the frame in work goes on, in arenas that hold it already
        let mut going_on = begun.map(|frame: SceneFrame| SceneFrame { uploads: Vec::new(), ..frame });
        plan.passes = Box::new(passes.map(move |pass| {
            let going_on = going_on.take();
            pass.map(|pass| Pass { frame: pass.frame.or(going_on), ..pass })
        }));
        Ok(skipped)
    }
}
