//! The steps after rust-gpu, on the committed modules and on modules that were broken on purpose.

mod allow;
mod check;
mod limits;
mod portable;
mod post;
mod reflect;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};
use xtask::shader::Flavour;
use xtask::shader::module::parse;
use xtask::shader::workspace::Workspace;

/// The binary of a committed module.
fn committed(flavour: Flavour, kernel: &str) -> Vec<u8> {
    let path = Workspace::current().module(flavour, kernel);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}: run `cargo xtask shader build`", path.display()))
}

/// A committed exact module with arithmetic of every kind, to be broken.
fn exact_module() -> Module {
    parse(&committed(Flavour::Exact, "self_check")).unwrap()
}

/// The first instruction with that opcode.
fn find(module: &mut Module, opcode: Op) -> &mut Instruction {
    module.all_inst_iter_mut().find(|i| i.class.opcode == opcode).unwrap_or_else(|| panic!("no {opcode:?}"))
}

/// Turns the first instruction with that opcode into another one with the same operands. Gives its id.
fn replace_opcode(module: &mut Module, from: Op, to: Op) -> Word {
    let instruction = find(module, from);
    instruction.class = Instruction::new(to, None, None, Vec::new()).class;
    instruction.result_id.unwrap()
}

/// An id that the module does not use.
fn fresh_id(module: &mut Module) -> Word {
    let bound = &mut module.header.as_mut().unwrap().bound;
    *bound += 1;
    *bound - 1
}

/// Adds a global instruction with a new id.
fn add_global(module: &mut Module, opcode: Op, operands: Vec<Operand>) -> Word {
    let id = fresh_id(module);
    module.types_global_values.push(Instruction::new(opcode, None, Some(id), operands));
    id
}
