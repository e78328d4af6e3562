//! SPIR-V binaries in and out of rspirv, and what the passes ask of a module.

use std::collections::HashMap;

use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Loader, Module, Operand};
use rspirv::spirv::{Decoration, GlslStd450Op, Op, Word};

/// Name of the set of extended instructions.
pub const GLSL: &str = "GLSL.std.450";

/// Parses a binary; the error is a sentence.
pub fn parse(bytes: &[u8]) -> Result<Module, String> {
    let mut loader = Loader::new();
    rspirv::binary::parse_bytes(bytes, &mut loader).map_err(|state| format!("not a SPIR-V module: {state}"))?;
    Ok(loader.module())
}

/// The binary of a module, in little-endian words as Vulkan takes them.
pub fn assemble(module: &Module) -> Vec<u8> {
    module.assemble().into_iter().flat_map(Word::to_le_bytes).collect()
}

/// Instructions inside functions, without labels: what the manifest calls operations.
pub fn operations(module: &Module) -> impl Iterator<Item = &Instruction> {
    module.functions.iter().flat_map(|f| &f.blocks).flat_map(|b| &b.instructions)
}

/// Name of an operation; those of [`GLSL`], which SPIR-V keeps outside its own opcodes, have the prefix of spirv-dis.
pub fn operation_name(instruction: &Instruction) -> String {
    match instruction.operands[..] {
        [_, Operand::LiteralExtInstInteger(number), ..] => match GlslStd450Op::from_u32(number) {
            Some(op) => format!("GLSL.{op:?}"),
            None => format!("GLSL.{number}"),
        },
        _ => format!("{:?}", instruction.class.opcode),
    }
}

/// Name of the only entry point, or `"?"`.
pub fn entry_name(module: &Module) -> String {
    module.entry_points.first().and_then(|entry| string_operand(entry, 2)).unwrap_or("?").to_owned()
}

/// The operand with that index, if it is a string.
pub fn string_operand(instruction: &Instruction, index: usize) -> Option<&str> {
    match instruction.operands.get(index) {
        Some(Operand::LiteralString(text)) => Some(text),
        _ => None,
    }
}

/// The operand with that index, if it is an id.
pub fn id_operand(instruction: &Instruction, index: usize) -> Option<Word> {
    match instruction.operands.get(index) {
        Some(Operand::IdRef(id)) => Some(*id),
        _ => None,
    }
}

/// The operand with that index, if it is a 32-bit literal.
pub fn literal_operand(instruction: &Instruction, index: usize) -> Option<u32> {
    match instruction.operands.get(index) {
        Some(Operand::LiteralBit32(value)) => Some(*value),
        _ => None,
    }
}

/// Types, constants and global variables by result id.
pub fn globals(module: &Module) -> HashMap<Word, &Instruction> {
    module.types_global_values.iter().filter_map(|i| Some((i.result_id?, i))).collect()
}

/// `OpDecorate` instructions as (target, decoration, first literal).
pub fn decorations(module: &Module) -> impl Iterator<Item = (Word, Decoration, Option<u32>)> {
    module.annotations.iter().filter(|i| i.class.opcode == Op::Decorate).filter_map(|i| match i.operands[..] {
        [Operand::IdRef(target), Operand::Decoration(decoration), ..] => {
            Some((target, decoration, literal_operand(i, 2)))
        }
        _ => None,
    })
}

/// All ids of an instruction: those that it refers to, and then its own.
pub fn ids(instruction: &Instruction) -> impl Iterator<Item = Word> {
    let operands = instruction.operands.iter().filter_map(Operand::id_ref_any);
    instruction.result_type.into_iter().chain(operands).chain(instruction.result_id)
}

/// Gives the ids of an instruction the names that they have in `names`, if any.
pub fn rename(instruction: &mut Instruction, names: &HashMap<Word, Word>) {
    let Instruction { result_type, result_id, operands, .. } = instruction;
    let operands = operands.iter_mut().filter_map(Operand::id_ref_any_mut);
    for id in result_type.iter_mut().chain(operands).chain(result_id) {
        *id = names.get(id).copied().unwrap_or(*id);
    }
}
