//! The limits on size and bindings.

use restir_kernels::{KernelDesc, Rays, film::film_add, path::path};
use xtask::shader::Flavour;
use xtask::shader::limits::{MAX_OPERATIONS, MAX_STORAGE_BUFFERS, MAX_STORAGE_BUFFERS_DEFERRED, check};
use xtask::shader::reflect::{Buffer, Contents, Interface, reflect};

use super::{exact_module, module};

fn with_bindings(bindings: impl IntoIterator<Item = (u32, u32)>) -> Interface {
    let buffer = |(set, binding)| Buffer { set, binding, contents: Contents::Array(16) };
    Interface { buffers: bindings.into_iter().map(buffer).collect(), ..reflect(&exact_module()).unwrap() }
}

#[test]
fn eight_buffers_are_the_limit_and_ten_where_rays_are_traced_elsewhere() {
    let deferred = &path::DEFERRED.desc;
    for (kernel, limit) in [(&film_add::DESC, MAX_STORAGE_BUFFERS), (deferred, MAX_STORAGE_BUFFERS_DEFERRED)] {
        let bindings = |count: usize| with_bindings((0..count as u32).map(|binding| (0, binding)));
        assert!(check(&exact_module(), &bindings(limit), kernel).is_empty());
        let found = check(&exact_module(), &bindings(limit + 1), kernel);
        assert_eq!(found, [format!("{} storage buffers, and {limit} are the limit: merge arrays", limit + 1)]);
    }
}

#[test]
fn a_kernel_that_traces_rays_does_not_hide_it() {
    let module = module(Flavour::Exact, "path");
    let interface = reflect(&module).unwrap();
    assert!(check(&module, &interface, &path::DESC).is_empty());
    let hidden = KernelDesc { rays: Rays::None, ..path::DESC };
    let found = check(&module, &interface, &hidden);
    assert_eq!(found, ["it traces rays: its declaration must not say `rays Rays::None`"]);
}

#[test]
fn bindings_are_dense_in_set_0() {
    for bindings in [[(0, 0), (0, 2)], [(0, 0), (1, 1)], [(0, 0), (0, 0)]] {
        let found = check(&exact_module(), &with_bindings(bindings), &film_add::DESC);
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
    let found = check(&module, &interface, &film_add::DESC);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(found[0].ends_with(&format!("{MAX_OPERATIONS} are the limit: split the pass")), "{}", found[0]);
}
