//! Images as arrays, without a copy where memory changes hands; and files of them.

use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use restir::image::{Channel, Image, read_exr, read_exr_metadata, write_exr, write_png};
use std::path::PathBuf;

use crate::refused;

/// (height, width, 3), in the memory that the image had.
pub(crate) fn of_image(py: Python<'_>, image: Image) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let shape = [image.height as usize, image.width as usize, 3];
    image.pixels.into_flattened().into_pyarray(py).reshape(shape)
}

/// The layers by name: (height, width) of a single channel, and (height, width, channels) of several.
pub(crate) fn of_layers<'py>(
    py: Python<'py>,
    layers: Vec<(&'static str, Vec<Channel>)>,
    [width, height]: [u32; 2],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, mut channels) in layers {
        let (mut shape, pixels) = (vec![height as usize, width as usize], width as usize * height as usize);
        let values = if channels.len() == 1 {
            channels.remove(0).values
        } else {
            shape.push(channels.len());
            (0..pixels).flat_map(|at| channels.iter().map(move |channel| channel.values[at])).collect()
        };
        dict.set_item(name, values.into_pyarray(py).reshape(shape)?)?;
    }
    Ok(dict)
}

/// An image of an array (height, width, 3).
pub(crate) fn image(array: &PyReadonlyArray3<'_, f32>) -> PyResult<Image> {
    let view = array.as_array();
    let &[height, width, channels] = view.shape() else { return Err(refused("an image has three dimensions")) };
    if channels != 3 {
        return Err(refused(format!(
            "an image has 3 channels, and this array has {channels}; give (height, width, 3)"
        )));
    }
    let values: Vec<f32> = view.iter().copied().collect();
    let pixels = values.as_chunks::<3>().0.to_vec();
    let side = |side: usize| u32::try_from(side).map_err(refused);
    Ok(Image { width: side(width)?, height: side(height)?, pixels })
}

/// The colour of an image, and pairs that say how it was made.
pub(crate) type Color<'py> = (Bound<'py, PyArray3<f32>>, Vec<(String, String)>);

#[pyfunction]
#[pyo3(name = "read_exr")]
fn read(py: Python<'_>, path: PathBuf) -> PyResult<Color<'_>> {
    let read = py.detach(|| Ok::<_, restir::Error>((read_exr(&path)?, read_exr_metadata(&path)?)));
    let (image, metadata) = read.map_err(refused)?;
    Ok((of_image(py, image)?, metadata))
}

#[pyfunction]
#[pyo3(name = "write_image")]
fn write(path: PathBuf, color: PyReadonlyArray3<'_, f32>, metadata: Vec<(String, String)>) -> PyResult<()> {
    let image = image(&color)?;
    let ends_in = |ending: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending));
    match (ends_in("exr"), ends_in("png")) {
        (true, _) => write_exr(&path, &image, &metadata).map_err(refused),
        (_, true) => write_png(&path, &image).map_err(refused),
        _ => Err(refused(format!("an image is written to an .exr or a .png file, not to {}", path.display()))),
    }
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(write, module)?)
}
