//! Bitterli et al. 2020, supplement, figure 1: error over render time of unbiased spatiotemporal reuse, by contribution
//! MIS ("proposed") and by Talbot's, with and without reuse of visibility.

mod claims;
mod ratio;
mod report;

use std::time::Duration;

use rayon::prelude::*;
use restir::advanced::reference::{Goal, Picture};
use restir::scene::{Environment, Scene};
use restir::technique::restir_di::{DiSettings, Visibility, VisibilityReuse};
use restir::{Error, buffers::SceneBuffers, render::Render};
use restir_shared::resample::mis::Mis;

use super::chains::{self, Chains, Protocol};
use super::scenes::{wall, white};
use super::{Environs, Files, cost::Cost};
use restir_cli::candidate::Candidate;

use crate::bench::{self, Matrix, Series, error::Truth, table::Setup};

/// The forms of MIS that are compared.
const FORMS: [(&str, Mis); 2] = [("proposed", Mis::CONTRIBUTION), ("Talbot", Mis::TALBOT)];
/// Index of each form.
const PROPOSED: usize = 0;
const TALBOT: usize = 1;
/// Candidates of the claim about few of them.
const CANDIDATES: [u32; 4] = [1, 4, 16, 64];
/// Stripes of the wall whose targets have unlike integrals, and the smallest part of the others' albedo.
const STRIPES: usize = 32;
const DARK_STRIPE: f32 = 0.01;

/// How much is done.
#[derive(Clone, Debug)]
pub(crate) struct Effort {
    pub(crate) protocol: Protocol,
    /// The largest number of frames of a running chain: a power of two.
    pub(crate) frames: u32,
    /// Running chains of that many frames.
    pub(crate) restarts: u32,
    pub(crate) reference: Goal,
}

/// Settings under a name; the form of MIS is that of either curve.
#[derive(Clone, Debug)]
struct Setting {
    name: &'static str,
    settings: DiSettings,
}

impl Setting {
    /// The settings of either form, with the names of their curves.
    fn by_form(&self) -> [(String, DiSettings); FORMS.len()] {
        FORMS.map(|(form, mis)| (self.curve(form), DiSettings { mis, ..self.settings.clone() }))
    }

    /// The name of a curve.
    fn curve(&self, form: &str) -> String {
        format!("{form}, {}", self.name)
    }
}

/// The chains of a form and what its frames cost.
struct Measured {
    chains: Chains,
    cost: Cost,
}

/// The forms with the same settings.
struct Pair {
    setting: Setting,
    of: [Measured; 2],
}

/// A scene, ready to be measured.
struct Subject {
    name: String,
    what: &'static str,
    buffers: SceneBuffers,
    truth: Truth,
    reference_samples: u64,
}

/// All that was measured on a scene.
struct Findings {
    subject: Subject,
    /// In the order of [`settings`].
    pairs: Vec<Pair>,
    /// By [`CANDIDATES`].
    candidates: Vec<Pair>,
    /// Running chains, of the first two settings.
    running: Vec<Series>,
}

/// A wall of equal albedo, and one with stripes of unlike albedo.
struct Stripes {
    walls: [Subject; 2],
    of: [Pair; 2],
}

/// Makes the measurements.
struct Study<'a, E> {
    environs: &'a mut E,
    effort: &'a Effort,
    picture: Picture,
}

/// The files of the figure. `environment` lights the exterior instead of its own.
///
/// # Errors
/// As of [`Render::render`] and of making references.
pub(crate) fn make(
    environs: &mut impl Environs,
    effort: &Effort,
    environment: Option<Environment>,
    setup: &Setup,
) -> Result<Files, Error> {
    let mut study = Study { environs, effort, picture: setup.picture };
    let mut findings = Vec::new();
    for (name, what, scene) in scenes(environment)? {
        findings.push(study.findings(name, what, &scene)?);
    }
    let stripes = study.stripes()?;
    report::Report { setup, effort, findings: &findings, stripes: &stripes }.files()
}

/// An interior with many lights, most of them hidden, an exterior under an environment, and narrow penumbras.
fn scenes(environment: Option<Environment>) -> Result<[(&'static str, &'static str, Scene); 3], Error> {
    let mut exterior = Scene::load("statue")?;
    exterior.environment = environment.or(exterior.environment);
    Ok([
        ("many-lights", "an interior with many occluded lights", Scene::load("many-lights")?),
        ("statue", "an exterior with an environment", exterior),
        ("wall", "small lights and narrow penumbras", wall("wall", &[1.0], white)),
    ])
}

/// What both forms are compared with, but for the form itself.
fn settings(height: u32) -> [Setting; 4] {
    let reused = DiSettings {
        neighbours: 4,
        radius: super::radius(height),
        // what is compared is MIS, in time as well
        still: false,
        ..DiSettings::preset("unbiased-2020").unwrap_or_default()
    };
    let off = DiSettings { visibility_reuse: VisibilityReuse::Off, ..reused.clone() };
    // the kept visibility is exact then, and no final ray is needed
    let selected =
        DiSettings { visibility_reuse: VisibilityReuse::Selection, visibility: Visibility::Selected, ..reused.clone() };
    let six = DiSettings { neighbours: 5, ..reused.clone() };
    [
        Setting { name: "visibility reuse", settings: reused },
        Setting { name: "no visibility reuse", settings: off },
        Setting { name: "visibility reuse, also in the selection", settings: selected },
        Setting { name: "visibility reuse, k = 6", settings: six },
    ]
}

impl<E: Environs> Study<'_, E> {
    fn subject(&mut self, name: &str, what: &'static str, scene: &Scene) -> Result<Subject, Error> {
        let buffers = SceneBuffers::build(scene)?;
        let reference = self.environs.reference(name, &buffers, self.effort.reference)?;
        let (truth, reference_samples) = (Truth::new(&reference), reference.samples());
        Ok(Subject { name: name.to_owned(), what, buffers, truth, reference_samples })
    }

    /// Runs the chains of both forms of all settings.
    fn pairs(&mut self, Subject { name, buffers, .. }: &Subject, settings: &[Setting]) -> Result<Vec<Pair>, Error> {
        let protocol = self.effort.protocol;
        let all: Vec<DiSettings> = settings.iter().flat_map(Setting::by_form).map(|(_, settings)| settings).collect();
        all.iter().try_for_each(|di| Render::new(protocol.size, di.clone()).check(buffers))?;
        let cost = |di: &DiSettings| Cost::of(buffers, protocol.size, di);
        let costs = all.par_iter().map(cost).collect::<Result<Vec<_>, _>>()?;
        let chains =
            self.environs.run(name, |executor, observe| chains::run(executor, buffers, &all, protocol, observe))?;
        let mut measured = chains.into_iter().zip(costs).map(|(chains, cost)| Measured { chains, cost });
        let mut next = || measured.next().ok_or(Error::Interrupted);
        settings.iter().map(|setting| Ok(Pair { setting: setting.clone(), of: [next()?, next()?] })).collect()
    }

    /// All that is measured on a scene.
    fn findings(&mut self, name: &str, what: &'static str, scene: &Scene) -> Result<Findings, Error> {
        let subject = self.subject(name, what, scene)?;
        let settings = settings(self.effort.protocol.size[1]);
        let few = CANDIDATES.map(|candidates| Setting {
            settings: DiSettings { candidates, ..settings[0].settings.clone() },
            ..settings[0].clone()
        });
        let candidates = self.pairs(&subject, &few)?;
        let running = self.running(&subject, &settings[..2])?;
        let pairs = self.pairs(&subject, &settings)?;
        Ok(Findings { subject, pairs, candidates, running })
    }

    /// Averages of running chains, from their first frame on.
    fn running(&mut self, subject: &Subject, settings: &[Setting]) -> Result<Vec<Series>, Error> {
        let technique = |(name, settings)| {
            let render = Render { accumulate: true, ..Render::new(self.picture.size, settings) };
            Candidate { name, render }
        };
        let matrix = Matrix {
            picture: self.picture,
            techniques: settings.iter().flat_map(Setting::by_form).map(technique).collect(),
            budgets: (0..=self.effort.frames.ilog2()).map(|log| 1 << log).collect(),
            restarts: self.effort.restarts,
            time: Duration::MAX,
        };
        let Subject { name, buffers, truth, .. } = subject;
        let (series, _) = self.environs.run(&format!("{name}, running chains"), |executor, observe| {
            bench::measure(executor, buffers, &matrix, truth, observe)
        })?;
        Ok(series)
    }

    /// The two walls.
    fn stripes(&mut self) -> Result<Stripes, Error> {
        let turns: Vec<f32> = (0..STRIPES).map(|i| if i % 2 == 0 { 1.0 } else { DARK_STRIPE }).collect();
        let mut make = |name: &str, stripes: &[f32]| -> Result<(Subject, Pair), Error> {
            let subject = self.subject(name, "", &wall(name, stripes, white))?;
            let mut pairs = self.pairs(&subject, &settings(self.effort.protocol.size[1])[..1])?;
            Ok((subject, pairs.remove(0)))
        };
        let (plain, striped) = (make("wall", &[1.0])?, make("striped wall", &turns)?);
        Ok(Stripes { walls: [plain.0, striped.0], of: [plain.1, striped.1] })
    }
}
