//! Frame after frame of a scene that may be edited.

use numpy::PyArray3;
use pyo3::prelude::*;
use restir::buffers::SceneBuffers;
use restir::denoise::Denoise;
use restir::session::{CpuSession, History, SceneChange, Setup, View};
use std::sync::{Mutex, PoisonError};

use crate::render::technique_of;
use crate::scene::{CameraTuple, Scene, camera_of};
use crate::{array, device::Device, refused};

/// A session on the CPU.
#[pyclass(frozen, module = "restir")]
pub(crate) struct Session(Mutex<CpuSession>);

#[pymethods]
impl Session {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, Scene>,
        technique: &str,
        settings: Vec<String>,
        size: [u32; 2],
        seed: u32,
        samples: u32,
        mean_of: Option<u32>,
        denoise: bool,
        device: &Bound<'_, Device>,
    ) -> PyResult<Self> {
        let cpu = device.get().cpu();
        let cpu =
            cpu.ok_or_else(|| refused("sessions of Python run on the CPU; give device=\"cpu\""))?.map_err(refused)?;
        let scene = scene.get();
        let session = py.detach(|| {
            let scene = scene.snapshot()?.framed(size);
            let technique = technique_of(technique, &settings)?;
            let denoise = denoise.then(Denoise::default);
            let setup = Setup::new(SceneBuffers::build_editable(&scene)?, technique, size);
            CpuSession::new(Setup { seed, samples, mean_of, denoise, ..setup }, cpu)
        });
        Ok(Self(Mutex::new(session.map_err(refused)?)))
    }

    /// The next frame, and what became of earlier ones: "new", "kept", or what has changed.
    #[pyo3(signature = (camera=None, frame=None, scene=None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: Option<CameraTuple>,
        frame: Option<f64>,
        scene: Option<&Bound<'py, Scene>>,
    ) -> PyResult<(Bound<'py, PyArray3<f32>>, String)> {
        let camera = camera.map(camera_of).transpose()?;
        let scene = scene.map(Bound::get);
        let (image, history) = py.detach(|| {
            let mut session = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let edited = scene.map(Scene::snapshot).transpose().map_err(refused)?;
            let edited = edited.map(|snapshot| snapshot.framed(session.setup().size));
            let change = match (&edited, frame) {
                (Some(_), Some(_)) => return Err(refused("an edited scene has no frame; give scene or frame")),
                (Some(scene), None) => SceneChange::Edited(scene),
                (None, Some(frame)) => SceneChange::Frame(frame),
                (None, None) => SceneChange::None,
            };
            let origin = session.setup().scene.origin();
            let camera = camera.map(|camera| camera.moved(-origin));
            let begun = session.frame(&View { camera, scene: change, ..View::default() }).map_err(refused)?;
            let history = match begun.history {
                History::New => "new",
                History::Lost(why) => why,
                _ => "kept",
            };
            Ok((session.image(), history.to_owned()))
        })?;
        Ok((array::of_image(py, image)?, history))
    }

    /// How many frames there were since the history began.
    #[getter]
    fn frames(&self) -> u32 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).frames()
    }

    /// Forgets earlier frames.
    fn reset(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).reset();
    }
}
