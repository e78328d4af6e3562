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
mod few;
mod simd;
mod triangles;

use crate::bvh::{self, Bounds, Bvh, Effort};
use few::Few;
use glam::{UVec4, Vec3};
use restir_kernels::Avx512;
#[cfg(target_arch = "x86_64")]
use restir_kernels::has_avx512;
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Solid};
use restir_shared::lanes::Lanes;
use restir_shared::layout::{STACK_DEPTH, TRIANGLE_ALPHA, TRIANGLE_WORDS};
use restir_shared::pack::xyz;
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

/// The bounds of the arena's triangles.
fn triangle_boxes(scene: &SceneView<'_>) -> Vec<Bounds> {
    let triangles = scene.geometry[scene.header.triangle_base as usize..].chunks_exact(TRIANGLE_WORDS as usize);
    let bounds = |words: &[UVec4]| Bounds::of(&[0, 1, 2].map(|corner| xyz(words[corner])));
    triangles.take(scene.header.triangle_count as usize).map(bounds).collect()
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
    /// The children with a triangle that emits, as bits.
    emitters: u32,
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
    /// All triangles, where they are few, none is marked and the processor has the registers.
    few: Option<(Few, Avx512)>,
    level: SimdLevel,
}

impl WideBvh {
    /// Makes a wide tree of the binary one in the arena.
    ///
    /// # Panics
    /// If the arena does not hold a tree as `SceneBuffers::build` makes it.
    pub fn new(scene: &SceneView<'_>) -> Self {
        Self::of(scene, &Bvh::of_arena(scene))
    }

    /// Makes a wide tree of a better binary one, which is built for it: a render of a mesh of 48 000 triangles takes 0.93 of the time, and its
    /// tree 0.14 s more.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn thorough(scene: &SceneView<'_>) -> Self {
        Self::of(scene, &bvh::build(&triangle_boxes(scene), Effort::THOROUGH))
    }

    fn of(scene: &SceneView<'_>, binary: &Bvh) -> Self {
        let collapse::Tree { nodes, packs, root, partial, depth } = collapse::collapse(scene, binary);
        assert!(depth <= STACK_DEPTH, "a wide tree is no deeper than the binary one");
        let header = &scene.header;
        let bounds = [header.bounds_lo, header.bounds_hi].map(Vec3::from_array);
        let few = Avx512::detect().filter(|_| !partial);
        Self {
            few: few.and_then(|registers| Some((Few::new(&packs, bounds)?, registers))),
            nodes,
            packs,
            root,
            partial,
            bounds,
            level: *SimdLevel::available().last().unwrap_or(&SimdLevel::Portable),
        }
    }

    /// The same tree, traversed at a level out of [`SimdLevel::available`]; a level that this processor lacks is ignored.
    #[must_use]
    pub fn with_level(mut self, level: SimdLevel) -> Self {
        let levels = SimdLevel::available();
        if levels.contains(&level) {
            self.level = level;
            // in step only with the widest registers
            self.few = self.few.filter(|_| levels.last() == Some(&level));
        }
        self
    }

    /// All triangles, where it takes less time to test them than to trace the rays in `of` one by one.
    #[inline(always)]
    fn few(&self, of: &Lanes<bool>) -> Option<(&Few, Avx512)> {
        self.few.as_ref().filter(|(few, _)| few.pays(of)).map(|(few, registers)| (few, *registers))
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
}

/// Makes a method of a traversal that is compiled for each level, with its instructions.
macro_rules! at_level {
    (fn $method:ident($($argument:ident: $of:ty),*) -> $answer:ty = $module:ident::$traversal:ident) => {
        #[inline(always)]
        fn $method<C: Coverage>(&self, $($argument: $of,)* coverage: &C) -> $answer {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            unsafe fn avx2<C: Coverage>(tree: &WideBvh, $($argument: $of,)* coverage: &C) -> $answer {
                $module::$traversal::<simd::Avx2, C>(tree, $($argument,)* coverage)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
            unsafe fn avx512<C: Coverage>(tree: &WideBvh, $($argument: $of,)* coverage: &C) -> $answer {
                $module::$traversal::<simd::Avx2, C>(tree, $($argument,)* coverage)
            }
            match self.level {
                SimdLevel::Portable => $module::$traversal::<simd::Portable, C>(self, $($argument,)* coverage),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the level is set to what the processor was found to have
                SimdLevel::Avx2 => unsafe { avx2(self, $($argument,)* coverage) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: as above
                SimdLevel::Avx512 => unsafe { avx512(self, $($argument,)* coverage) },
            }
        }
    };
}

impl WideBvh {
    at_level! { fn closest_over(ray: &Ray) -> Hit = closest::closest }
    at_level! { fn closest_each_over(rays: &Lanes<Ray>, of: &Lanes<bool>) -> Lanes<Hit> = closest::closest_each }
    at_level! { fn closest_together_over(rays: &Lanes<Ray>) -> Lanes<Hit> = beam::closest }
    at_level! { fn may_meet_emitters_over(rays: &Lanes<Ray>) -> bool = beam::may_meet_emitters }
    at_level! { fn emitters_between_over(rays: &Lanes<Ray>) -> bool = beam::emitters_between }
    at_level! { fn any_over(ray: &Ray) -> bool = any::any }
    at_level! { fn any_each_over(rays: &Lanes<Ray>, of: &Lanes<bool>) -> Lanes<bool> = any::any_each }
    at_level! { fn all_over(ray: &Ray) -> Crossings = any::all }
}

/// The method with `coverage` or, where no triangle is marked, without asking for it.
macro_rules! over {
    ($tree:ident.$method:ident($($argument:ident),*), $coverage:ident) => {
        if $tree.partial {
            $tree.$method($($argument,)* &$coverage)
        } else {
            $tree.$method($($argument,)* &Solid)
        }
    };
}

impl Hierarchy for WideBvh {
    fn closest(&self, ray: &Ray, coverage: &dyn Coverage) -> Hit {
        over!(self.closest_over(ray), coverage)
    }

    fn closest_together(&self, rays: &Lanes<Ray>, coverage: &dyn Coverage) -> Lanes<Hit> {
        over!(self.closest_together_over(rays), coverage)
    }

    fn closest_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> Lanes<Hit> {
        if let Some((few, registers)) = self.few(of) {
            return few.closest(rays, of, registers);
        }
        over!(self.closest_each_over(rays, of), coverage)
    }

    fn may_meet_emitters(&self, rays: &Lanes<Ray>) -> bool {
        self.may_meet_emitters_over(rays, &Solid)
    }

    fn emitters_between(&self, rays: &Lanes<Ray>) -> bool {
        self.emitters_between_over(rays, &Solid)
    }

    fn occluded(&self, ray: &Ray, coverage: &dyn Coverage) -> bool {
        over!(self.any_over(ray), coverage)
    }

    fn occluded_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> Lanes<bool> {
        if let Some((few, registers)) = self.few(of) {
            return few.occluded(rays, of, registers);
        }
        over!(self.any_each_over(rays, of), coverage)
    }

    fn crossings(&self, ray: &Ray, coverage: &dyn Coverage) -> Crossings {
        self.all_over(ray, &coverage)
    }
}

#[cfg(test)]
mod tests;
