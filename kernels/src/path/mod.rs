//! Path tracing, see [`restir_shared::technique::path`].

kernels! {
    path,
    path_entry,
    path_exits,
    path_media,
    path_media_clear,
    path_profile,
}
