//! All hits of objects on given segments, over a scene's arenas, by which host and device are compared. Its cases need a scene, so
//! the tests have them.

use super::ray_check::PackedRay;
use restir_shared::geometry::Ray;
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

restir_shared::fields!(CrossingCheckParams: scene, count, reserved);

impl Extent for CrossingCheckParams {
    fn extent(&self) -> [u32; 2] {
        [self.count, 1]
    }
}

/// A segment, and the object whose hits are asked for.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Segment {
    /// The segment.
    pub ray: PackedRay,
    /// The object.
    pub object: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

impl Segment {
    /// Of a ray.
    pub fn new(ray: &Ray, object: u32) -> Self {
        Self { ray: PackedRay::pack(ray), object, reserved: [0; 3] }
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

/// What a scene says of a segment.
#[inline(always)]
pub fn crossings<S: Probe>(scene: &S, segment: Segment) -> CrossingResults {
    let found = scene.probe(&segment.ray.unpack(), segment.object);
    let mut results = CrossingResults { count: found.count, nearest: [[0; 4]; 8] };
    let mut index = 0;
    while index < 8 {
        let hit = found.listed(index);
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
