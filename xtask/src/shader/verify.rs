//! Every check of a finished module that needs no external tool: contract, limits, interface, portability.

use restir_kernels::KernelDesc;

use super::flavour::{Entry, Flavour};
use super::{allow, limits, module, portable, reflect};

/// Checks a binary against its kernel's descriptor. Findings are sentences that name the module.
pub fn verify(entry: &Entry, bytes: &[u8], kernel: &KernelDesc) -> Vec<String> {
    let findings = module::parse(bytes).and_then(|module| {
        let interface = reflect::reflect(&module)?;
        let mut findings = reflect::compare(&interface, kernel);
        findings.extend(limits::check(&module, &interface, kernel));
        match entry.flavour {
            Flavour::Exact => findings.extend(allow::check(&module).iter().map(ToString::to_string)),
            Flavour::Fast => findings.extend(portable::check(bytes, kernel.name)),
        }
        Ok(findings)
    });
    let findings = findings.unwrap_or_else(|reason| vec![reason]);
    findings.into_iter().map(|finding| format!("{entry}: {finding}")).collect()
}
