//! Shifts of samples.

use restir_shared::technique::restir_sss::{PackedSubsurface, SssOrigin, SssParams};

shift_kernel! { sss_shift of PackedSubsurface, with SssParams, from SssOrigin, asks probed_frames }
