//! Sums of samples, see [`restir_shared::film`].
//!
//! ```
//! use restir_kernels::film::{KERNELS, film_add, film_resolve};
//!
//! // one kernel joins two blocks of samples, the other divides a sum by their number
//! assert_eq!([KERNELS[0].name, KERNELS[1].name], [film_add::DESC.name, film_resolve::DESC.name]);
//! assert_eq!(film_add::DESC.workgroup, [8, 8, 1]);
//! ```

kernels! {
    film_add,
    film_resolve,
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    [film_add::cases(), film_resolve::cases()].concat()
}
