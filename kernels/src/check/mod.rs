//! Functions on given operands, by which host and device are compared.

kernels! {
    bsdf_check,
    num_probe,
    sampler_check,
    self_check,
    #[cfg(feature = "size-probe")]
    size_probe,
}
