//! The canonical form of a module: equal code gives equal bytes, whatever else was compiled with it.
//!
//! rust-gpu numbers and lists what a module consists of in the order in which it met it in the whole crate. So a kernel or a type more would give
//! other bytes to every module. Here only a module's own code counts: its functions stand in the order in which they are called, and
//! everything has the number, and the place, of its first use by them.

use std::collections::HashMap;

use rspirv::binary::Assemble;
use rspirv::dr::{Function, Instruction, Module};
use rspirv::spirv::{Op, Word};

use crate::module::{globals, id_operand, ids, rename};

/// Brings a module with one entry point into canonical form, without names and other debug information.
pub fn canonicalise(module: &mut Module) {
    strip_debug(module);
    sort_functions(module);
    let numbers = numbers(module);
    module.header.iter_mut().for_each(|header| header.bound = numbers.len() as Word + 1);
    module.all_inst_iter_mut().for_each(|instruction| rename(instruction, &numbers));
    module.types_global_values.sort_by_key(|instruction| instruction.result_id);
    module.annotations.sort_by_cached_key(|instruction| (id_operand(instruction, 0), instruction.assemble()));
}

/// Removes what tells of the source, which has ids as well.
fn strip_debug(module: &mut Module) {
    let is_code = |instruction: &Instruction| !matches!(instruction.class.opcode, Op::Line | Op::NoLine);
    module.debug_string_source.clear();
    module.debug_names.clear();
    module.debug_module_processed.clear();
    module.types_global_values.retain(is_code);
    module.functions.iter_mut().flat_map(|f| &mut f.blocks).for_each(|block| block.instructions.retain(is_code));
}

/// The entry point's function comes first, each other one where it is first called; what nobody calls comes last.
fn sort_functions(module: &mut Module) {
    let mut called: Vec<Word> = module.entry_points.iter().filter_map(|entry| id_operand(entry, 1)).collect();
    let mut sorted = Vec::new();
    let mut next = 0;
    while next < called.len() {
        let is_next = |function: &Function| function.def_id() == Some(called[next]);
        if let Some(at) = module.functions.iter().position(is_next) {
            let function = module.functions.remove(at);
            let calls = function.all_inst_iter().filter(|i| i.class.opcode == Op::FunctionCall);
            called.extend(calls.filter_map(|call| id_operand(call, 0)));
            sorted.push(function);
        }
        next += 1;
    }
    sorted.append(&mut module.functions);
    module.functions = sorted;
}

/// New numbers for all ids, from 1 on in the order of use; what a type or a constant is made of comes before it.
fn numbers(module: &Module) -> HashMap<Word, Word> {
    let globals = globals(module);
    let mut numbers = HashMap::new();
    let code = module.functions.iter().flat_map(Function::all_inst_iter);
    for instruction in module.entry_points.iter().chain(code).chain(module.global_inst_iter()) {
        ids(instruction).for_each(|id| number(id, &globals, &mut numbers));
    }
    numbers
}

fn number(id: Word, globals: &HashMap<Word, &Instruction>, numbers: &mut HashMap<Word, Word>) {
    if numbers.contains_key(&id) {
        return;
    }
    if let Some(global) = globals.get(&id) {
        ids(global).filter(|&part| part != id).for_each(|part| number(part, globals, numbers));
    }
    numbers.insert(id, numbers.len() as Word + 1);
}

#[cfg(test)]
mod tests {
    use rspirv::dr::{Builder, Operand};
    use rspirv::spirv::{AddressingModel, Decoration, ExecutionModel, FunctionControl, MemoryModel};

    use super::*;
    use crate::module::assemble;

    /// An entry point that calls two functions, one of which adds. Helpers, types and decorations are made in one order or the other,
    /// and have names in one of them.
    fn module(other_order: bool) -> Module {
        let mut b = Builder::new();
        b.set_version(1, 5);
        b.memory_model(AddressingModel::Logical, MemoryModel::GLSL450);
        if other_order {
            b.type_int(32, 0);
            b.id();
        }
        let (float, void) = (b.type_float(32, None), b.type_void());
        let (of_float, of_nothing) = (b.type_function(float, [float]), b.type_function(void, []));
        let one = b.constant_bit32(float, 1.0_f32.to_bits());
        let [entry, twice, same] = if other_order { [3, 1, 2] } else { [1, 2, 3] }.map(|n| n + 100);
        let mut sum = 0;
        for id in if other_order { [same, entry, twice] } else { [entry, twice, same] } {
            let (result, kind) = if id == entry { (void, of_nothing) } else { (float, of_float) };
            b.begin_function(result, Some(id), FunctionControl::NONE, kind).unwrap();
            let given = (id != entry).then(|| b.function_parameter(float).unwrap());
            b.begin_block(None).unwrap();
            match given {
                None => {
                    let doubled = b.function_call(float, None, twice, [one]).unwrap();
                    b.function_call(float, None, same, [doubled]).unwrap();
                    b.ret().unwrap();
                }
                Some(x) if id == twice => {
                    sum = b.f_add(float, None, x, x).unwrap();
                    b.ret_value(sum).unwrap();
                }
                Some(x) => b.ret_value(x).unwrap(),
            }
            b.end_function().unwrap();
        }
        let mut decorated = [sum, one];
        if other_order {
            decorated.reverse();
            b.name(twice, "twice");
        }
        for id in decorated {
            b.decorate(id, Decoration::RelaxedPrecision, Vec::<Operand>::new());
        }
        b.entry_point(ExecutionModel::GLCompute, entry, "entry", []);
        b.module()
    }

    #[test]
    fn the_same_code_has_the_same_bytes_whatever_its_numbers() {
        let [mut one, mut other] = [false, true].map(module);
        other.types_global_values.retain(|i| i.class.opcode != Op::TypeInt);
        assert_ne!(assemble(&one), assemble(&other));
        canonicalise(&mut one);
        canonicalise(&mut other);
        assert_eq!(assemble(&one), assemble(&other));
        let callees = one.functions[0].all_inst_iter().filter(|i| i.class.opcode == Op::FunctionCall);
        let callees: Vec<_> = callees.map(|call| id_operand(call, 0)).collect();
        assert_eq!(callees, [one.functions[1].def_id(), one.functions[2].def_id()]);
    }

    #[test]
    fn what_nobody_uses_stays_and_comes_last() {
        let mut module = module(true);
        canonicalise(&mut module);
        assert_eq!(module.types_global_values.last().map(|i| i.class.opcode), Some(Op::TypeInt));
    }
}
