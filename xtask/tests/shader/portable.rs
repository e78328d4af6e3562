//! What naga makes of the modules.

use restir_host::spirv::{FloatMode, strip_modes};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::available_parallelism;
use xtask::shader::Flavour;
use xtask::shader::portable::check;

use super::committed;

/// By as many threads as there are processors, for a large module takes naga ten seconds.
#[test]
fn fast_modules_reach_every_language() {
    let (kernels, next) = (restir_kernels::all(), AtomicUsize::new(0));
    let check_some = || {
        while let Some(kernel) = kernels.get(next.fetch_add(1, Ordering::Relaxed)) {
            assert_eq!(check(&committed(Flavour::Fast, kernel.name), kernel.name), Vec::<String>::new());
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..available_parallelism().map_or(1, usize::from) {
            scope.spawn(check_some);
        }
    });
}

/// naga knows no float controls, which shows that a rejected module is reported.
#[test]
fn exact_modules_do_not() {
    let found = check(&committed(Flavour::Exact, "self_check"), "self_check");
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(found[0].starts_with("naga rejects the module"), "{}", found[0]);
}

/// What the build does for naga it does to `fast` modules alone: of others naga writes too much, and loops that end elsewhere.
#[test]
fn what_naga_gets_wrong_is_seen() {
    for (kernel, finding) in [("pt_recall", "bytes of"), ("suffix_find", "moves the end")] {
        let words: Vec<u32> = committed(Flavour::Exact, kernel)
            .chunks(4)
            .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
            .collect();
        let plain = strip_modes(&words, &FloatMode::ALL).unwrap();
        let found = check(&plain.into_iter().flat_map(u32::to_le_bytes).collect::<Vec<_>>(), kernel);
        let seen = found.iter().filter(|found| found.contains(finding)).count();
        assert!(seen >= 3, "{kernel}: {found:#?}");
    }
}
