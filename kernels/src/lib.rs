//! The kernels: entry points for a device, each with its native twin and a descriptor ([`KernelDesc`]), and the compiled modules ([`spirv`]).
//!
//! A kernel is one file with one `kernel!` declaration, and a line in the `mod.rs` of its folder; entry, twin and descriptor come from that
//! declaration. A technique is a folder, and a line below.
//!
//! ```
//! use restir_kernels::film::film_add;
//! use restir_kernels::{Access, NativeRow, SimdLevel, all};
//!
//! // the descriptor says what a host has to bind
//! let kernel = &film_add::DESC;
//! assert!(all().iter().any(|listed| listed.name == kernel.name));
//! let bindings = kernel.bindings.iter().map(|binding| (binding.name, binding.access));
//! assert_eq!(bindings.collect::<Vec<_>>()[1..], [("left", Access::Read), ("right", Access::Own)]);
//!
//! // one row of its native twin, over an image of one pixel: 4 words each of the parameters and of the two planes
//! let (params, left) = ([1, 1, 0, 0], [2.0_f32, 0.5, 0.0, 0.0].map(f32::to_bits));
//! let mut right = [1.0_f32, 1.0, 1.0, 0.0].map(f32::to_bits);
//! (kernel.native)(&mut NativeRow {
//!     x: 0,
//!     y: 0,
//!     width: 1,
//!     constants: &[],
//!     params: &params,
//!     read: &[&left],
//!     own: &mut [&mut right],
//!     tracers: [None, None],
//!     frames: None,
//!     lanes: SimdLevel::best(),
//! });
//! assert_eq!(right.map(f32::from_bits), [3.0, 1.5, 1.0, 0.0]);
//! ```
#![cfg_attr(target_arch = "spirv", no_std)]

#[macro_use]
mod kernel;
#[cfg(feature = "cases")]
mod case;
#[cfg(not(target_arch = "spirv"))]
mod desc;
#[cfg(not(target_arch = "spirv"))]
mod simd;
#[cfg(not(target_arch = "spirv"))]
pub mod spirv;

#[cfg(feature = "cases")]
pub use case::Case;
#[cfg(not(target_arch = "spirv"))]
pub use desc::{Access, Binding, Constant, DeferredKernel, KernelDesc, NativeRow, Rays};
#[cfg(not(target_arch = "spirv"))]
pub use simd::{Avx2, Avx512, SimdLevel};

folders! {
    #[doc(hidden)]
    check,
    compact,
    denoise,
    film,
    path,
    #[macro_use]
    reuse,
    restir_di,
    restir_pt,
    restir_sss,
    restir_suffix,
}

/// The parity cases of kernels that need no technique.
#[cfg(feature = "cases")]
pub fn cases() -> Vec<Case> {
    [check::cases(), compact::cases(), film::cases()].concat()
}
