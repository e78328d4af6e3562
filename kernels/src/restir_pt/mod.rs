//! ReSTIR PT, see [`restir_shared::technique::restir_pt`].

kernels! {
    pt_merge,
    pt_pair,
    pt_recall,
    pt_reproject,
    pt_shade,
    pt_shift,
    pt_trace,
}
