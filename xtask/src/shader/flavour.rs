//! The two builds of every kernel.

use std::fmt;

/// A build of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Flavour {
    /// Trusted operations only, decorated: the same bits as the native build.
    Exact,
    /// Native division, square root and intrinsics; also valid for WGSL, MSL, HLSL and GLSL.
    Fast,
}

impl Flavour {
    /// Both, in the order in which they are reported.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Fast];

    /// Name of its directory, and of its target directory.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Fast => "fast",
        }
    }

    /// Feature of the kernel crate that selects it.
    pub const fn feature(self) -> Option<&'static str> {
        match self {
            Self::Exact => None,
            Self::Fast => Some("fast"),
        }
    }
}

impl fmt::Display for Flavour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
