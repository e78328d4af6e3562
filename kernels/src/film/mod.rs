//! Sums of samples, see [`restir_shared::film`].

kernels! {
    film_add,
    film_resolve,
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    [film_add::cases(), film_resolve::cases()].concat()
}
