//! ReSTIR DI, see [`restir_shared::technique::restir_di`].
//!
//! ```
//! use restir_kernels::restir_di::{di_combine, di_initial, di_shade};
//!
//! // the passes of a frame with reuse in time alone
//! let frame = [&di_initial::DESC, &di_combine::DESC, &di_shade::DESC].map(|kernel| kernel.name);
//! assert_eq!(frame, ["di_initial", "di_combine", "di_shade"]);
//! ```

// di_primary lists it
#[doc(hidden)]
pub mod di_primary_deferred;

kernels! {
    di_combine,
    di_exchange,
    di_gather,
    di_initial,
    di_offer,
    di_primary,
    di_shade,
    di_tiles,
}
