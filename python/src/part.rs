//! Parts of an image.

use pyo3::prelude::*;
use restir::advanced::part::{Part, PartFile, Portion, Tile, Unit, merge, noise};
use std::path::PathBuf;

use crate::render::{Job, Request};
use crate::scene::Scene;
use crate::watch::Watch;
use crate::{array, device::Device, refused};

fn unit_of(name: &str) -> PyResult<Unit> {
    let units = [Unit::Samples, Unit::Chains, Unit::Frames];
    let found = units.into_iter().find(|unit| unit.name() == name);
    found.ok_or_else(|| refused(format!("parts are of samples, chains or frames, not of {name:?}")))
}

/// Renders a part to a file.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they have names in Python")]
fn render_part(
    py: Python<'_>,
    path: PathBuf,
    scene: &Bound<'_, Scene>,
    request: Request,
    unit: &str,
    range: (u32, u32),
    tile: Option<(u32, u32, u32, u32)>,
    device: &Bound<'_, Device>,
    progress: Option<Py<PyAny>>,
) -> PyResult<()> {
    let tile = tile.map(|(x, y, width, height)| Tile { x, y, width, height });
    let portion = Portion { unit: unit_of(unit)?, range: range.0..range.1, tile };
    let (scene, device) = (scene.get(), device.get());
    py.detach(|| {
        let Job { scene, buffers, render } = request.job(scene)?;
        let mut watch = Watch::new(progress);
        let done = device.with(|executor| {
            let part = Part::render(executor, &buffers, &render, &portion, &mut |progress| watch.see(progress))?;
            let technique = render.technique.as_ref();
            let notes = [("scene", scene.name), ("technique", technique.about().name.to_owned())];
            let settings = technique.entries().into_iter().map(|entry| (entry.key, entry.value));
            let notes = notes.into_iter().chain(settings).map(|(key, value)| (key.to_owned(), value));
            part.with_notes(notes.collect()).write(&path)
        });
        watch.done(done)
    })
}

#[pyfunction]
fn merge_parts(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<array::Color<'_>> {
    let merged = py.detach(|| {
        let parts = open(&paths)?;
        let notes = parts.first().map(|part| part.header().notes.clone()).unwrap_or_default();
        Ok::<_, restir::Error>((merge(&parts)?, notes))
    });
    let (merged, notes) = merged.map_err(refused)?;
    let own = [
        (merged.unit.name(), merged.count.to_string()),
        ("merged_parts", paths.len().to_string()),
        ("dispatches", merged.dispatches.to_string()),
        ("dropped_samples", merged.dropped_samples.to_string()),
    ];
    let own = own.map(|(key, value)| (key.to_owned(), value));
    let mut pairs: Vec<_> = notes.into_iter().filter(|(key, _)| !own.iter().any(|(own, _)| own == key)).collect();
    pairs.extend(own);
    Ok((array::of_image(py, merged.image)?, pairs))
}

/// The noise of the mean, and how many samples or chains it has.
#[pyfunction]
fn noise_of_parts(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<(f64, u32)> {
    let noise = py.detach(|| noise(&open(&paths)?)).map_err(refused)?;
    Ok((noise.relative, noise.count))
}

fn open(paths: &[PathBuf]) -> Result<Vec<PartFile>, restir::Error> {
    paths.iter().map(|path| PartFile::open(path)).collect()
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(render_part, module)?)?;
    module.add_function(wrap_pyfunction!(merge_parts, module)?)?;
    module.add_function(wrap_pyfunction!(noise_of_parts, module)?)
}
