//! Merges of paths.

use restir_shared::technique::restir_pt::{PackedPath, PtParams};

merge_kernel! { pt_merge of PackedPath, with PtParams }
