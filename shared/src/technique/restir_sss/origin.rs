//! Where the samples of a pixel begin: where its path enters a body.

use super::SssParams;
use crate::diffusion::DiskNumbers;
use crate::geometry::{Hit, PackedHit};
use crate::num;
use crate::scene::{Location, Surface};
use crate::technique::path::hybrid::{Entry, EntryProfile};
use crate::vec::{dot, length, max_component};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Where a pixel's path enters a body, in 32 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SssOrigin {
    /// The hit; a miss of a path that enters no body. Its distance says nothing.
    pub hit: PackedHit,
    /// What light that leaves the body there is worth, linear RGB.
    pub throughput: [f32; 3],
    /// How long the path is up to there.
    pub travelled: f32,
}

const _: () = assert!(size_of::<SssOrigin>() == 32);

impl SssOrigin {
    /// A path that enters no body.
    pub const NONE: Self = Self { hit: PackedHit::MISS, throughput: [0.0; 3], travelled: 0.0 };
}

/// An entry, ready to evaluate samples.
pub(super) struct Entrance {
    pub(super) hit: Hit,
    pub(super) at: Location,
    pub(super) body: u32,
    pub(super) profile: EntryProfile,
    throughput: Vec3,
    /// From there on points are reconnected.
    far: f32,
}

impl Entrance {
    /// That of an origin, which is one, in this frame or the other one.
    #[inline(always)]
    pub(super) fn new<S: Surface>(scene: &S, params: &SssParams, origin: &SssOrigin, of_other: bool) -> Self {
        let (hit, spread) = (origin.hit.unpack(), params.spread(of_other));
        let (at, interior) = (scene.location(&hit), scene.interior(&hit));
        let absorbed = scene.absorbed(&hit);
        let profile = EntryProfile::new(&params.fit(spread), &at, (&interior, absorbed), origin.travelled);
        let pixels = params.reconnected_beyond * spread * origin.travelled;
        let far = num::min(2.0 * max_component(profile.disk.profile.distance), pixels);
        Self { hit, at, body: interior.body, profile, throughput: Vec3::from_array(origin.throughput), far }
    }

    /// The same with the profile multiplied by [`EntryProfile::kept`], and the path's throughput times that.
    #[inline(always)]
    pub(super) fn kept<S: Surface>(self, scene: &S, entry: &Entry) -> (Self, Vec3) {
        let throughput = self.throughput * self.profile.kept(scene, entry, (&self.at, self.body));
        (Self { throughput, ..self }, throughput)
    }

    /// What light is worth that becomes diffuse at a point, over the point's address.
    #[inline(always)]
    pub(super) fn worth(&self, point: &Location) -> Vec3 {
        self.throughput * self.profile.at(point) * point.extent
    }

    /// The same of the entry itself, by the channels that are Lambertian.
    #[inline(always)]
    pub(super) fn lambert(&self) -> Vec3 {
        self.throughput * self.profile.lambert
    }

    /// The density of a point over its address, of segments all of whose hits are taken.
    #[inline(always)]
    pub(super) fn density(&self, point: &Location) -> f32 {
        self.profile.disk.density(point.position, point.normal) * point.extent
    }

    /// The partial Jacobian of a [replayed](super::Kind::Replayed) point of this density that the numbers find.
    #[inline(always)]
    pub(super) fn partial_jacobian(&self, numbers: &DiskNumbers, density: f32) -> f32 {
        let probability = self.profile.disk.probability(numbers);
        if density > 0.0 { num::flush(num::div(probability, density)) } else { 0.0 }
    }

    /// See [`is_connectable`].
    #[inline(always)]
    pub(super) fn is_connectable(&self, point: &Location) -> bool {
        is_connectable(&self.at, point, self.far)
    }
}

/// Whether the hybrid shift reconnects a point with an entry: where the surface has turned by 60 degrees between the two, or where they are
/// `far` from each other, the profile is smooth. Werner et al. 2024, §4, call two of the profile's largest distances `d` far. Some pixels are, too: the
/// profile changes little between neighbours then, and replay would often find no point. (Where the published program's comment says less than 60 degrees,
/// its code says as here.)
#[inline(always)]
pub fn is_connectable(entry: &Location, point: &Location, far: f32) -> bool {
    (dot(entry.normal, point.normal) <= 0.5) | (length(point.position - entry.position) >= far)
}
