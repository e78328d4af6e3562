//! Bitterli et al. 2020, supplement, figure 1: error over render time of unbiased spatiotemporal reuse, by contribution
//! MIS ("proposed") and by Talbot's, with and without reuse of visibility.

mod claims;
mod ratio;
mod report;

use std::time::Duration;

use rayon::prelude::*;
use restir::Error;
use restir::buffers::SceneBuffers;
use restir::reference::Goal;
use restir::reference::Picture;
use restir::render::Render;
use restir::scene::{Environment, Scene};
use restir::technique::restir_di::{DiSettings, Visibility, VisibilityReuse};
use restir_shared::resample::mis::Mis;

use super::chains::{self, Chains, Protocol};
use super::cost::Cost;
use super::scenes::{wall, white};
use super::{Environs, File};
use crate::bench::error::Truth;
use crate::bench::table::Setup;
use crate::bench::{self, Matrix, Series, Technique};

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
/// Radius of neighbours in parts of the image's height, as 30 of 1080 pixels, and the smallest in pixels, within which
/// there are eight.
const RADIUS: f32 = 30.0 / 1080.0;
const SMALLEST_RADIUS: f32 = 1.5;

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

/// The files of the figure. `environment` lights the exterior instead of its own.
///
/// # Errors
/// As of [`restir::render::render`] and of making references.
pub(crate) fn make(
    environs: &mut impl Environs,
    effort: &Effort,
    environment: Option<Environment>,
    setup: &Setup,
    command: &str,
) -> Result<Vec<File>, Error> {
    let mut findings = Vec::new();
    for (name, what, scene) in scenes(environment)? {
        let subject = subject(environs, effort, name, what, &scene)?;
        findings.push(measure(environs, effort, setup.picture, subject)?);
    }
    let stripes = stripes(environs, effort)?;
    let report = report::Report { setup, command, effort, findings: &findings, stripes: &stripes };
    report.files()
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
fn settings(size: [u32; 2]) -> [Setting; 4] {
    let reused = DiSettings {
        neighbours: 4,
        radius: SMALLEST_RADIUS.max(RADIUS * size[1] as f32),
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

fn subject(
    environs: &mut impl Environs,
    effort: &Effort,
    name: &str,
    what: &'static str,
    scene: &Scene,
) -> Result<Subject, Error> {
    let buffers = SceneBuffers::build(scene)?;
    let reference = environs.reference(name, &buffers, effort.reference)?;
    let (truth, reference_samples) = (Truth::new(&reference), reference.samples());
    Ok(Subject { name: name.to_owned(), what, buffers, truth, reference_samples })
}

/// Runs the chains of both forms of all settings.
fn pairs(
    environs: &mut impl Environs,
    subject: &Subject,
    protocol: Protocol,
    settings: Vec<Setting>,
) -> Result<Vec<Pair>, Error> {
    let of_form = |setting: &Setting, form| DiSettings { mis: form, ..setting.settings.clone() };
    let all: Vec<DiSettings> =
        settings.iter().flat_map(|setting| FORMS.map(|(_, form)| of_form(setting, form))).collect();
    let scene = &subject.buffers;
    all.iter().try_for_each(|settings| restir::render::check(scene, &Render::new(protocol.size, settings.clone())))?;
    let costs: Vec<Cost> =
        all.par_iter().map(|settings| Cost::of(scene, protocol.size, settings)).collect::<Result<_, _>>()?;
    let chains =
        environs.run(&subject.name, |executor, observe| chains::run(executor, scene, &all, protocol, observe))?;
    let mut measured = chains.into_iter().zip(costs).map(|(chains, cost)| Measured { chains, cost });
    let mut next = || measured.next().ok_or(Error::Interrupted);
    settings.into_iter().map(|setting| Ok(Pair { setting, of: [next()?, next()?] })).collect()
}

fn measure(
    environs: &mut impl Environs,
    effort: &Effort,
    picture: Picture,
    subject: Subject,
) -> Result<Findings, Error> {
    let settings = settings(effort.protocol.size);
    let few = CANDIDATES.map(|candidates| Setting {
        settings: DiSettings { candidates, ..settings[0].settings.clone() },
        ..settings[0].clone()
    });
    let candidates = pairs(environs, &subject, effort.protocol, few.to_vec())?;
    let running = running(environs, effort, picture, &subject, &settings[..2])?;
    let pairs = pairs(environs, &subject, effort.protocol, settings.to_vec())?;
    Ok(Findings { subject, pairs, candidates, running })
}

/// Averages of running chains, from their first frame on.
fn running(
    environs: &mut impl Environs,
    effort: &Effort,
    picture: Picture,
    subject: &Subject,
    settings: &[Setting],
) -> Result<Vec<Series>, Error> {
    let technique = |setting: &Setting, (name, mis): (&str, Mis)| {
        let settings = DiSettings { mis, ..setting.settings.clone() };
        let render = Render { accumulate: true, ..Render::new(effort.protocol.size, settings) };
        Technique { name: curve(name, setting), render }
    };
    let matrix = Matrix {
        picture,
        techniques: settings.iter().flat_map(|setting| FORMS.map(|form| technique(setting, form))).collect(),
        budgets: (0..=effort.frames.ilog2()).map(|log| 1 << log).collect(),
        restarts: effort.restarts,
        time: Duration::MAX,
    };
    let Subject { buffers, truth, .. } = subject;
    let (series, _) = environs.run(&format!("{}, running chains", subject.name), |executor, observe| {
        bench::measure(executor, buffers, &matrix, truth, observe)
    })?;
    Ok(series)
}

/// The name of a curve.
fn curve(form: &str, setting: &Setting) -> String {
    format!("{form}, {}", setting.name)
}

/// The two walls.
fn stripes(environs: &mut impl Environs, effort: &Effort) -> Result<Stripes, Error> {
    let turns: Vec<f32> = (0..STRIPES).map(|i| if i % 2 == 0 { 1.0 } else { DARK_STRIPE }).collect();
    let mut make = |name: &str, stripes: &[f32]| -> Result<(Subject, Pair), Error> {
        let subject = subject(environs, effort, name, "", &wall(name, stripes, white))?;
        let [reused, ..] = settings(effort.protocol.size);
        let mut pairs = pairs(environs, &subject, effort.protocol, vec![reused])?;
        Ok((subject, pairs.remove(0)))
    };
    let (plain, striped) = (make("wall", &[1.0])?, make("striped wall", &turns)?);
    Ok(Stripes { walls: [plain.0, striped.0], of: [plain.1, striped.1] })
}
