//! Composites that are made in whole, for naga.
//!
//! naga writes an insertion as a list of all members, each of which is taken from the composite before, and that one as its own list: a chain of n
//! insertions into m members becomes a text of m^n members, gigabytes of it. So an insertion becomes the members themselves here, which those
//! after it take up:
//!
//! ```text
//! %b = OpCompositeInsert %x %a 1          %b = OpCompositeConstruct %a0 %x %a2
//! %c = OpCompositeInsert %y %b 2    ──>   %c = OpCompositeConstruct %a0 %x %y
//! ```

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Block, Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};

use super::module::{globals, id_operand, ids, literal_operand};

/// Composites of more members stay as they are.
const MOST_MEMBERS: u32 = 64;

/// Replaces all insertions into structures and arrays, but those into a vector in them, and drops what is not used then.
pub(super) fn make_whole(module: &mut Module) {
    let members = members_by_type(module);
    let mut bound = module.header.as_ref().map_or(0, |header| header.bound);
    for function in &mut module.functions {
        let mut whole = Whole { members: &members, made: HashMap::new(), bound: &mut bound };
        function.blocks.iter_mut().for_each(|block| whole.block(block));
        drop_unused(&mut function.blocks);
    }
    module.header.iter_mut().for_each(|header| header.bound = bound);
}

/// The types of the members of each structure and array that is not too large.
fn members_by_type(module: &Module) -> HashMap<Word, Vec<Word>> {
    let globals = globals(module);
    let length = |array: &Instruction| {
        let length = globals.get(&id_operand(array, 1)?)?;
        literal_operand(length, 0).filter(|&length| length <= MOST_MEMBERS)
    };
    let members = |i: &Instruction| match i.class.opcode {
        Op::TypeStruct if i.operands.len() <= MOST_MEMBERS as usize => {
            (0..i.operands.len()).map(|member| id_operand(i, member)).collect()
        }
        Op::TypeArray => Some(vec![id_operand(i, 0)?; length(i)? as usize]),
        _ => None,
    };
    module.types_global_values.iter().filter_map(|i| Some((i.result_id?, members(i)?))).collect()
}

/// A function in work.
struct Whole<'a> {
    members: &'a HashMap<Word, Vec<Word>>,
    /// The members of what was made in whole. They are there wherever it is.
    made: HashMap<Word, Vec<Word>>,
    bound: &'a mut Word,
}

impl Whole<'_> {
    fn block(&mut self, block: &mut Block) {
        let mut done = Vec::with_capacity(block.instructions.len());
        for instruction in std::mem::take(&mut block.instructions) {
            match self.insertion(&instruction, &mut done) {
                Some(()) => {}
                None => done.push(instruction),
            }
        }
        block.instructions = done;
    }

    /// Writes an insertion in whole, if the instruction is one that can be.
    fn insertion(&mut self, i: &Instruction, done: &mut Vec<Instruction>) -> Option<()> {
        let is_insertion = i.class.opcode == Op::CompositeInsert;
        let (of, result) = (i.result_type?, i.result_id?);
        let (object, composite) = (id_operand(i, 0).filter(|_| is_insertion)?, id_operand(i, 1)?);
        let path: Vec<u32> = (2..i.operands.len()).map(|at| literal_operand(i, at)).collect::<Option<_>>()?;
        path.first()?;
        // what a path leads through has members
        let mut inner = of;
        for &at in &path {
            inner = *self.members.get(&inner)?.get(at as usize)?;
        }
        self.make(of, composite, &path, object, Some(result), done);
        Some(())
    }

    /// The composite with `object` at the end of the path, as the id `result` if one is given.
    fn make(
        &mut self,
        of: Word,
        composite: Word,
        path: &[u32],
        object: Word,
        result: Option<Word>,
        done: &mut Vec<Instruction>,
    ) -> Word {
        let Some((&at, path)) = path.split_first() else { return object };
        let types = self.members[&of].clone();
        let mut parts = self.parts(composite, &types, done);
        let at = at as usize;
        parts[at] = self.make(types[at], parts[at], path, object, None, done);
        let result = result.unwrap_or_else(|| self.fresh());
        let operands = parts.iter().copied().map(Operand::IdRef).collect();
        done.push(Instruction::new(Op::CompositeConstruct, Some(of), Some(result), operands));
        self.made.insert(result, parts);
        result
    }

    fn parts(&mut self, composite: Word, types: &[Word], done: &mut Vec<Instruction>) -> Vec<Word> {
        if let Some(parts) = self.made.get(&composite) {
            return parts.clone();
        }
        let taken = (0..).zip(types).map(|(at, &of)| {
            let part = self.fresh();
            let operands = vec![Operand::IdRef(composite), Operand::LiteralBit32(at)];
            done.push(Instruction::new(Op::CompositeExtract, Some(of), Some(part), operands));
            part
        });
        taken.collect()
    }

    fn fresh(&mut self) -> Word {
        *self.bound += 1;
        *self.bound - 1
    }
}

/// Drops composites, and what is taken from them, that nothing uses.
fn drop_unused(blocks: &mut [Block]) {
    loop {
        let used: HashSet<Word> = blocks
            .iter()
            .flat_map(|block| &block.instructions)
            .flat_map(|i| ids(i).filter(|&id| Some(id) != i.result_id))
            .collect();
        let is_needed = |i: &Instruction| {
            let is_move = matches!(i.class.opcode, Op::CompositeConstruct | Op::CompositeExtract);
            !is_move || i.result_id.is_some_and(|id| used.contains(&id))
        };
        let count = |blocks: &[Block]| blocks.iter().map(|block| block.instructions.len()).sum::<usize>();
        let before = count(blocks);
        blocks.iter_mut().for_each(|block| block.instructions.retain(is_needed));
        if count(blocks) == before {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rspirv::dr::Builder;
    use rspirv::spirv::FunctionControl;

    /// A structure of an array of three, into which two numbers are inserted one after the other.
    #[test]
    fn a_chain_becomes_the_members() {
        let mut b = Builder::new();
        let (void, number) = (b.type_void(), b.type_int(32, 0));
        let three = b.constant_bit32(number, 3);
        let array = b.type_array(number, three);
        let of = b.type_struct([array]);
        let signature = b.type_function(void, [of, number, number]);
        b.begin_function(void, None, FunctionControl::NONE, signature).expect("begins");
        let [composite, x, y] = [of, number, number].map(|of| b.function_parameter(of).expect("a parameter"));
        b.begin_block(None).expect("begins");
        let first = b.composite_insert(of, None, x, composite, [0, 1]).expect("inserted");
        let second = b.composite_insert(of, None, y, first, [0, 2]).expect("inserted");
        let result = b.composite_extract(number, None, second, [0, 0]).expect("taken");
        b.ret_value(result).expect("ends");
        b.end_function().expect("ends");
        let mut module = b.module();
        make_whole(&mut module);

        let code = &module.functions[0].blocks[0].instructions;
        let named = |id: Option<Word>| code.iter().find(|i| i.result_id == id).expect("there");
        let whole = named(Some(second));
        assert_eq!(whole.class.opcode, Op::CompositeConstruct);
        let members = named(id_operand(whole, 0));
        assert_eq!((members.class.opcode, members.result_type), (Op::CompositeConstruct, Some(array)));
        assert_eq!([1, 2].map(|at| id_operand(members, at)), [Some(x), Some(y)]);
        let taken = named(id_operand(members, 0));
        assert_eq!((taken.class.opcode, literal_operand(taken, 1)), (Op::CompositeExtract, Some(0)));
        // the first composite is gone, with what was taken for it alone
        assert!(code.iter().all(|i| i.class.opcode != Op::CompositeInsert && i.result_id != Some(first)));
        assert_eq!(code.iter().filter(|i| i.class.opcode == Op::CompositeConstruct).count(), 2);
        let bound = module.header.as_ref().expect("a header").bound;
        assert!(code.iter().filter_map(|i| i.result_id).all(|id| id < bound));
    }
}
