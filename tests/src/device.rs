//! Tests that need a GPU: each runs on every adapter. Without an adapter a suite has one test that says so: it is
//! ignored, visibly; with `RESTIR_REQUIRE_GPU` set ([`required`]) it fails.
//!
//! Adapters are opened by name. Of adapters with the same name (two equal cards, or a card under two backends) the first
//! is tested, once: it would answer for each of them.

use crate::suite::Trial;
use libtest_mimic::Failed;
use restir_host::exec::Executor;
use restir_host::exec::gpu::{GpuExecutor, adapters};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An adapter, with the executors of the exact flavour that no test uses now. There are as many as tests have run at once.
#[derive(Clone)]
pub struct Adapter {
    name: String,
    idle: Arc<Mutex<Vec<GpuExecutor>>>,
}

impl Adapter {
    /// The name by which it is opened.
    pub fn name(&self) -> &str {
        &self.name
    }

    fn idle(&self) -> MutexGuard<'_, Vec<GpuExecutor>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A test on this adapter, named after both, with an executor that no other test uses meanwhile.
    pub fn trial(
        &self,
        name: &str,
        test: impl FnOnce(&mut GpuExecutor) -> Result<(), Failed> + Send + 'static,
    ) -> Trial {
        let adapter = self.clone();
        Trial::test(format!("{}: {name}", self.name), move || {
            let idle = adapter.idle().pop();
            let mut executor = idle.map_or_else(|| GpuExecutor::builder().adapter(adapter.name.as_str()).open(), Ok)?;
            let result = test(&mut executor);
            adapter.idle().push(executor);
            result
        })
    }
}

/// Whether tests without an adapter fail: `RESTIR_REQUIRE_GPU` is set to anything but nothing or 0.
pub fn required() -> bool {
    std::env::var_os("RESTIR_REQUIRE_GPU").is_some_and(|value| !value.is_empty() && value != "0")
}

/// The tests on every adapter.
pub fn trials(on: impl Fn(&Adapter) -> Vec<Trial>) -> Vec<Trial> {
    let names: BTreeSet<String> = adapters().into_iter().map(|adapter| adapter.name).collect();
    if names.is_empty() {
        let name = "no GPU adapter; install a Vulkan driver, for example Mesa's lavapipe";
        let trial = Trial::test(name, || Err("RESTIR_REQUIRE_GPU is set and there is no adapter".into()));
        return vec![trial.with_ignored_flag(!required())];
    }
    names.into_iter().flat_map(|name| on(&Adapter { name, idle: Arc::default() })).collect()
}

/// Name and driver of an executor's adapter.
pub fn label(executor: &dyn Executor) -> String {
    executor.describe().adapter.unwrap_or_else(|| "CPU".to_owned())
}

/// Whether the adapter is lavapipe's, which contracts and folds whatever it may and ends long loops.
pub fn is_llvmpipe(executor: &dyn Executor) -> bool {
    label(executor).contains("llvmpipe")
}
