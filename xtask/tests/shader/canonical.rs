//! The canonical form on the committed modules.

use std::collections::HashMap;

use rspirv::dr::Module;
use rspirv::spirv::Word;
use xtask::shader::Flavour;
use xtask::shader::canonical::canonicalise;
use xtask::shader::module::{assemble, parse, rename};

use super::committed;

/// The same module with other numbers: the first id becomes the last one. Its globals and decorations are in another order.
fn renumbered(bytes: &[u8]) -> Module {
    let mut module = parse(bytes).unwrap();
    let bound = module.header.as_ref().unwrap().bound;
    let numbers: HashMap<Word, Word> = (1..bound).map(|id| (id, bound - id)).collect();
    module.all_inst_iter_mut().for_each(|instruction| rename(instruction, &numbers));
    module.types_global_values.rotate_left(1);
    module.annotations.reverse();
    module
}

#[test]
fn committed_modules_are_canonical_and_numbers_do_not_matter() {
    for kernel in restir_kernels::all() {
        for flavour in Flavour::ALL {
            let bytes = committed(flavour, kernel.name);
            for mut module in [parse(&bytes).unwrap(), renumbered(&bytes)] {
                canonicalise(&mut module);
                assert!(assemble(&module) == bytes, "{flavour}/{} has other bytes in canonical form", kernel.name);
            }
        }
    }
}
