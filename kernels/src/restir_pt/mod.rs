//! ReSTIR PT, see [`restir_shared::technique::restir_pt`].

kernels! {
    pt_shift,
}
