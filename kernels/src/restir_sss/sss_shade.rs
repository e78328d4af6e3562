//! The picture.

use restir_shared::technique::restir_sss::{PackedSubsurface, SssParams};

shade_kernel! { sss_shade of PackedSubsurface, with SssParams }
