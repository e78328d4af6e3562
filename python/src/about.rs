//! What there is: techniques, settings, scenes; and how far images differ.

use numpy::PyReadonlyArray3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use restir::advanced::metrics;
use restir::scene::builtin;
use restir::technique;

use crate::{array, device, refused};

/// Names of the techniques, and what each does.
#[pyfunction]
fn techniques() -> Vec<(&'static str, &'static str, &'static str)> {
    let all = technique::all().into_iter().map(|technique| *technique.about());
    all.map(|about| (about.name, about.repeats.name(), about.summary)).collect()
}

/// The settings of a technique: key, value, what it may be, what it does.
#[pyfunction]
fn settings(name: &str) -> PyResult<Vec<(&'static str, String, String, String)>> {
    let entries = technique::named(name).map_err(refused)?.entries();
    Ok(entries.into_iter().map(|entry| (entry.key, entry.value, entry.expected, entry.doc)).collect())
}

/// The names of its presets.
#[pyfunction]
fn presets(name: &str) -> PyResult<Vec<&'static str>> {
    Ok(technique::named(name).map_err(refused)?.presets().into_iter().map(|(name, _)| name).collect())
}

/// Why the mean of its images may be wrong.
#[pyfunction]
fn biases(name: &str, settings: Vec<String>) -> PyResult<Vec<&'static str>> {
    Ok(crate::render::technique_of(name, &settings).map_err(refused)?.biases())
}

/// The built-in scenes, and what each shows.
#[pyfunction]
fn scenes() -> Vec<(&'static str, &'static str)> {
    builtin::NAMES.to_vec()
}

/// How far an image is from a reference.
#[pyfunction]
fn compare<'py>(
    py: Python<'py>,
    test: PyReadonlyArray3<'py, f32>,
    reference: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyDict>> {
    let comparison = metrics::compare(&array::image(&test)?, &array::image(&reference)?).map_err(refused)?;
    let dict = PyDict::new(py);
    dict.set_item("identical", comparison.identical)?;
    dict.set_item("differing_words", comparison.differing_words)?;
    dict.set_item("max_ulp", comparison.max_ulp)?;
    dict.set_item("rmse", comparison.rmse)?;
    dict.set_item("rel_mse", comparison.rel_mse)?;
    dict.set_item("rmae", comparison.rmae)?;
    dict.set_item("rmae_global", comparison.rmae_global)?;
    dict.set_item("mean_ratio", comparison.mean_ratio)?;
    Ok(dict)
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(techniques, module)?)?;
    module.add_function(wrap_pyfunction!(settings, module)?)?;
    module.add_function(wrap_pyfunction!(presets, module)?)?;
    module.add_function(wrap_pyfunction!(biases, module)?)?;
    module.add_function(wrap_pyfunction!(scenes, module)?)?;
    module.add_function(wrap_pyfunction!(compare, module)?)?;
    module.add_function(wrap_pyfunction!(device::devices, module)?)
}
