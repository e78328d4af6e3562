//! Closed meshes do not leak: rays from inside at shared edges and vertices.

use crate::brute::Triangles;
use crate::random::SplitMix;
use glam::Vec3;
use restir_host::buffers::SceneBuffers;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::scene::Trace;
use restir_shared::vec::{cross, dot, normalize};
use std::collections::BTreeMap;

/// Distance of origins from the surface along the axes, relative to the extent of the mesh: 2^-11.
const MARGIN: f32 = 1.0 / 2048.0;
/// Tries to find an origin; where the mesh is thin there is none.
const TRIES: usize = 10_000;

/// A vertex, the middle of an edge or any point of an edge.
pub fn on_edge(triangles: &Triangles, random: &mut SplitMix) -> Vec3 {
    let corners = triangles.get(random.below(triangles.len()));
    let first = random.below(3);
    let (a, b) = (corners[first], corners[(first + 1) % 3]);
    match random.below(3) {
        0 => a,
        1 => (a + b) * 0.5,
        _ => a + (b - a) * random.unit() as f32,
    }
}

/// A closed mesh whose triangles face outwards.
pub struct Closed<'a> {
    buffers: &'a SceneBuffers,
    triangles: Triangles<'a>,
}

impl<'a> Closed<'a> {
    /// Checks that the mesh is closed.
    ///
    /// # Errors
    /// The number of edges that are not passed as often one way as the other.
    pub fn new(buffers: &'a SceneBuffers) -> Result<Self, usize> {
        let triangles = Triangles::new(buffers.view());
        let mut balance: BTreeMap<[[u32; 3]; 2], i32> = BTreeMap::new();
        // a zero is the same of either sign
        let key = |v: Vec3| (v + 0.0).to_array().map(f32::to_bits);
        for id in 0..triangles.len() {
            let [a, b, c] = triangles.get(id).map(key);
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *balance.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
            }
        }
        match balance.values().filter(|balance| **balance != 0).count() {
            0 => Ok(Self { buffers, triangles }),
            open => Err(open),
        }
    }

    /// A point inside, at a distance from the surface that is large against the rounding of hits.
    fn origin(&self, random: &mut SplitMix) -> Vec3 {
        let margin = self.triangles.extent() * MARGIN;
        let candidate = |_| {
            let [a, b, c] = self.triangles.get(random.below(self.triangles.len()));
            let (start, inwards) = ((a + b + c) * (1.0 / 3.0), -normalize(cross(b - a, c - a)));
            let thickness = self.closest(start + inwards * margin, inwards).t;
            let origin = start + inwards * (thickness * random.range(0.25, 0.75) as f32);
            let axes = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
            axes.into_iter().all(|axis| self.sees_back(origin, axis, margin)).then_some(origin)
        };
        (0..TRIES).find_map(candidate).expect("most normals of a closed mesh lead inside")
    }

    fn closest(&self, origin: Vec3, direction: Vec3) -> Hit {
        self.buffers.traced_view().closest(&Ray { origin, direction, t_max: Ray::FAR, key: 0 })
    }

    /// Whether the first surface, no nearer than `margin`, is seen from its back.
    fn sees_back(&self, origin: Vec3, direction: Vec3, margin: f32) -> bool {
        let hit = self.closest(origin, direction);
        hit.is_hit() && hit.t > margin && {
            let [a, b, c] = self.triangles.get(hit.id as usize);
            dot(cross(b - a, c - a), direction) > 0.0
        }
    }

    /// The rays of a stream, out of [`Self::RAYS`], that leave the mesh unnoticed.
    pub fn escaping(&self, stream: u64) -> Vec<Ray> {
        let random = &mut SplitMix::new(stream);
        let origin = self.origin(random);
        let tracer = self.buffers.traced_view();
        (0..Self::RAYS)
            .map(|_| Ray { origin, direction: on_edge(&self.triangles, random) - origin, t_max: Ray::FAR, key: 0 })
            .filter(|ray| !(tracer.closest(ray).is_hit() && tracer.occluded(ray)))
            .collect()
    }

    /// Rays of a stream; they share their origin.
    pub const RAYS: u64 = 64;
}
