//! The steps after rust-gpu, on the committed modules and on modules that were broken on purpose.

mod allow;
mod canonical;
mod check;
mod limits;
mod portable;
mod post;
mod reflect;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};
use xtask::shader::module::parse;
use xtask::shader::workspace::Workspace;
use xtask::shader::{Entry, Flavour};

/// The binary of a committed module.
fn committed(flavour: Flavour, kernel: &str) -> Vec<u8> {
    let path = Workspace::current().spirv().join(Entry::new(flavour, kernel).path());
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}: run `cargo xtask shader build`", path.display()))
}

/// A committed module, parsed.
fn module(flavour: Flavour, kernel: &str) -> Module {
    parse(&committed(flavour, kernel)).unwrap()
}

/// A committed exact module with arithmetic of every kind, to be broken.
fn exact_module() -> Module {
    module(Flavour::Exact, "self_check")
}

/// The first instruction with that opcode.
fn find(module: &mut Module, opcode: Op) -> &mut Instruction {
    module.all_inst_iter_mut().find(|i| i.class.opcode == opcode).unwrap_or_else(|| panic!("no {opcode:?}"))
}

/// Turns the first instruction with that opcode into another one with the same operands. Gives its id.
fn replace_opcode(module: &mut Module, from: Op, to: Op) -> Word {
    let replaced = find(module, from);
    replaced.class = instruction(to, []).class;
    replaced.result_id.unwrap()
}

/// An id that the module does not use.
fn fresh_id(module: &mut Module) -> Word {
    let bound = &mut module.header.as_mut().unwrap().bound;
    *bound += 1;
    *bound - 1
}

/// An instruction without type and id.
fn instruction(opcode: Op, operands: impl Into<Vec<Operand>>) -> Instruction {
    Instruction::new(opcode, None, None, operands.into())
}

/// Adds a global instruction of a type, with a new id.
fn add_global(module: &mut Module, opcode: Op, ty: Option<Word>, operands: impl Into<Vec<Operand>>) -> Word {
    let id = fresh_id(module);
    module.types_global_values.push(Instruction::new(opcode, ty, Some(id), operands.into()));
    id
}
