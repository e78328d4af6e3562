//! Sums of samples, see [`restir_shared::film`].

kernels! {
    film_add,
    film_resolve,
}
