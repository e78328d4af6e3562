//! ReSTIR SSS, see [`restir_shared::technique::restir_sss`].
//!
//! ```
//! use restir_kernels::path::path_entry;
//! use restir_kernels::restir_sss::{sss_initial, sss_shade};
//!
//! // a frame begins where paths enter bodies, and ends with an image
//! let frame = [&path_entry::DESC, &sss_initial::DESC, &sss_shade::DESC].map(|kernel| kernel.name);
//! assert_eq!(frame, ["path_entry", "sss_initial", "sss_shade"]);
//! ```

kernels! {
    sss_index,
    sss_initial,
    sss_merge,
    sss_recall,
    sss_shade,
    sss_shift,
}
