//! ReSTIR DI against the path tracer's direct light. A restart is a short chain of frames with its own seed, of which the
//! last frame counts. Chains run natively, with the bits of a render (the suite `restir_di` compares them).

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::di::{self, DiRender, DiSettings, MisForm, Visibility};
use restir_host::render::{PathSettings, RenderSettings};
use restir_host::replay;
use restir_tests::native::film;
use restir_tests::scenes::named;
use restir_tests::stats::{Moments, TileTest, Verdict, ZTest, sidak};
use serde::{Deserialize, Serialize};

use super::{
    FAMILY_RATE, Options, REFERENCE_SEED, SIZE, TILE, environment, folder, grid, merged, moments, print_tiles,
};
use crate::{Error, num};

/// Frames of a chain: with the cap below, confidence is limited from the second on.
const FRAMES: u32 = 4;
/// Restarts between two writes of the state.
const ROUND: u32 = 64;
/// Restarts of a cell, if nothing else is asked for.
const RESTARTS: u32 = 512;
const REFERENCE_ROUND: u32 = 1_024;
/// What a known-wrong picture is too bright by.
const WRONG_RADIANCE: f32 = 1.01;
/// A biased setting has to differ by this many standard errors, in the direction that is known.
const BIASED: f64 = 3.0;

/// Scenes with the number of candidates and what it takes for them: the picture of many lights is a noisy one.
const SCENES: [Scene; 4] = [
    Scene { name: "many-lights", candidates: 32, reference_restarts: 65_536 },
    Scene { name: "cornell", candidates: 4, reference_restarts: 16_384 },
    Scene { name: "statue-by-night", candidates: 4, reference_restarts: 16_384 },
    Scene { name: "all-lights", candidates: 4, reference_restarts: 16_384 },
];
/// Unbiased forms of MIS.
const FORMS: [&str; 6] = ["1/z", "contribution", "talbot", "pairwise", "pairwise-defensive", "pairwise-counted"];
/// Unbiased uses of visibility.
const ROWS: [&str; 4] = ["+lights", "+Z+D", "+Z+D+selected", "+Z+D+Q+selected"];
/// Unbiased settings beside forms x rows.
const MORE: [&str; 16] = [
    "talbot+lights+jitter",
    "pairwise-defensive+Z+D+Q+selected+jitter",
    "talbot+lights+fused",
    "contribution+Z+D+fused",
    "pairwise-defensive+Z+D+Q+selected+fused",
    "1/z+Z+D+twice",
    "pairwise-counted-defensive+Z+D+Q+selected",
    "pairwise+Z+D+lights",
    "talbot+lights+shaded",
    "pairwise+Z+D+Q+selected+rays+shaded",
    "pairwise+Z+D+Q+selected+still+gathered",
    "contribution+Z+D+still",
    "pairwise-defensive+Z+D+twice+forgets",
    "pairwise+Z+D+Q+selected+tiles",
    "pairwise+Z+D+Q+selected+tiles+rays+alone+still+gathered",
    "pairwise+Z+D+Q+selected+tiles+rays+apart+gathered",
];
/// Settings that make pictures darker.
const DARKER: [&str; 7] =
    ["1/m+lights", "1/m+Z", "constant+lights", "constant+Z", "pairwise-defensive+Z", "talbot", "talbot+Z+averaged"];
/// Tested with [`WRONG_RADIANCE`] as well.
const WRONG: &str = "pairwise-defensive+Z+D+Q+selected";

/// A scene of the matrix.
struct Scene {
    name: &'static str,
    /// Candidates from lights.
    candidates: u32,
    /// Restarts of the path tracer, which all cells of a scene share.
    reference_restarts: u32,
}

/// What is known of settings before they are tested.
#[derive(Clone, Copy, PartialEq)]
enum Expected {
    Unbiased,
    Darker,
    /// [`WRONG_RADIANCE`]: it has to be seen where the test has the power for it.
    Wrong,
}

/// Settings by name: a form of MIS, then what differs from candidates without visibility and a final ray, joined by "+".
fn settings(name: &str, candidates: u32) -> Option<DiSettings> {
    let (form, words) = name.split_once('+').unwrap_or((name, ""));
    let mis = MisForm::ALL.iter().find(|(name, _)| *name == form)?.1;
    let mut s = DiSettings {
        mis,
        candidates,
        neighbours: 3,
        radius: 8.0,
        confidence_cap: 3,
        scatter: true,
        still: false,
        ..DiSettings::visibility_in_shading()
    };
    for word in words.split('+').filter(|word| !word.is_empty()) {
        match word {
            "Z" => s.initial_visibility = true,
            "Q" => s.target_visibility = true,
            "D" => s.mis_visibility = true,
            "selected" => s.visibility = Visibility::Selected,
            "averaged" => s.visibility = Visibility::Averaged,
            "fused" => s.fused = true,
            "jitter" => s.jitter = true,
            "twice" => s.spatial = 2,
            "lights" => s.scatter = false,
            "shaded" => s.shaded = 4,
            "gathered" => s.shaded = 20,
            "rays" => s.initial_rays = 4,
            "still" => s.still = true,
            "forgets" => s.feedback = false,
            "tiles" => (s.tiles, s.tile_size) = (4, 64),
            "alone" => s.spatial = 0,
            "apart" => s.temporal = false,
            _ => return None,
        }
    }
    Some(s)
}

/// Moments so far, in a file.
#[derive(Serialize, Deserialize)]
struct Side {
    /// What they are of.
    digest: String,
    restarts: u32,
    moments: Vec<[u64; 3]>,
}

impl Side {
    fn load(path: &Path, digest: String, fresh: bool) -> Result<Self, Error> {
        if fresh || !path.exists() {
            return Ok(Self { digest, restarts: 0, moments: Vec::new() });
        }
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        serde_json::from_str(&text).ok().filter(|side: &Self| side.digest == digest).ok_or_else(|| {
            Error::Environment(format!("{} is of another scene or version; discard it by --fresh", path.display()))
        })
    }

    /// Adds rounds of restarts; `images(first, count)` gives their moments.
    fn advance(
        &mut self,
        path: &Path,
        [restarts, round]: [u32; 2],
        images: &mut dyn FnMut(u32, u32) -> Result<Vec<Moments>, Error>,
    ) -> Result<(), Error> {
        while self.restarts < restarts {
            self.moments = merged(&self.moments, images(self.restarts, round)?);
            self.restarts += round;
            super::save(self, path)?;
        }
        Ok(())
    }
}

/// A scene, and what is rendered with.
struct Stage {
    setup: &'static Scene,
    buffers: SceneBuffers,
    /// The same, brighter.
    wrong: SceneBuffers,
    folder: PathBuf,
    fresh: bool,
}

impl Stage {
    fn open(name: &str, options: &Options) -> Result<Self, Error> {
        let (scene, setup) = named(name).zip(SCENES.iter().find(|setup| setup.name == name)).ok_or_else(|| {
            let names = SCENES.map(|setup| setup.name).join(", ");
            Error::Environment(format!("there is no scene {name} for restir-di; there are {names}"))
        })?;
        let mut wrong = scene.clone();
        let scale = |colour: &mut [f32; 3]| colour.iter_mut().for_each(|x| *x *= WRONG_RADIANCE);
        wrong.materials.iter_mut().for_each(|material| scale(&mut material.emission));
        wrong.lights.iter_mut().for_each(|light| scale(&mut light.intensity));
        wrong.environment.iter_mut().for_each(|environment| environment.scale *= WRONG_RADIANCE);
        Ok(Self {
            setup,
            buffers: SceneBuffers::build(&scene).map_err(environment)?,
            wrong: SceneBuffers::build(&wrong).map_err(environment)?,
            folder: folder(options)?,
            fresh: options.fresh,
        })
    }

    fn digest(&self, what: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        for words in [&self.buffers.geometry, &self.buffers.attributes, &self.buffers.texels] {
            hasher.update(&words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>());
        }
        hasher.update(format!("{:?} {SIZE} {TILE} {what}", self.buffers.camera).as_bytes());
        hasher.finalize().to_hex().to_string()
    }

    /// The path tracer's direct light.
    fn reference(&self, jitter: bool) -> Result<Side, Error> {
        let suffix = if jitter { "-jitter" } else { "" };
        let path = self.folder.join(format!("direct-{}{suffix}.json", self.setup.name));
        let digest = self.digest(&format!("{jitter} {REFERENCE_ROUND}"));
        // no part of any one cell, so it stays
        let mut side = Side::load(&path, digest, false)?;
        let settings = RenderSettings {
            width: SIZE,
            height: SIZE,
            samples: 1,
            seed: 0,
            path: PathSettings { max_depth: 2, jitter, roulette: false },
            dispatch_samples: None,
        };
        let params = replay::params(&self.buffers, &settings, 0).map_err(environment)?;
        let view = self.buffers.traced_view();
        side.advance(&path, [self.setup.reference_restarts, REFERENCE_ROUND], &mut |first, count| {
            Ok(grid().moments(count, |restart, x, y| {
                let mut params = params;
                params.seed = REFERENCE_SEED + first + restart;
                replay::trace(&view, &params, x, y).sum.map(f64::from)
            }))
        })?;
        Ok(side)
    }

    fn tested(&self, name: &str, wrong: bool, restarts: u32) -> Result<Side, Error> {
        let settings = settings(name, self.setup.candidates).ok_or_else(|| {
            let forms: Vec<&str> = MisForm::ALL.iter().map(|(name, _)| *name).collect();
            Error::Environment(format!(
                "there are no settings {name}; they are one of {}, and any of Z, D, Q, selected, averaged, fused, jitter, \
                 twice and lights, joined by +",
                forms.join(", ")
            ))
        })?;
        let suffix = if wrong { "-wrong" } else { "" };
        let path = self.folder.join(format!("restir-di-{}-{}{suffix}.json", name.replace('/', "-"), self.setup.name));
        let digest = self.digest(&format!("{settings:?} {wrong} {ROUND} {FRAMES}"));
        let mut side = Side::load(&path, digest, self.fresh)?;
        let scene = if wrong { &self.wrong } else { &self.buffers };
        // cells differ in their seeds, so that the same picture twice is two tests
        let [a, b, ..] = *blake3::hash(format!("{name}{suffix}").as_bytes()).as_bytes();
        let seed = u32::from_le_bytes([0, 0, a, b & 0x7f]);
        let render = DiRender { frames: FRAMES, ..DiRender::new([SIZE; 2], settings) };
        side.advance(&path, [restarts, ROUND], &mut |first, count| {
            let film = |restart| film(di::plan(scene, &DiRender { seed: seed + restart, ..render.clone() }));
            let films = (first..first + count).into_par_iter().map(film).collect::<Result<Vec<_>, _>>();
            let films = films.map_err(environment)?;
            if films.iter().flatten().any(|pixel| pixel.dropped > 0.0) {
                return Err(Error::Failed(format!("{name}/{}: dropped samples", self.setup.name)));
            }
            let at = |x: u32, y: u32| (y * SIZE + x) as usize;
            Ok(grid().moments(count, |restart, x, y| films[restart as usize][at(x, y)].sum.map(f64::from)))
        })?;
        Ok(side)
    }
}

/// A tested cell.
struct Row {
    scene: &'static str,
    name: String,
    expected: Expected,
    restarts: u32,
    verdict: Verdict,
    /// The bias that is detectable in half of the tiles and channels.
    detectable_in_half: f64,
    /// Relative difference of the image's mean in green, and its standard error.
    bias: [f64; 2],
}

impl Row {
    fn new(
        scene: &'static str,
        name: &str,
        expected: Expected,
        family_rate: f64,
        [tested, reference]: [&Side; 2],
    ) -> Self {
        let (a, b) = (moments(&tested.moments), moments(&reference.moments));
        let rate = sidak(family_rate, a.len());
        let detectable = |(a, b): (&Moments, &Moments)| ZTest::new(*a, *b).detectable_bias(rate) / b.mean();
        let mut detectable: Vec<f64> = a.iter().zip(&b).map(detectable).collect();
        detectable.sort_by(f64::total_cmp);
        Self {
            scene,
            name: name.to_owned(),
            expected,
            restarts: tested.restarts,
            verdict: TileTest { grid: grid(), family_rate }.compare(&a, &b),
            detectable_in_half: detectable[detectable.len() / 2],
            bias: relative_bias(&a, &b),
        }
    }

    /// Whether the outcome is what is known; nothing if the test cannot tell.
    fn agrees(&self) -> Option<bool> {
        let [bias, error] = self.bias;
        match self.expected {
            Expected::Unbiased => Some(self.verdict.passed()),
            Expected::Darker if bias.abs() <= BIASED * error => None,
            Expected::Darker => Some(bias < 0.0),
            Expected::Wrong if self.verdict.detectable_in_image > f64::from(WRONG_RADIANCE) - 1.0 => None,
            Expected::Wrong => Some(!self.verdict.passed()),
        }
    }
}

fn restarts(options: &Options) -> u32 {
    options.restarts.unwrap_or(RESTARTS).max(1).next_multiple_of(ROUND)
}

fn relative_bias(tested: &[Moments], reference: &[Moments]) -> [f64; 2] {
    // the image's numbers are the last three
    let at = tested.len() - 2;
    let (a, b) = (tested[at], reference[at]);
    let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt();
    [(a.mean() - b.mean()) / b.mean(), error / b.mean()]
}

/// The cell `restir-di:<settings>/<scene>`.
pub(super) fn run_cell(options: &Options, name: &str, scene: &str) -> Result<(), Error> {
    let stage = Stage::open(scene, options)?;
    let tested = stage.tested(name, options.wrong, restarts(options))?;
    let reference = stage.reference(name.contains("+jitter"))?;
    let (a, b) = (moments(&tested.moments), moments(&reference.moments));
    let verdict = TileTest { grid: grid(), family_rate: FAMILY_RATE }.compare(&a, &b);
    let wrong = if options.wrong { format!(", radiance x {WRONG_RADIANCE}") } else { String::new() };
    let [bias, error] = relative_bias(&a, &b).map(|x| 100.0 * x);
    println!(
        "restir-di:{name}/{scene}{wrong}: {} restarts of {FRAMES} frames, {SIZE} x {SIZE} pixels",
        tested.restarts
    );
    println!("false-alarm rate of the family {FAMILY_RATE}, power 99 %: {verdict}");
    println!("bias of the image, green: {bias:+.3} +- {error:.3} %");
    print_tiles(&a, &b);
    if verdict.passed() { Ok(()) } else { Err(Error::Failed(format!("{name}/{scene}{wrong} is biased: {verdict}"))) }
}

/// All cells, and the report on them.
pub(super) fn run_matrix(options: &Options) -> Result<(), Error> {
    let cells = cells();
    let family_rate = sidak(FAMILY_RATE, cells.len() * SCENES.len());
    let start = Instant::now();
    let mut rows = Vec::new();
    for Scene { name: scene, .. } in SCENES {
        let stage = Stage::open(scene, options)?;
        for (name, expected) in &cells {
            let tested = stage.tested(name, *expected == Expected::Wrong, restarts(options))?;
            let reference = stage.reference(name.contains("+jitter"))?;
            let row = Row::new(scene, name, *expected, family_rate, [&tested, &reference]);
            eprintln!("{:.0} s: {}", start.elapsed().as_secs_f64(), line(&row));
            rows.push(row);
        }
    }
    let report = report(&rows);
    println!("{report}");
    if options.write {
        num::write(&Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs").join("restir-di-bias.md"), &report)?;
    }
    let findings = findings(&rows, &cells);
    if findings.is_empty() { Ok(()) } else { Err(Error::Failed(findings.join("\n"))) }
}

/// The settings of the matrix.
fn cells() -> Vec<(String, Expected)> {
    let forms = FORMS.iter().flat_map(|form| ROWS.iter().map(move |row| format!("{form}{row}")));
    let unbiased = forms.chain(MORE.map(str::to_owned)).map(|name| (name, Expected::Unbiased));
    let darker = DARKER.map(|name| (name.to_owned(), Expected::Darker));
    unbiased.chain(darker).chain([(WRONG.to_owned(), Expected::Wrong)]).collect()
}

/// What is not as it should be: a cell that says otherwise, or settings of which no scene tells.
fn findings(rows: &[Row], cells: &[(String, Expected)]) -> Vec<String> {
    let wrong = rows.iter().filter(|row| row.agrees() == Some(false));
    let mut findings: Vec<String> = wrong.map(|row| format!("{}/{}: {}", row.name, row.scene, row.verdict)).collect();
    for (name, expected) in cells {
        let mut of_it = rows.iter().filter(|row| row.name == *name && row.expected == *expected);
        if of_it.all(|row| row.agrees().is_none()) {
            findings.push(format!("{name}: its bias is not seen on any scene; give it more restarts"));
        }
    }
    findings
}

fn line(row: &Row) -> String {
    let known = match row.expected {
        Expected::Unbiased => "none",
        Expected::Darker => "darker",
        Expected::Wrong => "x 1.01",
    };
    let outcome = match row.agrees() {
        Some(true) => "as known",
        Some(false) => "**not as known**",
        None => "not seen here",
    };
    let Verdict { max_z, detectable_in_image, .. } = row.verdict;
    let [bias, error] = row.bias.map(|x| 100.0 * x);
    format!(
        "| {} | {} | {known} | {} | {max_z:.2} | {:.2} | {:.2} | {bias:+.3} +- {error:.3} | {outcome} |",
        row.scene,
        row.name,
        row.restarts,
        100.0 * row.detectable_in_half,
        100.0 * detectable_in_image
    )
}

fn report(rows: &[Row]) -> String {
    let threshold = rows.first().map_or(f64::NAN, |row| row.verdict.threshold);
    let mut text = format!(
        "# Bias of ReSTIR DI\n\nEach row compares the last of {FRAMES} frames, over independent restarts, with the path \
         tracer's direct light (depth 2): {SIZE} x {SIZE} pixels, the \
         three channels of {} tiles of {TILE} x {TILE} and of the image. A row passes if no |z| exceeds {threshold:.2}; the \
         whole table has a false alarm with probability {FAMILY_RATE}. The detectable bias is noticed with 99 % \
         probability: in half of the tiles and channels, and in the worst channel of the image. The last figures are the \
         bias of the image's mean in green and its standard error, in percent.\n\n\
         Settings: 4 candidates from lights, 32 in `many-lights`, and one from scattering, temporal reuse with a cap of 3, one spatial pass of \
         3 neighbours within 8 pixels. Z: occluded initial samples count for nothing; Q: targets of the selection contain \
         visibility; D: those of MIS weights do; shading traces a ray, or takes the visibility of the selected sample, or \
         the averaged one. Fused: one pass for both kinds of reuse. Twice: two spatial passes. Lights: no candidate from \
         scattering, which cannot find what is occluded and so needs D. Shaded, gathered: 4 or 20 neighbours are shaded as \
         well. Rays: 4 groups of candidates, each tested by a ray. Still: frames are merged as those of a still view. Forgets: \
         spatial reuse is not fed back. Tiles: 4 tiles of 64 candidates. Alone: no spatial reuse but in shading. Apart: none of the last frame. Of settings known to be darker a row tells where \
         the bias exceeds {BIASED} standard errors; of radiance x 1.01, where that is detectable. A tile that \
         light reaches rarely has no variance yet in few restarts, and z says nothing: such rows need more of them.\n\n\
         Made by `cargo xtask unbiased --di --write`.\n\n\
         | scene | settings | known bias | restarts | max \\|z\\| | detectable in tiles, % | in the image, % | bias, % | \
         outcome |\n|---|---|---|---:|---:|---:|---:|---:|---|\n",
        (SIZE / TILE).pow(2),
    );
    for row in rows {
        // writing to a string cannot fail
        let _ = writeln!(text, "{}", line(row));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_what_the_settings_say() {
        for (name, expected) in cells() {
            let settings = settings(&name, 4).expect(&name);
            settings.check().expect(&name);
            assert_eq!(settings.biases().is_empty(), expected != Expected::Darker, "{name}");
        }
    }

    #[test]
    fn settings_and_scenes_that_are_none_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for (cell, known) in [("restir-di:magic/cornell", "talbot"), ("restir-di:talbot/teapot", "all-lights")] {
            let options = super::super::tests::options(cell, folder.path(), 1);
            let message = super::super::run(&options).unwrap_err().to_string();
            assert!(message.contains(known), "{message}");
        }
    }
}
