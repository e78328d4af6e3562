//! Path tracing, see [`restir_shared::technique::path`].
#![expect(clippy::module_inception, reason = "the folder has the technique's name, and its only kernel as well")]

kernels! {
    path,
}
