//! What a long call hears of Python: Ctrl-C, and who asked for its progress.

use pyo3::prelude::*;
use restir::Error;
use restir::render::Progress;
use std::time::{Duration, Instant};

use crate::refused;

/// How often Python is asked.
const EVERY: Duration = Duration::from_millis(50);

/// Watches over work that goes on without the interpreter.
pub(crate) struct Watch {
    /// Called with the share that is done, from 0 to 1.
    progress: Option<Py<PyAny>>,
    asked: Instant,
    raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, asked: Instant::now(), raised: None }
    }

    /// Ends the work where a signal or the callback raises something.
    pub(crate) fn see(&mut self, progress: Progress) -> Result<(), Error> {
        if self.asked.elapsed() < EVERY && progress.done < progress.total {
            return Ok(());
        }
        self.asked = Instant::now();
        let share = progress.done as f64 / progress.total.max(1) as f64;
        let asked = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map_or(Ok(()), |call| call.call1(py, (share,)).map(drop))
        });
        asked.map_err(|raised| {
            self.raised = Some(raised);
            Error::Interrupted
        })
    }

    /// The result, or what was raised meanwhile.
    pub(crate) fn done<T>(self, result: Result<T, Error>) -> PyResult<T> {
        match self.raised {
            Some(raised) => Err(raised),
            None => result.map_err(refused),
        }
    }
}
