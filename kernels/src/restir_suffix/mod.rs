//! Suffix ReSTIR, see [`restir_shared::technique::restir_suffix`].
//!
//! ```
//! use restir_kernels::restir_suffix::{suffix_gather, suffix_support};
//!
//! // a frame begins where suffixes are found, and ends where they are used
//! let ends = [&suffix_support::DESC, &suffix_gather::DESC].map(|kernel| kernel.name);
//! assert_eq!(ends, ["suffix_support", "suffix_gather"]);
//! ```

kernels! {
    suffix_ask,
    suffix_canonical,
    suffix_find,
    suffix_gather,
    suffix_keep,
    suffix_pair,
    suffix_point,
    suffix_prefix,
    suffix_support,
    suffix_trace,
}
