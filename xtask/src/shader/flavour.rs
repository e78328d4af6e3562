//! The two builds of every kernel.

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
pub use restir_kernels::spirv::Flavour;

/// Takes the name of a flavour on a command line.
pub fn parser() -> impl TypedValueParser<Value = Flavour> {
    PossibleValuesParser::new(["exact", "fast"]).map(|name| if name == "fast" { Flavour::Fast } else { Flavour::Exact })
}

/// A kernel in one of its builds.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// The build.
    pub flavour: Flavour,
    /// Name of the kernel.
    pub kernel: String,
}

impl Entry {
    /// The kernel of that name.
    pub fn new(flavour: Flavour, kernel: &str) -> Self {
        Self { flavour, kernel: kernel.to_owned() }
    }

    /// The module's path inside the directory of modules.
    pub fn path(&self) -> PathBuf {
        format!("{self}.spv").into()
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.flavour, self.kernel)
    }
}
