//! Merges of samples.

use restir_shared::technique::restir_sss::{PackedSubsurface, SssParams};

merge_kernel! { sss_merge of PackedSubsurface, with SssParams }
