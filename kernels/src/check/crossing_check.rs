//! All hits of objects on given segments, over a scene's arenas, by which host and device are compared. Its cases need a scene, so
//! the tests have them.

use restir_shared::geometry::Ray;
use restir_shared::glam::Vec3;
use restir_shared::layout::{Extent, SceneHeader};
use restir_shared::scene::Probe;

/// Parameters of the kernel `crossing_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct CrossingCheckParams {
    /// Where the scene's tables are.
    pub scene: SceneHeader,
    /// Number of segments.
    pub count: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

impl Extent for CrossingCheckParams {
    fn extent(&self) -> [u32; 2] {
        [self.count, 1]
    }
}

/// A segment, and the object whose hits are asked for.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Segment {
    /// As of [`Ray`].
    pub origin: [f32; 3],
    /// As of [`Ray`].
    pub t_max: f32,
    /// As of [`Ray`].
    pub direction: [f32; 3],
    /// As of [`Ray`].
    pub key: u32,
    /// The object.
    pub object: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

impl Segment {
    /// Of a ray.
    pub fn new(ray: &Ray, object: u32) -> Self {
        let Ray { origin, direction, t_max, key } = *ray;
        let array = |v: Vec3| [v.x, v.y, v.z];
        Self { origin: array(origin), t_max, direction: array(direction), key, object, reserved: [0; 3] }
    }
}

/// The crossings: t, id and coordinates of each, as their bits.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct CrossingResults {
    /// How many there are.
    pub count: u32,
    /// Those that are listed.
    pub nearest: [[u32; 4]; 8],
}

#[inline(always)]
fn vector(v: [f32; 3]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

/// What a scene says of a segment.
#[inline(always)]
pub fn crossings<S: Probe>(scene: &S, segment: Segment) -> CrossingResults {
    let Segment { origin, t_max, direction, key, object, .. } = segment;
    let found = scene.probe(&Ray { origin: vector(origin), direction: vector(direction), t_max, key }, object);
    let mut results = CrossingResults { count: found.count, nearest: [[0; 4]; 8] };
    let mut index = 0;
    while index < 8 {
        let hit = found.nearest[index];
        results.nearest[index] = [hit.t.to_bits(), hit.id, hit.uv.x.to_bits(), hit.uv.y.to_bits()];
        index += 1;
    }
    results
}

kernel! {
    /// Probes one segment an invocation.
    pub fn crossing_check(64, 1) {
        constants { 0: features = 0xffff_ffff }
        params 0: CrossingCheckParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: segments: Segment },
        own { 5: results: CrossingResults },
    }
    |x, _y, at, p, scene| results[at] = crossings(&scene, segments[x as usize])
}
