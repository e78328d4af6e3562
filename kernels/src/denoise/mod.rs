//! The denoiser, see [`restir_shared::denoise`].
//!
//! ```
//! use restir_kernels::denoise::{denoise_filter, denoise_modulate, denoise_share};
//!
//! // the last ones, of which the first two are repeated
//! let passes = [denoise_share::DESC, denoise_filter::DESC, denoise_modulate::DESC];
//! let makes = passes.map(|kernel| kernel.bindings.last().expect("has an output").name);
//! assert_eq!(makes, ["shares", "filtered", "denoised"]);
//! ```

kernels! {
    denoise_accumulate,
    denoise_contrast,
    denoise_estimate,
    denoise_filter,
    denoise_guide,
    denoise_modulate,
    denoise_share,
}
