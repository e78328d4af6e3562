//! The genealogy of a record: from which record of which pass and frame it comes, back to the candidate.

use super::{Lineage, Origin, Reuse, Reused};
use crate::render::Render;
use crate::{Error, buffers::SceneBuffers, exec::Executor, memory, technique::explain::Place};

/// A record of a genealogy.
#[derive(Clone, Debug)]
pub struct Generation<R: Reused> {
    /// Index of the frame.
    pub frame: u32,
    /// Index of the pass among those that leave records, or what these read.
    pub pass: usize,
    /// What it does.
    pub reuse: Reuse,
    /// Index of the pixel.
    pub pixel: u32,
    /// The record as the executor left it.
    pub record: R,
    /// The same, replayed natively.
    pub replayed: R,
    /// Where it comes from.
    pub origin: Origin,
    /// What else there is to tell.
    pub details: R::Details,
}

impl<R: Reused> Generation<R> {
    /// The record unpacked.
    pub fn stored(&self) -> R::Stored {
        self.record.stored()
    }

    /// Whether the replay has found the executor's bits.
    pub fn is_identical(&self) -> bool {
        self.record == self.replayed
    }

    fn of(lineage: &Lineage<R>, index: usize, pixel: u32) -> Result<Self, Error> {
        let pass = lineage.pass(index)?;
        let (replayed, origin) = R::replay(pass)?(pixel);
        let (frame, reuse, record) = (pass.params.frame, R::reuse(pass), pass.records()[pixel as usize]);
        let details = R::details(lineage, index, pixel)?;
        Ok(Self { frame, pass: index, reuse, pixel, record, replayed, origin, details })
    }
}

/// The genealogy of the record that a pixel has in the last frame of a render whose technique reuses records `R`: from there to the
/// candidate; of a record without a sample only itself.
///
/// # Errors
/// As of [`Render::render`]; [`Error::Pixel`] for one outside of the image, [`Error::Memory`] for frames whose records cannot all be kept.
pub fn genealogy<R: Reused>(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    place: Place,
) -> Result<Vec<Generation<R>>, Error> {
    check::<R>(scene, render)?;
    place.check(render)?;
    let (mut lineage, mut last) = (Lineage::new(scene, render), None);
    render.render_observed(scene, executor, &mut |step| {
        last = lineage.follow(step)?.or(last);
        Ok(())
    })?;
    let mut generations = Vec::new();
    let mut next = last.map(|last| (last, place.y * render.width + place.x));
    while let Some((pass, pixel)) = next {
        let generation: Generation<R> = Generation::of(&lineage, pass, pixel)?;
        next = match generation.origin {
            Origin::Record { made_by, pixel, .. } if generation.record.has_sample() => Some((made_by, pixel)),
            _ => None,
        };
        generations.push(generation);
    }
    Ok(generations)
}

/// What [`genealogy`] checks first.
pub(crate) fn check<R: Reused>(scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
    render.check_settings(scene)?;
    // before the rest, which takes time with the number of frames; a frame adds what the third one does
    let kept_of = |count| Lineage::<R>::bytes(scene, &Render { count, ..render.clone() });
    let planes = kept_of(3)?.saturating_sub(kept_of(2)?);
    // and of a scene that moves its frames, with their wide trees
    let scenes = if scene.is_animated() { 2 * scene.stats().bytes } else { 0 };
    let bytes = u64::from(render.count).saturating_mul(planes + scenes);
    memory::check(bytes, "this genealogy", "give fewer frames or a smaller size")?;
    render.check(scene)
}
