//! What records hold, pixel by pixel, to be looked at.

use super::{Before, Followed, Lineage, Origin, Reuse, Reused};
use crate::exec::{Executor, Observer};
use crate::render::Render;
use crate::technique::inspect::Layered;
use crate::{Error, buffers::SceneBuffers, image::Channel, memory};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The records of the last frame.
#[derive(Clone, Debug)]
pub struct Layers<R: Reused> {
    /// The index of the frame.
    pub frame: u32,
    /// The records, rows from top to bottom.
    pub records: Vec<R::Stored>,
    /// What else there is to tell of each pixel.
    pub beside: Vec<R::Beside>,
}

impl<R: Reused> Layers<R> {
    /// As channels of an EXR file.
    pub fn channels(&self) -> Vec<Channel> {
        R::channels(self)
    }

    /// A channel of that name, which is made of records.
    pub(crate) fn channel(&self, name: &'static str, value: impl Fn(&R::Stored) -> f32) -> Channel {
        Channel { name, values: self.records.iter().map(value).collect() }
    }
}

impl<R: Reused> Layered<Layers<R>> {
    /// The same as channels of an EXR file.
    pub(crate) fn into_channels(self) -> Layered<Vec<Channel>> {
        Layered { rendered: self.rendered, layers: self.layers.channels() }
    }
}

/// As [`Render::render`] of a technique that reuses records `R`, with those of the last frame. The plan is the same; what there is to tell
/// beside is found by replaying passes natively, which takes the time that they take on the CPU.
///
/// # Errors
/// As of [`Render::render`].
pub fn render_with_layers<R: Reused>(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<Layered<Layers<R>>, Error> {
    render.check(scene)?;
    // beside the plan: its planes read back, and what is made of them
    let bytes = 2 * render.plan(scene).bytes() + R::LAYER_BYTES * u64::from(render.width) * u64::from(render.height);
    memory::check(bytes, "this render with layers", "choose a smaller size")?;
    let mut lineage = Lineage::<R>::new(scene, render);
    let (mut beside, mut last) = (Before::<R>::new(), None);
    let rendered = render.render_observed(scene, executor, &mut |step| {
        if let Some(pass) = lineage.follow(step)? {
            if R::LOOKS_BACK || lineage.pass(pass)?.params.frame + 1 == render.count {
                beside.insert(pass, R::beside(&lineage, pass, &beside)?);
            }
            lineage.forget_before(pass);
            beside.retain(|&before, _| lineage.is_held(before));
            last = Some(pass);
        }
        observe(step)
    })?;
    let mut layers = Layers { frame: 0, records: Vec::new(), beside: Vec::new() };
    if let Some(last) = last {
        let pass = lineage.pass(last)?;
        layers.frame = pass.params.frame;
        layers.records = pass.records().iter().map(R::stored).collect();
        layers.beside = beside.remove(&last).unwrap_or_default();
    }
    Ok(Layered { rendered, layers })
}

/// For how many frames each pixel has had its sample after a pass, from how many it was after those before. It is drawn in the frame of age
/// 0; without a sample, for how many it has had none.
///
/// # Errors
/// Those of [`Reused::replay`].
pub(crate) fn ages<R: Reused>(pass: &Followed<R>, before: &BTreeMap<usize, Vec<u32>>) -> Result<Vec<u32>, Error> {
    let pixels = pass.records().len();
    if R::reuse(pass) == Reuse::Initial {
        return Ok(vec![0; pixels]);
    }
    let replay = R::replay(pass)?;
    let age = |pixel: usize| match replay(pixel as u32).1 {
        Origin::Candidate(_) => 0,
        Origin::Record { made_by, pixel, of_last_frame, .. } => {
            before[&made_by][pixel as usize] + u32::from(of_last_frame)
        }
    };
    Ok((0..pixels).into_par_iter().map(age).collect())
}
