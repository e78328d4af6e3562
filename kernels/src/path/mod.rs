//! Path tracing, see [`restir_shared::technique::path`].

kernels! {
    path,
    path_hybrid,
    path_media,
    path_profile,
}
