//! The picture.

use restir_shared::technique::restir_pt::{PackedPath, PtParams};

shade_kernel! { pt_shade of PackedPath, with PtParams }
