//! The entry points. A kernel is one file with one `kernel!` declaration and its parity cases, and one line in
//! the list below; entry, native twin and [`KernelDesc`] come from that declaration.
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

kernels! {
    bsdf_check,
    compact_count,
    compact_gather,
    compact_scan,
    compact_sum,
    di_combine,
    di_exchange,
    di_gather,
    di_initial,
    di_offer,
    di_primary,
    di_shade,
    di_tiles,
    film_add,
    film_resolve,
    num_probe,
    path,
    sampler_check,
    self_check,
    #[cfg(feature = "size-probe")]
    size_probe,
}
