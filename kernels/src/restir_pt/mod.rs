//! ReSTIR PT, see [`restir_shared::technique::restir_pt`].
//!
//! ```
//! use restir_kernels::restir_pt::{pt_shade, pt_trace};
//!
//! // a frame begins with paths of its own, and ends with an image
//! let ends = [&pt_trace::DESC, &pt_shade::DESC].map(|kernel| kernel.name);
//! assert_eq!(ends, ["pt_trace", "pt_shade"]);
//! ```

kernels! {
    pt_merge,
    pt_recall,
    pt_retrace,
    pt_shade,
    pt_shift,
    pt_trace,
}
