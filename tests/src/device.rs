//! Tests that need a GPU: each runs on every adapter. Without an adapter a suite has one test that says so: it is
//! ignored, visibly; with `RESTIR_REQUIRE_GPU=1` it fails.

use libtest_mimic::{Failed, Trial};
use restir_host::exec::gpu::{GpuExecutor, adapters};
use restir_host::exec::{Executor, Flavour};
use std::sync::{Arc, Mutex, PoisonError};

/// An adapter, with an executor of the exact flavour that the first test which needs it opens.
#[derive(Clone)]
pub struct Adapter {
    name: String,
    executor: Arc<Mutex<Option<GpuExecutor>>>,
}

impl Adapter {
    fn new(name: String) -> Self {
        Self {
            name,
            executor: Arc::default(),
        }
    }

    /// The adapter's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Runs `work` on the executor, which no other test uses meanwhile.
    ///
    /// # Errors
    /// What `work` reports, and why the adapter cannot be opened.
    pub fn with<T>(&self, work: impl FnOnce(&mut GpuExecutor) -> Result<T, Failed>) -> Result<T, Failed> {
        let mut guard = self.executor.lock().unwrap_or_else(PoisonError::into_inner);
        let executor = match guard.take() {
            Some(executor) => executor,
            None => GpuExecutor::open(Some(&self.name), Flavour::Exact)?,
        };
        work(guard.insert(executor))
    }

    /// A test on this adapter, named after both.
    pub fn trial(
        &self,
        name: &str,
        test: impl FnOnce(&mut GpuExecutor) -> Result<(), Failed> + Send + 'static,
    ) -> Trial {
        let adapter = self.clone();
        Trial::test(format!("{}: {name}", self.name), move || adapter.with(test))
    }
}

/// Whether tests without an adapter fail.
pub fn is_required() -> bool {
    std::env::var("RESTIR_REQUIRE_GPU").is_ok_and(|value| value == "1")
}

/// The tests of `suite` on every adapter.
pub fn trials(suite: &str, on: impl Fn(&Adapter) -> Vec<Trial>) -> Vec<Trial> {
    let adapters = adapters();
    if adapters.is_empty() {
        let name = format!("{suite}: no GPU adapter; install a Vulkan driver, for example Mesa's lavapipe");
        let trial = Trial::test(name, || Err("RESTIR_REQUIRE_GPU is 1 and there is no adapter".into()));
        return vec![trial.with_ignored_flag(!is_required())];
    }
    adapters
        .into_iter()
        .flat_map(|adapter| on(&Adapter::new(adapter.name)))
        .collect()
}

/// Name and driver of an executor's adapter.
pub fn label(executor: &dyn Executor) -> String {
    executor.describe().adapter.unwrap_or_else(|| "CPU".to_owned())
}
