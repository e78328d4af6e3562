//! Every kernel, case, adapter and flavour against the native twin.
//!
//! `exact` must give the host's words; where it cannot be loaded by passthrough it is refused. `fast` makes no claim
//! about bits, but it must load, write every word, and give most elements as the host does but for rounding: its random numbers are
//! the host's, so that only where a rounding turns a decision may a pixel become another one.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::Error;
use restir_host::Shaders;
use restir_host::exec::{CpuExecutor, Description, Executor, Flavour, GpuExecutor, Observer};
use restir_host::plan::FramePlan;
use restir_kernels::path::path;
use restir_kernels::{Case, KernelDesc, all};
use restir_tests::cases;
use restir_tests::device::{self, Adapter};
use restir_tests::parity::{Outcome, compare};
use restir_tests::suite::ensure;
use std::process::ExitCode;

/// The share of a buffer's elements that other roundings may change for good. Most by far is measured where a hash of a ray's bits
/// decides whether it passes a blended surface: a fifth.
const MOST_FAR: f64 = 0.25;
/// Kernels that ask single functions at the ends of their ranges, where `fast` promises nothing.
const PROBES: [&str; 5] = ["self_check", "num_probe", "sampler_check", "bsdf_check", "diffusion_check"];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let mut trials = vec![Trial::test("a kernel without cases fails", kernel_without_cases)];
    trials.push(Trial::test("a fast kernel with arbitrary values fails", arbitrary_values_are_refused));
    for kernel in all() {
        trials.push(Trial::test(format!("{}: has cases", kernel.name), || {
            cases::of_kernel(kernel).map(drop).map_err(Failed::from)
        }));
    }
    trials.extend(device::trials("parity", on));
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn kernel_without_cases() -> Result<(), Failed> {
    let untested = KernelDesc { name: "untested", ..path::DESC };
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
    let outcome = compare(&mut executor.reload(Flavour::Fast, Shaders::Embedded), case)?;
    ensure(outcome.words > 0 && outcome.poisoned == 0, || outcome.to_string())?;
    ensure(passes_as_fast(case, &outcome), || format!("{} of {} elements are far", outcome.far, outcome.elements))
}

fn passes_as_fast(case: &Case, outcome: &Outcome) -> bool {
    PROBES.contains(&case.kernel.name) || outcome.far_share() <= MOST_FAR
}

/// The host, but for every other element of what it gives.
struct HalfRight(CpuExecutor);

impl Executor for HalfRight {
    fn describe(&self) -> Description {
        self.0.describe()
    }

    fn run(&mut self, plan: FramePlan<'_>, observe: &mut Observer<'_>) -> Result<Vec<Vec<u32>>, Error> {
        let mut outputs = self.0.run(plan, observe)?;
        outputs.iter_mut().flat_map(|words| words.chunks_mut(8)).for_each(|words| words[..4].fill(0x3f80_0000));
        Ok(outputs)
    }
}

/// Ones in the place of every other pixel do not pass for another rounding, in any case whose elements are pixels.
fn arbitrary_values_are_refused() -> Result<(), Failed> {
    let is_picture = |case: &&Case| case.kernel.name == path::DESC.name && case.grid[0] * case.grid[1] > 16;
    let cases: Vec<&Case> = cases::all().iter().filter(is_picture).collect();
    ensure(cases.len() > 10, || format!("only {} pictures", cases.len()))?;
    for case in cases {
        let outcome = compare(&mut HalfRight(CpuExecutor::inline()), case)?;
        ensure(!passes_as_fast(case, &outcome), || {
            format!("{}: {} of {} are far", case.name, outcome.far, outcome.elements)
        })?;
    }
    Ok(())
}
