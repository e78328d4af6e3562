//! Path tracing, see [`restir_shared::technique::path`].

kernels! {
    path,
    path_media,
}
