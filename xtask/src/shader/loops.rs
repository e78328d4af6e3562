//! Loops that naga writes right in GLSL, HLSL and MSL.
//!
//! naga moves the end of a round to the start of the next one. If the last block decides whether the loop goes on, it reads variables there that
//! have already changed (issue 4558 of wgpu): images were black. So the last block becomes a part of the round, with a jump behind it that
//! does nothing else, and a round hands values to the next one by variables, which it writes before:
//!
//! ```text
//! %header: %a = OpPhi %a0 %before %b %last        %header: %a = OpLoad %variable
//!          OpLoopMerge %merge %last                        OpLoopMerge %merge %again
//!   ...                                     ──>     ...
//! %last:   %b = ...                               %last:   %b = ...
//!          OpBranchConditional %c %header %merge           OpStore %variable %b
//!                                                          OpBranchConditional %c %again %merge
//!                                                 %again:  OpBranch %header
//! ```

use std::collections::{HashMap, HashSet};

use rspirv::dr::{Block, Function, Instruction, Module, Operand};
use rspirv::spirv::{Op, StorageClass, Word};

use super::module::id_operand;

/// Rewrites all loops that hand something on, or do not end with a jump. The error is a sentence.
pub(super) fn hand_on_by_variables(module: &mut Module) -> Result<(), String> {
    let mut ids = Ids { bound: module.header.as_ref().map_or(0, |header| header.bound), pointers: pointers(module) };
    let known: HashSet<Word> = ids.pointers.values().copied().collect();
    for function in &mut module.functions {
        while let Some(header) = function.blocks.iter().position(decides_at_its_end(function)) {
            rewrite(function, header, &mut ids)?;
        }
    }
    let mut made: Vec<(Word, Word)> =
        ids.pointers.into_iter().filter(|(_, pointer)| !known.contains(pointer)).collect();
    made.sort_unstable_by_key(|(_, pointer)| *pointer);
    for (pointee, pointer) in made {
        let operands = vec![Operand::StorageClass(StorageClass::Function), Operand::IdRef(pointee)];
        module.types_global_values.push(Instruction::new(Op::TypePointer, None, Some(pointer), operands));
    }
    module.header.iter_mut().for_each(|header| header.bound = ids.bound);
    Ok(())
}

/// New ids, and the pointers to variables of functions by what they point at.
struct Ids {
    bound: Word,
    pointers: HashMap<Word, Word>,
}

impl Ids {
    fn fresh(&mut self) -> Word {
        self.bound += 1;
        self.bound - 1
    }

    fn pointer(&mut self, pointee: Word) -> Word {
        self.pointers.get(&pointee).copied().unwrap_or_else(|| {
            let pointer = self.fresh();
            self.pointers.insert(pointee, pointer);
            pointer
        })
    }
}

fn pointers(module: &Module) -> HashMap<Word, Word> {
    let of_functions = |i: &Instruction| match (i.class.opcode, &i.operands[..]) {
        (Op::TypePointer, [Operand::StorageClass(StorageClass::Function), Operand::IdRef(pointee)]) => {
            Some((*pointee, i.result_id?))
        }
        _ => None,
    };
    module.types_global_values.iter().filter_map(of_functions).collect()
}

fn label(block: &Block) -> Option<Word> {
    block.label.as_ref()?.result_id
}

/// The instruction that says where a loop goes on and where it ends.
fn merge(block: &Block) -> Option<&Instruction> {
    block.instructions.iter().find(|i| i.class.opcode == Op::LoopMerge)
}

fn jumps_to(block: &Block, target: Word) -> bool {
    let last = block.instructions.last();
    last.is_some_and(|last| last.operands.iter().any(|operand| operand.id_ref_any() == Some(target)))
}

/// Whether a block is the header of a loop that hands something on, or whose last block does more than jump back.
fn decides_at_its_end(function: &Function) -> impl Fn(&Block) -> bool {
    let jumps: HashMap<Word, Word> = function
        .blocks
        .iter()
        .filter_map(|block| match &block.instructions[..] {
            [only] if only.class.opcode == Op::Branch => Some((label(block)?, id_operand(only, 0)?)),
            _ => None,
        })
        .collect();
    move |block| {
        let hands_on = block.instructions.iter().any(|i| i.class.opcode == Op::Phi);
        let last = merge(block).and_then(|merge| id_operand(merge, 1));
        last.is_some_and(|last| hands_on || jumps.get(&last).copied() != label(block))
    }
}

fn rewrite(function: &mut Function, header: usize, ids: &mut Ids) -> Result<(), String> {
    let of = &function.blocks[header];
    let (header_id, last_id) =
        label(of).zip(merge(of).and_then(|merge| id_operand(merge, 1))).ok_or("a loop has no end")?;
    let blocks = &function.blocks;
    let all_that_jump = |to: Word| (0..blocks.len()).filter(move |&at| jumps_to(&blocks[at], to));
    let back: Vec<usize> = all_that_jump(header_id).filter(|&at| at >= header).collect();
    let &[last] = &back[..] else { return Err(format!("a loop has {} ways back", back.len())) };
    // several would have to stay jumps to the end of the loop, which this block is no more
    if last_id != header_id && all_that_jump(last_id).count() != 1 {
        return Err("several blocks of a loop go on with its next round".to_owned());
    }
    hand_on(function, header, ids);
    let again = ids.fresh();
    let redirect = |i: &mut Instruction, from: Word| {
        i.operands
            .iter_mut()
            .filter(|operand| **operand == Operand::IdRef(from))
            .for_each(|operand| *operand = Operand::IdRef(again));
    };
    function.blocks[last].instructions.iter_mut().rev().take(1).for_each(|i| redirect(i, header_id));
    let merges = function.blocks[header].instructions.iter_mut().filter(|i| i.class.opcode == Op::LoopMerge);
    merges.for_each(|i| i.operands[1] = Operand::IdRef(again));
    let jump = Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(header_id)]);
    let begin = Instruction::new(Op::Label, None, Some(again), Vec::new());
    function.blocks.insert(last + 1, Block { label: Some(begin), instructions: vec![jump] });
    Ok(())
}

/// Replaces what the rounds of a loop begin with by variables.
fn hand_on(function: &mut Function, header: usize, ids: &mut Ids) {
    let instructions = std::mem::take(&mut function.blocks[header].instructions);
    let (phis, rest): (Vec<_>, Vec<_>) = instructions.into_iter().partition(|i| i.class.opcode == Op::Phi);
    let mut loads = Vec::new();
    for phi in phis {
        let Some(of) = phi.result_type else { continue };
        let (pointer, variable) = (ids.pointer(of), ids.fresh());
        let storage = vec![Operand::StorageClass(StorageClass::Function)];
        let declared = Instruction::new(Op::Variable, Some(pointer), Some(variable), storage);
        function.blocks[0].instructions.insert(0, declared);
        loads.push(Instruction::new(Op::Load, Some(of), phi.result_id, vec![Operand::IdRef(variable)]));
        for pair in phi.operands.chunks(2) {
            let (value, from) = (pair[0].clone(), pair[1].id_ref_any());
            if let Some(block) = function.blocks.iter_mut().find(|block| label(block) == from) {
                let store = Instruction::new(Op::Store, None, None, vec![Operand::IdRef(variable), value]);
                block.instructions.insert(before_end(block), store);
            }
        }
    }
    // a loop of one block stores to its own variables
    let own = std::mem::take(&mut function.blocks[header].instructions);
    let end = rest.iter().position(|i| i.class.opcode == Op::LoopMerge).unwrap_or(rest.len());
    let (body, end) = rest.split_at(end);
    function.blocks[header].instructions = [&loads[..], body, &own[..], end].concat();
}

/// Where the instructions end that are no jump, and say nothing of one.
fn before_end(block: &Block) -> usize {
    let is_end = |i: &Instruction| matches!(i.class.opcode, Op::LoopMerge | Op::SelectionMerge);
    let merge = block.instructions.iter().position(is_end);
    merge.unwrap_or_else(|| block.instructions.len().saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rspirv::dr::Builder;
    use rspirv::spirv::{FunctionControl, LoopControl};

    /// A loop whose last block decides, as spirv-opt leaves loops: two numbers change places in each round, if the loop hands them on.
    fn a_loop(hands_on: bool) -> (Module, [Word; 6]) {
        let mut b = Builder::new();
        let (void, number, truth) = (b.type_void(), b.type_int(32, 0), b.type_bool());
        let [zero, one] = [0, 1].map(|value| b.constant_bit32(number, value));
        let signature = b.type_function(void, [truth]);
        b.begin_function(void, None, FunctionControl::NONE, signature).expect("begins");
        let goes_on = b.function_parameter(truth).expect("a parameter");
        let [before, header, last, after, x, y] = [(); 6].map(|()| b.id());
        b.begin_block(Some(before)).expect("begins");
        b.branch(header).expect("ends");
        b.begin_block(Some(header)).expect("begins");
        if hands_on {
            b.phi(number, Some(x), [(zero, before), (y, last)]).expect("a phi");
            b.phi(number, Some(y), [(one, before), (x, last)]).expect("a phi");
        }
        b.loop_merge(after, last, LoopControl::NONE, []).expect("a merge");
        b.branch(last).expect("ends");
        b.begin_block(Some(last)).expect("begins");
        b.branch_conditional(goes_on, header, after, []).expect("ends");
        b.begin_block(Some(after)).expect("begins");
        b.ret().expect("ends");
        b.end_function().expect("ends");
        (b.module(), [before, header, last, after, x, y])
    }

    #[test]
    fn what_a_round_hands_on_goes_through_variables() {
        let (mut module, [_, header, _, after, x, y]) = a_loop(true);
        hand_on_by_variables(&mut module).expect("rewritten");
        let blocks = &module.functions[0].blocks;
        let opcodes = |at: usize| blocks[at].instructions.iter().map(|i| i.class.opcode).collect::<Vec<_>>();
        assert_eq!(opcodes(0), [Op::Variable, Op::Variable, Op::Store, Op::Store, Op::Branch]);
        assert_eq!(opcodes(1), [Op::Load, Op::Load, Op::LoopMerge, Op::Branch]);
        assert_eq!(opcodes(2), [Op::Store, Op::Store, Op::BranchConditional]);
        assert_eq!(opcodes(3), [Op::Branch]);
        // numbers are loaded, both of them, before one is stored
        let loaded = |at: usize| (blocks[1].instructions[at].result_id, id_operand(&blocks[1].instructions[at], 0));
        let stored =
            |at: usize| (id_operand(&blocks[2].instructions[at], 1), id_operand(&blocks[2].instructions[at], 0));
        let [(first, of_first), (second, of_second)] = [loaded(0), loaded(1)];
        assert_eq!([first, second], [Some(x), Some(y)]);
        assert_eq!([stored(0), stored(1)], [(Some(y), of_first), (Some(x), of_second)]);
        let again = label(&blocks[3]).expect("a label");
        assert!(jumps_to(&blocks[2], again) && jumps_to(&blocks[2], after) && jumps_to(&blocks[3], header));
        assert_eq!(merge(&blocks[1]).and_then(|merge| id_operand(merge, 1)), Some(again));
        // one pointer for both, declared once
        let declared = module.types_global_values.iter().filter(|i| i.class.opcode == Op::TypePointer).count();
        assert_eq!(declared, 1);
    }

    #[test]
    fn a_last_block_that_decides_is_seen_without_values() {
        let (mut module, [_, header, _, after, ..]) = a_loop(false);
        hand_on_by_variables(&mut module).expect("rewritten");
        let blocks = &module.functions[0].blocks;
        let again = label(&blocks[3]).expect("a label");
        assert!(jumps_to(&blocks[2], again) && jumps_to(&blocks[2], after) && jumps_to(&blocks[3], header));
        // and once is enough
        let before = module.functions[0].blocks.len();
        hand_on_by_variables(&mut module).expect("nothing to do");
        assert_eq!(module.functions[0].blocks.len(), before);
    }

    #[test]
    fn a_last_block_that_is_reached_twice_is_refused() {
        let (mut module, [_, _, last, ..]) = a_loop(true);
        let other = Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(last)]);
        let label = Instruction::new(Op::Label, None, Some(900), Vec::new());
        module.functions[0].blocks.push(Block { label: Some(label), instructions: vec![other] });
        assert!(hand_on_by_variables(&mut module).unwrap_err().contains("several blocks"));
    }
}
