//! The genealogy of a path: which pixel of which pass and frame had it before, back to the one that traced it.

use super::PtSettings;
use super::lineage::{Follower, Origin, PathPass};
use crate::render::{self, Render};
use crate::{Error, buffers::SceneBuffers, exec::Executor, memory, technique::explain::Place};
use restir_shared::shift::Cause;
use restir_shared::technique::restir_pt::{MAX_NEIGHBOURS, PackedPath, Stored};

/// What a pass does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reuse {
    /// Traces a path.
    Initial,
    /// Finds the last frame's paths in a scene that has changed since.
    Recalled,
    /// Shares with the last frame.
    Temporal,
    /// Shares with neighbours: which of the passes that do, from 1.
    Spatial(u32),
}

/// A path that another pixel, or the last frame, has offered to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offered {
    /// Index of the pixel whose path it is.
    pub pixel: u32,
    /// Why it cannot be shifted, if it cannot.
    pub cause: Cause,
    /// The Jacobian of the shift; 0 if there is none.
    pub jacobian: f32,
}

/// A path of the genealogy.
#[derive(Clone, Debug)]
pub struct Generation {
    /// Index of the frame.
    pub frame: u32,
    /// Index of the pass among those that leave paths.
    pub pass: usize,
    /// What it does.
    pub reuse: Reuse,
    /// Index of the pixel.
    pub pixel: u32,
    /// The path as the executor left it.
    pub word: PackedPath,
    /// The same, replayed natively.
    pub replayed: PackedPath,
    /// Where it comes from.
    pub origin: Origin,
    /// What was offered to the pixel by way of a shift.
    pub offers: Vec<Offered>,
}

impl Generation {
    /// The path.
    pub fn stored(&self) -> Stored {
        self.word.unpack()
    }
}

/// The genealogy of the path that a pixel has in the last frame, from there to where it was traced; of a pixel without a path only what
/// it has been offered.
///
/// # Errors
/// As of [`render::render`]; [`Error::Pixel`] for one outside of the image, [`Error::Memory`] for frames whose paths cannot
/// all be kept.
pub fn genealogy(
    settings: &PtSettings,
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    place: Place,
) -> Result<Vec<Generation>, Error> {
    check(settings, scene, render)?;
    place.check(render)?;
    let mut follower = Follower::new(scene, render);
    let mut passes = Vec::new();
    render::render(executor, scene, render, &mut |step| {
        passes.extend(follower.follow(step)?);
        Ok(())
    })?;
    let mut generations = Vec::new();
    let mut next = passes.len().checked_sub(1).map(|last| (last, place.y * render.width + place.x));
    while let Some((pass, pixel)) = next {
        let generation = generation(&passes[pass], pixel);
        next = match generation.origin {
            Origin::Path { made_by, pixel, .. } if generation.stored().path.length > 0 => Some((made_by, pixel)),
            _ => None,
        };
        generations.push(generation);
    }
    Ok(generations)
}

/// What [`genealogy`] checks first.
pub(super) fn check(settings: &PtSettings, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    // first, for to check a render takes time with the number of frames
    let [width, height, frames] = [render.width, render.height, render.count].map(u64::from);
    // starts, and paths that are traced, recalled (or retraced both ways) and merged in time; jobs of both ways; then those of each spatial pass
    let passes = u64::from(settings.spatial) * (64 + 24 * u64::from(settings.neighbours.min(MAX_NEIGHBOURS)));
    let planes = (32 + 4 * 64 + 40 + passes) * width * height;
    // and of a scene that moves its frames, with their wide trees
    let scenes = if scene.is_animated() { 2 * scene.stats().bytes } else { 0 };
    let bytes = frames.saturating_mul(planes + scenes);
    memory::check(bytes, "this genealogy", "give fewer frames or a smaller size")?;
    render::check(scene, render)
}

fn generation(pass: &PathPass, pixel: u32) -> Generation {
    let (replayed, origin) = pass.replay(pixel);
    let p = &pass.params;
    let reuse = match (pass.is_trace(), pass.is_merge(), pass.is_temporal()) {
        (true, ..) => Reuse::Initial,
        (_, false, _) => Reuse::Recalled,
        (.., true) => Reuse::Temporal,
        _ => Reuse::Spatial(p.merge),
    };
    let word = pass.made.words[pixel as usize];
    let offers = offers(pass, pixel);
    Generation { frame: p.frame, pass: pass.made.made_by, reuse, pixel, word, replayed, origin, offers }
}

fn offers(pass: &PathPass, pixel: u32) -> Vec<Offered> {
    let Some(shifts) = pass.shifts() else { return Vec::new() };
    let pixels = (pass.params.width * pass.params.height) as usize;
    let offered = |job: usize| {
        let (shifted, jacobian) = shifts.replay(job)?;
        let jacobian = if shifted.cause == Cause::Nothing { jacobian } else { 0.0 };
        Some(Offered { pixel: shifts.jobs[job].path, cause: shifted.cause, jacobian })
    };
    (pixel as usize..shifts.jobs.len()).step_by(pixels).filter_map(offered).collect()
}
