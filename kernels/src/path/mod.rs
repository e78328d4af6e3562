//! Path tracing, see [`restir_shared::technique::path`].
//!
//! ```
//! use restir_kernels::path::path;
//!
//! // a host binds the parameters and the scene's arenas, and sets the scene's features as a specialisation constant
//! let bindings = path::DESC.bindings.iter().map(|binding| binding.name);
//! assert!(bindings.clone().any(|name| name == "params") && bindings.clone().any(|name| name == "geometry"));
//! assert!(path::DESC.constants.iter().any(|constant| constant.name == "features"));
//! ```

kernels! {
    path,
    path_entry,
    path_exits,
    path_media,
    path_media_clear,
    path_profile,
}
