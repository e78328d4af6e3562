//! Every kernel, case, adapter and flavour against the native twin.
//!
//! `exact` must give the host's words; where it cannot be loaded by passthrough it is refused. `fast` makes no claim
//! about bits, but it must load and write every word.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::Shaders;
use restir_host::exec::{Flavour, GpuExecutor};
use restir_kernels::{Case, KernelDesc, all};
use restir_tests::device::{self, Adapter};
use restir_tests::parity::{cases, compare};
use restir_tests::suite::ensure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials = vec![Trial::test("a kernel without cases fails", kernel_without_cases)];
    for kernel in all() {
        trials
            .push(Trial::test(format!("{}: has cases", kernel.name), || cases(kernel).map(drop).map_err(Failed::from)));
    }
    trials.extend(device::trials("parity", on));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn kernel_without_cases() -> Result<(), Failed> {
    let untested = KernelDesc { cases: |_| Vec::new(), ..restir_kernels::path::path::DESC };
    match cases(&untested) {
        Err(message) if message.contains("no parity cases") => Ok(()),
        other => Err(format!("a kernel without cases was let through: {other:?}").into()),
    }
}

fn on(adapter: &Adapter) -> Vec<Trial> {
    let mut trials = Vec::new();
    for kernel in all() {
        for case in cases(kernel).unwrap_or_default() {
            let name = |flavour| format!("{} / {}: {flavour}", kernel.name, case.name);
            let same = case.clone();
            trials.push(adapter.trial(&name(Flavour::Fast), move |executor| fast(executor, kernel, &same)));
            trials.push(adapter.trial(&name(Flavour::Exact), move |executor| exact(executor, kernel, &case)));
        }
    }
    trials
}

fn exact(executor: &mut GpuExecutor, kernel: &'static KernelDesc, case: &Case) -> Result<(), Failed> {
    let outcome = compare(executor, kernel, case)?;
    if outcome.is_exact() {
        return Ok(());
    }
    let listed: Vec<String> = outcome.first.iter().map(ToString::to_string).collect();
    Err(format!("{outcome} ({})\n{}", executor.loading(), listed.join("\n")).into())
}

fn fast(executor: &mut GpuExecutor, kernel: &'static KernelDesc, case: &Case) -> Result<(), Failed> {
    let outcome = compare(&mut executor.reload(Flavour::Fast, Shaders::from_env()), kernel, case)?;
    ensure(outcome.words > 0 && outcome.poisoned == 0, || outcome.to_string())
}
