//! Builds that break the contract on purpose, made from the committed `exact` modules: what the parity suite must
//! notice.

use restir_host::Shaders;
use restir_host::exec::Flavour;
use restir_kernels::all;
use restir_shared::geometry::Scratch;
use restir_shared::layout::LEAF;
use rspirv::binary::Assemble;
use rspirv::dr::{Builder, Instruction, Loader, Module, Operand};
use rspirv::spirv::{BuiltIn, Capability, Decoration, ExecutionMode, GlslStd450Op, Op, StorageClass, Word};
use std::collections::HashMap;
use tempfile::TempDir;

/// A change of a module.
pub type Change = fn(&mut Builder);

/// All `exact` modules, changed, in a folder that [`Shaders::Folder`] takes.
///
/// # Errors
/// A sentence, if a committed module cannot be read or the folder cannot be written.
pub fn build(change: Change) -> Result<TempDir, String> {
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for modules: {e}"))?;
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).map_err(|e| format!("cannot write {name}: {e}"))
    };
    std::fs::create_dir(folder.path().join("exact")).map_err(|e| e.to_string())?;
    let mut kernels = serde_json::Map::new();
    for kernel in all() {
        let words = Shaders::Embedded.load(kernel.name, Flavour::Exact).map_err(|e| e.to_string())?;
        let bytes = changed(&words, change)?;
        write(&format!("exact/{}.spv", kernel.name), &bytes)?;
        let hash = blake3::hash(&bytes).to_hex().to_string();
        kernels.insert(kernel.name.to_owned(), serde_json::json!({ "exact": { "blake3": hash } }));
    }
    let manifest = serde_json::json!({ "kernels": kernels });
    write("manifest.json", manifest.to_string().as_bytes())?;
    Ok(folder)
}

fn changed(words: &[u32], change: Change) -> Result<Vec<u8>, String> {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(words, &mut loader).map_err(|e| format!("not a SPIR-V module: {e}"))?;
    let mut builder = Builder::new_from_module(loader.module());
    change(&mut builder);
    Ok(bytemuck::cast_slice(&builder.module().assemble()).to_vec())
}

/// Removes what the post-pass adds: `NoContraction` and the float-control modes.
pub fn undecorate(builder: &mut Builder) {
    let is_added = |operand: &Operand| match operand {
        Operand::Decoration(decoration) => *decoration == Decoration::NoContraction,
        Operand::ExecutionMode(mode) => MODES.contains(mode),
        Operand::Capability(capability) => CAPABILITIES.contains(capability),
        _ => false,
    };
    let Module { annotations, execution_modes, capabilities, .. } = builder.module_mut();
    for list in [annotations, execution_modes, capabilities] {
        list.retain(|instruction| !instruction.operands.iter().any(is_added));
    }
}

const MODES: [ExecutionMode; 2] = [ExecutionMode::RoundingModeRTE, ExecutionMode::SignedZeroInfNanPreserve];
const CAPABILITIES: [Capability; 2] = [Capability::RoundingModeRTE, Capability::SignedZeroInfNanPreserve];

/// Besides, makes each sum or difference of a product one operation with one rounding: GLSL's `Fma`, which a driver
/// may still split.
pub fn fuse(builder: &mut Builder) {
    let glsl = builder.ext_inst_import("GLSL.std.450");
    fuse_by(builder, |instruction, terms, _| {
        let fma = [Operand::IdRef(glsl), Operand::LiteralExtInstInteger(GlslStd450Op::Fma as u32)];
        let operands = fma.into_iter().chain(terms.map(Operand::IdRef)).collect();
        vec![Instruction::new(Op::ExtInst, instruction.result_type, instruction.result_id, operands)]
    });
}

/// As [`fuse`], by 64-bit arithmetic, in which the product is exact.
pub fn fuse_in_double(builder: &mut Builder) {
    builder.capability(Capability::Float64);
    let double = builder.type_float(64, None);
    fuse_by(builder, |instruction, terms, builder| {
        let mut made = Vec::new();
        let mut push = |opcode, operands: &[Word]| {
            let id = builder.id();
            let operands = operands.iter().copied().map(Operand::IdRef).collect();
            made.push(Instruction::new(opcode, Some(double), Some(id), operands));
            id
        };
        let [x, y, addend] = terms.map(|term| push(Op::FConvert, &[term]));
        let product = push(Op::FMul, &[x, y]);
        let sum = vec![Operand::IdRef(push(Op::FAdd, &[product, addend]))];
        made.push(Instruction::new(Op::FConvert, instruction.result_type, instruction.result_id, sum));
        made
    });
}

/// Replaces sums of products by what `make` gives for their terms: two factors and what is added to their product.
fn fuse_by(builder: &mut Builder, mut make: impl FnMut(&Instruction, [Word; 3], &mut Builder) -> Vec<Instruction>) {
    undecorate(builder);
    let products = operands(builder.module_ref(), Op::FMul);
    rewrite(builder, |instruction, [a, b], builder| {
        let opcode = instruction.class.opcode;
        let (factors, addend, negate) = match (opcode, products.get(&a), products.get(&b)) {
            (Op::FAdd, Some(&factors), _) => (factors, b, None),
            (Op::FAdd, None, Some(&factors)) => (factors, a, None),
            (Op::FSub, Some(&factors), _) => (factors, b, Some(Term::Addend)),
            (Op::FSub, None, Some(&factors)) => (factors, a, Some(Term::Product)),
            _ => return None,
        };
        let mut terms = [factors[0], factors[1], addend];
        let mut made = Vec::new();
        if let Some(term) = negate {
            let id = builder.id();
            let place = &mut terms[term as usize];
            let operand = vec![Operand::IdRef(*place)];
            made.push(Instruction::new(Op::FNegate, instruction.result_type, Some(id), operand));
            *place = id;
        }
        made.extend(make(instruction, terms, builder));
        Some(made)
    });
}

/// What a difference negates, by its place in a fused multiply-add.
#[derive(Clone, Copy)]
enum Term {
    Product = 0,
    Addend = 2,
}

/// Besides, simplifies as if numbers were real: `(a - b) + b`, `c - (c - a)`, `a + (b - b)`, `(x c1) c2`.
pub fn reassociate(builder: &mut Builder) {
    undecorate(builder);
    let module = builder.module_ref();
    let [differences, products] = [Op::FSub, Op::FMul].map(|opcode| operands(module, opcode));
    let constants = float_constants(module);
    rewrite(builder, |instruction, [a, b], builder| {
        let opcode = instruction.class.opcode;
        let (ty, result) = (instruction.result_type, instruction.result_id);
        let copy = |id| Some(vec![Instruction::new(Op::CopyObject, ty, result, vec![Operand::IdRef(id)])]);
        match (opcode, differences.get(&a), differences.get(&b)) {
            (Op::FAdd, Some(&[x, y]), _) if y == b => copy(x),
            (Op::FAdd, _, Some(&[x, y])) if x == y => copy(a),
            (Op::FSub, _, Some(&[x, y])) if x == a => copy(y),
            (Op::FMul, ..) => {
                let &[x, c1] = products.get(&a)?;
                let product = constants.get(&c1)? * constants.get(&b)?;
                let constant = builder.constant_bit32(ty?, product.to_bits());
                let scaled = vec![Operand::IdRef(x), Operand::IdRef(constant)];
                Some(vec![Instruction::new(Op::FMul, ty, result, scaled)])
            }
            _ => None,
        }
    });
}

/// Has the memory of the workgroup, where traversals keep what is pending and what they have crossed, begin with leaves that hold no triangle: what
/// nobody may read.
pub fn poison_shared(builder: &mut Builder) {
    let Some(Shared { variables, pointer }) = shared(builder.module_ref()) else { return };
    let word = builder.type_int(32, 0);
    let input = builder.type_pointer(None, StorageClass::Input, word);
    let invocation = builder.variable(input, None, StorageClass::Input, None);
    let index = Operand::BuiltIn(BuiltIn::LocalInvocationIndex);
    builder.decorate(invocation, Decoration::BuiltIn, [index]);
    let poison = builder.constant_bit32(word, LEAF);
    let instruction = |opcode, kind, id, operands: &[Word]| {
        Instruction::new(opcode, kind, id, operands.iter().copied().map(Operand::IdRef).collect())
    };
    let at = builder.id();
    let mut added = vec![instruction(Op::Load, Some(word), Some(at), &[invocation])];
    for (variable, words) in variables {
        for first in (0..words).step_by(Scratch::INVOCATIONS as usize) {
            let first = builder.constant_bit32(word, first);
            let [place, pointed] = [builder.id(), builder.id()];
            added.push(instruction(Op::IAdd, Some(word), Some(place), &[at, first]));
            added.push(instruction(Op::AccessChain, Some(pointer), Some(pointed), &[variable, place]));
            added.push(instruction(Op::Store, None, None, &[pointed, poison]));
        }
    }
    let module = builder.module_mut();
    module.entry_points[0].operands.push(Operand::IdRef(invocation));
    let entry = module.entry_points[0].operands[1].id_ref_any();
    let function = module.functions.iter_mut().find(|f| f.def_id() == entry);
    let block = &mut function.expect("an entry point has a function").blocks[0].instructions;
    let variables = block.iter().take_while(|i| i.class.opcode == Op::Variable).count();
    block.splice(variables..variables, added);
}

/// Besides, nothing is ever written into it by traversals.
pub fn forget_shared(builder: &mut Builder) {
    let Some(Shared { pointer, .. }) = shared(builder.module_ref()) else { return };
    let places = |i: &Instruction| (i.result_type == Some(pointer)).then_some(i.result_id);
    let places: Vec<_> = builder.module_ref().all_inst_iter().filter_map(places).collect();
    for block in builder.module_mut().functions.iter_mut().flat_map(|f| &mut f.blocks) {
        let is_shared = |i: &Instruction| i.class.opcode == Op::Store && places.contains(&i.operands[0].id_ref_any());
        block.instructions.retain(|i| !is_shared(i));
    }
    poison_shared(builder);
}

/// What a module has in the memory of the workgroup.
struct Shared {
    /// The variables: the rings of traversals and the lists of crossings, each with its number of words.
    variables: Vec<(Word, u32)>,
    /// The type of pointers to words.
    pointer: Word,
}

/// That of a module that traces rays.
fn shared(module: &Module) -> Option<Shared> {
    let globals = &module.types_global_values;
    let of_workgroup = |i: &&Instruction| i.operands.first() == Some(&Operand::StorageClass(StorageClass::Workgroup));
    let defined = |id: Option<Word>| globals.iter().find(|i| i.result_id == id);
    // what a pointer points to
    let pointee = |pointer: &Instruction| defined(pointer.operands[1].id_ref_any());
    let found = |opcode| globals.iter().filter(of_workgroup).filter(move |i| i.class.opcode == opcode);
    let variables = found(Op::Variable).filter_map(|variable| {
        let array = pointee(defined(variable.result_type)?)?;
        let length = defined(array.operands[1].id_ref_any())?;
        Some((variable.result_id?, length.operands[0].unwrap_literal_bit32()))
    });
    let pointer = found(Op::TypePointer).find(|i| pointee(i).is_some_and(|of| of.class.opcode == Op::TypeInt))?;
    Some(Shared { variables: variables.collect(), pointer: pointer.result_id? })
}

/// The two operands of each instruction with that opcode.
fn operands(module: &Module, opcode: Op) -> HashMap<Word, [Word; 2]> {
    module
        .all_inst_iter()
        .filter(|i| i.class.opcode == opcode)
        .filter_map(|i| Some((i.result_id?, two_ids(i)?)))
        .collect()
}

fn two_ids(instruction: &Instruction) -> Option<[Word; 2]> {
    match instruction.operands[..] {
        [Operand::IdRef(a), Operand::IdRef(b)] => Some([a, b]),
        _ => None,
    }
}

fn float_constants(module: &Module) -> HashMap<Word, f32> {
    let is_float = |id| {
        let types = &module.types_global_values;
        types.iter().any(|t| t.result_id == id && t.class.opcode == Op::TypeFloat)
    };
    let constants = module.types_global_values.iter().filter(|i| i.class.opcode == Op::Constant);
    constants
        .filter(|i| is_float(i.result_type))
        .filter_map(|i| match i.operands[..] {
            [Operand::LiteralBit32(bits)] => Some((i.result_id?, f32::from_bits(bits))),
            _ => None,
        })
        .collect()
}

/// Replaces instructions of two operands by what `change` makes of them.
fn rewrite(
    builder: &mut Builder,
    mut change: impl FnMut(&Instruction, [Word; 2], &mut Builder) -> Option<Vec<Instruction>>,
) {
    let mut functions = std::mem::take(&mut builder.module_mut().functions);
    for block in functions.iter_mut().flat_map(|f| &mut f.blocks) {
        let old = std::mem::take(&mut block.instructions);
        let changed = old.into_iter().flat_map(|i| {
            let changed = two_ids(&i).and_then(|ids| change(&i, ids, builder));
            changed.unwrap_or_else(|| vec![i])
        });
        block.instructions = changed.collect();
    }
    builder.module_mut().functions = functions;
}
