//! Rays that somebody else traces: hardware, another library, or a tree of the embedder's.
//!
//! A function of this crate asks its scene for hits while it runs, and a kernel cannot stop in between. So it is run again: [`Deferred`]
//! answers by what is known, and at the first ray that is new it keeps the ray as a request. What the function computes from
//! there on is discarded. Once the request is resolved it runs again from its beginning, gets one ray further, and ends when all of its rays are known.
//! Every method of a scene is a function of its arguments alone, so each round repeats the last one to the bit. Of n rays shading takes
//! the time of n / 2 runs; nothing of a path is stored but its hits.
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::geometry::{PackedHit, Ray};
//! use restir_shared::glam::Vec3;
//! use restir_shared::rng::{Rng, Sampler};
//! use restir_shared::scene::{Asked, Deferred, DeferredRay, KnownHits, Trace};
//! use restir_shared::technique::path::radiance;
//! use core::cell::Cell;
//!
//! let ray = Ray { origin: Vec3::Y, direction: Vec3::new(0.6, -0.8, 0.0), t_max: Ray::FAR, key: 0 };
//! let rng = Rng::new(0, 0, 0, 7, Sampler::Sobol);
//! let (mut hits, mut request) = (Vec::new(), DeferredRay::default());
//! let deferred = loop {
//!     let asked = Cell::new(Asked::default());
//!     let known = KnownHits { planes: &hits, index: 0, stride: 1, known: request.known() };
//!     let value = radiance(&Deferred::new(&Floor, known, &asked), ray, &rng, 5, false);
//!     request = DeferredRay::after(&asked, known.known);
//!     if request.is_finished() {
//!         break value;
//!     }
//!     // this is the tracer
//!     hits.push(PackedHit::pack(&Floor.closest(&request.ray())));
//! };
//! assert_eq!(deferred, radiance(&Floor, ray, &rng, 5, false));
//! // to the floor, to the lamp, and away
//! assert_eq!(hits.len(), 3);
//! ```

use super::delegate::{delegate_lights, delegate_surfaces};
use super::{Frames, LightAddress, Trace};
use crate::geometry::{Hit, PackedHit, Ray};
use bytemuck::{Pod, Zeroable};
#[cfg(not(target_arch = "spirv"))]
use core::cell::Cell;
use glam::Vec3;

/// A ray that an invocation asks for. An invocation that has not run yet has zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DeferredRay {
    /// See [`Ray::origin`].
    pub origin: [f32; 3],
    /// See [`Ray::t_max`].
    pub t_max: f32,
    /// See [`Ray::direction`]. It need not have unit length: distances count in its length.
    pub direction: [f32; 3],
    /// See [`Ray::key`]. It counts in scenes with blended surfaces alone.
    pub key: u32,
    /// What is asked: [`Self::CLOSEST`] or [`Self::OCCLUDED`], else nothing.
    pub asks: u32,
    /// 1 if it is asked of the scene in the other frame, else 0.
    pub other_frame: u32,
    /// The number of rays that the invocation has asked for before: the plane of answers to which this one belongs.
    pub plane: u32,
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<DeferredRay>() == 48);

impl DeferredRay {
    /// The nearest hit is asked for, as [`Trace::closest`] gives it.
    pub const CLOSEST: u32 = 1;
    /// Any hit will do, as [`Trace::occluded`] says: of the answer only counts whether it is a hit.
    pub const OCCLUDED: u32 = 2;
    /// The invocation has all that it needs, and has written its results.
    pub const FINISHED: u32 = 3;

    /// That of an invocation that needs no more rays.
    pub const LAST: Self = Self {
        origin: [0.0; 3],
        t_max: 0.0,
        direction: [0.0; 3],
        key: 0,
        asks: Self::FINISHED,
        other_frame: 0,
        plane: 0,
        reserved: 0,
    };

    /// The nearest hit of an invocation's first ray, in the scene of this frame.
    #[inline(always)]
    pub fn first(ray: &Ray) -> Self {
        Self::asking(ray, Self::CLOSEST, false)
    }

    #[inline(always)]
    fn asking(ray: &Ray, asks: u32, other_frame: bool) -> Self {
        let Ray { origin, direction, t_max, key } = *ray;
        let (origin, direction, other_frame) = (origin.to_array(), direction.to_array(), other_frame as u32);
        Self { origin, t_max, direction, key, asks, other_frame, plane: 0, reserved: 0 }
    }

    /// Whether the invocation needs no more rays.
    #[inline(always)]
    pub fn is_finished(&self) -> bool {
        self.asks == Self::FINISHED
    }

    /// How many answers the invocation has, once this ray is resolved.
    #[inline(always)]
    pub fn known(&self) -> u32 {
        if self.asks == 0 { 0 } else { self.plane.wrapping_add(1) }
    }

    /// The ray itself.
    #[inline(always)]
    pub fn ray(&self) -> Ray {
        let Self { origin, direction, t_max, key, .. } = *self;
        Ray { origin: Vec3::from_array(origin), direction: Vec3::from_array(direction), t_max, key }
    }

    /// What an invocation asks for next, after it has run with `known` answers.
    #[inline(always)]
    pub fn after(memory: Memory<'_>, known: u32) -> Self {
        if memory::asked(memory) > known { Self { plane: known, ..memory::kept(memory) } } else { Self::LAST }
    }
}

/// What an invocation has asked for so far.
#[cfg(not(target_arch = "spirv"))]
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// Rays, known ones and others.
    count: u32,
    /// The first that is not known.
    ray: DeferredRay,
}

/// Where an invocation keeps what it asks for.
#[cfg(not(target_arch = "spirv"))]
pub type Memory<'a> = &'a Cell<Asked>;
/// On a device it lies in memory of the workgroup, for no structure there may point to a variable.
#[cfg(target_arch = "spirv")]
pub type Memory<'a> = crate::geometry::Scratch;

/// The hits that an invocation knows: one from each plane.
#[derive(Clone, Copy, Debug)]
pub struct KnownHits<'a> {
    /// Planes one after another, each with an element an invocation.
    pub planes: &'a [PackedHit],
    /// The invocation.
    pub index: u32,
    /// Elements of a plane.
    pub stride: u32,
    /// How many planes hold hits of this invocation.
    pub known: u32,
}

/// A scene, or [`Frames`] of one, whose rays somebody else traces.
#[derive(Clone, Copy, Debug)]
pub struct Deferred<'a, S> {
    scene: S,
    hits: KnownHits<'a>,
    memory: Memory<'a>,
    other_frame: bool,
}

impl<'a, S> Deferred<'a, S> {
    /// For one run of an invocation; `memory` begins anew.
    #[inline(always)]
    pub fn new(scene: S, hits: KnownHits<'a>, memory: Memory<'a>) -> Self {
        memory::begin(memory);
        Self { scene, hits, memory, other_frame: false }
    }

    /// The answer, if it is known. Else the ray is kept, if it is the first such.
    #[inline(always)]
    fn ask(&self, ray: &Ray, asks: u32) -> Hit {
        let KnownHits { planes, index, stride, known } = self.hits;
        let plane = memory::count(self.memory);
        if plane < known {
            return planes[plane.wrapping_mul(stride).wrapping_add(index) as usize].unpack();
        }
        if plane == known {
            memory::keep(self.memory, &DeferredRay::asking(ray, asks, self.other_frame));
        }
        // ends paths, and nothing is made of it
        Hit::CUT
    }
}

impl<S> Trace for Deferred<'_, S> {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        self.ask(ray, DeferredRay::CLOSEST)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        let hit = self.ask(ray, DeferredRay::OCCLUDED);
        hit.is_hit() | hit.is_cut()
    }
}

delegate_surfaces!(['a] Deferred<'a, S>, self => self.scene);
delegate_lights!(['a] Deferred<'a, S>, self => self.scene);

impl<'a, F: Frames> Frames for Deferred<'a, F> {
    type Scene = Deferred<'a, F::Scene>;

    #[inline(always)]
    fn scene(&self, other: bool) -> Self::Scene {
        Deferred { scene: self.scene.scene(other), hits: self.hits, memory: self.memory, other_frame: other }
    }

    #[inline(always)]
    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        self.scene.counterpart(address, of_other)
    }
}

#[cfg(not(target_arch = "spirv"))]
mod memory {
    use super::{Asked, DeferredRay, Memory};

    pub(super) fn begin(memory: Memory<'_>) {
        memory.set(Asked::default());
    }

    /// Counts a ray; how many came before it.
    pub(super) fn count(memory: Memory<'_>) -> u32 {
        let asked = memory.get();
        memory.set(Asked { count: asked.count + 1, ..asked });
        asked.count
    }

    pub(super) fn keep(memory: Memory<'_>, ray: &DeferredRay) {
        memory.set(Asked { ray: *ray, ..memory.get() });
    }

    pub(super) fn asked(memory: Memory<'_>) -> u32 {
        memory.get().count
    }

    pub(super) fn kept(memory: Memory<'_>) -> DeferredRay {
        memory.get().ray
    }
}

#[cfg(target_arch = "spirv")]
mod memory {
    use super::{DeferredRay, Memory};
    use crate::geometry::{Scratch, workgroup};

    /// Words of an invocation: those of a ray up to its key, what it asks, of which frame, and the number of rays.
    const WORDS: usize = 11;
    const COUNT: u32 = 10;

    #[inline(always)]
    fn access(memory: Memory<'_>, at: u32, word: u32, writes: bool) -> u32 {
        workgroup::access::<{ WORDS * Scratch::INVOCATIONS as usize }>(memory.invocation, at, word, writes)
    }

    #[inline(always)]
    pub(super) fn begin(memory: Memory<'_>) {
        access(memory, COUNT, 0, true);
    }

    #[inline(always)]
    pub(super) fn count(memory: Memory<'_>) -> u32 {
        let count = asked(memory);
        access(memory, COUNT, count.wrapping_add(1), true);
        count
    }

    #[inline(always)]
    pub(super) fn keep(memory: Memory<'_>, ray: &DeferredRay) {
        let DeferredRay { origin, t_max, direction, key, asks, other_frame, .. } = *ray;
        access(memory, 0, origin[0].to_bits(), true);
        access(memory, 1, origin[1].to_bits(), true);
        access(memory, 2, origin[2].to_bits(), true);
        access(memory, 3, t_max.to_bits(), true);
        access(memory, 4, direction[0].to_bits(), true);
        access(memory, 5, direction[1].to_bits(), true);
        access(memory, 6, direction[2].to_bits(), true);
        access(memory, 7, key, true);
        access(memory, 8, asks, true);
        access(memory, 9, other_frame, true);
    }

    #[inline(always)]
    pub(super) fn asked(memory: Memory<'_>) -> u32 {
        access(memory, COUNT, 0, false)
    }

    #[inline(always)]
    pub(super) fn kept(memory: Memory<'_>) -> DeferredRay {
        let word = |at| access(memory, at, 0, false);
        let number = |at| f32::from_bits(word(at));
        DeferredRay {
            origin: [number(0), number(1), number(2)],
            t_max: number(3),
            direction: [number(4), number(5), number(6)],
            key: word(7),
            asks: word(8),
            other_frame: word(9),
            ..DeferredRay::default()
        }
    }
}
