//! Functions on given operands, by which host and device are compared.

#[cfg(feature = "cases")]
mod operands;

kernels! {
    bsdf_check,
    num_probe,
    sampler_check,
    self_check,
    #[cfg(feature = "size-probe")]
    size_probe,
}

/// The parity cases of these kernels.
#[cfg(feature = "cases")]
pub(crate) fn cases() -> Vec<crate::Case> {
    [bsdf_check::cases(), num_probe::cases(), sampler_check::cases(), self_check::cases()].concat()
}
