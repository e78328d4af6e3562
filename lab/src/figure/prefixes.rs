//! What suffix ReSTIR has of error and rays by its settings: what figures 3 and 4 of Kettunen et al. 2023 are made of.

use std::fmt::Write;

use restir::render::Render;
use restir::scene::Scene;
use restir::technique::{asked::asked_after, named};
use restir::{Error, buffers::SceneBuffers};
use restir_cli::trial::{Estimate, NORMAL, Subject, Tried, Window, judge, try_once, wall_clock};
use restir_tests::technique::configure_by;

use super::chains::Protocol;
use super::claim::{self, Claim};
use super::{Environs, Files};
use crate::bench::table::Setup;
use crate::bootstrap::Interval;

/// A room that is lit through a door.
pub(super) const SCENE: &str = "ajar";

/// The last frame of chains with some settings.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) settings: String,
    pub(super) rel_mse: Estimate,
    /// Of a pixel and frame.
    pub(super) rays: f64,
}

impl Measured {
    /// The quotient of the errors of both, and its interval of 95 %.
    pub(super) fn over(&self, other: &Self) -> Interval {
        let relative = |of: &Self| of.rel_mse.error / of.rel_mse.value;
        let value = self.rel_mse.value / other.rel_mse.value;
        let factor = (NORMAL * relative(self).hypot(relative(other))).exp();
        Interval { value, ends: [value / factor, value * factor] }
    }
}

/// Runs the chains of all settings, and counts their rays natively.
///
/// # Errors
/// As of [`Render::render`].
pub(super) fn measured(
    environs: &mut impl Environs,
    protocol: Protocol,
    settings: &[String],
) -> Result<Vec<Measured>, Error> {
    let Protocol { size, warm_up, chains, .. } = protocol;
    let scene = Scene::load(SCENE)?;
    let subject = Subject::new(&scene, SceneBuffers::build(&scene)?, Vec::new(), warm_up + 1)?;
    let renders = settings.iter().map(|text| {
        let mut technique = named("restir-suffix")?;
        configure_by(technique.as_mut(), text)?;
        Ok(Render { count: warm_up + 1, ..Render::new(size, technique) })
    });
    let renders = renders.collect::<Result<Vec<_>, Error>>()?;
    let whole = [Window { whole: size, size, margin: 0, middle: [0.0; 2] }];
    let trials: Vec<_> = renders.iter().map(|render| subject.trial(render, &whole)).collect();
    let (mut tried, clock) = (vec![Tried::default(); trials.len()], wall_clock());
    environs.run(SCENE, |executor, observe| {
        (0..chains).try_for_each(|seed| try_once(executor, &clock, &trials, &mut tried, seed, observe))
    })?;
    let judged = judge(&trials, &tried);
    let pixels = f64::from(size[0]) * f64::from(size[1]);
    let of_each = settings.iter().zip(&trials).zip(judged).map(|((settings, trial), judged)| {
        let asked = asked_after(trial.scene, &trial.pieces[0].1, warm_up)?;
        let rays: u64 = asked.values().map(|asked| asked.counts.rays()).sum();
        Ok(Measured { settings: settings.clone(), rel_mse: judged.rel_mse, rays: rays as f64 / pixels })
    });
    of_each.collect()
}

/// The files of a figure: `text` says what it shows.
pub(super) fn files(text: &str, protocol: Protocol, claims: &[Claim], rows: &[Measured], setup: &Setup) -> Files {
    let mut table = "| settings | relMSE | rays a pixel |\n|---|---:|---:|\n".to_owned();
    let mut csv = "settings,rel_mse,standard_error,rays\n".to_owned();
    for Measured { settings, rel_mse: Estimate { value, error }, rays } in rows {
        let _ = writeln!(table, "| `{settings}` | {value:.3} ± {error:.3} | {rays:.2} |");
        let _ = writeln!(csv, "\"{settings}\",{value},{error},{rays}");
    }
    let Protocol { warm_up, chains, .. } = protocol;
    let report = format!(
        "{text}\n{}\n`restir-suffix` in `{SCENE}`; relMSE of the last of {} frames, a variance over {chains} independent chains; ± is a standard \
         error, brackets are 95 % intervals. relMSE is the mean of `(x - r)² / (r² + 0.01 m²)` over the channels of all pixels, r being the truth and \
         m its mean.\n\n## Claims\n\n{}\n## Errors and rays\n\n{table}",
        setup.markdown(""),
        warm_up + 1,
        claim::table(claims),
    );
    Files { picture: None, texts: vec![("settings.csv".to_owned(), csv)], report }
}
