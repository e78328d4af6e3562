//! What a kernel may cost: limits that let a device with default limits run it, in both flavours.

use rspirv::dr::Module;

use super::module::operations;
use super::reflect::Interface;

/// Instructions inside functions: a larger kernel's first dispatch takes more than 4 s on lavapipe (docs/size-probe.md).
pub const MAX_OPERATIONS: usize = 25_000;
/// `maxStorageBuffersPerShaderStage` of a WebGPU device with default limits.
pub const MAX_STORAGE_BUFFERS: usize = 8;

/// Findings as sentences.
pub fn check(module: &Module, interface: &Interface) -> Vec<String> {
    let mut findings = Vec::new();
    let count = operations(module).count();
    if count > MAX_OPERATIONS {
        findings.push(format!("{count} operations, and {MAX_OPERATIONS} are the limit: split the pass"));
    }
    let buffers = interface.buffers.len();
    if buffers > MAX_STORAGE_BUFFERS {
        findings.push(format!("{buffers} storage buffers, and {MAX_STORAGE_BUFFERS} are the limit: merge arrays"));
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
