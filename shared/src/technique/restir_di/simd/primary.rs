//! What pixels see, by SIMD.

use super::super::pixel::View;
use super::super::{DiParams, PackedHit};
use crate::geometry::Ray;
use crate::lanes::{LANES, LaneKernel, Lanes, SimdToken};
use crate::scene::{SceneView, Surface};

/// [`primary`](super::super::primary()) of the pixels of a row from (x, y) on, in whose order the `hits` are.
#[inline(always)]
pub fn primary_row<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    [x, y]: [u32; 2],
    hits: &mut [PackedHit],
    token: impl SimdToken,
) {
    let mut rays = Lanes::ZERO;
    for (x, hits) in (x..).step_by(LANES).zip(hits.chunks_mut(LANES)) {
        token.run(&CameraRays { view: params.view(), features: scene.features(), x, y }, &(), &mut rays);
        let found = scene.closest_together(&rays);
        for (lane, hit) in hits.iter_mut().enumerate() {
            *hit = PackedHit::pack(&found.get(lane));
        }
    }
}

/// The camera's rays through the pixels from (x, y) on.
struct CameraRays {
    view: View,
    features: u32,
    x: u32,
    y: u32,
}

impl LaneKernel for CameraRays {
    type In = ();
    type Out = Lanes<Ray>;

    #[inline(always)]
    fn run(&self, (): &(), rays: &mut Lanes<Ray>) {
        for lane in 0..LANES {
            rays.set(lane, self.view.ray([self.x.wrapping_add(lane as u32), self.y], self.features));
        }
    }
}
