//! The scene over its arenas.

use super::{Trace, Tracer};
use crate::geometry::{self, Hit, Ray, Scratch};
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::Lanes;
use crate::layout::{FEATURES_ALL, SceneHeader};
use crate::num;
use crate::pack::{element, xyz};
use crate::vec::{cross, length, max_abs, normalize};
use core::fmt;
use glam::{UVec4, Vec2, Vec3};

/// Spawn offsets as a fraction of a triangle's largest coordinate: 2^-18, some sixty roundings.
const SPAWN_OFFSET: f32 = 1.0 / 262_144.0;

/// Nearer to an edge than this part of the spawn offset, some four roundings, a point is on it.
const ON_EDGE: f32 = 1.0 / 16.0;

/// The barycentric coordinates of a triangle's centre.
const CENTRE: Vec2 = Vec2::splat(1.0 / 3.0);

/// A scene in its arenas, see [`crate::layout`]. What is not in `COMPILED`, it has not, and no code is compiled for it.
#[derive(Clone, Copy)]
pub struct SceneView<'a, const COMPILED: u32 = FEATURES_ALL> {
    /// Where the tables are.
    pub header: SceneHeader,
    /// Nodes and triangles.
    pub geometry: &'a [UVec4],
    /// Materials, lights, alias table.
    pub attributes: &'a [UVec4],
    /// Textures and environment.
    pub texels: &'a [UVec4],
    /// Feature bits that the scene may have; a constant where the kernel was specialised.
    pub features: u32,
    /// What answers visibility queries in place of the geometry arena, with the same hits.
    pub tracer: Tracer<'a>,
}

impl<const COMPILED: u32> fmt::Debug for SceneView<'_, COMPILED> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { header, features, .. } = self;
        f.debug_struct("SceneView").field("header", header).field("features", features).finish_non_exhaustive()
    }
}

#[cfg(not(target_arch = "spirv"))]
impl<'a> SceneView<'a> {
    /// The same scene for code that is compiled for some features only, if it has no others.
    #[doc(hidden)]
    #[inline(always)]
    pub fn within<const COMPILED: u32>(&self) -> Option<SceneView<'a, COMPILED>> {
        let Self { header, geometry, attributes, texels, features, tracer } = *self;
        (features & !COMPILED == 0).then_some(SceneView { header, geometry, attributes, texels, features, tracer })
    }
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    #[inline(always)]
    pub(super) fn attribute(&self, word: u32) -> UVec4 {
        element(self.attributes, word as usize)
    }

    #[inline(always)]
    pub(super) fn geometry_word(&self, word: usize) -> UVec4 {
        element(self.geometry, word)
    }

    #[inline(always)]
    pub(super) fn texel_word(&self, word: u32) -> UVec4 {
        element(self.texels, word as usize)
    }

    /// Where a traversal of the arena has its ring.
    #[inline(always)]
    pub(super) fn scratch(&self) -> Scratch {
        #[cfg(target_arch = "spirv")]
        return self.tracer;
        #[cfg(not(target_arch = "spirv"))]
        Scratch::default()
    }

    #[inline(always)]
    pub(super) fn has(&self, feature: u32) -> bool {
        self.features & COMPILED & feature != 0
    }

    /// The barycentric coordinates `b`, or where they are on an edge, others that are as far off all edges as rays begin off the surface, if
    /// the triangle is wide enough.
    #[inline(always)]
    pub(super) fn off_triangle_edges(&self, triangle: u32, b: Vec2) -> Vec2 {
        let at = self.header.triangle_word(triangle);
        let (v0, v1, v2) =
            (xyz(self.geometry_word(at)), xyz(self.geometry_word(at + 1)), xyz(self.geometry_word(at + 2)));
        let (e0, e1, e2) = (v2 - v1, v0 - v2, v1 - v0);
        // a coordinate is the distance from an edge by the height above it; largest components do for lengths
        let scale = num::div(reach(v0, v1, v2) * SPAWN_OFFSET, max_abs(cross(e1, e2)));
        let least = Vec3::new(max_abs(e0), max_abs(e1), max_abs(e2)) * scale;
        let near = |weight: f32, least: f32| if weight < least * ON_EDGE { least } else { 0.0 };
        let rim = num::max(num::max(near(1.0 - b.x - b.y, least.x), near(b.x, least.y)), near(b.y, least.z));
        // of the way to the centre
        let part = num::min(rim * 3.0, 1.0);
        b + (CENTRE - b) * part
    }

    /// The point of a triangle with the given barycentric coordinates.
    #[inline(always)]
    pub(super) fn triangle_point(&self, triangle: u32, b: Vec2) -> TrianglePoint {
        let at = self.header.triangle_word(triangle);
        let (w0, w1, w2) = (self.geometry_word(at), self.geometry_word(at + 1), self.geometry_word(at + 2));
        let (v0, v1, v2) = (xyz(w0), xyz(w1), xyz(w2));
        let reach = reach(v0, v1, v2);
        let across = cross(v1 - v0, v2 - v0);
        TrianglePoint {
            position: v0 * (1.0 - b.x - b.y) + v1 * b.x + v2 * b.y,
            normal: normalize(across),
            extent: length(across),
            offset: reach * SPAWN_OFFSET,
            material: w0.w,
        }
    }
}

/// The largest coordinate of a triangle.
#[inline(always)]
fn reach(v0: Vec3, v1: Vec3, v2: Vec3) -> f32 {
    num::max(num::max(max_abs(v0), max_abs(v1)), max_abs(v2))
}

/// A point of a triangle, before its material.
pub(super) struct TrianglePoint {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) offset: f32,
    pub(super) extent: f32,
    pub(super) material: u32,
}

#[cfg(not(target_arch = "spirv"))]
impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// Whether one of the rays may meet a triangle that emits, be it behind others.
    #[inline(always)]
    pub(crate) fn may_meet_emitters(&self, rays: &Lanes<Ray>) -> bool {
        self.tracer.is_none_or(|tracer| tracer.may_meet_emitters(rays))
    }

    /// Whether a ray between the given ones may meet a triangle that emits, see [`Hierarchy`](super::Hierarchy::emitters_between).
    #[inline(always)]
    pub(crate) fn emitters_between(&self, rays: &Lanes<Ray>) -> bool {
        self.tracer.is_none_or(|tracer| tracer.emitters_between(rays))
    }

    /// [`Trace::closest`] of each ray, where they have most of their way in common.
    #[doc(hidden)]
    #[inline(always)]
    pub fn closest_together(&self, rays: &Lanes<Ray>) -> Lanes<Hit> {
        match self.tracer {
            Some(tracer) => tracer.closest_together(rays, self),
            None => Lanes::from_fn(|lane| self.closest(&rays.get(lane))),
        }
    }

    /// [`Trace::closest`] of each ray in `of`, in the place of others [`Hit::MISS`].
    #[doc(hidden)]
    #[inline(always)]
    pub fn closest_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>) -> Lanes<Hit> {
        match self.tracer {
            Some(tracer) => tracer.closest_each(rays, of, self),
            None => Lanes::from_fn(|lane| if of.get(lane) { self.closest(&rays.get(lane)) } else { Hit::MISS }),
        }
    }

    /// [`Trace::occluded`] of each ray in `of`, in the place of others false.
    #[doc(hidden)]
    #[inline(always)]
    pub fn occluded_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>) -> Lanes<bool> {
        match self.tracer {
            Some(tracer) => tracer.occluded_each(rays, of, self),
            None => Lanes::from_fn(|lane| of.get(lane) && self.occluded(&rays.get(lane))),
        }
    }
}

impl<const COMPILED: u32> Trace for SceneView<'_, COMPILED> {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        #[cfg(not(target_arch = "spirv"))]
        if let Some(tracer) = self.tracer {
            return tracer.closest(ray, self);
        }
        geometry::traverse::<false, Self>(self.geometry, &self.header, self, ray, self.scratch())
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        #[cfg(not(target_arch = "spirv"))]
        if let Some(tracer) = self.tracer {
            return tracer.occluded(ray, self);
        }
        let hit = geometry::traverse::<true, Self>(self.geometry, &self.header, self, ray, self.scratch());
        hit.is_hit() | hit.is_cut()
    }
}
