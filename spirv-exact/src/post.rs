//! The post-pass: what a module needs between rust-gpu and `spirv-opt`.
//!
//! rust-gpu says nothing about float arithmetic, so a driver may contract, reassociate and flush. The exact flavour
//! forbids it here, **before** the optimiser runs: `spirv-opt` itself respects what stands in the module.

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{
    AddressingModel, Capability, Decoration, ExecutionMode, MemoryAccess, MemoryModel, Op, StorageClass, Word,
};

use crate::module::{decorations, globals, id_operand, operations, rename, string_operand};

/// What the Vulkan memory model adds to memory operands; none of it means anything under GLSL450.
const VULKAN_ACCESS: MemoryAccess = MemoryAccess::MAKE_POINTER_AVAILABLE
    .union(MemoryAccess::MAKE_POINTER_VISIBLE)
    .union(MemoryAccess::NON_PRIVATE_POINTER);

/// Makes a module of rust-gpu, which has one entry point, ready for the optimiser; `exact` asks for arithmetic that every driver rounds alike. The
/// error is a sentence.
pub fn prepare(module: &mut Module, exact: bool) -> Result<(), String> {
    name_entry(module);
    if exact {
        decorate_arithmetic(module);
        declare_float_controls(module)?;
    }
    drop_private_layout(module);
    merge_equal_types(module);
    use_glsl450_memory_model(module)
}

/// The kernel's name in an entry point's name: rust-gpu writes the whole path of the function.
pub fn kernel_name(entry: &str) -> &str {
    entry.rsplit("::").next().unwrap_or(entry)
}

/// Names the entry point after the kernel.
fn name_entry(module: &mut Module) {
    for entry in &mut module.entry_points {
        if let Some(Operand::LiteralString(name)) = entry.operands.get_mut(2) {
            *name = kernel_name(name).to_owned();
        }
    }
}

/// Decorates the result of every float arithmetic instruction with `NoContraction`.
pub fn decorate_arithmetic(module: &mut Module) {
    let decorated: HashSet<Word> =
        decorations(module).filter(|d| d.1 == Decoration::NoContraction).map(|d| d.0).collect();
    let missing: Vec<Word> = operations(module)
        .filter(|i| is_float_arithmetic(i.class.opcode))
        .filter_map(|i| i.result_id)
        .filter(|id| !decorated.contains(id))
        .collect();
    module.annotations.extend(missing.into_iter().map(no_contraction));
}

fn no_contraction(target: Word) -> Instruction {
    statement(Op::Decorate, [Operand::IdRef(target), Operand::Decoration(Decoration::NoContraction)])
}

/// An instruction without a result.
fn statement(opcode: Op, operands: impl Into<Vec<Operand>>) -> Instruction {
    Instruction::new(opcode, None, None, operands.into())
}

/// Every opcode to which SPIR-V applies `NoContraction`, whether or not the allow-list permits it.
fn is_float_arithmetic(opcode: Op) -> bool {
    use Op::*;
    let of_numbers = matches!(opcode, FNegate | FAdd | FSub | FMul | FDiv | FRem | FMod);
    let of_factors = matches!(opcode, VectorTimesScalar | MatrixTimesScalar | OuterProduct);
    of_numbers || of_factors || matches!(opcode, Dot | VectorTimesMatrix | MatrixTimesVector | MatrixTimesMatrix)
}

/// Declares round-to-nearest-even and the preservation of signed zeros, infinities and NaN for 32-bit floats.
pub fn declare_float_controls(module: &mut Module) -> Result<(), String> {
    let entry = entry_id(module)?;
    let controls = [
        (Capability::RoundingModeRTE, ExecutionMode::RoundingModeRTE),
        (Capability::SignedZeroInfNanPreserve, ExecutionMode::SignedZeroInfNanPreserve),
    ];
    for (capability, mode) in controls {
        module.capabilities.push(statement(Op::Capability, [Operand::Capability(capability)]));
        let operands = [Operand::IdRef(entry), Operand::ExecutionMode(mode), Operand::LiteralBit32(32)];
        module.execution_modes.push(statement(Op::ExecutionMode, operands));
    }
    if module.header.as_ref().is_none_or(|header| header.version() < (1, 4)) {
        let extension = Operand::LiteralString("SPV_KHR_float_controls".to_owned());
        module.extensions.push(statement(Op::Extension, [extension]));
    }
    Ok(())
}

fn entry_id(module: &Module) -> Result<Word, String> {
    match &module.entry_points[..] {
        [entry] => id_operand(entry, 1).ok_or_else(|| "the entry point has no function".to_owned()),
        entries => Err(format!("the module has {} entry points and must have one", entries.len())),
    }
}

/// Removes the offsets of structures that no buffer holds: they are Rust's, with members of one byte and nested
/// structures without padding, which naga takes for overlaps.
pub fn drop_private_layout(module: &mut Module) {
    let shared = types_in_buffers(module);
    module.annotations.retain(|i| {
        let is_offset = matches!(i.operands.get(2), Some(Operand::Decoration(Decoration::Offset)));
        !(i.class.opcode == Op::MemberDecorate && is_offset) || id_operand(i, 0).is_some_and(|id| shared.contains(&id))
    });
}

/// Makes one of the types that differed in their layout alone: `spirv-opt` takes either for the other.
pub fn merge_equal_types(module: &mut Module) {
    let shared = types_in_buffers(module);
    let mut merged: HashMap<Word, Word> = HashMap::new();
    let mut seen: Vec<Instruction> = Vec::new();
    module.types_global_values.retain_mut(|i| {
        rename(i, &merged);
        let Some(id) = i.result_id.filter(|id| is_type(i.class.opcode) && !shared.contains(id)) else { return true };
        let same = seen.iter().find(|other| other.class.opcode == i.class.opcode && other.operands == i.operands);
        if let Some(same) = same.and_then(|same| same.result_id) {
            merged.insert(id, same);
            return false;
        }
        seen.push(i.clone());
        true
    });
    let of_merged = |i: &Instruction| id_operand(i, 0).is_some_and(|id| merged.contains_key(&id));
    module.debug_names.retain(|i| !of_merged(i));
    module.annotations.retain(|i| !of_merged(i));
    module.functions.iter_mut().flat_map(|f| f.all_inst_iter_mut()).for_each(|i| rename(i, &merged));
}

fn is_type(opcode: Op) -> bool {
    matches!(opcode, Op::TypeStruct | Op::TypeArray | Op::TypePointer | Op::TypeFunction)
}

/// The types behind pointers that leave the invocation, with all that they consist of.
fn types_in_buffers(module: &Module) -> HashSet<Word> {
    let types = globals(module);
    let is_private =
        |class: StorageClass| matches!(class, StorageClass::Function | StorageClass::Private | StorageClass::Workgroup);
    let pointees = module.types_global_values.iter().filter_map(|i| match i.operands[..] {
        [Operand::StorageClass(class), Operand::IdRef(pointee)] if !is_private(class) => Some(pointee),
        _ => None,
    });
    let (mut work, mut found): (Vec<Word>, _) = (pointees.collect(), HashSet::new());
    while let Some(id) = work.pop() {
        if found.insert(id)
            && let Some(instruction) = types.get(&id)
        {
            work.extend((0..instruction.operands.len()).filter_map(|part| id_operand(instruction, part)));
        }
    }
    found
}

/// Replaces the Vulkan memory model, whose device feature wgpu does not enable, by GLSL450.
///
/// That keeps the meaning of a module in which no invocation waits for another, so barriers and atomics are refused.
pub fn use_glsl450_memory_model(module: &mut Module) -> Result<(), String> {
    if let Some(found) = operations(module).find(|i| synchronises(i.class.opcode)) {
        let opcode = found.class.opname;
        return Err(format!("Op{opcode} synchronises invocations, which the GLSL450 memory model would change"));
    }
    let of_vulkan = [Capability::VulkanMemoryModel, Capability::VulkanMemoryModelDeviceScope].map(Operand::Capability);
    module.capabilities.retain(|i| !i.operands.iter().any(|operand| of_vulkan.contains(operand)));
    module.extensions.retain(|i| string_operand(i, 0) != Some("SPV_KHR_vulkan_memory_model"));
    let model = [Operand::AddressingModel(AddressingModel::Logical), Operand::MemoryModel(MemoryModel::GLSL450)];
    module.memory_model = Some(statement(Op::MemoryModel, model));
    module.all_inst_iter_mut().for_each(drop_vulkan_access);
    Ok(())
}

fn synchronises(opcode: Op) -> bool {
    matches!(opcode, Op::ControlBarrier | Op::MemoryBarrier) || format!("{opcode:?}").starts_with("Atomic")
}

/// Removes [`VULKAN_ACCESS`] from a load or store, with the scope ids that belong to it.
fn drop_vulkan_access(instruction: &mut Instruction) {
    let mut scopes = 0;
    instruction.operands.retain_mut(|operand| match operand {
        Operand::MemoryAccess(access) => {
            scopes = (*access & (MemoryAccess::MAKE_POINTER_AVAILABLE | MemoryAccess::MAKE_POINTER_VISIBLE))
                .bits()
                .count_ones();
            access.remove(VULKAN_ACCESS);
            !access.is_empty()
        }
        Operand::IdScope(_) if scopes > 0 => {
            scopes -= 1;
            false
        }
        _ => true,
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use rspirv::dr::Builder;

    /// Two structures of a float, two of such structures, pointers to both, and a third that a buffer holds.
    #[test]
    fn equal_types_become_one_but_for_those_of_buffers() {
        let mut b = Builder::new();
        let float = b.type_float(32, None);
        let ids = [b.id(), b.id(), b.id(), b.id(), b.id()];
        let [inner, twin, outer, outer_twin, shared] = ids;
        for (id, member) in [(inner, float), (twin, float), (outer, inner), (outer_twin, twin), (shared, float)] {
            b.type_struct_id(Some(id), [member]);
            b.name(id, format!("{id}"));
        }
        b.type_pointer(None, StorageClass::StorageBuffer, shared);
        let pointers = [outer, outer_twin].map(|to| b.type_pointer(None, StorageClass::Function, to));
        let undefined = b.undef(outer_twin, None);
        let mut module = b.module();
        merge_equal_types(&mut module);
        let found = |id: Word| module.types_global_values.iter().find(|i| i.result_id == Some(id));
        assert!([inner, outer, shared, pointers[0]].iter().all(|&id| found(id).is_some()));
        assert!([twin, outer_twin, pointers[1]].iter().all(|&id| found(id).is_none()));
        assert_eq!(found(undefined).and_then(|i| i.result_type), Some(outer));
        assert_eq!(module.debug_names.len(), 3);
    }
}
