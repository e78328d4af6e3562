//! The commands of the laboratory, run as one runs them.

#[path = "../../../host/program/tests/program/adapter.rs"]
mod adapter;
mod bench;
#[cfg(unix)]
#[path = "../../../host/program/tests/program/child.rs"]
#[allow(dead_code, reason = "the suite of the program uses the rest")]
mod child;
mod device;
mod figure;
#[cfg(unix)]
mod interrupt;
#[path = "../../../host/program/tests/program/support.rs"]
#[allow(dead_code, reason = "the suite of the program uses the rest")]
mod support;

/// The program.
const PROGRAM: &str = env!("CARGO_BIN_EXE_lab");

/// The text of an output.
fn read(workplace: &support::Workplace, name: &str) -> String {
    std::fs::read_to_string(workplace.output(name)).unwrap()
}
