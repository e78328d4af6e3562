//! The post-pass, step by step.

use rspirv::dr::{Module, Operand};
use rspirv::spirv::{AddressingModel, Capability, Decoration, ExecutionMode, MemoryAccess, MemoryModel, Op, Word};
use xtask::shader::allow::check;
use xtask::shader::module::{assemble, operations, parse};
use xtask::shader::{Entry, Flavour, pipeline, post};

use super::{exact_module, find, instruction};

/// The module as it might come from rust-gpu: without decorations and modes, with the Vulkan memory model.
fn raw_module() -> Module {
    let mut module = exact_module();
    module.annotations.retain(|i| i.operands.get(1) != Some(&Operand::Decoration(Decoration::NoContraction)));
    module.execution_modes.retain(|i| i.operands[1] == Operand::ExecutionMode(ExecutionMode::LocalSize));
    module.capabilities.retain(|i| i.operands[0] == Operand::Capability(Capability::Shader));
    let capability = Operand::Capability(Capability::VulkanMemoryModel);
    module.capabilities.push(instruction(Op::Capability, [capability]));
    let extension = Operand::LiteralString("SPV_KHR_vulkan_memory_model".to_owned());
    module.extensions.push(instruction(Op::Extension, [extension]));
    let model = [Operand::AddressingModel(AddressingModel::Logical), Operand::MemoryModel(MemoryModel::Vulkan)];
    module.memory_model = Some(instruction(Op::MemoryModel, model));
    module
}

#[test]
fn what_is_no_module_is_refused() {
    assert!(parse(b"not SPIR-V").is_err() && parse(&[]).is_err());
}

fn no_contractions(module: &Module) -> usize {
    let decoration = Operand::Decoration(Decoration::NoContraction);
    module.annotations.iter().filter(|i| i.operands.get(1) == Some(&decoration)).count()
}

#[test]
fn an_exact_module_satisfies_the_allow_list_again() {
    let mut module = raw_module();
    assert!(!check(&module).is_empty());
    post::prepare(&mut module, true).unwrap();
    assert_eq!(check(&module), []);
    assert!(module.extensions.is_empty());
    parse(&assemble(&module)).unwrap();
}

#[test]
fn a_fast_module_gets_no_decorations_and_no_modes() {
    let mut module = raw_module();
    post::prepare(&mut module, false).unwrap();
    assert_eq!(no_contractions(&module), 0);
    assert_eq!(module.execution_modes.len(), 1);
    assert_eq!(module.memory_model, exact_module().memory_model);
}

#[test]
fn decorating_twice_changes_nothing() {
    let mut module = raw_module();
    post::decorate_arithmetic(&mut module);
    let once = no_contractions(&module);
    assert_eq!(once, no_contractions(&exact_module()));
    post::decorate_arithmetic(&mut module);
    assert_eq!(no_contractions(&module), once);
}

/// The decoration covers more than the allow-list permits, so that the optimiser cannot fold a division either.
#[test]
fn forbidden_arithmetic_is_decorated_too() {
    for opcode in [Op::FDiv, Op::FRem, Op::FMod, Op::Dot, Op::VectorTimesScalar] {
        let mut module = raw_module();
        let id = super::replace_opcode(&mut module, Op::FMul, opcode);
        post::decorate_arithmetic(&mut module);
        assert!(module.annotations.iter().any(|i| i.operands[0] == Operand::IdRef(id)), "{opcode:?}");
    }
}

#[test]
fn float_controls_need_the_extension_before_version_1_4() {
    let extension = Operand::LiteralString("SPV_KHR_float_controls".to_owned());
    for (minor, expected) in [(3, true), (4, false), (5, false)] {
        let mut module = raw_module();
        module.header.as_mut().unwrap().set_version(1, minor);
        post::declare_float_controls(&mut module).unwrap();
        assert_eq!(module.extensions.iter().any(|i| i.operands[0] == extension), expected, "1.{minor}");
    }
}

/// Gives the first load these memory operands and runs the rewrite over it.
fn rewritten_load(operands: &[Operand]) -> Vec<Operand> {
    let mut module = raw_module();
    let load = find(&mut module, Op::Load);
    load.operands.truncate(1);
    load.operands.extend_from_slice(operands);
    post::use_glsl450_memory_model(&mut module).unwrap();
    find(&mut module, Op::Load).operands[1..].to_vec()
}

#[test]
fn vulkan_memory_operands_go_with_their_scopes() {
    let scope: Word = 1;
    let vulkan = MemoryAccess::NON_PRIVATE_POINTER | MemoryAccess::MAKE_POINTER_VISIBLE;
    assert_eq!(rewritten_load(&[Operand::MemoryAccess(vulkan), Operand::IdScope(scope)]), []);
    let (aligned, four) = (MemoryAccess::ALIGNED, Operand::LiteralBit32(4));
    let loaded = rewritten_load(&[Operand::MemoryAccess(vulkan | aligned), four.clone(), Operand::IdScope(scope)]);
    assert_eq!(loaded, [Operand::MemoryAccess(aligned), four]);
    let volatile = [Operand::MemoryAccess(MemoryAccess::VOLATILE)];
    assert_eq!(rewritten_load(&volatile), volatile);
}

#[test]
fn a_kernel_that_synchronises_is_refused() {
    for opcode in [Op::ControlBarrier, Op::MemoryBarrier, Op::AtomicIAdd] {
        let mut module = raw_module();
        module.functions[0].blocks[0].instructions.insert(0, instruction(opcode, []));
        let reason = post::use_glsl450_memory_model(&mut module).unwrap_err();
        assert!(reason.contains(&format!("{opcode:?}")), "{reason}");
    }
}

#[test]
fn the_entry_point_is_named_after_the_kernel() {
    let mut module = raw_module();
    module.entry_points[0].operands[2] = Operand::LiteralString("self_check::self_check".to_owned());
    post::prepare(&mut module, true).unwrap();
    assert_eq!(module.entry_points[0].operands[2], Operand::LiteralString("self_check".to_owned()));
}

/// The optimiser keeps every decoration and adds no undecorated operation.
#[test]
fn the_contract_survives_the_optimiser() {
    if !xtask::shader::tools::are_installed() {
        eprintln!("skipped: SPIRV-Tools are not installed");
        return;
    }
    let entry = Entry::new(Flavour::Exact, "self_check");
    let module = parse(&pipeline::finish_module(&entry, &assemble(&raw_module())).unwrap()).unwrap();
    assert_eq!(check(&module), []);
    assert!(operations(&module).count() > 0);
}
