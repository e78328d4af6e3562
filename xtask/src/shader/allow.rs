//! The allow-list: what may stand in an `exact` module. The final binary is the evidence, not the intention.
//!
//! Everything that is not listed in `permitted.txt` is forbidden. Listed are integer operations, comparisons, moves, control flow, the
//! float operations that Vulkan requires to be correctly rounded, and exact conversions. DETERMINISM.md says why.

use std::collections::HashSet;
use std::fmt;
use std::sync::LazyLock;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, ExecutionMode, GlslStd450Op, MemoryModel, Op, Word};

use super::ext_inst;
use super::module::{decorations, entry_name, globals, id_operand, literal_operand, parse, string_operand};

/// Something in a module that breaks the contract.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Name of the entry point.
    pub kernel: String,
    /// The instruction, without the prefix `Op`.
    pub opcode: String,
    /// Its result id, or the id that it refers to.
    pub id: Option<Word>,
    /// What is wrong and what to do.
    pub reason: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "kernel `{}`: Op{}", self.kernel, self.opcode)?;
        if let Some(id) = self.id {
            write!(f, " %{id}")?;
        }
        write!(f, ": {}", self.reason)
    }
}

/// Checks the binary of an `exact` module against the numeric contract.
pub fn check_exact(bytes: &[u8]) -> Result<(), Vec<Violation>> {
    let module = parse(bytes)
        .map_err(|reason| vec![Violation { kernel: "?".to_owned(), opcode: "Nop".to_owned(), id: None, reason }])?;
    let violations = check_module(&module);
    if violations.is_empty() { Ok(()) } else { Err(violations) }
}

/// As [`check_exact`], for a parsed module.
pub fn check_module(module: &Module) -> Vec<Violation> {
    let mut checker = Checker::new(module);
    module.all_inst_iter().for_each(|instruction| checker.instruction(instruction));
    checker.header(module);
    checker.violations
}

struct Checker {
    kernel: String,
    decorated: HashSet<Word>,
    glsl: HashSet<Word>,
    zeros: HashSet<Word>,
    violations: Vec<Violation>,
}

impl Checker {
    fn new(module: &Module) -> Self {
        let glsl = module.ext_inst_imports.iter().filter(|i| string_operand(i, 0) == Some(ext_inst::GLSL));
        Self {
            kernel: entry_name(module),
            decorated: decorations(module).filter(|d| d.1 == Decoration::NoContraction).map(|d| d.0).collect(),
            glsl: glsl.filter_map(|i| i.result_id).collect(),
            zeros: zeros(module),
            violations: Vec::new(),
        }
    }

    fn instruction(&mut self, instruction: &Instruction) {
        let opcode = instruction.class.opcode;
        let problem = if is_permitted("Op", opcode) {
            operand_problem(instruction).or_else(|| self.context_problem(instruction))
        } else {
            Some(why_forbidden(opcode).to_owned())
        };
        if let Some(reason) = problem {
            let id = instruction.result_id.or_else(|| id_operand(instruction, 0));
            self.violation(opcode, id, reason);
        }
    }

    /// What depends on the rest of the module.
    fn context_problem(&self, instruction: &Instruction) -> Option<String> {
        match instruction.class.opcode {
            Op::FAdd | Op::FSub | Op::FMul | Op::FNegate | Op::VectorTimesScalar => {
                let decorated = instruction.result_id.is_some_and(|id| self.decorated.contains(&id));
                if !decorated {
                    return Some("is not decorated NoContraction, so the driver may fuse or reorder it".to_owned());
                }
                self.zero_problem(instruction)
            }
            Op::ExtInst => {
                let set = id_operand(instruction, 0)?;
                let number = ext_inst::number(instruction)?;
                let permitted = self.glsl.contains(&set)
                    && GlslStd450Op::from_u32(number).is_some_and(|op| is_permitted("GLSL", op));
                (!permitted).then(|| format!("{} is not exact on every device", ext_inst::name(number)))
            }
            _ => None,
        }
    }

    /// Lavapipe drops a constant zero whatever the module says, and with it the sign of the result.
    fn zero_problem(&self, instruction: &Instruction) -> Option<String> {
        let folds = matches!(instruction.class.opcode, Op::FAdd | Op::FSub | Op::FMul);
        let zero = (0..2).any(|index| id_operand(instruction, index).is_some_and(|id| self.zeros.contains(&id)));
        (folds && zero).then(|| {
            "has a constant zero as an operand, which drivers drop without regard to the sign of zero: leave the \
             operation out, or take the zero from data"
                .to_owned()
        })
    }

    /// What must be present.
    fn header(&mut self, module: &Module) {
        let model = module.memory_model.as_ref().and_then(|i| i.operands.get(1));
        if model != Some(&Operand::MemoryModel(MemoryModel::GLSL450)) {
            self.violation(Op::MemoryModel, None, "the memory model must be GLSL450".to_owned());
        }
        for mode in [ExecutionMode::RoundingModeRTE, ExecutionMode::SignedZeroInfNanPreserve] {
            let present = module
                .execution_modes
                .iter()
                .any(|i| i.operands.get(1) == Some(&Operand::ExecutionMode(mode)) && literal_operand(i, 2) == Some(32));
            if !present {
                self.violation(Op::ExecutionMode, None, format!("{mode:?} 32 is missing"));
            }
        }
        if module.entry_points.len() != 1 {
            let reason = format!("{} entry points instead of one", module.entry_points.len());
            self.violation(Op::EntryPoint, None, reason);
        }
    }

    fn violation(&mut self, opcode: Op, id: Option<Word>, reason: String) {
        let opcode = format!("{opcode:?}");
        self.violations.push(Violation { kernel: self.kernel.clone(), opcode, id, reason });
    }
}

/// Constants that hold a zero: scalars of either sign, and vectors with such a component.
fn zeros(module: &Module) -> HashSet<Word> {
    let globals = globals(module);
    let is_float = |ty: Option<Word>| {
        let component = |i: &Instruction| match i.class.opcode {
            Op::TypeVector => id_operand(i, 0),
            _ => i.result_id,
        };
        ty.and_then(|ty| component(globals.get(&ty)?))
            .and_then(|ty| globals.get(&ty))
            .is_some_and(|i| i.class.opcode == Op::TypeFloat)
    };
    let mut zeros = HashSet::new();
    for constant in module.types_global_values.iter().filter(|i| is_float(i.result_type)) {
        let is_zero = match constant.class.opcode {
            Op::Constant => literal_operand(constant, 0).is_some_and(|bits| bits & 0x7fff_ffff == 0),
            Op::ConstantNull => true,
            // constants stand before what they are parts of
            Op::ConstantComposite => {
                (0..constant.operands.len()).any(|at| id_operand(constant, at).is_some_and(|id| zeros.contains(&id)))
            }
            _ => false,
        };
        zeros.extend(constant.result_id.filter(|_| is_zero));
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
    let words = lines.map(str::split_whitespace);
    words
        .flat_map(|mut words| {
            words.next().into_iter().flat_map(move |kind| words.clone().map(move |name| (kind, name)))
        })
        .collect()
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
    use rspirv::spirv::{Capability, StorageClass};

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
