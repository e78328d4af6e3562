//! Objects over the arenas: all hits of one on a segment.

use super::{Probe, SceneView};
#[cfg(not(target_arch = "spirv"))]
use crate::geometry::Coverage;
use crate::geometry::{Crossings, Hit, Ray, traverse_all};
use crate::layout::TRIANGLE_ALPHA;

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// The object of a triangle, with [`TRIANGLE_ALPHA`] where it is marked.
    #[inline(always)]
    fn marked_object(&self, triangle: u32) -> u32 {
        self.geometry_word(self.header.triangle_word(triangle) + 2).w
    }
}

impl<const COMPILED: u32> Probe for SceneView<'_, COMPILED> {
    #[inline(always)]
    fn object(&self, hit: &Hit) -> u32 {
        self.marked_object(hit.id) & !TRIANGLE_ALPHA
    }

    #[inline(always)]
    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        #[cfg(not(target_arch = "spirv"))]
        if let Some(tracer) = self.tracer {
            return tracer.crossings(ray, &Belonging { scene: self, object });
        }
        traverse_all(self.geometry, &self.header, self, ray, object, self.scratch())
    }
}

/// Of the hits that count, those of one object.
#[cfg(not(target_arch = "spirv"))]
struct Belonging<'a, 'b, const COMPILED: u32> {
    scene: &'a SceneView<'b, COMPILED>,
    object: u32,
}

#[cfg(not(target_arch = "spirv"))]
impl<const COMPILED: u32> Coverage for Belonging<'_, '_, COMPILED> {
    #[inline(always)]
    fn covers(&self, ray: &Ray, hit: &Hit) -> bool {
        let word = self.scene.marked_object(hit.id);
        word & !TRIANGLE_ALPHA == self.object && (word & TRIANGLE_ALPHA == 0 || self.scene.covers(ray, hit))
    }
}
