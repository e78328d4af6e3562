//! Every kernel, case, adapter and flavour against the native twin.
//!
//! `exact` must give the host's words wherever it is loaded by passthrough. Without an adapter the device tests are
//! ignored, visibly; with `RESTIR_REQUIRE_GPU=1` they fail instead.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::exec::Flavour;
use restir_host::exec::gpu::{GpuExecutor, adapters};
use restir_kernels::{ALL, Case, KernelDesc};
use restir_tests::parity::{cases, compare};
use std::process::ExitCode;
use std::sync::{Arc, Mutex};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials = vec![Trial::test("a kernel without cases fails", kernel_without_cases)];
    for kernel in ALL {
        trials.push(Trial::test(format!("{}: has cases", kernel.name), || {
            cases(kernel).map(drop).map_err(Failed::from)
        }));
    }
    let adapters = adapters();
    let required = std::env::var_os("RESTIR_REQUIRE_GPU").is_some();
    if adapters.is_empty() {
        let trial = Trial::test(
            "parity: no GPU adapter; install a Vulkan driver, for example Mesa's lavapipe",
            || Err("RESTIR_REQUIRE_GPU is set and there is no adapter".into()),
        );
        trials.push(trial.with_ignored_flag(!required));
    }
    for adapter in adapters {
        trials.extend(device_trials(&adapter.name));
    }
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn kernel_without_cases() -> Result<(), Failed> {
    let untested = KernelDesc {
        cases: |_| Vec::new(),
        ..restir_kernels::path::DESC
    };
    match cases(&untested) {
        Err(message) if message.contains("no parity cases") => Ok(()),
        other => Err(format!("a kernel without cases was let through: {other:?}").into()),
    }
}

/// One executor an adapter, opened by the first test that needs it.
type Shared = Arc<Mutex<Option<GpuExecutor>>>;

fn device_trials(adapter: &str) -> Vec<Trial> {
    let shared = Shared::default();
    let mut trials = Vec::new();
    for kernel in ALL {
        for case in cases(kernel).unwrap_or_default() {
            let name = format!("{adapter}: {} / {}: exact", kernel.name, case.name);
            let (shared, adapter) = (shared.clone(), adapter.to_owned());
            trials.push(Trial::test(name, move || exact(&shared, &adapter, kernel, &case)));
        }
    }
    trials
}

fn exact(shared: &Shared, adapter: &str, kernel: &'static KernelDesc, case: &Case) -> Result<(), Failed> {
    let mut guard = shared.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if guard.is_none() {
        *guard = Some(GpuExecutor::open(Some(adapter), Flavour::Exact)?);
    }
    let Some(executor) = guard.as_mut() else {
        return Err("the adapter is gone".into());
    };
    let outcome = compare(executor, kernel, case)?;
    if outcome.is_exact() {
        return Ok(());
    }
    let listed: Vec<String> = outcome.first.iter().map(ToString::to_string).collect();
    Err(format!("{outcome} ({})\n{}", executor.loading(), listed.join("\n")).into())
}
