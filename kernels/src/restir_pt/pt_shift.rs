//! Shifts of paths.

use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};

shift_kernel! { pt_shift of PackedPath, with PtParams, from PathOrigin, asks frames, deferred pt_shift_deferred(|p| p.most_rays_of_shift()) }
