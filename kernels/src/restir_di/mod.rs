//! ReSTIR DI, see [`restir_shared::technique::restir_di`].

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
