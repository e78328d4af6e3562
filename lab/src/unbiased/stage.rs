//! A scene, and both sides of the comparisons that are made of it.

use std::collections::BTreeMap;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene, builtin};
use restir_host::settings::Choice as _;
use restir_host::settings::Settings;
use restir_host::technique::path::{PathSettings, film};
use restir_host::technique::{Integral, PixelFilter, Repeats, Technique};
use restir_tests::scenes::named;
use restir_tests::stats::Moments;
use restir_tests::technique::configure_by;

use super::oracle::Independent;
use super::report::Row;
use super::side::{Picture, Side};
use super::{Cell, Expected, GRID, Goal, Options, SIZE, WRONG_RADIANCE};
use crate::Error;

/// Frames of a restart: enough for a history that has a history.
pub(super) const FRAMES: u32 = 4;
/// Seeds of references lie beyond those of what is tested.
const REFERENCE_SEED: u32 = 1 << 31;

/// Samples of a pixel in each restart of a reference.
const REFERENCE_SAMPLES: u32 = 64;

/// In names of what light that is seen directly is taken off.
const BEYOND: &str = "-beyond-1";

/// A scene, and what is known of it so far.
pub(super) struct Stage<'a> {
    options: &'a Options,
    scene: Scene,
    buffers: SceneBuffers,
    /// What the last frame shows.
    last: SceneBuffers,
    /// References by name, with their samples.
    references: BTreeMap<String, (u32, Vec<Moments>)>,
}

impl<'a> Stage<'a> {
    pub(super) fn open(name: &str, options: &'a Options) -> Result<Self, Error> {
        let scene = named(name).ok_or_else(|| {
            let names: Vec<&str> = builtin::NAMES.iter().map(|(name, _)| *name).collect();
            let names = names.join(", ");
            Error::Environment(format!(
                "there is no scene {name}; there are: {names}, statue-by-night, all-lights, panes"
            ))
        })?;
        let buffers = SceneBuffers::build(&scene)?;
        let last = buffers.at(f64::from(FRAMES - 1))?;
        Ok(Self { options, scene, buffers, last, references: BTreeMap::new() })
    }

    /// Runs a cell and its reference, and compares them, until the biases of the goal would be noticed.
    pub(super) fn row(&mut self, cell: Cell, goal: Option<Goal>, family_rate: f64) -> Result<Row, Error> {
        self.check(&cell)?;
        let mut samples = self.options.reference_samples;
        let mut restarts = self.options.restarts.unwrap_or(match cell.technique.about().repeats {
            Repeats::Samples => 16_384,
            Repeats::Frames => 512,
        });
        loop {
            let (reference, tested) = (self.reference(&cell, samples)?, self.tested(&cell, restarts)?);
            let row = Row::new(&self.scene.name, cell.clone(), goal, family_rate, &tested, &reference);
            let over = row.detectable_over_goal();
            let most = self.options.most_restarts;
            if restarts >= most || over <= 1.0 {
                return Ok(row);
            }
            // what is detectable falls with the root of them, and is not well known where they are few
            restarts = most.min((f64::from(restarts) * (1.05 * over * over).clamp(1.1, 2.0)) as u32);
            // whichever is worse known gains more
            let [of_tested, of_reference] = [&tested.moments(), &reference].map(|side| image_variance(side));
            samples = if of_reference > 0.5 * of_tested { samples.saturating_mul(2) } else { samples };
        }
    }

    /// Whether path tracing shows the same.
    fn check(&self, cell: &Cell) -> Result<(), Error> {
        let shown = !cell.technique.shown_by_path().is_empty();
        let why = cell.technique.differs_from_path(&self.buffers).filter(|_| !shown);
        let refused = |why| Error::Environment(format!("{}/{}: the technique {why}", cell.name(), self.scene.name));
        why.map_or(Ok(()), |why| Err(refused(why)))
    }

    fn tested(&self, cell: &Cell, restarts: u32) -> Result<Side, Error> {
        let wrong = cell.expected == Expected::Wrong;
        let brighter = wrong.then(|| SceneBuffers::build(&brightened(&self.scene))).transpose()?;
        let buffers = brighter.as_ref().unwrap_or(&self.buffers);
        let count = match cell.technique.about().repeats {
            Repeats::Samples => 1,
            Repeats::Frames => FRAMES,
        };
        // where frames show the same and do not know each other, each tells as much as the last
        let accumulate = count > 1 && !cell.technique.looks_back() && !buffers.is_animated();
        let render = Render { count, accumulate, ..Render::new([SIZE; 2], cell.technique.clone()) };
        let seen = self.seen_directly(cell)?;
        // cells differ in their seeds, so that the same picture twice is two tests
        let [a, b, ..] = *blake3::hash(cell.name().as_bytes()).as_bytes();
        let seed = u32::from_le_bytes([0, 0, a, b & 0x7f]);
        let what = format!("{render:?}{}", if seen.is_some() { BEYOND } else { "" });
        self.side(&cell.name(), &what, restarts, &|restart| {
            let whole = picture(buffers, &render, seed + restart)?;
            let Some(seen) = &seen else { return Ok(whole) };
            let sample = |frame| self.sample(seen, seed + restart, frame);
            let frames = if accumulate { 0..count } else { count - 1..count };
            let share = 1.0 / frames.len() as f64;
            frames.map(sample).try_fold(whole, |rest, seen| Ok(less(rest, &seen?, share)))
        })
    }

    /// Path tracing of light that camera rays see directly, where it is taken off both sides: they find it in the same points, and where rays are
    /// spread over pixels that see small bright lights it has most of the variance.
    fn seen_directly(&self, cell: &Cell) -> Result<Option<PathSettings>, Error> {
        let integral = cell.technique.integral();
        if !integral.jitter || cell.technique.about().repeats == Repeats::Samples {
            return Ok(None);
        }
        let mut path = PathSettings { max_depth: 1, ..PathSettings::of(integral) };
        if let Some(sampler) = cell.technique.value("sampler") {
            path.set("sampler", &sampler)?;
        }
        Ok(Some(path))
    }

    /// A sample of what the last frame shows.
    fn sample(&self, path: &PathSettings, seed: u32, index: u32) -> Result<Picture, Error> {
        let render = Render { seed, cameras: vec![self.last_camera()], ..Render::new([SIZE; 2], path.clone()) };
        let pixels = film(&mut CpuExecutor::inline(), &self.last, &render, index)?;
        Ok(pixels.into_iter().map(|pixel| pixel.sum.map(f64::from)).collect())
    }

    fn last_camera(&self) -> Camera {
        self.buffers.camera_at(f64::from(FRAMES - 1))
    }

    /// Path tracing with the technique's integral; if that is what the technique is, the oracle, or what the harness declares instead.
    fn reference(&mut self, cell: &Cell, samples: u32) -> Result<Vec<Moments>, Error> {
        let integral = cell.technique.integral();
        let Integral { max_depth, jitter, filter, multiscatter } = integral;
        let mut path: Box<dyn Technique> = PathSettings::of(integral).into();
        let is_itself = *path == *cell.technique;
        let shown = cell.technique.shown_by_path();
        let by = match cell.instead.filter(|_| is_itself).or(Some(&*shown).filter(|shown| !shown.is_empty())) {
            Some(other) => {
                configure_by(path.as_mut(), other)?;
                format!("reference-{other}")
            }
            None => if is_itself { "oracle" } else { "reference" }.to_owned(),
        };
        let [jitter, single] =
            [(jitter, "-jitter"), (!multiscatter, "-single")].map(|(on, name)| if on { name } else { "" });
        let filter = if filter == PixelFilter::Box { String::new() } else { format!("-{}", filter.name()) };
        // samples show the scene as it is at first
        let last = cell.technique.about().repeats == Repeats::Frames && self.buffers.is_animated();
        let (shown, when) = if last { (&self.last, "-last") } else { (&self.buffers, "") };
        let seen = self.seen_directly(cell)?;
        let beyond = if seen.is_some() { BEYOND } else { "" };
        let name = format!("{by}-{max_depth}{jitter}{filter}{single}{when}{beyond}");
        if let Some((_, known)) = self.references.get(&name).filter(|(known, _)| *known >= samples) {
            return Ok(known.clone());
        }
        let side = if by == "oracle" {
            let oracle = Independent::new(&self.scene, &self.buffers, cell.technique.integral())?;
            self.side(&name, "", samples, &|restart| {
                Ok((0..SIZE * SIZE).map(|i| oracle.pixel(REFERENCE_SEED + restart, i % SIZE, i / SIZE)).collect())
            })
        } else {
            // samples of one picture are spread, and have less variance than as many pictures
            let frame = if last { f64::from(FRAMES - 1) } else { 0.0 };
            let cameras = vec![self.buffers.camera_at(frame)];
            let render = Render { count: REFERENCE_SAMPLES, cameras, ..Render::new([SIZE; 2], path) };
            let restarts = samples.div_ceil(REFERENCE_SAMPLES);
            let what = format!("{REFERENCE_SAMPLES} samples");
            // of the same numbers as these samples, whatever those of the technique are
            let sampler = render.technique.value("sampler");
            let seen = seen.map(|mut seen| sampler.map_or(Ok(()), |s| seen.set("sampler", &s)).map(|()| seen));
            let seen = seen.transpose()?.map(|seen| Render { technique: seen.into(), ..render.clone() });
            self.side(&name, &what, restarts, &|restart| {
                let whole = picture(shown, &render, REFERENCE_SEED + restart)?;
                let Some(seen) = &seen else { return Ok(whole) };
                Ok(less(whole, &picture(shown, seen, REFERENCE_SEED + restart)?, 1.0))
            })
        }?;
        self.references.insert(name, (samples, side.moments()));
        Ok(side.moments())
    }

    /// Continues what is in the file; `what` is what pictures depend on beside the name and the scene.
    fn side(
        &self,
        name: &str,
        what: &str,
        restarts: u32,
        picture: &(impl Fn(u32) -> Result<Picture, Error> + Sync),
    ) -> Result<Side, Error> {
        let Options { state: folder, fresh, .. } = self.options;
        std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
        let path = folder.join(format!("{}-{}.json", name.replace(['/', ':', ' '], "-"), self.scene.name));
        let digest = blake3::hash(format!("{:?} {GRID:?} {name} {what}", self.scene).as_bytes());
        Side::open(&path, digest.to_hex().to_string(), *fresh)?.advance(&path, restarts, picture)
    }
}

/// The variance of the mean of the image in green; its numbers are the last three.
fn image_variance(side: &[Moments]) -> f64 {
    side[side.len() - 2].variance_of_mean()
}

/// A picture without a share of another one.
fn less(picture: Picture, other: &Picture, share: f64) -> Picture {
    let pixels = picture.into_iter().zip(other);
    pixels.map(|(a, b)| std::array::from_fn(|channel| a[channel] - share * b[channel])).collect()
}

/// What a restart shows.
fn picture(scene: &SceneBuffers, render: &Render, seed: u32) -> Result<Picture, Error> {
    let render = Render { seed, ..render.clone() };
    let rendered = render.render(scene, &mut CpuExecutor::inline())?;
    if rendered.dropped_samples > 0 {
        return Err(Error::Failed(format!("dropped samples with seed {seed}: {:?}", render.technique)));
    }
    Ok(rendered.image.pixels.into_iter().map(|pixel| pixel.map(f64::from)).collect())
}

/// The scene with [`WRONG_RADIANCE`].
fn brightened(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let scale = |colour: &mut [f32; 3]| colour.iter_mut().for_each(|x| *x *= WRONG_RADIANCE);
    scene.materials.iter_mut().for_each(|material| scale(&mut material.emission));
    scene.lights.iter_mut().for_each(|light| scale(&mut light.intensity));
    scene.environment.iter_mut().for_each(|environment| environment.scale *= WRONG_RADIANCE);
    scene
}
