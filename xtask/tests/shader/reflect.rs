//! Reflection agrees with every descriptor, and a wrong descriptor is told what is wrong with it.

use restir_kernels::{Access, Binding, Constant, KernelDesc};
use rspirv::dr::Operand;
use rspirv::spirv::{Op, StorageClass};
use xtask::shader::reflect::{compare, reflect};
use xtask::shader::verify::verify;
use xtask::shader::{Entry, Flavour};

use super::{committed, exact_module, module};

fn kernel(name: &str) -> KernelDesc {
    **restir_kernels::all().iter().find(|k| k.name == name).unwrap()
}

/// The one difference between a committed module and a changed descriptor of its kernel.
#[track_caller]
fn difference(name: &str, change: impl FnOnce(&mut KernelDesc)) -> String {
    let interface = reflect(&module(Flavour::Exact, name)).unwrap();
    let mut descriptor = kernel(name);
    change(&mut descriptor);
    let found = compare(&interface, &descriptor);
    let [finding] = &found[..] else { panic!("expected one difference, found {found:#?}") };
    finding.clone()
}

fn change_bindings(kernel: &mut KernelDesc, change: impl FnOnce(&mut Vec<Binding>)) {
    let mut bindings = kernel.bindings.to_vec();
    change(&mut bindings);
    kernel.bindings = bindings.leak();
}

#[test]
fn every_descriptor_agrees_with_both_modules() {
    for kernel in restir_kernels::all() {
        for flavour in Flavour::ALL {
            // what naga makes of fast modules takes minutes, and has a test of its own
            let findings = match flavour {
                Flavour::Exact => verify(&Entry::new(flavour, kernel.name), &committed(flavour, kernel.name), kernel),
                Flavour::Fast => compare(&reflect(&module(flavour, kernel.name)).unwrap(), kernel),
            };
            assert_eq!(findings, Vec::<String>::new());
        }
    }
}

#[test]
fn a_wrong_descriptor_is_told_what_is_wrong() {
    const UNUSED: Constant = Constant { name: "unused", id: 7, default: 1 };
    type Change = fn(&mut KernelDesc);
    let cases: [(Change, &str); 8] = [
        (|k| k.name = "other", "the entry point is `self_check` in the module, `other` in the descriptor"),
        (|k| k.workgroup = [8, 8, 1], "the workgroup is [64, 1, 1] in the module, [8, 8, 1] in the descriptor"),
        (
            |k| change_bindings(k, |b| b[1].stride = 20),
            "binding 1 (`operands`) holds an array of 16-byte elements in the module, \
             an array of 20-byte elements in the descriptor",
        ),
        (
            |k| change_bindings(k, |b| b[0].stride = 8),
            "binding 0 (`params`) holds a block of 4 bytes in the module, a block of 8 bytes in the descriptor",
        ),
        (
            |k| change_bindings(k, |b| b[1].access = Access::Params),
            "binding 1 (`operands`) holds an array of 16-byte elements in the module, a block of 16 bytes in the descriptor",
        ),
        (
            |k| change_bindings(k, |b| b.push(Binding { name: "unused", access: Access::Read, stride: 4 })),
            "binding 3 (`unused`) is not in the module: the kernel does not use it, remove it from the declaration",
        ),
        (|k| change_bindings(k, |b| b.truncate(2)), "set 0 binding 2 is not in the descriptor"),
        (
            |k| k.constants = &[UNUSED],
            "constant 7 (`unused`) is not in the module: the kernel does not use it, remove it from the declaration",
        ),
    ];
    for (change, expected) in cases {
        assert_eq!(difference("self_check", change), expected);
    }
}

#[test]
fn defaults_of_constants() {
    let features @ Constant { name, id, default } = kernel("bsdf_check").constants[0];
    assert_eq!(
        difference("bsdf_check", |k| k.constants = vec![Constant { default: 5, ..features }].leak()),
        format!("constant {id} (`{name}`) defaults to {default} in the module, 5 in the descriptor")
    );
    assert_eq!(difference("bsdf_check", |k| k.constants = &[]), format!("constant {id} is not in the descriptor"));
}

#[test]
fn other_resources_than_storage_buffers_are_refused() {
    let mut module = exact_module();
    let buffer = Operand::StorageClass(StorageClass::StorageBuffer);
    for variable in module.types_global_values.iter_mut().filter(|i| i.class.opcode == Op::Variable) {
        if variable.operands[0] == buffer {
            variable.operands[0] = Operand::StorageClass(StorageClass::Uniform);
        }
    }
    assert!(reflect(&module).unwrap_err().contains("is not a storage buffer"));
}

#[test]
fn a_module_without_workgroup_size_is_refused() {
    let mut module = exact_module();
    module.execution_modes.clear();
    assert_eq!(reflect(&module).unwrap_err(), "the module declares no workgroup size");
}
