//! The allow-list accepts what is committed and rejects every kind of smuggled goods.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Decoration, ExecutionMode, GlslStd450Op, MemoryModel, Op, StorageClass, Word};
use xtask::shader::Flavour;
use xtask::shader::allow::{Violation, check_exact};
use xtask::shader::module::assemble;

use super::{add_global, committed, exact_module, find, fresh_id, replace_opcode};

/// Violations of a module, by way of its binary.
fn violations(module: &Module) -> Vec<Violation> {
    check_exact(&assemble(module)).err().unwrap_or_default()
}

/// Exactly one violation, with its opcode and a part of its reason.
#[track_caller]
fn assert_one(module: &Module, opcode: &str, reason: &str) -> Violation {
    let found = violations(module);
    let [violation] = &found[..] else { panic!("expected one violation, found {found:#?}") };
    assert_eq!(violation.kernel, "self_check");
    assert_eq!(violation.opcode, opcode);
    assert!(violation.reason.contains(reason), "`{reason}` is not in: {violation}");
    violation.clone()
}

#[test]
fn committed_exact_modules_are_accepted() {
    for kernel in restir_kernels::all() {
        assert_eq!(check_exact(&committed(Flavour::Exact, kernel.name)), Ok(()), "{}", kernel.name);
    }
}

/// The two flavours differ in what the list is about, or it would be about nothing.
#[test]
fn fast_modules_are_rejected() {
    let found = check_exact(&committed(Flavour::Fast, "self_check")).unwrap_err();
    for opcode in ["FDiv", "ExtInst", "FAdd", "ExecutionMode"] {
        assert!(found.iter().any(|v| v.opcode == opcode), "no violation names Op{opcode}");
    }
}

#[test]
fn a_smuggled_operation_is_rejected() {
    for opcode in [Op::FDiv, Op::FRem, Op::FMod, Op::Dot] {
        let mut module = exact_module();
        let id = replace_opcode(&mut module, Op::FMul, opcode);
        assert_eq!(assert_one(&module, &format!("{opcode:?}"), "restir_shared").id, Some(id));
    }
}

#[test]
fn opcodes_that_are_not_listed_are_rejected() {
    for opcode in [Op::GroupNonUniformFAdd, Op::AtomicFAddEXT, Op::AtomicIAdd, Op::IsNan, Op::DPdx] {
        let mut module = exact_module();
        let id = replace_opcode(&mut module, Op::FMul, opcode);
        // The operands do not fit these opcodes, so the parsed module is checked.
        let found = xtask::shader::allow::check_module(&module);
        assert_eq!(found.len(), 1, "{found:#?}");
        assert_eq!((found[0].opcode.as_str(), found[0].id), (format!("{opcode:?}").as_str(), Some(id)));
    }
}

#[test]
fn a_missing_decoration_is_rejected() {
    let mut module = exact_module();
    let position = module
        .annotations
        .iter()
        .position(|i| i.operands.get(1) == Some(&Operand::Decoration(Decoration::NoContraction)))
        .unwrap();
    let removed = module.annotations.remove(position);
    let found = violations(&module);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0].id, Some(removed.operands[0].unwrap_id_ref()));
    assert!(found[0].reason.contains("NoContraction"), "{}", found[0]);
}

#[test]
fn each_missing_execution_mode_is_rejected() {
    for mode in [ExecutionMode::RoundingModeRTE, ExecutionMode::SignedZeroInfNanPreserve] {
        let mut module = exact_module();
        module.execution_modes.retain(|i| i.operands[1] != Operand::ExecutionMode(mode));
        assert_one(&module, "ExecutionMode", &format!("{mode:?} 32 is missing"));
    }
}

#[test]
fn an_execution_mode_for_another_width_does_not_count() {
    let mut module = exact_module();
    for mode in &mut module.execution_modes {
        if mode.operands[1] == Operand::ExecutionMode(ExecutionMode::RoundingModeRTE) {
            mode.operands[2] = Operand::LiteralBit32(16);
        }
    }
    assert_one(&module, "ExecutionMode", "RoundingModeRTE 32 is missing");
}

/// Turns a negation into an extended instruction of the given set.
fn with_ext_inst(set: &str, number: GlslStd450Op) -> Module {
    let mut module = exact_module();
    let import = fresh_id(&mut module);
    let name = vec![Operand::LiteralString(set.to_owned())];
    module.ext_inst_imports.push(Instruction::new(Op::ExtInstImport, None, Some(import), name));
    let victim = find(&mut module, Op::FMul);
    let operands =
        vec![Operand::IdRef(import), Operand::LiteralExtInstInteger(number as u32), victim.operands[0].clone()];
    *victim = Instruction::new(Op::ExtInst, victim.result_type, victim.result_id, operands);
    module
}

#[test]
fn only_exact_extended_instructions_are_accepted() {
    use GlslStd450Op::*;
    for number in [Sqrt, InverseSqrt, Sin, Exp2, Pow, Fma, FMin, FMax, FClamp, FMix, Round, Normalize, Length] {
        assert_one(&with_ext_inst("GLSL.std.450", number), "ExtInst", &format!("GLSL.{number:?}"));
    }
    for number in [FAbs, FSign, Floor, Ceil, Trunc] {
        assert_eq!(violations(&with_ext_inst("GLSL.std.450", number)), []);
    }
}

#[test]
fn an_exact_number_of_another_set_is_rejected() {
    let module = with_ext_inst("OpenCL.std", GlslStd450Op::FAbs);
    assert!(!xtask::shader::allow::check_module(&module).is_empty());
}

#[test]
fn other_widths_are_rejected() {
    for (opcode, operands) in [
        (Op::TypeFloat, vec![Operand::LiteralBit32(64)]),
        (Op::TypeFloat, vec![Operand::LiteralBit32(16)]),
        (Op::TypeInt, vec![Operand::LiteralBit32(64), Operand::LiteralBit32(0)]),
        (Op::TypeInt, vec![Operand::LiteralBit32(8), Operand::LiteralBit32(0)]),
    ] {
        let mut module = exact_module();
        let id = add_global(&mut module, opcode, operands);
        assert_eq!(assert_one(&module, &format!("{opcode:?}"), "outside the contract").id, Some(id));
    }
}

#[test]
fn the_vulkan_memory_model_is_rejected() {
    let mut module = exact_module();
    module.memory_model.as_mut().unwrap().operands[1] = Operand::MemoryModel(MemoryModel::Vulkan);
    assert_one(&module, "MemoryModel", "GLSL450");
}

#[test]
fn capabilities_decorations_and_storage_have_lists_too() {
    let mut module = exact_module();
    let float64 = vec![Operand::Capability(Capability::Float64)];
    module.capabilities.push(Instruction::new(Op::Capability, None, None, float64));
    assert_one(&module, "Capability", "Float64");

    let mut module = exact_module();
    let target = find(&mut module, Op::FMul).result_id.unwrap();
    let relaxed = vec![Operand::IdRef(target), Operand::Decoration(Decoration::RelaxedPrecision)];
    module.annotations.push(Instruction::new(Op::Decorate, None, None, relaxed));
    assert_eq!(assert_one(&module, "Decorate", "RelaxedPrecision").id, Some(target));

    let mut module = exact_module();
    let float = find(&mut module, Op::FMul).result_type.unwrap();
    let shared = vec![Operand::StorageClass(StorageClass::Workgroup), Operand::IdRef(float)];
    add_global(&mut module, Op::TypePointer, shared);
    assert_one(&module, "TypePointer", "Workgroup");
}

#[test]
fn a_specialization_constant_hides_no_float_operation() {
    let mut module = exact_module();
    let float = find(&mut module, Op::FMul).result_type;
    let id = fresh_id(&mut module);
    let operands = vec![Operand::LiteralSpecConstantOpInteger(Op::FDiv), Operand::IdRef(id), Operand::IdRef(id)];
    module.types_global_values.push(Instruction::new(Op::SpecConstantOp, float, Some(id), operands));
    let found = xtask::shader::allow::check_module(&module);
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!((found[0].opcode.as_str(), found[0].id), ("SpecConstantOp", Some(id)));
}

/// Gives the first `opcode` a new constant as its second operand, and that operation's id.
fn with_constant_operand(module: &mut Module, opcode: Op, constant: Op, operands: Vec<Operand>) -> Word {
    let float = find(module, Op::FMul).result_type;
    let id = fresh_id(module);
    module.types_global_values.push(Instruction::new(constant, float, Some(id), operands));
    let victim = find(module, opcode);
    victim.operands[1] = Operand::IdRef(id);
    victim.result_id.unwrap()
}

#[test]
fn a_constant_zero_is_no_operand() {
    for opcode in [Op::FAdd, Op::FSub, Op::FMul] {
        for bits in [0, 0x8000_0000] {
            let mut module = exact_module();
            let zero = vec![Operand::LiteralBit32(bits)];
            let id = with_constant_operand(&mut module, opcode, Op::Constant, zero);
            assert_eq!(assert_one(&module, &format!("{opcode:?}"), "constant zero").id, Some(id));
        }
        let mut module = exact_module();
        with_constant_operand(&mut module, opcode, Op::ConstantNull, vec![]);
        assert_one(&module, &format!("{opcode:?}"), "constant zero");
        let mut module = exact_module();
        let smallest = vec![Operand::LiteralBit32(f32::MIN_POSITIVE.to_bits())];
        with_constant_operand(&mut module, opcode, Op::Constant, smallest);
        assert_eq!(violations(&module), []);
    }
}

#[test]
fn a_vector_with_a_constant_zero_is_no_operand() {
    for (parts, expected) in [([1.0_f32, 2.0], 0), ([0.0, 2.0], 1), ([1.0, -0.0], 1)] {
        let mut module = exact_module();
        let float = find(&mut module, Op::FMul).result_type;
        let ids = parts.map(|part| {
            let id = fresh_id(&mut module);
            let bits = vec![Operand::LiteralBit32(part.to_bits())];
            module.types_global_values.push(Instruction::new(Op::Constant, float, Some(id), bits));
            Operand::IdRef(id)
        });
        let pair = vec![Operand::IdRef(float.unwrap()), Operand::LiteralBit32(2)];
        let vector = add_global(&mut module, Op::TypeVector, pair);
        let constant = fresh_id(&mut module);
        let composite = Instruction::new(Op::ConstantComposite, Some(vector), Some(constant), ids.into());
        module.types_global_values.push(composite);
        find(&mut module, Op::FAdd).operands[0] = Operand::IdRef(constant);
        assert_eq!(violations(&module).len(), expected, "{parts:?}");
    }
}

#[test]
fn a_violation_reads_as_a_sentence() {
    let mut module = exact_module();
    let id = replace_opcode(&mut module, Op::FMul, Op::FDiv);
    let text = violations(&module)[0].to_string();
    assert!(text.starts_with(&format!("kernel `self_check`: OpFDiv %{id}: division is not")), "{text}");
}

#[test]
fn what_is_no_module_is_rejected() {
    assert!(check_exact(b"not SPIR-V").is_err());
    assert!(check_exact(&[]).is_err());
}
