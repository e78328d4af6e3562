//! `cargo lab parity`: every kernel, case and flavour on every adapter against the native twin, as a table.

use clap::Args;
use restir_host::Shaders;
use restir_host::exec::gpu::{AdapterInfo, adapters, takes_passthrough};
use restir_host::exec::{Flavour, GpuExecutor};
use restir_kernels::{Case, all};
use restir_tests::cases;
use restir_tests::parity::{Outcome, compare};

use crate::Error;
use xtask::shader::flavour;

const NO_ADAPTER: &str = "no GPU adapter; install a Vulkan driver, for example Mesa's lavapipe";

/// Options of `cargo lab parity`.
#[derive(Args)]
pub struct Options {
    /// Part of the name of the adapters to test, in any case; all if not given.
    #[arg(long)]
    adapter: Option<String>,
    /// Name of the kernel to test; all if not given.
    #[arg(long)]
    kernel: Option<String>,
    /// Part of the name of the cases to test.
    #[arg(long, default_value = "")]
    case: String,
    /// The flavour to test; both if not given.
    #[arg(long, value_parser = flavour::parser())]
    flavour: Option<Flavour>,
}

/// A line of the table.
struct Row {
    flavour: Flavour,
    case: &'static Case,
}

/// What the table says about a [`Row`].
enum Finding {
    Compared(Outcome),
    /// The adapter does not run the case; that is a failure.
    Broken(String),
    /// There is nothing to run the case on, or the adapter cannot have the flavour.
    Skipped(String),
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Compared(outcome) if outcome.is_exact() => f.write_str("exact"),
            Self::Compared(Outcome { poisoned: 0, max_ulp, differing, words, .. }) => {
                write!(f, "approximate ({max_ulp} ulp, {differing} of {words} words)")
            }
            Self::Compared(Outcome { poisoned, words, .. }) => {
                write!(f, "incomplete ({poisoned} of {words} words not written)")
            }
            Self::Broken(reason) => write!(f, "failed ({reason})"),
            Self::Skipped(reason) => write!(f, "skipped ({reason})"),
        }
    }
}

impl Finding {
    /// `offered`: whether the adapter can have the flavour at all.
    fn of(result: Result<Outcome, restir_host::Error>, offered: bool) -> Self {
        let refused = if offered { Self::Broken } else { Self::Skipped };
        result.map_or_else(|error| refused(error.to_string()), Self::Compared)
    }

    /// Every word must have been written, and those of `exact` are the host's.
    fn fails(&self, flavour: Flavour) -> bool {
        match self {
            Self::Compared(outcome) => outcome.poisoned > 0 || flavour == Flavour::Exact && !outcome.is_exact(),
            Self::Broken(_) => true,
            Self::Skipped(_) => false,
        }
    }
}

/// Prints the table.
///
/// # Errors
/// [`Error::Failed`] if a case of the flavour exact is not exact, or a case of either flavour does not load or leaves
/// words unwritten; [`Error::Environment`] if there is nothing to test or no adapter to test on.
pub fn run(options: &Options) -> Result<(), Error> {
    let rows = rows(options)?;
    let adapters = chosen(options)?;
    if adapters.is_empty() {
        print_table(&rows, |_| Finding::Skipped(NO_ADAPTER.to_owned()));
        return Err(Error::Environment(NO_ADAPTER.to_owned()));
    }
    let failures: usize = adapters.iter().map(|adapter| on(adapter, &rows)).sum();
    if failures == 0 {
        return Ok(());
    }
    Err(Error::Failed(format!(
        "{failures} cases failed: they do not run, are incomplete, or are of the flavour exact and differ from the host"
    )))
}

fn rows(options: &Options) -> Result<Vec<Row>, Error> {
    let flavours = options.flavour.map_or(Flavour::ALL.to_vec(), |flavour| vec![flavour]);
    let mut rows = Vec::new();
    for kernel in all().into_iter().filter(|kernel| options.kernel.as_ref().is_none_or(|name| name == kernel.name)) {
        let cases = cases::of_kernel(kernel).map_err(Error::Failed)?;
        for case in cases.into_iter().filter(|case| case.name.contains(&options.case)) {
            rows.extend(flavours.iter().map(|&flavour| Row { flavour, case }));
        }
    }
    if rows.is_empty() {
        let names = all().iter().map(|kernel| kernel.name).collect::<Vec<_>>().join(", ");
        return Err(Error::Environment(format!("no case has that kernel and that name: the kernels are {names}")));
    }
    Ok(rows)
}

/// The adapters that the options name.
fn chosen(options: &Options) -> Result<Vec<AdapterInfo>, Error> {
    let wanted = options.adapter.as_deref().unwrap_or_default().to_lowercase();
    let (chosen, others): (Vec<_>, Vec<_>) =
        adapters().into_iter().partition(|adapter| adapter.name.to_lowercase().contains(&wanted));
    if chosen.is_empty() && !others.is_empty() {
        let names: Vec<String> = others.into_iter().map(|adapter| adapter.name).collect();
        let names = names.join(", ");
        return Err(Error::Environment(format!("no adapter has {wanted:?} in its name; there are: {names}")));
    }
    Ok(chosen)
}

/// Prints the table of an adapter and gives the number of its failures.
fn on(adapter: &AdapterInfo, rows: &[Row]) -> usize {
    println!("{} ({}, {})", adapter.name, adapter.backend, adapter.driver);
    let base = match GpuExecutor::builder().adapter(adapter.name.as_str()).flavour(Flavour::Fast).open() {
        Ok(base) => base,
        Err(error) => {
            print_table(rows, |_| Finding::Broken(error.to_string()));
            return rows.len();
        }
    };
    let offers_exact = takes_passthrough(base.device());
    let mut executors = Flavour::ALL.map(|flavour| base.reload(flavour, Shaders::Embedded));
    for executor in &executors {
        println!("{}", executor.loading());
    }
    let mut failures = 0;
    print_table(rows, |row| {
        let executor = &mut executors[row.flavour as usize];
        let offered = row.flavour == Flavour::Fast || offers_exact;
        let finding = Finding::of(compare(executor, row.case), offered);
        failures += usize::from(finding.fails(row.flavour));
        finding
    });
    failures
}

/// Prints a line a row, as they come.
fn print_table(rows: &[Row], mut finding: impl FnMut(&Row) -> Finding) {
    let width = |text: fn(&Row) -> &str| rows.iter().map(|row| text(row).len()).fold("kernel".len(), usize::max);
    let (kernel, case) = (width(|row| row.case.kernel.name), width(|row| &row.case.name));
    println!("{:<kernel$}  {:<case$}  {:<7}  result", "kernel", "case", "flavour");
    for row in rows {
        let finding = finding(row);
        println!("{:<kernel$}  {:<case$}  {:<7}  {finding}", row.case.kernel.name, row.case.name, row.flavour);
    }
    println!();
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_host::error::AdapterError;

    fn error() -> restir_host::Error {
        restir_host::Error::Adapter(AdapterError::Lost("no passthrough".into()))
    }

    #[test]
    fn words_not_written_and_rejected_modules_fail_in_both_flavours() {
        let outcome =
            |differing, poisoned| Finding::Compared(Outcome { words: 4, differing, poisoned, ..Outcome::default() });
        let rejected = Finding::of(Err(error()), true);
        for flavour in Flavour::ALL {
            assert!(outcome(0, 1).fails(flavour));
            assert!(rejected.fails(flavour));
            assert!(!outcome(0, 0).fails(flavour));
        }
        assert!(outcome(1, 0).fails(Flavour::Exact));
        assert!(!outcome(1, 0).fails(Flavour::Fast));
    }

    #[test]
    fn an_adapter_without_exact_is_skipped_with_the_reason() {
        let refused = Finding::of(Err(error()), false);
        assert!(!refused.fails(Flavour::Exact));
        assert_eq!(refused.to_string(), format!("skipped ({})", error()));
    }
}
