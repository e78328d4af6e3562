//! What the kernels of a render ask of a scene (rays, surfaces, points of lights), counted natively.
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::{asked::asked, path::PathSettings};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render::new([16, 16], PathSettings { max_depth: 2, ..PathSettings::default() });
//! let kernels = asked(&scene, &job)?;
//! // paths of two segments: a camera ray for each pixel, and at most one of each kind from what it hits
//! let counts = kernels["path"].counts;
//! assert!((256..=512).contains(&counts.closest) && counts.shadow <= 256);
//! # Ok::<(), Error>(())
//! ```

use crate::replay::{Counts, Recording};
use crate::{Error, buffers::SceneBuffers, exec::CpuExecutor, render::Render};
use restir_shared::scene::{Probed, SceneView};
use std::collections::BTreeMap;

/// What the passes of one kernel asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// How often each question was asked.
    pub counts: Counts,
    /// The kernel runs once a pixel. What others ask does not depend on the size of the image.
    pub by_pixel: bool,
}

/// What each kernel of a render asks, by its name; of a scene that stands still.
///
/// # Errors
/// As of [`Render::check`].
pub fn asked(scene: &SceneBuffers, render: &Render) -> Result<BTreeMap<&'static str, Asked>, Error> {
    render.check(scene)?;
    let view = SceneView { features: render.technique.integral().features(scene.features), ..scene.traced_view() };
    let recording = Recording::new(&view);
    let mut kernels: BTreeMap<&'static str, Asked> = BTreeMap::new();
    let plan = render.plan(scene);
    CpuExecutor::run_over_observed(&Probed(&recording), plan, &mut |step| {
        let kernel = kernels.entry(step.pass.kernel.name).or_default();
        kernel.counts = kernel.counts.plus(recording.take_counts());
        kernel.by_pixel = step.pass.grid == [render.width, render.height];
        Ok(())
    })?;
    Ok(kernels)
}

/// As [`asked`], by the repeats of a render after the first `settled` of them.
///
/// # Errors
/// As of [`asked`].
pub fn asked_after(
    scene: &SceneBuffers,
    render: &Render,
    settled: u32,
) -> Result<BTreeMap<&'static str, Asked>, Error> {
    let mut kernels = asked(scene, render)?;
    if settled > 0 {
        for (name, before) in asked(scene, &Render { count: settled, ..render.clone() })? {
            kernels.entry(name).and_modify(|kernel| kernel.counts = kernel.counts.minus(before.counts));
        }
    }
    Ok(kernels)
}
