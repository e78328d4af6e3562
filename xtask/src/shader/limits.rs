//! What a kernel may cost: limits that let a device with default limits run it, in both flavours.

use restir_kernels::{KernelDesc, Rays};
use rspirv::dr::{Module, Operand};
use rspirv::spirv::{Op, StorageClass};

use super::module::operations;
use super::reflect::Interface;

/// Instructions inside functions: a larger kernel's first dispatch takes more than 4 s on lavapipe (docs/size-probe.md).
pub const MAX_OPERATIONS: usize = 25_000;
/// `maxStorageBuffersPerShaderStage` of a WebGPU device with default limits.
pub const MAX_STORAGE_BUFFERS: usize = 8;
/// Buffers of a kernel whose rays are traced elsewhere, by something that no browser has.
pub const MAX_STORAGE_BUFFERS_DEFERRED: usize = 10;

/// Findings as sentences.
pub fn check(module: &Module, interface: &Interface, kernel: &KernelDesc) -> Vec<String> {
    let mut findings = Vec::new();
    let count = operations(module).count();
    if count > MAX_OPERATIONS {
        findings.push(format!("{count} operations, and {MAX_OPERATIONS} are the limit: split the pass"));
    }
    let buffers = interface.buffers.len();
    let most = if kernel.is_deferred() { MAX_STORAGE_BUFFERS_DEFERRED } else { MAX_STORAGE_BUFFERS };
    if buffers > most {
        findings.push(format!("{buffers} storage buffers, and {most} are the limit: merge arrays"));
    }
    if matches!(kernel.rays, Rays::None) && !kernel.is_deferred() && traverses(module) {
        findings.push("it traces rays: its declaration must not say `rays Rays::None`".to_owned());
    }
    for (index, buffer) in interface.buffers.iter().enumerate() {
        if (buffer.set, buffer.binding as usize) != (0, index) {
            findings.push(format!(
                "a buffer at set {} binding {} where set 0 binding {index} is due: bindings are dense from 0 in set 0",
                buffer.set, buffer.binding
            ));
        }
    }
    findings
}

/// Whether rays are traced: only traversals use memory of the workgroup.
fn traverses(module: &Module) -> bool {
    let class = Some(&Operand::StorageClass(StorageClass::Workgroup));
    module.types_global_values.iter().any(|i| i.class.opcode == Op::Variable && i.operands.first() == class)
}
