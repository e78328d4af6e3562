//! Ctrl-C during a benchmark.

use crate::child::interrupt;
use crate::support::{Workplace, program};

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn an_interrupted_benchmark_leaves_no_file() {
    let (workplace, cache) = (Workplace::new(), tempfile::tempdir().unwrap());
    let mut command = program(["bench", "cornell", "--device", "cpu", "--seconds", "1000000"]);
    command.args(["--size", "16x16", "--reference-spp", "100000000"]).arg("--cache").arg(cache.path());
    let said = interrupt(command.args(["--out", &workplace.output("")]), "-INT");
    assert!(said.contains("kept in"), "{said}");
    assert_eq!(workplace.outputs(), [""; 0]);
}
