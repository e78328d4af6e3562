//! Renders, and what they are asked for.

use numpy::PyArray3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use restir::advanced::aov::{Aov, Shot};
use restir::advanced::settings::{Choice as _, Value};
use restir::buffers::SceneBuffers;
use restir::denoise::Denoise;
use restir::exec::Description;
use restir::render::{Render, Rendered};
use restir::scene::{self, Camera};
use restir::technique::explain::{Place, Subject};
use restir::technique::{Repeats, Technique, configure, named};
use std::sync::Arc;

use crate::scene::{CameraTuple, Scene, Snapshot, camera_of};
use crate::watch::Watch;
use crate::{array, device::Device, refused};

/// Image size of a scene that has none of its own, in pixels.
const DEFAULT_SIZE: [u32; 2] = [512, 512];

/// What is rendered.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Request {
    technique: String,
    /// As `KEY=VALUE`.
    settings: Vec<String>,
    size: Option<[u32; 2]>,
    /// Samples or frames; the technique chooses if there is none.
    count: Option<u32>,
    accumulate: bool,
    seed: u32,
    camera: Option<CameraTuple>,
    /// The frame of its animation that the scene stands at.
    frame: f64,
    denoise: bool,
}

/// A scene and the render of it.
pub(crate) struct Job {
    pub(crate) scene: scene::Scene,
    pub(crate) buffers: Arc<SceneBuffers>,
    pub(crate) render: Render,
}

pub(crate) fn technique_of(name: &str, settings: &[String]) -> Result<Box<dyn Technique>, restir::Error> {
    let mut technique = named(name)?;
    configure(technique.as_mut(), settings)?;
    Ok(technique)
}

impl Request {
    /// What it is for this scene; without the interpreter.
    pub(crate) fn job(self, scene: &Scene) -> PyResult<Job> {
        let snapshot = scene.snapshot().map_err(refused)?;
        let technique = technique_of(&self.technique, &self.settings).map_err(refused)?;
        let size = self.size.or(snapshot.scene.default_size).unwrap_or(DEFAULT_SIZE);
        let framing = snapshot.scene.camera.is_none().then(|| snapshot.framing(size));
        let Snapshot { scene, mut buffers, .. } = snapshot;
        let given = self.camera.map(camera_of).transpose()?.map(|camera| camera.moved(-scene.origin));
        let camera = given.or(framing);
        // the scene's own camera where nothing moves, as the program has it: parts of both are of one render then
        let (own, moving) = if buffers.is_animated() { (None, camera) } else { (camera, None) };
        if let Some(camera) = own {
            Arc::make_mut(&mut buffers).camera = camera;
        }
        if self.frame != 0.0 {
            buffers = Arc::new(buffers.at(self.frame).map_err(refused)?);
        }
        let count = self.count.unwrap_or(technique.about().default_count);
        let (denoise, cameras) = (self.denoise.then(Denoise::default), moving.into_iter().collect());
        let (accumulate, seed) = (self.accumulate, self.seed);
        let render = Render { count, accumulate, seed, denoise, cameras, ..Render::new(size, technique) };
        Ok(Job { scene, buffers, render })
    }
}

impl Job {
    fn camera(&self) -> Camera {
        self.render.cameras.first().copied().unwrap_or(self.buffers.camera)
    }

    /// What the camera sees.
    fn shot<'a>(&'a self, camera: &'a dyn Fn(f64) -> Camera) -> Shot<'a> {
        let Render { width, height, seed, count, ref technique, .. } = self.render;
        let (integral, repeats) = (technique.integral(), technique.about().repeats);
        let samples = if repeats == Repeats::Samples { count } else { u32::MAX };
        Shot { scene: &self.buffers, frame: 0.0, camera, size: [width, height], seed, integral, samples }
    }
}

/// Pairs that say how an image was made.
fn pairs(job: &Job, device: &Description, rendered: &Rendered) -> Vec<(String, String)> {
    let Job { scene, render, .. } = job;
    let about = render.technique.about();
    let mut pairs = vec![
        ("scene", scene.name.clone()),
        ("technique", about.name.to_owned()),
        ("width", render.width.to_string()),
        ("height", render.height.to_string()),
        (about.repeats.name(), render.count.to_string()),
        ("accumulate", render.accumulate.to_string()),
        ("seed", render.seed.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("executor", device.executor.to_owned()),
        ("adapter", device.adapter.clone().unwrap_or_else(|| "none".to_owned())),
        ("flavour", device.flavour.to_string()),
        ("dispatches", rendered.dispatches.to_string()),
        ("dropped_samples", rendered.dropped_samples.to_string()),
    ];
    pairs.extend(rendered.counts.iter().map(|(name, count)| (*name, count.to_string())));
    pairs.extend(render.technique.entries().into_iter().map(|entry| (entry.key, entry.value)));
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// What [`render`] gives: the colour, the other layers by name, and pairs that say how it was made.
type Given<'py> = (Bound<'py, PyArray3<f32>>, Bound<'py, PyDict>, Vec<(String, String)>);

/// Renders; `layers` are what the camera sees, and `inspect` asks for those of the technique.
#[pyfunction]
fn render<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    request: Request,
    layers: Vec<String>,
    inspect: bool,
    device: &Bound<'py, Device>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Given<'py>> {
    let aovs: Vec<Aov> = layers.iter().map(|layer| aov(layer)).collect::<PyResult<_>>()?;
    let (scene, device) = (scene.get(), device.get());
    let (image, layers, pairs) = py.detach(|| {
        let job = request.job(scene)?;
        let mut watch = Watch::new(progress);
        let done = device.with(|executor| {
            let observe = &mut |step: &restir::exec::Step<'_>| watch.see(step.progress);
            let (rendered, channels) = if inspect {
                let shown = job.render.technique.inspect();
                let layered = shown.render_with_layers(executor, &job.buffers, &job.render, observe)?;
                (layered.rendered, layered.layers)
            } else {
                (job.render.render_observed(&job.buffers, executor, observe)?, Vec::new())
            };
            // each of the technique's channels is a layer of its own
            let mut layers: Vec<_> = channels.into_iter().map(|channel| (channel.name, vec![channel])).collect();
            for aov in aovs {
                layers.push((aov.name(), job.shot(&|_| job.camera()).channels(&[aov])?));
            }
            let pairs = pairs(&job, &executor.describe(), &rendered);
            Ok((rendered.image, layers, pairs))
        });
        watch.done(done)
    })?;
    let size = [image.width, image.height];
    Ok((array::of_image(py, image)?, array::of_layers(py, layers, size)?, pairs))
}

fn aov(name: &str) -> PyResult<Aov> {
    Aov::read(name).ok_or_else(|| refused(format!("there is no layer {name:?}; there are: {}", Aov::expected())))
}

/// Explains a pixel: lines to read, and the same as JSON.
#[pyfunction]
fn explain(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    request: Request,
    pixel: [u32; 2],
    sample: u32,
    device: &Bound<'_, Device>,
) -> PyResult<(String, String)> {
    let (scene, device) = (scene.get(), device.get());
    py.detach(|| {
        let Job { scene, buffers, mut render } = request.job(scene)?;
        if render.technique.about().repeats == Repeats::Samples {
            render.count = 1;
        }
        let [x, y] = pixel;
        let place = Place { x, y, sample };
        let explained = place.check(&render).and_then(|()| {
            render.technique.inspect().check_explained(&buffers, &render)?;
            let subject = Subject { scene: &scene, buffers: &buffers, render: &render, place };
            device.with(|executor| render.technique.inspect().explain(executor, subject))
        });
        let explanation = explained.map_err(refused)?;
        Ok((explanation.text, explanation.json.to_string()))
    })
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(render, module)?)?;
    module.add_function(wrap_pyfunction!(explain, module)?)
}
