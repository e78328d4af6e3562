//! The compiled kernels: the files that `cargo xtask shader build` has written, embedded in this crate.
//!
//! A module is there in two flavours: `exact` gives the bits of the native twin on devices that keep the numeric contract, `fast` uses the
//! device's own division, roots and intrinsics.
//!
//! ```
//! use restir_kernels::spirv::{Flavour, file};
//!
//! for kernel in restir_kernels::all() {
//!     for flavour in Flavour::ALL {
//!         let module = file(&format!("{flavour}/{}.spv", kernel.name)).expect("a module of every kernel");
//!         // the magic number of SPIR-V
//!         assert_eq!(module[..4], 0x0723_0203_u32.to_le_bytes());
//!     }
//! }
//! assert!(file("manifest.json").is_some());
//! ```

use std::fmt;

/// Which build of the kernels a device runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flavour {
    /// The same bits as on the host, where the backend keeps the numeric contract.
    #[default]
    Exact,
    /// Native division, square root and intrinsics: statistically equal, faster.
    Fast,
}

impl Flavour {
    /// All flavours, in the order in which reports have them.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Fast];
}

impl fmt::Display for Flavour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Exact => "exact",
            Self::Fast => "fast",
        })
    }
}

/// All of them, under their paths in the folder `spirv` of this crate: `manifest.json`, and modules such as
/// `exact/path.spv`. What the manifest lists is there, but in a workspace in which somebody has removed it.
pub static FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/spirv.rs"));

/// The file at a path.
pub fn file(path: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
}
