//! Whether there is a GPU. The suite of the laboratory has this file, too.

use restir::exec::gpu::adapters;

use crate::support::skipped;

/// Whether there is an adapter to test on; says so if there is none.
pub(crate) fn adapter_is_there() -> bool {
    let none = adapters().is_empty();
    if none {
        let required = std::env::var("RESTIR_REQUIRE_GPU").is_ok_and(|value| value == "1");
        assert!(!required, "RESTIR_REQUIRE_GPU is 1 and there is no adapter");
        skipped("there is no GPU adapter");
    }
    !none
}
