//! The native half of the Python package `restir`: what it exports is wrapped by `python/restir/__init__.py`, which has the
//! documentation for users.

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

mod about;
mod array;
mod device;
mod part;
mod render;
mod scene;
mod session;
mod watch;

create_exception!(
    restir,
    RestirError,
    PyException,
    "What cannot be done: one sentence that says what, where and what to do."
);

/// The sentence of an error of the library.
fn refused(error: impl std::fmt::Display) -> PyErr {
    RestirError::new_err(error.to_string())
}

#[pymodule]
fn _restir(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("RestirError", module.py().get_type::<RestirError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<device::Device>()?;
    module.add_class::<session::Session>()?;
    about::add(module)?;
    array::add(module)?;
    part::add(module)?;
    render::add(module)
}
