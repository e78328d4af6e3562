//! The instructions of GLSL.std.450, which SPIR-V keeps outside its own opcodes.

use rspirv::dr::{Instruction, Operand};
use rspirv::spirv::GlslStd450Op;

/// Name of the set.
pub const GLSL: &str = "GLSL.std.450";

/// Number of an extended instruction in its set.
pub fn number(instruction: &Instruction) -> Option<u32> {
    match instruction.operands.get(1) {
        Some(Operand::LiteralExtInstInteger(number)) => Some(*number),
        _ => None,
    }
}

/// Its name, with the prefix that spirv-dis and the op histogram use.
pub fn name(number: u32) -> String {
    match GlslStd450Op::from_u32(number) {
        Some(op) => format!("GLSL.{op:?}"),
        None => format!("GLSL.{number}"),
    }
}
