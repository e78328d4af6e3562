//! The allow-list accepts what is committed and rejects every kind of smuggled goods.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Decoration, ExecutionMode, GlslStd450Op, MemoryModel, Op, StorageClass, Word};
use xtask::shader::Flavour;
use xtask::shader::allow::{Violation, check};

use super::{add_global, exact_module, find, fresh_id, instruction, module, replace_opcode};

/// Exactly one violation, with its opcode and a part of its reason. Gives its id.
#[track_caller]
fn assert_one(module: &Module, expected: Op, part: &str) -> Option<Word> {
    let found = check(module);
    let [Violation { opcode, id, reason }] = &found[..] else { panic!("expected one violation, found {found:#?}") };
    assert_eq!(*opcode, expected);
    assert!(reason.contains(part), "`{part}` is not in: {reason}");
    *id
}

#[test]
fn committed_exact_modules_are_accepted() {
    for kernel in restir_kernels::all() {
        assert_eq!(check(&module(Flavour::Exact, kernel.name)), [], "{}", kernel.name);
    }
}

/// The two flavours differ in what the list is about, or it would be about nothing.
#[test]
fn fast_modules_are_rejected() {
    let found = check(&module(Flavour::Fast, "self_check"));
    for opcode in [Op::FDiv, Op::ExtInst, Op::FAdd, Op::ExecutionMode] {
        assert!(found.iter().any(|v| v.opcode == opcode), "no violation names {opcode:?}");
    }
}

#[test]
fn a_smuggled_operation_is_rejected() {
    use Op::*;
    let unlisted =
        [GroupNonUniformFAdd, AtomicFAddEXT, AtomicIAdd, IsNan, DPdx].map(|opcode| (opcode, "not on the list"));
    for (opcode, reason) in [FDiv, FRem, FMod, Dot].map(|opcode| (opcode, "restir_shared")).into_iter().chain(unlisted)
    {
        let mut module = exact_module();
        let id = replace_opcode(&mut module, FMul, opcode);
        assert_eq!(assert_one(&module, opcode, reason), Some(id));
    }
}

#[test]
fn a_missing_decoration_is_rejected() {
    let mut module = exact_module();
    let decoration = Some(&Operand::Decoration(Decoration::NoContraction));
    let position = module.annotations.iter().position(|i| i.operands.get(1) == decoration).unwrap();
    let removed = module.annotations.remove(position).operands[0].unwrap_id_ref();
    let [Violation { id, reason, .. }] = &check(&module)[..] else { panic!("one violation is due") };
    assert_eq!(*id, Some(removed));
    assert!(reason.contains("NoContraction"), "{reason}");
}

#[test]
fn each_missing_execution_mode_is_rejected() {
    for mode in [ExecutionMode::RoundingModeRTE, ExecutionMode::SignedZeroInfNanPreserve] {
        let mut module = exact_module();
        module.execution_modes.retain(|i| i.operands[1] != Operand::ExecutionMode(mode));
        assert_one(&module, Op::ExecutionMode, &format!("{mode:?} 32 is missing"));
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
    assert_one(&module, Op::ExecutionMode, "RoundingModeRTE 32 is missing");
}

/// Turns a negation into an extended instruction of the given set.
fn with_ext_inst(set: &str, number: GlslStd450Op) -> Module {
    let mut module = exact_module();
    let import = fresh_id(&mut module);
    let name = vec![Operand::LiteralString(set.to_owned())];
    module.ext_inst_imports.push(Instruction::new(Op::ExtInstImport, None, Some(import), name));
    let victim = find(&mut module, Op::FMul);
    let number = Operand::LiteralExtInstInteger(number as u32);
    let operands = vec![Operand::IdRef(import), number, victim.operands[0].clone()];
    *victim = Instruction::new(Op::ExtInst, victim.result_type, victim.result_id, operands);
    module
}

#[test]
fn only_exact_extended_instructions_are_accepted() {
    use GlslStd450Op::*;
    for number in [Sqrt, InverseSqrt, Sin, Exp2, Pow, Fma, FMin, FMax, FClamp, FMix, Round, Normalize, Length] {
        assert_one(&with_ext_inst("GLSL.std.450", number), Op::ExtInst, &format!("GLSL.{number:?}"));
    }
    for number in [FAbs, FSign, Floor, Ceil, Trunc] {
        assert_eq!(check(&with_ext_inst("GLSL.std.450", number)), []);
    }
}

#[test]
fn an_exact_number_of_another_set_is_rejected() {
    assert!(!check(&with_ext_inst("OpenCL.std", GlslStd450Op::FAbs)).is_empty());
}

#[test]
fn other_widths_are_rejected() {
    for (opcode, operands) in
        [(Op::TypeFloat, &[64][..]), (Op::TypeFloat, &[16]), (Op::TypeInt, &[64, 0]), (Op::TypeInt, &[8, 0])]
    {
        let mut module = exact_module();
        let operands: Vec<_> = operands.iter().copied().map(Operand::LiteralBit32).collect();
        let id = add_global(&mut module, opcode, None, operands);
        assert_eq!(assert_one(&module, opcode, "outside the contract"), Some(id));
    }
}

#[test]
fn the_vulkan_memory_model_is_rejected() {
    let mut module = exact_module();
    module.memory_model.as_mut().unwrap().operands[1] = Operand::MemoryModel(MemoryModel::Vulkan);
    assert_one(&module, Op::MemoryModel, "GLSL450");
}

#[test]
fn capabilities_decorations_and_storage_have_lists_too() {
    let mut module = exact_module();
    module.capabilities.push(instruction(Op::Capability, [Operand::Capability(Capability::Float64)]));
    assert_one(&module, Op::Capability, "Float64");

    let mut module = exact_module();
    let target = find(&mut module, Op::FMul).result_id.unwrap();
    let relaxed = [Operand::IdRef(target), Operand::Decoration(Decoration::RelaxedPrecision)];
    module.annotations.push(instruction(Op::Decorate, relaxed));
    assert_eq!(assert_one(&module, Op::Decorate, "RelaxedPrecision"), Some(target));

    let mut module = exact_module();
    let float = find(&mut module, Op::FMul).result_type.unwrap();
    let shared = [Operand::StorageClass(StorageClass::CrossWorkgroup), Operand::IdRef(float)];
    add_global(&mut module, Op::TypePointer, None, shared);
    assert_one(&module, Op::TypePointer, "CrossWorkgroup");
}

#[test]
fn invocations_share_rings_and_lists_and_nothing_else() {
    let mut module = module(Flavour::Exact, "crossing_check");
    let shared = Operand::StorageClass(StorageClass::Workgroup);
    let shared = module.types_global_values.iter().find(|i| i.class.opcode == Op::Variable && i.operands[0] == shared);
    let mut third = shared.expect("a kernel that probes has a ring and a list").clone();
    third.result_id = Some(fresh_id(&mut module));
    let id = third.result_id;
    module.types_global_values.push(third);
    assert_eq!(assert_one(&module, Op::Variable, "third variable of the workgroup"), id);
}

#[test]
fn a_specialization_constant_hides_no_float_operation() {
    let mut module = exact_module();
    let product = find(&mut module, Op::FMul);
    let (float, id) = (product.result_type, product.result_id.unwrap());
    let operands = [Operand::LiteralSpecConstantOpInteger(Op::FDiv), Operand::IdRef(id), Operand::IdRef(id)];
    let id = add_global(&mut module, Op::SpecConstantOp, float, operands);
    assert_eq!(assert_one(&module, Op::SpecConstantOp, "not permitted"), Some(id));
}

/// Gives the first `opcode` a new constant as its second operand, and that operation's id.
fn with_constant_operand(module: &mut Module, opcode: Op, constant: Op, bits: Option<u32>) -> Word {
    let float = find(module, Op::FMul).result_type;
    let id = add_global(module, constant, float, bits.map(Operand::LiteralBit32).into_iter().collect::<Vec<_>>());
    let victim = find(module, opcode);
    victim.operands[1] = Operand::IdRef(id);
    victim.result_id.unwrap()
}

#[test]
fn a_constant_zero_is_no_operand() {
    for opcode in [Op::FAdd, Op::FSub, Op::FMul] {
        for (constant, bits) in [(Op::Constant, Some(0)), (Op::Constant, Some(0x8000_0000)), (Op::ConstantNull, None)] {
            let mut module = exact_module();
            let id = with_constant_operand(&mut module, opcode, constant, bits);
            assert_eq!(assert_one(&module, opcode, "constant zero"), Some(id));
        }
        let mut module = exact_module();
        with_constant_operand(&mut module, opcode, Op::Constant, Some(f32::MIN_POSITIVE.to_bits()));
        assert_eq!(check(&module), []);
    }
}

#[test]
fn a_vector_with_a_constant_zero_is_no_operand() {
    for (parts, expected) in [([1.0_f32, 2.0], 0), ([0.0, 2.0], 1), ([1.0, -0.0], 1)] {
        let mut module = exact_module();
        let float = find(&mut module, Op::FMul).result_type;
        let ids = parts.map(|part| {
            Operand::IdRef(add_global(&mut module, Op::Constant, float, [Operand::LiteralBit32(part.to_bits())]))
        });
        let pair = [Operand::IdRef(float.unwrap()), Operand::LiteralBit32(2)];
        let vector = add_global(&mut module, Op::TypeVector, None, pair);
        let constant = add_global(&mut module, Op::ConstantComposite, Some(vector), ids);
        find(&mut module, Op::FAdd).operands[0] = Operand::IdRef(constant);
        assert_eq!(check(&module).len(), expected, "{parts:?}");
    }
}

#[test]
fn a_violation_reads_as_a_sentence() {
    let mut module = exact_module();
    let id = replace_opcode(&mut module, Op::FMul, Op::FDiv);
    let text = check(&module)[0].to_string();
    assert!(text.starts_with(&format!("OpFDiv %{id}: division is not")), "{text}");
}
