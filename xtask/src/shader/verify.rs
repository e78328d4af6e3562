//! Every check of a finished module that needs no external tool: contract, limits, interface, portability.

use restir_kernels::KernelDesc;

use super::flavour::Flavour;
use super::{allow, limits, module, portable, reflect};

/// Checks a binary against its kernel's descriptor. Findings are sentences that name the kernel and the flavour.
pub fn verify(bytes: &[u8], flavour: Flavour, kernel: &KernelDesc) -> Vec<String> {
    let findings = match module::parse(bytes) {
        Ok(module) => verify_module(&module, bytes, flavour, kernel),
        Err(reason) => vec![reason],
    };
    findings.into_iter().map(|finding| format!("{flavour}/{}: {finding}", kernel.name)).collect()
}

fn verify_module(module: &rspirv::dr::Module, bytes: &[u8], flavour: Flavour, kernel: &KernelDesc) -> Vec<String> {
    let mut findings = Vec::new();
    match reflect::reflect(module) {
        Ok(interface) => {
            findings.extend(reflect::compare(&interface, kernel));
            findings.extend(limits::check(module, &interface));
        }
        Err(reason) => findings.push(reason),
    }
    match flavour {
        Flavour::Exact => findings.extend(allow::check_module(module).iter().map(ToString::to_string)),
        Flavour::Fast => findings.extend(portable::check(bytes, kernel.name)),
    }
    findings
}

/// Differences between the entry points that were built and the kernels that the crate lists.
pub fn compare_entries<'a>(
    built: impl IntoIterator<Item = &'a str>,
    flavour: Flavour,
    kernels: &[&KernelDesc],
) -> Vec<String> {
    let built: Vec<&str> = built.into_iter().collect();
    let missing = kernels
        .iter()
        .filter(|k| !built.contains(&k.name))
        .map(|k| format!("{flavour}/{}: the kernel is listed, but there is no module for it", k.name));
    let extra = built
        .iter()
        .filter(|name| kernels.iter().all(|k| k.name != **name))
        .map(|name| format!("{flavour}/{name}: there is a module, but no kernel of this name is listed"));
    missing.chain(extra).collect()
}
