//! Sixteen rays, prepared for boxes and triangles in vectors.

use super::boxes::{Boxes, sign};
use super::simd::{Array8, F32x8, WIDTH};
use super::triangles::{ROTATIONS, Triangles, largest, shear};
use glam::Vec3;
use restir_shared::geometry::{Ray, Slab};
use restir_shared::lanes::{LANES, Lanes};

/// Parts of as many rays as there are lanes.
pub(super) const HALVES: usize = LANES / WIDTH;
const _: () = assert!(HALVES == 2 && HALVES * WIDTH == LANES);

/// A number of each ray.
pub(super) type Numbers = [Array8; HALVES];
const ZEROS: Numbers = [Array8([0.0; WIDTH]); HALVES];

/// What there is to know of each ray, by axis.
pub(super) struct RayPacket16 {
    origin: [Numbers; 3],
    /// Of [`Slab`].
    pub(super) lo_origin: [Numbers; 3],
    pub(super) hi_origin: [Numbers; 3],
    pub(super) inverse: [Numbers; 3],
    /// What [`shear`] says.
    shear: [Numbers; 3],
    pub(super) t_max: Numbers,
    /// The axis along which the direction is [`largest`].
    last: [u32; LANES],
}

impl RayPacket16 {
    /// A loop that a compiler makes vectors of.
    #[inline(always)]
    pub(super) fn new(rays: &Lanes<Ray>, [lo, hi]: [Vec3; 2]) -> Self {
        let mut each = Self {
            origin: [ZEROS; 3],
            lo_origin: [ZEROS; 3],
            hi_origin: [ZEROS; 3],
            inverse: [ZEROS; 3],
            shear: [ZEROS; 3],
            t_max: ZEROS,
            last: [0; LANES],
        };
        for half in 0..HALVES {
            for lane in 0..WIDTH {
                let ray = rays.get(half * WIDTH + lane);
                let slab = Slab::new(&ray, lo, hi);
                set(&mut each.origin, half, lane, ray.origin);
                set(&mut each.lo_origin, half, lane, slab.lo_origin);
                set(&mut each.hi_origin, half, lane, slab.hi_origin);
                set(&mut each.inverse, half, lane, slab.inverse);
                let (d, last) = (ray.direction, largest(ray.direction));
                // as ROTATIONS has it
                let rotated = if last == 0 { [d.y, d.z, d.x] } else { [d.z, d.x, d.y] };
                let [x, y, z] = if last == 2 { [d.x, d.y, d.z] } else { rotated };
                set(&mut each.shear, half, lane, Vec3::from_array(shear(x, y, z)));
                each.t_max[half].0[lane] = ray.t_max;
                each.last[half * WIDTH + lane] = last;
            }
        }
        each
    }

    /// The order of axes of all rays, if it is one.
    #[inline(always)]
    pub(super) fn order(&self) -> Option<[usize; 3]> {
        let first = self.last[0];
        let others = self.last.iter().fold(0, |others, last| others | (last ^ first));
        (others == 0).then(|| ROTATIONS[first as usize & 3])
    }

    /// The rays of a half, one in each lane; `order` is that of all.
    #[inline(always)]
    pub(super) fn half<L: F32x8>(&self, order: [usize; 3], half: usize) -> (Boxes<L>, Triangles<L>) {
        (
            Boxes::of_each(load(&self.lo_origin, half), load(&self.hi_origin, half), load(&self.inverse, half), [0; 3]),
            Triangles::of_each(load(&self.origin, half), load(&self.shear, half), order),
        )
    }

    /// A ray in all lanes.
    #[inline(always)]
    pub(super) fn ray<L: F32x8>(&self, at: usize) -> (Boxes<L>, Triangles<L>) {
        let inverse = component(&self.inverse, at);
        let near = [sign(inverse[0]), sign(inverse[1]), sign(inverse[2])];
        (
            Boxes::of_each(splat(&self.lo_origin, at), splat(&self.hi_origin, at), splat(&self.inverse, at), near),
            Triangles::of_each(splat(&self.origin, at), splat(&self.shear, at), ROTATIONS[self.last[at] as usize & 3]),
        )
    }
}

#[inline(always)]
fn set([x, y, z]: &mut [Numbers; 3], half: usize, lane: usize, v: Vec3) {
    (x[half].0[lane], y[half].0[lane], z[half].0[lane]) = (v.x, v.y, v.z);
}

#[inline(always)]
fn component([x, y, z]: &[Numbers; 3], at: usize) -> [f32; 3] {
    let (half, lane) = (at / WIDTH % HALVES, at % WIDTH);
    [x[half].0[lane], y[half].0[lane], z[half].0[lane]]
}

#[inline(always)]
fn splat<L: F32x8>(numbers: &[Numbers; 3], at: usize) -> [L; 3] {
    let [x, y, z] = component(numbers, at);
    [L::splat(x), L::splat(y), L::splat(z)]
}

#[inline(always)]
fn load<L: F32x8>([x, y, z]: &[Numbers; 3], half: usize) -> [L; 3] {
    [L::load(&x[half]), L::load(&y[half]), L::load(&z[half])]
}
