//! Where renders run.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use restir::Error;
use restir::exec::gpu::{GpuExecutor, adapters};
use restir::exec::{CpuExecutor, Executor, Flavour};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};

use crate::refused;

/// A GPU works on one render at a time; on the CPU each has its own executor.
enum Kind {
    Cpu(Option<usize>),
    Gpu(Gpu),
}

/// An executor, and the thread for which it works.
struct Gpu {
    executor: Mutex<GpuExecutor>,
    works_for: Mutex<Option<ThreadId>>,
}

impl Gpu {
    fn with<T>(&self, work: impl FnOnce(&mut dyn Executor) -> Result<T, Error>) -> Result<T, Error> {
        let works_for = || self.works_for.lock().unwrap_or_else(PoisonError::into_inner);
        let this = Some(thread::current().id());
        if *works_for() == this {
            let problem = "the device works for this thread already; what is called while it does cannot render on it";
            return Err(Error::Setting(problem.to_owned()));
        }
        let mut executor = self.executor.lock().unwrap_or_else(PoisonError::into_inner);
        *works_for() = this;
        let done = work(&mut *executor);
        *works_for() = None;
        done
    }
}

/// A CPU or an opened GPU.
#[pyclass(frozen, module = "restir")]
pub(crate) struct Device {
    kind: Arc<Kind>,
    name: String,
}

#[pymethods]
impl Device {
    #[new]
    #[pyo3(signature = (name="cpu", *, adapter=None, flavour="exact", threads=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        adapter: Option<String>,
        flavour: &str,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        match name {
            "cpu" if adapter.is_some() => Err(refused("an adapter is a GPU; give Device(\"gpu\", adapter=...)")),
            "cpu" => Ok(Self { kind: Arc::new(Kind::Cpu(threads)), name: "cpu".to_owned() }),
            "gpu" => {
                let flavour = match flavour {
                    "exact" => Flavour::Exact,
                    "fast" => Flavour::Fast,
                    other => return Err(refused(format!("there is no flavour {other:?}; there are: exact, fast"))),
                };
                let open = || GpuExecutor::builder().adapter(adapter.as_deref()).flavour(flavour).open();
                let executor = py.detach(open).map_err(refused)?;
                let name = executor.describe().adapter.unwrap_or_default();
                let gpu = Gpu { executor: Mutex::new(executor), works_for: Mutex::new(None) };
                Ok(Self { kind: Arc::new(Kind::Gpu(gpu)), name })
            }
            other => Err(refused(format!("there is no device {other:?}; there are: cpu, gpu"))),
        }
    }

    /// What it is called.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    fn __repr__(&self) -> String {
        format!("restir.Device({:?})", self.name)
    }
}

impl Device {
    /// Works on the device; without the interpreter.
    pub(crate) fn with<T>(&self, work: impl FnOnce(&mut dyn Executor) -> Result<T, Error>) -> Result<T, Error> {
        match &*self.kind {
            Kind::Cpu(threads) => work(&mut cpu(*threads)?),
            Kind::Gpu(gpu) => gpu.with(work),
        }
    }

    /// An executor of the CPU, if that is it.
    pub(crate) fn cpu(&self) -> Option<Result<CpuExecutor, Error>> {
        match &*self.kind {
            Kind::Cpu(threads) => Some(cpu(*threads)),
            Kind::Gpu(_) => None,
        }
    }
}

fn cpu(threads: Option<usize>) -> Result<CpuExecutor, Error> {
    threads.map_or_else(CpuExecutor::new, CpuExecutor::with_threads)
}

/// The adapters, hardware first.
#[pyfunction]
pub(crate) fn devices(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let found = py.detach(adapters);
    let described = found.into_iter().map(|adapter| {
        let dict = PyDict::new(py);
        dict.set_item("name", adapter.name)?;
        dict.set_item("backend", adapter.backend)?;
        dict.set_item("driver", adapter.driver)?;
        dict.set_item("kind", adapter.kind)?;
        Ok(dict)
    });
    described.collect()
}
