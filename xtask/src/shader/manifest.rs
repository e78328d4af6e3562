//! `manifest.json`: what the committed modules are, and what they were made from and with.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::flavour::Flavour;
use super::module::{operation_name, operations, parse};
use super::toolchain::Identity;
use super::workspace::MANIFEST;
use crate::Error;

/// The whole manifest. It holds no time and no path of a machine, so equal inputs give equal files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The compiler and the optimiser.
    pub toolchain: Identity,
    /// Versions of the libraries that take part.
    pub tools: BTreeMap<String, String>,
    /// Digest of the source that the modules are made from.
    pub source_digest: String,
    /// The kernels by name.
    pub kernels: BTreeMap<String, KernelRecord>,
}

/// What a kernel compiled to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KernelRecord {
    /// Operations of the exact flavour for one of the fast flavour: a first measure of the price of exactness.
    pub exact_per_fast: f64,
    /// The exact module.
    pub exact: ModuleRecord,
    /// The fast module.
    pub fast: ModuleRecord,
}

/// A module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleRecord {
    /// Hash of the file.
    pub blake3: String,
    /// Size of the file.
    pub bytes: usize,
    /// Instructions inside functions.
    pub operations: usize,
    /// The same by opcode.
    pub histogram: BTreeMap<String, usize>,
}

impl KernelRecord {
    /// Describes a kernel by its two binaries.
    pub fn new(exact: &[u8], fast: &[u8]) -> Result<Self, String> {
        let (exact, fast) = (ModuleRecord::new(exact)?, ModuleRecord::new(fast)?);
        let ratio = exact.operations as f64 / fast.operations.max(1) as f64;
        Ok(Self { exact_per_fast: (ratio * 1000.0).round() / 1000.0, exact, fast })
    }

    /// The module of a flavour.
    pub fn module(&self, flavour: Flavour) -> &ModuleRecord {
        match flavour {
            Flavour::Exact => &self.exact,
            Flavour::Fast => &self.fast,
        }
    }
}

impl ModuleRecord {
    /// Describes a binary.
    pub fn new(bytes: &[u8]) -> Result<Self, String> {
        let module = parse(bytes)?;
        let mut histogram = BTreeMap::new();
        for operation in operations(&module) {
            *histogram.entry(operation_name(operation)).or_default() += 1;
        }
        let operations = operations(&module).count();
        Ok(Self { blake3: hash(bytes), bytes: bytes.len(), operations, histogram })
    }
}

/// Hash of a module, as the manifest writes it.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

impl Manifest {
    /// Reads the manifest in a directory of modules.
    pub fn read(spirv: &Path) -> Result<Self, Error> {
        let path = spirv.join(MANIFEST);
        let failed =
            |what: String| Error::Failed(format!("{}: {what}: run `cargo xtask shader build`", path.display()));
        let text = std::fs::read_to_string(&path).map_err(|e| failed(format!("it cannot be read ({e})")))?;
        serde_json::from_str(&text).map_err(|e| failed(format!("it is damaged ({e})")))
    }

    /// The text of the file.
    pub fn to_json(&self) -> Result<String, Error> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::Failed(format!("manifest: {e}")))?;
        Ok(text + "\n")
    }
}
