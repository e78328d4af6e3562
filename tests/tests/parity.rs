//! Every kernel, case, adapter and flavour against the native twin.
//!
//! `exact` must give the host's words; where it cannot be loaded by passthrough it is refused. `fast` makes no claim
//! about bits, but it must load and write every word.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::Shaders;
use restir_host::exec::{Flavour, GpuExecutor};
use restir_kernels::{Case, KernelDesc, all};
use restir_tests::cases;
use restir_tests::device::{self, Adapter};
use restir_tests::parity::compare;
use restir_tests::suite::ensure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials = vec![Trial::test("a kernel without cases fails", kernel_without_cases)];
    for kernel in all() {
        trials.push(Trial::test(format!("{}: has cases", kernel.name), || {
            cases::of_kernel(kernel).map(drop).map_err(Failed::from)
        }));
    }
    trials.extend(device::trials("parity", on));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn kernel_without_cases() -> Result<(), Failed> {
    let untested = KernelDesc { name: "untested", ..restir_kernels::path::path::DESC };
    match cases::of_kernel(&untested) {
        Err(message) if message.contains("no parity cases") => Ok(()),
        other => Err(format!("a kernel without cases was let through: {other:?}").into()),
    }
}

fn on(adapter: &Adapter) -> Vec<Trial> {
    let mut trials = Vec::new();
    for case in cases::all() {
        let name = |flavour| format!("{} / {}: {flavour}", case.kernel.name, case.name);
        trials.push(adapter.trial(&name(Flavour::Fast), |executor| fast(executor, case)));
        trials.push(adapter.trial(&name(Flavour::Exact), |executor| exact(executor, case)));
    }
    trials
}

fn exact(executor: &mut GpuExecutor, case: &Case) -> Result<(), Failed> {
    let outcome = compare(executor, case)?;
    if outcome.is_exact() {
        return Ok(());
    }
    let listed: Vec<String> = outcome.first.iter().map(ToString::to_string).collect();
    Err(format!("{outcome} ({})\n{}", executor.loading(), listed.join("\n")).into())
}

fn fast(executor: &mut GpuExecutor, case: &Case) -> Result<(), Failed> {
    let outcome = compare(&mut executor.reload(Flavour::Fast, Shaders::from_env()), case)?;
    ensure(outcome.words > 0 && outcome.poisoned == 0, || outcome.to_string())
}
