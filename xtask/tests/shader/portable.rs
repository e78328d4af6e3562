//! What naga makes of the modules.

use xtask::shader::Flavour;
use xtask::shader::portable::check;

use super::committed;

#[test]
fn fast_modules_reach_every_language() {
    for kernel in restir_kernels::all() {
        assert_eq!(check(&committed(Flavour::Fast, kernel.name), kernel.name), Vec::<String>::new());
    }
}

/// naga knows no float controls, which shows that a rejected module is reported.
#[test]
fn exact_modules_do_not() {
    let found = check(&committed(Flavour::Exact, "self_check"), "self_check");
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(found[0].starts_with("naga rejects the module"), "{}", found[0]);
}
