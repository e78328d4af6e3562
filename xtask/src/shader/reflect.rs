//! Reflection: what a module expects of its host, and whether the kernel's descriptor says the same.

use std::collections::{BTreeMap, HashMap};

use restir_kernels::{Access, KernelDesc};
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, ExecutionMode, Op, StorageClass, Word};

use super::module::{decorations, entry_name, globals, id_operand, literal_operand};

/// The interface of a module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Name of the entry point.
    pub entry: String,
    /// Workgroup size.
    pub workgroup: [u32; 3],
    /// Storage buffers by (set, binding).
    pub buffers: Vec<Buffer>,
    /// Default values of the specialization constants by their `SpecId`.
    pub constants: BTreeMap<u32, u32>,
}

/// A storage buffer as the module declares it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Buffer {
    /// Descriptor set.
    pub set: u32,
    /// Binding number.
    pub binding: u32,
    /// What it holds.
    pub contents: Contents,
}

/// What a storage buffer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Contents {
    /// One block of this many bytes.
    Block(u32),
    /// An array with this stride in bytes.
    Array(u32),
}

/// Reads the interface of a module with one entry point. The error is a sentence.
pub fn reflect(module: &Module) -> Result<Interface, String> {
    let types = Types::new(module);
    let resources = module.types_global_values.iter().filter(|i| is_resource(i));
    let mut buffers = resources.map(|variable| types.buffer(variable)).collect::<Result<Vec<_>, _>>()?;
    buffers.sort_unstable();
    let constants = module.types_global_values.iter().filter_map(|i| types.constant(i)).collect();
    Ok(Interface { entry: entry_name(module), workgroup: workgroup(module)?, buffers, constants })
}

fn workgroup(module: &Module) -> Result<[u32; 3], String> {
    let size = Operand::ExecutionMode(ExecutionMode::LocalSize);
    let mode = module.execution_modes.iter().find(|i| i.operands.get(1) == Some(&size));
    mode.and_then(|i| Some([literal_operand(i, 2)?, literal_operand(i, 3)?, literal_operand(i, 4)?]))
        .ok_or_else(|| "the module declares no workgroup size".to_owned())
}

/// A variable that the host binds; built-in inputs and private variables are none.
fn is_resource(instruction: &Instruction) -> bool {
    use StorageClass::*;
    instruction.class.opcode == Op::Variable
        && !matches!(instruction.operands.first(), Some(Operand::StorageClass(Input | Private | Function | Workgroup)))
}

/// Types and their layout decorations.
struct Types<'a> {
    globals: HashMap<Word, &'a Instruction>,
    decorations: HashMap<(Word, Decoration), u32>,
    offsets: HashMap<(Word, u32), u32>,
}

impl<'a> Types<'a> {
    fn new(module: &'a Module) -> Self {
        let offsets = module.annotations.iter().filter_map(|i| match i.operands[..] {
            [
                Operand::IdRef(target),
                Operand::LiteralBit32(member),
                Operand::Decoration(Decoration::Offset),
                Operand::LiteralBit32(offset),
            ] => Some(((target, member), offset)),
            _ => None,
        });
        let decorations = decorations(module).filter_map(|(id, decoration, value)| Some(((id, decoration), value?)));
        Self { globals: globals(module), decorations: decorations.collect(), offsets: offsets.collect() }
    }

    /// `SpecId` and default value.
    fn constant(&self, instruction: &Instruction) -> Option<(u32, u32)> {
        let id = self.decorations.get(&(instruction.result_id?, Decoration::SpecId))?;
        Some((*id, literal_operand(instruction, 0)?))
    }

    fn buffer(&self, variable: &Instruction) -> Result<Buffer, String> {
        let id = variable.result_id.unwrap_or_default();
        let place = |decoration| self.decorations.get(&(id, decoration)).copied();
        let (Some(set), Some(binding)) = (place(Decoration::DescriptorSet), place(Decoration::Binding)) else {
            return Err(format!("the variable %{id} has no set and binding"));
        };
        if variable.operands.first() != Some(&Operand::StorageClass(StorageClass::StorageBuffer)) {
            return Err(format!("set {set} binding {binding} is not a storage buffer, and kernels bind nothing else"));
        }
        let contents = variable
            .result_type
            .and_then(|pointer| id_operand(self.globals.get(&pointer)?, 1))
            .and_then(|pointee| self.contents(pointee))
            .ok_or_else(|| format!("the layout of set {set} binding {binding} cannot be read"))?;
        Ok(Buffer { set, binding, contents })
    }

    /// Contents of a block: rust-gpu wraps both arrays and parameter structs in a struct with one member.
    fn contents(&self, block: Word) -> Option<Contents> {
        let members = &self.globals.get(&block)?.operands;
        if let [Operand::IdRef(member)] = members[..]
            && self.globals.get(&member)?.class.opcode == Op::TypeRuntimeArray
        {
            return self.decorations.get(&(member, Decoration::ArrayStride)).copied().map(Contents::Array);
        }
        self.size(block).map(Contents::Block)
    }

    /// Size of a type with explicit layout: up to the end of its last member.
    fn size(&self, id: Word) -> Option<u32> {
        let instruction = self.globals.get(&id)?;
        match instruction.class.opcode {
            Op::TypeInt | Op::TypeFloat => literal_operand(instruction, 0).map(|bits| bits / 8),
            Op::TypeVector => Some(self.size(id_operand(instruction, 0)?)? * literal_operand(instruction, 1)?),
            Op::TypeArray => {
                let length = self.globals.get(&id_operand(instruction, 1)?)?;
                let stride = self.decorations.get(&(id, Decoration::ArrayStride))?;
                Some(stride * literal_operand(length, 0)?)
            }
            Op::TypeStruct => {
                let end = |(member, index)| {
                    Some(self.offsets.get(&(id, index))? + self.size(id_operand(instruction, member)?)?)
                };
                (0..instruction.operands.len()).zip(0..).map(end).try_fold(0, |largest, end| Some(end?.max(largest)))
            }
            _ => None,
        }
    }
}

/// Differences between a module and the descriptor of its kernel, as sentences.
pub fn compare(module: &Interface, kernel: &KernelDesc) -> Vec<String> {
    let mut findings = Vec::new();
    let mut compare = |what: String, verb, found: Option<String>, declared: Option<String>| match (found, declared) {
        (Some(found), Some(declared)) if found != declared => {
            findings.push(format!("{what} {verb} {found} in the module, {declared} in the descriptor"));
        }
        (None, Some(_)) => findings
            .push(format!("{what} is not in the module: the kernel does not use it, remove it from the declaration")),
        (Some(_), None) => findings.push(format!("{what} is not in the descriptor")),
        _ => {}
    };
    let names = [&module.entry, kernel.name].map(|name| Some(format!("`{name}`")));
    let sizes = [module.workgroup, kernel.workgroup].map(|size| Some(format!("{size:?}")));
    for (what, [found, declared]) in [("the entry point", names), ("the workgroup", sizes)] {
        compare(what.to_owned(), "is", found, declared);
    }
    for (binding, declared) in (0..).zip(kernel.bindings) {
        let expected = match declared.access {
            Access::Params => Contents::Block(declared.stride),
            Access::Read | Access::Own => Contents::Array(declared.stride),
        };
        let found = module.buffers.iter().find(|b| (b.set, b.binding) == (0, binding)).map(|b| b.contents.to_string());
        compare(format!("binding {binding} (`{}`)", declared.name), "holds", found, Some(expected.to_string()));
    }
    for extra in module.buffers.iter().filter(|b| b.set != 0 || b.binding as usize >= kernel.bindings.len()) {
        let found = Some(extra.contents.to_string());
        compare(format!("set {} binding {}", extra.set, extra.binding), "holds", found, None);
    }
    for declared in kernel.constants {
        let found = module.constants.get(&declared.id).map(u32::to_string);
        let what = format!("constant {} (`{}`)", declared.id, declared.name);
        compare(what, "defaults to", found, Some(declared.default.to_string()));
    }
    for (id, default) in module.constants.iter().filter(|(id, _)| kernel.constants.iter().all(|c| c.id != **id)) {
        compare(format!("constant {id}"), "defaults to", Some(default.to_string()), None);
    }
    findings
}

impl std::fmt::Display for Contents {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Block(size) => write!(f, "a block of {size} bytes"),
            Self::Array(stride) => write!(f, "an array of {stride}-byte elements"),
        }
    }
}
