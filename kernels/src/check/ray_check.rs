//! Nothing but rays: what they meet in a scene. Host and device are compared by it, and the speed of the traversal alone is measured. Its
//! cases need a scene, so the tests have them.

use restir_shared::geometry::{Hit, PackedHit, Ray};
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::layout::{Extent, SceneHeader};
use restir_shared::scene::Trace;

/// Parameters of the kernel `ray_check`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct RayCheckParams {
    /// Where the scene's tables are.
    pub scene: SceneHeader,
    /// Rays in a row: an image has one a pixel.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

restir_shared::fields!(RayCheckParams: scene, width, height, reserved);

impl Extent for RayCheckParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// A ray in 32 bytes.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PackedRay {
    /// As of [`Ray`].
    pub origin: [f32; 3],
    /// As of [`Ray`].
    pub t_max: f32,
    /// As of [`Ray`].
    pub direction: [f32; 3],
    /// As of [`Ray`].
    pub key: u32,
}

impl PackedRay {
    /// Packs a ray.
    pub fn pack(ray: &Ray) -> Self {
        let Ray { origin, direction, t_max, key } = *ray;
        let array = |v: Vec3| [v.x, v.y, v.z];
        Self { origin: array(origin), t_max, direction: array(direction), key }
    }

    /// The ray that was packed, with the same bits.
    #[inline(always)]
    pub fn unpack(self) -> Ray {
        let Self { origin, t_max, direction, key } = self;
        let vector = |v: [f32; 3]| Vec3::new(v[0], v[1], v[2]);
        Ray { origin: vector(origin), direction: vector(direction), t_max, key }
    }
}

/// The closest hit of a ray; where `any_hit` is not zero, all that is told is whether there is one, by a hit of triangle 0.
#[inline(always)]
pub fn traced<S: Trace>(scene: &S, ray: &Ray, any_hit: u32) -> PackedHit {
    let hit = if any_hit == 0 {
        scene.closest(ray)
    } else if scene.occluded(ray) {
        Hit { t: 0.0, id: 0, uv: Vec2::ZERO }
    } else {
        Hit::MISS
    };
    PackedHit::pack(&hit)
}

kernel! {
    /// Traces one ray an invocation.
    pub fn ray_check(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: any_hit = 0 }
        params 0: RayCheckParams,
        asks scene(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: rays: PackedRay },
        own { 5: hits: PackedHit },
    }
    |x, y, at, p, scene| hits[at] = traced(&scene, &rays[(y * p.width + x) as usize].unpack(), any_hit)
}
