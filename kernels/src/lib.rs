//! The entry points. A kernel is one file with one `kernel!` declaration, and a line in the `mod.rs` of its folder; entry,
//! native twin and [`KernelDesc`] come from that declaration. A technique is a folder, and a line below.
#![cfg_attr(target_arch = "spirv", no_std)]

#[macro_use]
mod kernel;
#[cfg(feature = "cases")]
mod case;
#[cfg(not(target_arch = "spirv"))]
mod desc;
#[cfg(not(target_arch = "spirv"))]
pub mod spirv;

#[cfg(feature = "cases")]
pub use case::Case;
#[cfg(not(target_arch = "spirv"))]
pub use desc::{Access, Binding, Constant, KernelDesc, NativeRow};

folders! {
    check,
    compact,
    film,
    path,
    restir_di,
    restir_pt,
}

/// The parity cases of kernels that need no technique.
#[cfg(feature = "cases")]
pub fn cases() -> Vec<Case> {
    [check::cases(), compact::cases(), film::cases()].concat()
}
