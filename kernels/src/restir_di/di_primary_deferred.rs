//! First pass of ReSTIR DI, of rays that somebody else traces.

use restir_shared::geometry::PackedHit;
use restir_shared::scene::DeferredRay;
use restir_shared::technique::restir_di::{self, DiParams};

kernel! {
    /// What each pixel sees. It asks no scene, and so has a declaration of its own.
    pub fn di_primary_deferred(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: DiParams,
        read { 1: answers: PackedHit },
        own { 2: hits: PackedHit, 3: rays: DeferredRay },
    }
    |x, y, at, p| {
        let asked = rays[at];
        if asked.known() == 0 {
            rays[at] = DeferredRay::first(&restir_di::primary_ray(&p.specialised(settings), features, [x, y]));
        } else if !asked.is_finished() {
            hits[at] = answers[(y * p.width + x) as usize];
            rays[at] = DeferredRay::LAST;
        }
    }
}

/// As the form of [`di_primary`](super::di_primary) whose rays are traced elsewhere.
#[cfg(not(target_arch = "spirv"))]
pub const DEFERRED: crate::DeferredKernel = crate::DeferredKernel { desc: DESC, most_rays: |_, _| 1 };
