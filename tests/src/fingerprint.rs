//! Hashes by which two modules are compared, whatever the numbers of their identifiers and the order of their declarations.

use rspirv::dr::{Function, Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};
use std::collections::{HashMap, HashSet};

/// What identifiers stand for.
type Names = HashMap<Word, String>;

/// A hash of a module's operations in their order. Identifiers are numbered in the order in which they are defined, and types and
/// constants are what they say: neither their numbers nor the order in which they are declared count, nor that in which a phi names
/// its blocks.
///
/// # Errors
/// A sentence, if the words are no SPIR-V.
pub fn exact(words: &[u32]) -> Result<String, String> {
    let module = load(words)?;
    let mut names = globals(&module);
    names.extend((0_u32..).zip(operations(&module).filter_map(|i| i.result_id)).map(|(at, id)| (id, format!("%{at}"))));
    Ok(hash(operations(&module).map(|i| line(i, &names))))
}

/// A hash of what a module computes: of its blocks, branches, phis and stores in their order, and of the values, as often as each is
/// computed. In contrast to [`exact`], it does not count where between them a value is computed that depends on its operands alone, nor
/// copies: `spirv-opt` leaves values where they were first asked for, although what asked for them is gone, and shuffles that give a vector as it
/// was.
///
/// # Errors
/// A sentence, if the words are no SPIR-V.
pub fn values(words: &[u32]) -> Result<String, String> {
    let module = load(words)?;
    let mut names = globals(&module);
    let kinds = kinds(&module);
    let memory = Memory::of(&module);
    let (placed, free): (Vec<_>, Vec<_>) = operations(&module).partition(|i| memory.is_placed(i));
    names.extend((0_u32..).zip(placed.iter().filter_map(|i| i.result_id)).map(|(at, id)| (id, format!("%{at}"))));
    let mut values = Vec::new();
    for instruction in free {
        let Some(id) = instruction.result_id else { continue };
        let value = match copied(instruction, &kinds) {
            Some(of) => name(of, &names),
            None => {
                let value = hash([text(instruction, &names)]);
                values.push(value.clone());
                value
            }
        };
        names.insert(id, value);
    }
    values.sort();
    Ok(hash(placed.into_iter().map(|i| line(i, &names)).chain(values)))
}

fn load(words: &[u32]) -> Result<Module, String> {
    rspirv::dr::load_words(words).map_err(|state| format!("not a SPIR-V module: {state}"))
}

fn operations(module: &Module) -> impl Iterator<Item = &Instruction> {
    module.functions.iter().flat_map(Function::all_inst_iter)
}

fn hash(lines: impl IntoIterator<Item = String>) -> String {
    let mut hasher = blake3::Hasher::new();
    lines.into_iter().for_each(|line| {
        hasher.update(line.as_bytes());
    });
    hasher.finalize().to_hex().to_string()
}

/// Types, constants and variables by what they say.
fn globals(module: &Module) -> Names {
    let mut names = Names::new();
    for global in &module.types_global_values {
        let Some(id) = global.result_id else { continue };
        let decorated = module.annotations.iter().filter(|a| a.operands.first() == Some(&Operand::IdRef(id)));
        let decorations: Vec<String> = decorated.map(|a| format!("{:?}", &a.operands[1..])).collect();
        let text = text(global, &names);
        names.insert(id, text + &decorations.concat());
    }
    names
}

fn name(id: Word, names: &Names) -> String {
    names.get(&id).cloned().unwrap_or_default()
}

/// An instruction with its result.
fn line(instruction: &Instruction, names: &Names) -> String {
    text(instruction, names) + &instruction.result_id.map(|id| name(id, names)).unwrap_or_default()
}

/// An instruction without its result, by the names of what it uses.
fn text(instruction: &Instruction, names: &Names) -> String {
    let kind = instruction.result_type.map(|id| name(id, names));
    let operand = |operand: &Operand| match operand.id_ref_any() {
        Some(id) => name(id, names),
        None => format!("{operand:?}"),
    };
    let mut operands: Vec<String> = instruction.operands.iter().map(operand).collect();
    if instruction.class.opcode == Op::Phi {
        // values with the blocks that they come from
        operands.as_chunks_mut::<2>().0.sort();
    }
    format!("({} {kind:?} {operands:?})", instruction.class.opname)
}

/// The types of values.
fn kinds(module: &Module) -> HashMap<Word, Word> {
    let all = module.types_global_values.iter().chain(operations(module));
    all.filter_map(|i| Some((i.result_id?, i.result_type?))).collect()
}

/// The value that an instruction gives as it was.
fn copied(instruction: &Instruction, kinds: &HashMap<Word, Word>) -> Option<Word> {
    let [Operand::IdRef(left), Operand::IdRef(right), components @ ..] = &instruction.operands[..] else { return None };
    let first = match components.first()? {
        Operand::LiteralBit32(first) if instruction.class.opcode == Op::VectorShuffle => *first,
        _ => return None,
    };
    let in_a_row = (first..).zip(components).all(|(at, component)| *component == Operand::LiteralBit32(at));
    let is_whole = |id| kinds.get(id) == instruction.result_type.as_ref();
    let of = if first == 0 { left } else { right };
    let begins = first == 0 || (is_whole(left) && first as usize == components.len());
    (in_a_row && begins && is_whole(of)).then_some(*of)
}

/// What loads read.
struct Memory {
    /// The pointers that access chains begin at.
    bases: HashMap<Word, Word>,
    /// Variables in which nothing is ever stored.
    constant: HashSet<Word>,
}

impl Memory {
    fn of(module: &Module) -> Self {
        let is_chain = |i: &&Instruction| matches!(i.class.opcode, Op::AccessChain | Op::InBoundsAccessChain);
        let chains = operations(module).filter(is_chain);
        let bases = chains.filter_map(|i| Some((i.result_id?, first(i)?))).collect();
        let variables = module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable);
        let mut memory = Self { bases, constant: variables.filter_map(|i| i.result_id).collect() };
        for store in operations(module).filter(|i| matches!(i.class.opcode, Op::Store | Op::CopyMemory)) {
            let variable = first(store).map(|pointer| memory.variable(pointer));
            variable.map(|variable| memory.constant.remove(&variable));
        }
        memory
    }

    fn variable(&self, pointer: Word) -> Word {
        self.bases.get(&pointer).map_or(pointer, |&base| self.variable(base))
    }

    /// Whether it counts where the instruction stands.
    fn is_placed(&self, instruction: &Instruction) -> bool {
        let opcode = instruction.class.opcode;
        let has_place = matches!(
            opcode,
            Op::Function
                | Op::FunctionParameter
                | Op::FunctionCall
                | Op::Variable
                | Op::Label
                | Op::Phi
                | Op::CopyMemory
        );
        let of_constant = |pointer| self.constant.contains(&self.variable(pointer));
        let reads = opcode == Op::Load && !first(instruction).is_some_and(of_constant);
        has_place || reads || instruction.result_id.is_none()
    }
}

/// The first operand, if it is an identifier.
fn first(instruction: &Instruction) -> Option<Word> {
    instruction.operands.first().and_then(Operand::id_ref_any)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rspirv::binary::Assemble;
    use rspirv::dr::Builder;
    use rspirv::spirv::{FunctionControl, StorageClass};

    /// A function that stores a vector that it loads from another variable, after `work` on its two components.
    fn module(work: impl Fn(&mut Builder, [Word; 3], Word) -> Word) -> Vec<u32> {
        let mut b = Builder::new();
        let (void, float) = (b.type_void(), b.type_float(32, None));
        let vector = b.type_vector(float, 2);
        let pointer = b.type_pointer(None, StorageClass::Private, vector);
        let [from, to] = [(); 2].map(|()| b.variable(pointer, None, StorageClass::Private, None));
        let kind = b.type_function(void, []);
        b.begin_function(void, None, FunctionControl::NONE, kind).unwrap();
        b.begin_block(None).unwrap();
        let loaded = b.load(vector, None, from, None, []).unwrap();
        let result = work(&mut b, [float, vector, to], loaded);
        b.store(to, result, None, []).unwrap();
        b.ret().unwrap();
        b.end_function().unwrap();
        b.module().assemble()
    }

    /// The negated components in one order or the other, with or without something that nobody needs.
    fn swapped(order: [u32; 2], extra: bool) -> Vec<u32> {
        module(|b, [float, vector, _], loaded| {
            let mut parts = order.map(|at| (at, b.composite_extract(float, None, loaded, [at]).unwrap()));
            parts.iter_mut().for_each(|(_, part)| *part = b.f_negate(float, None, *part).unwrap());
            if extra {
                b.f_negate(float, None, parts[0].1).unwrap();
            }
            parts.sort();
            b.composite_construct(vector, None, parts.map(|(_, part)| part)).unwrap()
        })
    }

    #[test]
    fn values_have_no_order_and_operations_have() {
        let [one, other] = [[0, 1], [1, 0]].map(|order| swapped(order, false));
        assert_eq!(values(&one), values(&other));
        assert_ne!(exact(&one), exact(&other));
    }

    #[test]
    fn a_value_that_nobody_needs_counts() {
        assert_ne!(values(&swapped([0, 1], true)), values(&swapped([0, 1], false)));
    }

    #[test]
    fn a_copy_does_not_count_and_an_exchange_does() {
        let shuffled = |components: Vec<u32>| {
            module(|b, [_, vector, _], loaded| {
                b.vector_shuffle(vector, None, loaded, loaded, components.clone()).unwrap()
            })
        };
        let plain = values(&module(|_, _, loaded| loaded));
        assert_eq!(values(&shuffled(vec![0, 1])), plain);
        assert_eq!(values(&shuffled(vec![2, 3])), plain);
        assert_ne!(values(&shuffled(vec![1, 0])), plain);
        assert_ne!(values(&shuffled(vec![1, 2])), plain);
    }

    #[test]
    fn loads_stay_where_stores_are() {
        let loaded_after = |first: bool| {
            module(|b, [_, vector, to], loaded| {
                let before = b.load(vector, None, to, None, []).unwrap();
                b.store(to, loaded, None, []).unwrap();
                let after = b.load(vector, None, to, None, []).unwrap();
                if first { before } else { after }
            })
        };
        assert_ne!(values(&loaded_after(true)), values(&loaded_after(false)));
    }
}
