//! The limits on size and bindings.

use xtask::shader::limits::{MAX_OPERATIONS, MAX_STORAGE_BUFFERS, check};
use xtask::shader::reflect::{Buffer, Contents, Interface, reflect};

use super::exact_module;

fn with_bindings(bindings: impl IntoIterator<Item = (u32, u32)>) -> Interface {
    let buffer = |(set, binding)| Buffer { set, binding, contents: Contents::Array(16) };
    Interface { buffers: bindings.into_iter().map(buffer).collect(), ..reflect(&exact_module()).unwrap() }
}

#[test]
fn eight_buffers_are_the_limit() {
    let limit = MAX_STORAGE_BUFFERS as u32;
    assert!(check(&exact_module(), &with_bindings((0..limit).map(|b| (0, b)))).is_empty());
    let found = check(&exact_module(), &with_bindings((0..=limit).map(|b| (0, b))));
    assert_eq!(found, ["9 storage buffers, and 8 are the limit: merge arrays"]);
}

#[test]
fn bindings_are_dense_in_set_0() {
    for bindings in [[(0, 0), (0, 2)], [(0, 0), (1, 1)], [(0, 0), (0, 0)]] {
        let found = check(&exact_module(), &with_bindings(bindings));
        assert_eq!(found.len(), 1, "{found:#?}");
        assert!(found[0].contains("where set 0 binding 1 is due"), "{}", found[0]);
    }
}

#[test]
fn large_kernels_are_refused() {
    let mut module = exact_module();
    let interface = reflect(&module).unwrap();
    let block = &mut module.functions[0].blocks[0].instructions;
    let filler = block[0].clone();
    block.extend(std::iter::repeat_n(filler, MAX_OPERATIONS));
    let found = check(&module, &interface);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(found[0].ends_with(&format!("{MAX_OPERATIONS} are the limit: split the pass")), "{}", found[0]);
}
