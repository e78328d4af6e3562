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
use crate::output::write_atomically;
use crate::plan::{BufferId, FramePlan, Pass, SceneFrame};
use crate::render::{Render, Rendered};
use crate::{Error, buffers::SceneBuffers};
use std::fs;
use std::io::{ErrorKind, Write};
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
    // arenas with contents are those of the scene
    let planes: Vec<BufferId> = (0..plan.buffers.len()).filter(|&id| plan.buffers[id].contents.is_none()).collect();
    let done = Kept::read(checkpoint.path, &digest)?
        .map_or(Ok(0), |kept| kept.restore(checkpoint.path, &planes, &mut plan))?;
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

/// A name for all that the bits of a render depend on: renders with the same name have the same image.
#[doc(hidden)]
pub fn name_of(scene: &SceneBuffers, render: &Render, description: &Description) -> String {
    digest(scene, render, description).to_hex().to_string()
}

/// All that the bits depend on.
fn digest(scene: &SceneBuffers, render: &Render, description: &Description) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let Render { width, height, count, accumulate, seed, cameras, shows, technique, denoise, _more: _ } = render;
    for arena in [&scene.geometry, &scene.attributes, &scene.texels] {
        hasher.update(&(arena.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(arena));
    }
    hasher.update(scene.motion().as_bytes());
    let described = (width, height, count, accumulate, seed, shows, technique.about().name);
    hasher.update(format!("{described:?} {:?}", (cameras, scene.camera, technique.entries(), denoise)).as_bytes());
    hasher.update(description.origin().as_bytes());
    hash_code(&mut hasher);
    hasher.finalize()
}

/// The version of the code that makes the bits. The manifest of the compiled kernels holds the digest of their sources, from which the native
/// ones are built, too.
pub(crate) fn hash_code(hasher: &mut blake3::Hasher) {
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(restir_kernels::spirv::file("manifest.json").unwrap_or_default());
}

/// What a checkpoint keeps.
struct Kept {
    done: u64,
    /// The words of each plane.
    planes: Vec<Vec<u32>>,
}

impl Kept {
    fn of(step: &Step<'_>, done: u64, planes: &[BufferId]) -> Result<Self, Error> {
        Ok(Self { done, planes: planes.iter().map(|&id| step.read(id)).collect::<Result<_, _>>()? })
    }

    /// The digest, the number of passes, each plane with its length, and a hash of all that.
    fn write(&self, path: &Path, digest: &blake3::Hash) -> Result<(), Error> {
        write_atomically(path, |file| {
            let mut hasher = blake3::Hasher::new();
            let mut put = |bytes: &[u8]| {
                hasher.update(bytes);
                file.write_all(bytes)
            };
            put(MAGIC)?;
            put(digest.as_bytes())?;
            put(&self.done.to_le_bytes())?;
            for plane in &self.planes {
                put(&(plane.len() as u64).to_le_bytes())?;
                put(bytemuck::cast_slice(plane))?;
            }
            let hash = hasher.finalize();
            file.write_all(hash.as_bytes())
        })
    }

    /// Nothing, if there is no file.
    fn read(path: &Path, digest: &blake3::Hash) -> Result<Option<Self>, Error> {
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
        if digest != of {
            return Err(refused("it is of another scene, of other settings, of another device or of another version"));
        }
        let mut number = || {
            let (number, rest) = kept.split_first_chunk::<8>()?;
            kept = rest;
            Some(u64::from_le_bytes(*number))
        };
        let done = number().ok_or_else(damaged)?;
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

    /// Puts the planes into the plan, whose passes go on after those that are done.
    fn restore(self, path: &Path, planes: &[BufferId], plan: &mut FramePlan<'_>) -> Result<u64, Error> {
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
        let mut begun = None;
        for _ in 0..self.done {
            let Some(pass) = passes.next().transpose()? else { break };
            begun = pass.frame.or(begun);
        }
        // the frame in work goes on, in arenas that hold it already
        let mut going_on = begun.map(|frame: SceneFrame| SceneFrame { uploads: Vec::new(), ..frame });
        plan.passes = Box::new(passes.map(move |pass| {
            let going_on = going_on.take();
            pass.map(|pass| Pass { frame: pass.frame.or(going_on), ..pass })
        }));
        Ok(self.done)
    }
}
