//! The allow-list: what may stand in an `exact` module. The final binary is the evidence, not the intention.
//!
//! Everything that is not listed in `permitted.txt` is forbidden. Listed are integer operations, comparisons, moves, control flow, the
//! float operations that Vulkan requires to be correctly rounded, and exact conversions. DETERMINISM.md says why.

use std::collections::HashSet;
use std::fmt;
use std::sync::LazyLock;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, ExecutionMode, MemoryModel, Op, StorageClass, Word};

use crate::module::{GLSL, decorations, id_operand, literal_operand, operation_name, string_operand};

/// Something in a module that breaks the contract.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Of the instruction.
    pub opcode: Op,
    /// Its result id, or the id that it refers to.
    pub id: Option<Word>,
    /// What is wrong and what to do.
    pub reason: String,
}

/// Lavapipe drops a constant zero whatever the module says, and with it the sign of the result.
const CONSTANT_ZERO: &str = "has a constant zero as an operand, which drivers drop without regard to the sign of zero: leave the \
                             operation out, or take the zero from data";

impl Violation {
    /// Nothing but the sign of a zero is at stake, which most results do not show: an operation has a constant zero as an operand.
    pub fn is_sign_of_zero(&self) -> bool {
        self.reason == CONSTANT_ZERO
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let id = self.id.map(|id| format!(" %{id}")).unwrap_or_default();
        write!(f, "Op{:?}{id}: {}", self.opcode, self.reason)
    }
}

/// Checks an `exact` module against the numeric contract.
pub fn check(module: &Module) -> Vec<Violation> {
    let context = Context::new(module);
    let instructions = module.all_inst_iter().filter_map(|instruction| {
        let opcode = instruction.class.opcode;
        let reason = if is_permitted("Op", opcode) {
            operand_problem(instruction).or_else(|| context.problem(instruction))?
        } else {
            why_forbidden(opcode).to_owned()
        };
        Some(Violation { opcode, id: instruction.result_id.or_else(|| id_operand(instruction, 0)), reason })
    });
    let missing = missing(module).into_iter().map(|(opcode, reason)| Violation { opcode, id: None, reason });
    instructions.chain(shared_variables(module)).chain(missing).collect()
}

/// Variables of a workgroup beyond two. In kernels of `restir` these are the rings of traversals and the lists of crossings, or the rays that a kernel
/// asks for: an invocation reads no word of them that it has not written itself. Of others nobody has shown that.
fn shared_variables(module: &Module) -> impl Iterator<Item = Violation> {
    let is_shared = |instruction: &&Instruction| {
        instruction.class.opcode == Op::Variable
            && instruction.operands.first() == Some(&Operand::StorageClass(StorageClass::Workgroup))
    };
    module.types_global_values.iter().filter(is_shared).skip(2).map(|instruction| Violation {
        opcode: Op::Variable,
        id: instruction.result_id,
        reason: "is a third variable of the workgroup: two are permitted, of which an invocation reads only what it has written".to_owned(),
    })
}

/// What instructions refer to.
struct Context {
    decorated: HashSet<Word>,
    glsl: HashSet<Word>,
    zeros: HashSet<Word>,
}

impl Context {
    fn new(module: &Module) -> Self {
        let glsl = module.ext_inst_imports.iter().filter(|i| string_operand(i, 0) == Some(GLSL));
        Self {
            decorated: decorations(module).filter(|d| d.1 == Decoration::NoContraction).map(|d| d.0).collect(),
            glsl: glsl.filter_map(|i| i.result_id).collect(),
            zeros: zeros(module),
        }
    }

    /// What depends on the rest of the module.
    fn problem(&self, instruction: &Instruction) -> Option<String> {
        match instruction.class.opcode {
            Op::FAdd | Op::FSub | Op::FMul | Op::FNegate | Op::VectorTimesScalar => {
                let decorated = instruction.result_id.is_some_and(|id| self.decorated.contains(&id));
                if !decorated {
                    return Some("is not decorated NoContraction, so the driver may fuse or reorder it".to_owned());
                }
                self.zero_problem(instruction)
            }
            Op::ExtInst => {
                let (set, name) = (id_operand(instruction, 0)?, operation_name(instruction));
                let exact = name.strip_prefix("GLSL.").is_some_and(|name| PERMITTED.contains(&("GLSL", name)));
                (!exact || !self.glsl.contains(&set)).then(|| format!("{name} is not exact on every device"))
            }
            _ => None,
        }
    }

    fn zero_problem(&self, instruction: &Instruction) -> Option<String> {
        let folds = matches!(instruction.class.opcode, Op::FAdd | Op::FSub | Op::FMul);
        let zero = (0..2).any(|index| id_operand(instruction, index).is_some_and(|id| self.zeros.contains(&id)));
        (folds && zero).then(|| CONSTANT_ZERO.to_owned())
    }
}

/// What must be present and is not.
fn missing(module: &Module) -> Vec<(Op, String)> {
    let mut missing = Vec::new();
    let model = module.memory_model.as_ref().and_then(|i| i.operands.get(1));
    if model != Some(&Operand::MemoryModel(MemoryModel::GLSL450)) {
        missing.push((Op::MemoryModel, "the memory model must be GLSL450".to_owned()));
    }
    for mode in [ExecutionMode::RoundingModeRTE, ExecutionMode::SignedZeroInfNanPreserve] {
        let operands = [Operand::ExecutionMode(mode), Operand::LiteralBit32(32)];
        if !module.execution_modes.iter().any(|i| i.operands.get(1..) == Some(&operands)) {
            missing.push((Op::ExecutionMode, format!("{mode:?} 32 is missing")));
        }
    }
    if module.entry_points.len() != 1 {
        missing.push((Op::EntryPoint, format!("{} entry points instead of one", module.entry_points.len())));
    }
    missing
}

/// Constants that hold a zero: scalars of either sign, and vectors with such a component. What they are made of stands
/// before them.
fn zeros(module: &Module) -> HashSet<Word> {
    let (mut floats, mut zeros) = (HashSet::new(), HashSet::new());
    for instruction in &module.types_global_values {
        let of = |set: &HashSet<Word>| {
            instruction.operands.iter().any(|o| matches!(o, Operand::IdRef(id) if set.contains(id)))
        };
        match instruction.class.opcode {
            Op::TypeFloat => floats.extend(instruction.result_id),
            Op::TypeVector if of(&floats) => floats.extend(instruction.result_id),
            _ if !instruction.result_type.is_some_and(|ty| floats.contains(&ty)) => {}
            Op::Constant if literal_operand(instruction, 0).is_none_or(|bits| bits & 0x7fff_ffff != 0) => {}
            Op::ConstantComposite if !of(&zeros) => {}
            Op::Constant | Op::ConstantNull | Op::ConstantComposite => zeros.extend(instruction.result_id),
            _ => {}
        }
    }
    zeros
}

/// What an instruction says by itself: capabilities, decorations, widths, storage.
fn operand_problem(instruction: &Instruction) -> Option<String> {
    match instruction.class.opcode {
        Op::TypeInt | Op::TypeFloat => {
            let width = literal_operand(instruction, 0)?;
            (width != 32).then(|| format!("{width}-bit types are outside the contract"))
        }
        Op::Extension => Some(format!("extension {} is not permitted", string_operand(instruction, 0)?))
            .filter(|_| string_operand(instruction, 0) != Some("SPV_KHR_float_controls")),
        _ => instruction.operands.iter().find_map(enumerant_problem),
    }
}

fn enumerant_problem(operand: &Operand) -> Option<String> {
    let permitted = match operand {
        Operand::Capability(capability) => is_permitted("Capability", capability),
        Operand::Decoration(decoration) => is_permitted("Decoration", decoration),
        Operand::ExecutionMode(mode) => is_permitted("ExecutionMode", mode),
        Operand::StorageClass(class) => is_permitted("StorageClass", class),
        Operand::LiteralSpecConstantOpInteger(opcode) => is_permitted("Op", opcode) && !is_float(*opcode),
        _ => true,
    };
    (!permitted).then(|| format!("{operand:?} is not permitted"))
}

fn is_float(opcode: Op) -> bool {
    let name = format!("{opcode:?}");
    name.starts_with('F') && !name.starts_with("Function")
}

/// The kinds and names of the list.
static PERMITTED: LazyLock<HashSet<(&str, &str)>> = LazyLock::new(|| {
    let lines = include_str!("permitted.txt").lines().filter(|line| !line.starts_with('#'));
    let lines = lines.filter_map(|line| line.split_once(char::is_whitespace));
    lines.flat_map(|(kind, names)| names.split_whitespace().map(move |name| (kind, name))).collect()
});

/// Whether the list has something, which is named as `rspirv` shows it.
fn is_permitted(kind: &str, name: impl fmt::Debug) -> bool {
    PERMITTED.contains(&(kind, format!("{name:?}").as_str()))
}

/// The most helpful thing to say about a forbidden opcode.
fn why_forbidden(opcode: Op) -> &'static str {
    use Op::*;
    match opcode {
        FDiv => {
            "division is not correctly rounded on a device: use restir_shared::num::div, and `const` for quotients of literals"
        }
        FRem | FMod => "a float remainder is not correctly rounded on a device: use restir_shared::num",
        Dot | OuterProduct | VectorTimesMatrix | MatrixTimesScalar | MatrixTimesVector | MatrixTimesMatrix => {
            "the order of evaluation is up to the driver: use restir_shared::vec"
        }
        ControlBarrier | MemoryBarrier => "kernels are barrier-free passes",
        _ => "is not on the list of permitted operations",
    }
}

#[cfg(test)]
mod tests {
    use rspirv::spirv::{Capability, GlslStd450Op};

    use super::*;

    #[test]
    fn the_list_has_no_name_that_there_is_not() {
        let opcodes: HashSet<String> = (0..=0xffff).filter_map(Op::from_u32).map(|op| format!("{op:?}")).collect();
        for &(kind, name) in PERMITTED.iter() {
            let known = match kind {
                "Capability" => name.parse::<Capability>().is_ok(),
                "Decoration" => name.parse::<Decoration>().is_ok(),
                "ExecutionMode" => name.parse::<ExecutionMode>().is_ok(),
                "StorageClass" => name.parse::<StorageClass>().is_ok(),
                "GLSL" => (0..100).filter_map(GlslStd450Op::from_u32).any(|op| format!("{op:?}") == name),
                _ => kind == "Op" && opcodes.contains(name),
            };
            assert!(known, "{kind} {name}");
        }
    }
}
