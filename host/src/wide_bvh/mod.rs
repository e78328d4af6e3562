//! A BVH of eight children a node for the CPU, with the same hits, bit for bit, as the traversal of the arena.
//!
//! It needs no proof of its own: the closest hit is *defined* by [`restir_shared::geometry`], the triangles are tested by
//! the same operations in the same order, eight at a time, and boxes by the same monotone arithmetic. Ids are those of
//! the arena, so the tree may be any tree.
//!
//! ```
//! use restir_host::wide_bvh::{SimdLevel, WideBvh};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//! use restir_shared::camera::primary_ray;
//! use restir_shared::geometry::Solid;
//! use restir_shared::glam::Vec2;
//! use restir_shared::scene::{Hierarchy, Trace};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let (view, camera) = (scene.view(), scene.camera.params(16, 16));
//! // every level that this processor has gives the hits of the arena's tree
//! for level in SimdLevel::available() {
//!     let tree = WideBvh::new(&view).with_level(level);
//!     for pixel in 0..256 {
//!         let ray = primary_ray(&camera, Vec2::new((pixel % 16) as f32, (pixel / 16) as f32), Vec2::ZERO);
//!         assert_eq!(tree.closest(&ray, &Solid), view.closest(&ray));
//!     }
//! }
//! # Ok::<(), Error>(())
//! ```

mod any;
mod beam;
mod boxes;
mod closest;
mod collapse;
mod each;
mod simd;
mod triangles;

use glam::Vec3;
#[cfg(target_arch = "x86_64")]
use restir_kernels::has_avx512;
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Solid};
use restir_shared::lanes::{LANES as RAYS, Lanes};
use restir_shared::layout::{STACK_DEPTH, TRIANGLE_ALPHA};
use restir_shared::scene::{Hierarchy, SceneView};
use simd::{LANES, Row};

/// What a processor offers for traversal. Every level gives the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdLevel {
    /// Whatever the compiler makes of arrays for the target.
    Portable,
    /// 256-bit registers, and the operations on bits that came with them, detected when the program runs.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// The same registers, twice as many, and masks, as they came with AVX-512.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl SimdLevel {
    /// The levels that this processor has, best last.
    pub fn available() -> Vec<Self> {
        let mut levels = vec![Self::Portable];
        #[cfg(target_arch = "x86_64")]
        if Self::has_avx2() {
            levels.push(Self::Avx2);
        }
        #[cfg(target_arch = "x86_64")]
        if has_avx512() {
            levels.push(Self::Avx512);
        }
        levels
    }

    #[cfg(target_arch = "x86_64")]
    fn has_avx2() -> bool {
        let bits = is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("bmi2");
        let counts = is_x86_feature_detected!("lzcnt") && is_x86_feature_detected!("popcnt");
        is_x86_feature_detected!("avx2") && bits && counts
    }
}

/// Marks a child as a pack of triangles; the other bits are its index.
const PACK: u32 = 1 << 31;

/// Marks the id of a triangle that is not everywhere, as in the arena.
const PARTIAL: u32 = TRIANGLE_ALPHA;

/// Up to eight children. Slots without one have boxes that nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node {
    /// For each axis the lower and the upper planes of the children's boxes.
    planes: [[Row; 2]; 3],
    /// [`PACK`] and the index of a pack, or the index of a node.
    children: [u32; LANES],
}

/// Up to eight triangles. The other lanes hold triangles without an area, which nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Pack {
    /// Vertices, each by axis.
    vertices: [[Row; 3]; 3],
    /// The triangles' ids, with their marks.
    ids: [u32; LANES],
}

/// A child of a node.
enum Subtree<'a> {
    Node(&'a Node),
    Pack(&'a Pack),
}

/// A BVH of eight children a node over the triangles of a scene.
#[derive(Debug)]
pub struct WideBvh {
    nodes: Vec<Node>,
    packs: Vec<Pack>,
    /// As a child of a node.
    root: u32,
    /// Some triangle is marked.
    partial: bool,
    bounds: [Vec3; 2],
    level: SimdLevel,
}

impl WideBvh {
    /// Makes a wide tree of the binary one in the arena.
    ///
    /// # Panics
    /// If the arena does not hold a tree as `SceneBuffers::build` makes it.
    pub fn new(scene: &SceneView<'_>) -> Self {
        let collapse::Tree { nodes, packs, root, partial, depth } = collapse::collapse(scene);
        assert!(depth <= STACK_DEPTH, "a wide tree is no deeper than the binary one");
        let header = &scene.header;
        Self {
            nodes,
            packs,
            root,
            partial,
            bounds: [header.bounds_lo, header.bounds_hi].map(Vec3::from_array),
            level: *SimdLevel::available().last().unwrap_or(&SimdLevel::Portable),
        }
    }

    /// The same tree, traversed at a level out of [`SimdLevel::available`]; a level that this processor lacks is ignored.
    #[must_use]
    pub fn with_level(mut self, level: SimdLevel) -> Self {
        if SimdLevel::available().contains(&level) {
            self.level = level;
        }
        self
    }

    /// What a reference to a child stands for.
    #[inline(always)]
    fn subtree(&self, reference: u32) -> Subtree<'_> {
        // SAFETY: references of a `WideBvh` are indices of its packs and nodes
        unsafe {
            if reference & PACK != 0 {
                Subtree::Pack(self.packs.get_unchecked((reference & !PACK) as usize))
            } else {
                Subtree::Node(self.nodes.get_unchecked(reference as usize))
            }
        }
    }

    #[inline(always)]
    fn closest_over<C: Coverage>(&self, ray: &Ray, coverage: &C) -> Hit {
        match self.level {
            SimdLevel::Portable => closest::closest::<simd::Portable, C>(self, ray, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the level is set to what the processor was found to have
            SimdLevel::Avx2 => unsafe { closest::closest_avx2(self, ray, coverage) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx512 => unsafe { closest::closest_avx512(self, ray, coverage) },
        }
    }

    #[inline(always)]
    fn closest_together_over<C: Coverage>(&self, rays: &Lanes<Ray>, coverage: &C) -> [Hit; RAYS] {
        match self.level {
            SimdLevel::Portable => beam::closest::<simd::Portable, C>(self, rays, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx2 => unsafe { beam::closest_avx2(self, rays, coverage) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx512 => unsafe { beam::closest_avx512(self, rays, coverage) },
        }
    }

    #[inline(always)]
    fn closest_each_over<C: Coverage>(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &C) -> [Hit; RAYS] {
        match self.level {
            SimdLevel::Portable => closest::closest_each::<simd::Portable, C>(self, rays, of, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx2 => unsafe { closest::closest_each_avx2(self, rays, of, coverage) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx512 => unsafe { closest::closest_each_avx512(self, rays, of, coverage) },
        }
    }

    #[inline(always)]
    fn any_each_over<C: Coverage>(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &C) -> [bool; RAYS] {
        match self.level {
            SimdLevel::Portable => any::any_each::<simd::Portable, C>(self, rays, of, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx2 => unsafe { any::any_each_avx2(self, rays, of, coverage) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx512 => unsafe { any::any_each_avx512(self, rays, of, coverage) },
        }
    }

    #[inline(always)]
    fn any_over<C: Coverage>(&self, ray: &Ray, coverage: &C) -> bool {
        match self.level {
            SimdLevel::Portable => any::any::<simd::Portable, C>(self, ray, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx2 => unsafe { any::any_avx2(self, ray, coverage) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above
            SimdLevel::Avx512 => unsafe { any::any_avx512(self, ray, coverage) },
        }
    }
}

impl Hierarchy for WideBvh {
    fn closest(&self, ray: &Ray, coverage: &dyn Coverage) -> Hit {
        if self.partial { self.closest_over(ray, &coverage) } else { self.closest_over(ray, &Solid) }
    }

    fn closest_together(&self, rays: &Lanes<Ray>, coverage: &dyn Coverage) -> [Hit; RAYS] {
        if self.partial {
            self.closest_together_over(rays, &coverage)
        } else {
            self.closest_together_over(rays, &Solid)
        }
    }

    fn closest_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> [Hit; RAYS] {
        if self.partial {
            self.closest_each_over(rays, of, &coverage)
        } else {
            self.closest_each_over(rays, of, &Solid)
        }
    }

    fn occluded_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> [bool; RAYS] {
        if self.partial { self.any_each_over(rays, of, &coverage) } else { self.any_each_over(rays, of, &Solid) }
    }

    fn occluded(&self, ray: &Ray, coverage: &dyn Coverage) -> bool {
        if self.partial { self.any_over(ray, &coverage) } else { self.any_over(ray, &Solid) }
    }

    fn crossings(&self, ray: &Ray, coverage: &dyn Coverage) -> Crossings {
        match self.level {
            SimdLevel::Portable => any::all::<simd::Portable>(self, ray, coverage),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: what has AVX-512 has this level; all hits are asked for seldom
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { any::all_avx2(self, ray, coverage) },
        }
    }
}

#[cfg(test)]
mod tests;
