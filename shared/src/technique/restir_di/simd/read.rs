//! What the scene's tables have for pixels and samples. Stages of their own, for what is computed of it is vectorised where reading is not,
//! see [`SimdToken::GATHERS`](crate::lanes::SimdToken::GATHERS).

use super::super::pixel::View;
use super::super::select::with_light;
use super::Looking;
use crate::geometry::Ray;
use crate::lanes::{LANES, LaneKernel, Lanes, soa};
use crate::scene::{AddressedLight, LightAddress, LightSample, SceneView, SurfacePoint};

soa! {
    LightsAtAddresses = AddressedLight { sample: LightSample, extent: f32 }
    LightAddresses = LightAddress { light: u32, u: u32, v: u32 }
}

/// Rays, and the points that they meet.
pub(super) struct Sees {
    pub(super) ray: Lanes<Ray>,
    pub(super) point: Lanes<SurfacePoint>,
}

impl Sees {
    pub(super) const ZERO: Self = Self { ray: Lanes::ZERO, point: Lanes::ZERO };
}

/// Looks at the points that pixels of a view see.
#[derive(Clone, Copy)]
pub(super) struct Look<'a, const COMPILED: u32> {
    pub(super) scene: &'a SceneView<'a, COMPILED>,
    pub(super) view: View,
}

impl<const COMPILED: u32> LaneKernel for Look<'_, COMPILED> {
    type In = Lanes<Looking>;
    type Out = Sees;

    #[inline(always)]
    fn run(&self, looking: &Lanes<Looking>, seen: &mut Sees) {
        let (scene, view) = (*self.scene, self.view);
        for lane in 0..LANES {
            let Looking { x, y, hit } = looking.get(lane);
            let pixel = view.of_hit([x, y], hit);
            seen.ray.set(lane, pixel.ray);
            seen.point.set(lane, pixel.point(&scene));
        }
    }
}

/// Looks up what lies at addresses.
pub(super) struct LookUp<'a, const COMPILED: u32>(pub(super) &'a SceneView<'a, COMPILED>);

impl<const COMPILED: u32> LaneKernel for LookUp<'_, COMPILED> {
    type In = Lanes<LightAddress>;
    type Out = Lanes<AddressedLight>;

    #[inline(always)]
    fn run(&self, addresses: &Lanes<LightAddress>, lights: &mut Lanes<AddressedLight>) {
        for lane in 0..LANES {
            lights.set(lane, with_light(self.0, addresses.get(lane)).1);
        }
    }
}
