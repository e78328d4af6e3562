//! What becomes of the last frame's paths where things move, and what that gains.

use restir_cli::trial::{Estimate, Subject, Trial, Tried, Window, judge, try_once};
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::scene::Scene;
use restir_tests::scenes::named;

use super::{FRAMES, seconds, study};
use crate::time::thread_seconds;

/// A room in which things move, and the same at four times the speed.
const SCENES: [&str; 2] = ["moving", "moving-fast"];
/// With neighbours and without; reuse in time last, for what it is worth at all.
const SETTINGS: [&str; 7] = [
    "",
    "changed=retrace",
    "changed=stale",
    "spatial=0",
    "spatial=0,changed=retrace",
    "spatial=0,changed=stale",
    "temporal=off",
];
/// The last frame of a chain.
pub(super) struct Row {
    pub(super) scene: &'static str,
    pub(super) settings: &'static str,
    pub(super) rel_mse: Estimate,
    /// Processor time of a frame.
    pub(super) seconds: f64,
}

/// All rows, of so many images each.
pub(super) fn measured(images: u32, size: [u32; 2]) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    for name in SCENES {
        let scene = named(name).map_or_else(|| Scene::load(name), Ok)?;
        let subject = Subject::new(&scene, SceneBuffers::build(&scene)?, Vec::new(), FRAMES)?;
        let whole = [Window { whole: size, size, margin: 0, middle: [0.0; 2] }];
        let renders =
            SETTINGS.into_iter().map(|text| study::PATHS.chain(size, text)).collect::<Result<Vec<_>, Error>>()?;
        let trials: Vec<Trial<'_>> = renders.iter().map(|render| subject.trial(render, &whole)).collect();
        let mut tried = vec![Tried::default(); trials.len()];
        for seed in 0..images {
            try_once(&mut CpuExecutor::inline(), &thread_seconds, &trials, &mut tried, seed, &mut |_| Ok(()))?;
        }
        let judged = judge(&trials, &tried);
        for ((settings, trial), judged) in SETTINGS.into_iter().zip(&trials).zip(&judged) {
            rows.push(Row {
                scene: name,
                settings,
                rel_mse: judged.rel_mse,
                seconds: seconds(trial.scene, &trial.pieces[0].1)?,
            });
        }
    }
    Ok(rows)
}
