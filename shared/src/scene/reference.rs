//! A reference to a scene is a scene.

use super::delegate::{delegate_lights, delegate_surfaces};
use super::{Probe, Trace};
use crate::geometry::{Crossings, Hit, Ray};

impl<S: Trace + ?Sized> Trace for &S {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        (**self).closest(ray)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        (**self).occluded(ray)
    }
}

impl<S: Probe + ?Sized> Probe for &S {
    #[inline(always)]
    fn object(&self, hit: &Hit) -> u32 {
        (**self).object(hit)
    }

    #[inline(always)]
    fn probe(&self, ray: &Ray, object: u32) -> Crossings {
        (**self).probe(ray, object)
    }
}

delegate_surfaces!([?Sized] &S, self => (**self));
delegate_lights!([?Sized] &S, self => (**self));
