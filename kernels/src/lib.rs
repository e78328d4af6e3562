//! The entry points. A kernel is one file with one `kernel!` declaration, and a line in the `mod.rs` of its folder; entry,
//! native twin and [`KernelDesc`] come from that declaration. A technique is a folder, and a line below.
#![cfg_attr(target_arch = "spirv", no_std)]

#[macro_use]
mod kernel;
#[cfg(not(target_arch = "spirv"))]
mod desc;
#[cfg(not(target_arch = "spirv"))]
mod di_cases;
#[cfg(not(target_arch = "spirv"))]
pub mod probe;
#[cfg(not(target_arch = "spirv"))]
pub mod spirv;

#[cfg(not(target_arch = "spirv"))]
pub use desc::{Access, Binding, Case, CaseScene, CaseScenes, Constant, KernelDesc, NativeRow};

folders! {
    check,
    compact,
    di,
    film,
    path,
}
