//! Reflection: what a module expects of its host, and whether the kernel's descriptor says the same.

use std::collections::HashMap;

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
    /// Specialization constants by id.
    pub constants: Vec<SpecConstant>,
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

/// A specialization constant as the module declares it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SpecConstant {
    /// `SpecId`.
    pub id: u32,
    /// Default value.
    pub default: u32,
}

/// Reads the interface of a module with one entry point. The error is a sentence.
pub fn reflect(module: &Module) -> Result<Interface, String> {
    let types = Types::new(module);
    let mut buffers = Vec::new();
    for variable in module.types_global_values.iter().filter(|i| is_resource(i)) {
        buffers.push(types.buffer(variable)?);
    }
    buffers.sort_unstable();
    let mut constants: Vec<_> = module.types_global_values.iter().filter_map(|i| types.constant(i)).collect();
    constants.sort_unstable();
    Ok(Interface { entry: entry_name(module), workgroup: workgroup(module)?, buffers, constants })
}

fn workgroup(module: &Module) -> Result<[u32; 3], String> {
    module
        .execution_modes
        .iter()
        .find_map(|i| match i.operands[..] {
            [
                _,
                Operand::ExecutionMode(ExecutionMode::LocalSize),
                Operand::LiteralBit32(x),
                Operand::LiteralBit32(y),
                Operand::LiteralBit32(z),
            ] => Some([x, y, z]),
            _ => None,
        })
        .ok_or_else(|| "the module declares no workgroup size".to_owned())
}

/// A variable that the host binds; built-in inputs and private variables are none.
fn is_resource(instruction: &Instruction) -> bool {
    use StorageClass::*;
    instruction.class.opcode == Op::Variable
        && !matches!(instruction.operands.first(), Some(Operand::StorageClass(Input | Private | Function)))
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

    fn constant(&self, instruction: &Instruction) -> Option<SpecConstant> {
        let id = *self.decorations.get(&(instruction.result_id?, Decoration::SpecId))?;
        Some(SpecConstant { id, default: literal_operand(instruction, 0)? })
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
                let mut end = 0;
                for (member, index) in (0..instruction.operands.len()).zip(0..) {
                    let offset = self.offsets.get(&(id, index))?;
                    end = end.max(offset + self.size(id_operand(instruction, member)?)?);
                }
                Some(end)
            }
            _ => None,
        }
    }
}

/// Differences between a module and the descriptor of its kernel, as sentences.
pub fn compare(module: &Interface, kernel: &KernelDesc) -> Vec<String> {
    let mut findings = Vec::new();
    if module.entry != kernel.name {
        findings
            .push(format!("the entry point is `{}` in the module, `{}` in the descriptor", module.entry, kernel.name));
    }
    if module.workgroup != kernel.workgroup {
        findings.push(format!(
            "the workgroup is {:?} in the module, {:?} in the descriptor",
            module.workgroup, kernel.workgroup
        ));
    }
    compare_bindings(module, kernel, &mut findings);
    compare_constants(module, kernel, &mut findings);
    findings
}

fn compare_bindings(module: &Interface, kernel: &KernelDesc, findings: &mut Vec<String>) {
    for (binding, declared) in (0..).zip(kernel.bindings) {
        let expected = match declared.access {
            Access::Params => Contents::Block(declared.stride),
            Access::Read | Access::Own => Contents::Array(declared.stride),
        };
        let name = declared.name;
        match module.buffers.iter().find(|b| b.set == 0 && b.binding == binding) {
            None => findings.push(format!(
                "binding {binding} (`{name}`) is not in the module: the kernel does not use it, remove it from the declaration"
            )),
            Some(found) if found.contents != expected => findings.push(format!(
                "binding {binding} (`{name}`) holds {} in the module, {} in the descriptor",
                found.contents, expected
            )),
            Some(_) => {}
        }
    }
    for extra in module.buffers.iter().filter(|b| b.set != 0 || b.binding as usize >= kernel.bindings.len()) {
        findings.push(format!("set {} binding {} is not in the descriptor", extra.set, extra.binding));
    }
}

fn compare_constants(module: &Interface, kernel: &KernelDesc, findings: &mut Vec<String>) {
    for declared in kernel.constants {
        let (name, id) = (declared.name, declared.id);
        match module.constants.iter().find(|c| c.id == id) {
            None => findings.push(format!(
                "constant {id} (`{name}`) is not in the module: the kernel does not use it, remove it from the declaration"
            )),
            Some(found) if found.default != declared.default => findings.push(format!(
                "constant {id} (`{name}`) defaults to {} in the module, {} in the descriptor",
                found.default, declared.default
            )),
            Some(_) => {}
        }
    }
    for extra in module.constants.iter().filter(|c| kernel.constants.iter().all(|d| d.id != c.id)) {
        findings.push(format!("constant {} is not in the descriptor", extra.id));
    }
}

impl std::fmt::Display for Contents {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Block(size) => write!(f, "a block of {size} bytes"),
            Self::Array(stride) => write!(f, "an array of {stride}-byte elements"),
        }
    }
}
