//! A scene, and both sides of the comparisons that are made of it.

use std::collections::BTreeMap;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::{self, Render};
use restir_host::scene::{Scene, builtin};
use restir_host::technique::path::PathSettings;
use restir_host::technique::{Integral, PixelFilter, Repeats, Technique};
use restir_tests::scenes::named;
use restir_tests::stats::Moments;

use super::oracle::oracle;
use super::report::Row;
use super::side::{Picture, Side};
use super::{Cell, Expected, GRID, Options, SIZE, WRONG_RADIANCE};
use crate::Error;

/// Frames of a restart: enough for a history that has a history.
pub(super) const FRAMES: u32 = 4;
/// Seeds of references lie beyond those of what is tested.
const REFERENCE_SEED: u32 = 1 << 31;

/// A scene, and what is known of it so far.
pub(super) struct Stage<'a> {
    options: &'a Options,
    scene: Scene,
    buffers: SceneBuffers,
    /// References by name.
    references: BTreeMap<String, Vec<Moments>>,
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
        Ok(Self { options, scene, buffers, references: BTreeMap::new() })
    }

    /// Runs a cell and its reference, and compares them.
    pub(super) fn row(&mut self, cell: Cell, family_rate: f64) -> Result<Row, Error> {
        self.check(&cell)?;
        let reference = self.reference(&cell)?;
        let tested = self.tested(&cell)?;
        Ok(Row::new(&self.scene.name, cell, family_rate, &tested, &reference))
    }

    /// Whether path tracing shows the same.
    fn check(&self, cell: &Cell) -> Result<(), Error> {
        let why = if cell.technique.about().repeats == Repeats::Frames && self.buffers.is_animated() {
            Some("shows its last frame, and path tracing the first; give a scene that does not move")
        } else {
            cell.technique.differs_from_path(&self.buffers)
        };
        let refused = |why| Error::Environment(format!("{}/{}: the technique {why}", cell.name(), self.scene.name));
        why.map_or(Ok(()), |why| Err(refused(why)))
    }

    fn tested(&self, cell: &Cell) -> Result<Side, Error> {
        let wrong = cell.expected == Expected::Wrong;
        let brighter = wrong.then(|| SceneBuffers::build(&brightened(&self.scene))).transpose()?;
        let buffers = brighter.as_ref().unwrap_or(&self.buffers);
        let (count, restarts) = match cell.technique.about().repeats {
            Repeats::Samples => (1, 16_384),
            Repeats::Frames => (FRAMES, 512),
        };
        let render = Render { count, ..Render::new([SIZE; 2], cell.technique.clone()) };
        // cells differ in their seeds, so that the same picture twice is two tests
        let [a, b, ..] = *blake3::hash(cell.name().as_bytes()).as_bytes();
        let seed = u32::from_le_bytes([0, 0, a, b & 0x7f]);
        self.side(&cell.name(), &format!("{render:?}"), self.options.restarts.unwrap_or(restarts), &|restart| {
            picture(buffers, &render, seed + restart)
        })
    }

    /// Path tracing with the technique's integral, or the oracle, if that is what the technique is.
    fn reference(&mut self, cell: &Cell) -> Result<Vec<Moments>, Error> {
        let integral = cell.technique.integral();
        let Integral { max_depth, jitter, filter, multiscatter } = integral;
        let path: Box<dyn Technique> = PathSettings::of(integral).into();
        let is_itself = *path == *cell.technique;
        let by = if is_itself { "oracle" } else { "reference" };
        let [jitter, single] =
            [(jitter, "-jitter"), (!multiscatter, "-single")].map(|(on, name)| if on { name } else { "" });
        let filter = if filter == PixelFilter::Box { String::new() } else { format!("-{}", filter.name()) };
        let name = format!("{by}-{max_depth}{jitter}{filter}{single}");
        if let Some(known) = self.references.get(&name) {
            return Ok(known.clone());
        }
        let restarts = self.options.reference_restarts;
        let side = if is_itself {
            let oracle = oracle(&self.scene, &self.buffers, cell.technique.integral())?;
            self.side(&name, "", restarts, &|restart| {
                Ok((0..SIZE * SIZE).map(|i| oracle.pixel(REFERENCE_SEED + restart, i % SIZE, i / SIZE)).collect())
            })
        } else {
            let render = Render::new([SIZE; 2], path);
            self.side(&name, "", restarts, &|restart| picture(&self.buffers, &render, REFERENCE_SEED + restart))
        }?;
        self.references.insert(name, side.moments());
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

/// What a restart shows.
fn picture(scene: &SceneBuffers, render: &Render, seed: u32) -> Result<Picture, Error> {
    let render = Render { seed, ..render.clone() };
    let rendered = render::render(&mut CpuExecutor::inline(), scene, &render, &mut |_| Ok(()))?;
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
