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
mod brute_force;
mod closest;
mod collapse;
mod node;
mod packet;
mod simd;
mod triangles;

use crate::bvh::{self, Bounds, Bvh, Effort};
use brute_force::BruteForce;
use glam::UVec4;
use node::Tree;
use restir_kernels::Avx512;
pub use restir_kernels::SimdLevel;
use restir_shared::geometry::{Coverage, Crossings, Hit, Ray, Solid};
use restir_shared::lanes::Lanes;
use restir_shared::layout::TRIANGLE_WORDS;
use restir_shared::pack::xyz;
use restir_shared::scene::{Hierarchy, SceneView};
use std::sync::Arc;

/// The bounds of the arena's triangles.
fn triangle_boxes(scene: &SceneView<'_>) -> Vec<Bounds> {
    let triangles = scene.geometry[scene.header.triangle_base as usize..].chunks_exact(TRIANGLE_WORDS as usize);
    let bounds = |words: &[UVec4]| Bounds::of(&[0, 1, 2].map(|corner| xyz(words[corner])));
    triangles.take(scene.header.triangle_count as usize).map(bounds).collect()
}

/// A BVH of eight children a node over the triangles of a scene.
#[derive(Debug, Clone)]
pub struct WideBvh {
    tree: Arc<Tree>,
    /// All triangles, where they are few and none is marked.
    brute_force: Option<Arc<BruteForce>>,
    level: SimdLevel,
    /// Where the level is that of the widest registers.
    widest: Option<Avx512>,
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
        let tree = collapse::collapse(scene, binary);
        let few = if tree.partial { None } else { BruteForce::new(&tree.leaves, tree.bounds) };
        let level = SimdLevel::best();
        Self { tree: Arc::new(tree), brute_force: few.map(Arc::new), level, widest: Avx512::at(level) }
    }

    /// The same tree, traversed at a level, or at the best below it that this processor has.
    #[must_use]
    pub fn with_level(mut self, level: SimdLevel) -> Self {
        self.level = level.or_below();
        self.widest = Avx512::at(self.level);
        self
    }

    /// All triangles, where it takes less time to test them than to trace the rays in `of` one by one: with the widest registers, for with
    /// those of AVX2 the tree is faster.
    #[inline(always)]
    fn brute_force(&self, of: &Lanes<bool>) -> Option<(&BruteForce, Avx512)> {
        let token = self.widest?;
        Some((self.brute_force.as_ref().filter(|all| all.pays(of))?, token))
    }
}

/// Makes a method of a traversal that is compiled for each level, with its instructions.
macro_rules! at_level {
    (fn $method:ident($($argument:ident: $of:ty),*) -> $answer:ty = $module:ident::$traversal:ident) => {
        #[inline(always)]
        fn $method<C: Coverage>(&self, $($argument: $of,)* coverage: &C) -> $answer {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            unsafe fn avx2<C: Coverage>(tree: &Tree, $($argument: $of,)* coverage: &C) -> $answer {
                $module::$traversal::<simd::Avx2, C>(tree, $($argument,)* coverage)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
            unsafe fn avx512<C: Coverage>(tree: &Tree, $($argument: $of,)* coverage: &C) -> $answer {
                $module::$traversal::<simd::Avx2, C>(tree, $($argument,)* coverage)
            }
            match self.level {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the level is set to what the processor was found to have
                SimdLevel::Avx2 => unsafe { avx2(&self.tree, $($argument,)* coverage) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: as above
                SimdLevel::Avx512 => unsafe { avx512(&self.tree, $($argument,)* coverage) },
                _ => $module::$traversal::<simd::Portable, C>(&self.tree, $($argument,)* coverage),
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
        if $tree.tree.partial {
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
        if let Some((all, token)) = self.brute_force(of) {
            return all.closest(rays, of, token);
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
        if let Some((all, token)) = self.brute_force(of) {
            return all.occluded(rays, of, token);
        }
        over!(self.any_each_over(rays, of), coverage)
    }

    fn crossings(&self, ray: &Ray, coverage: &dyn Coverage) -> Crossings {
        self.all_over(ray, &coverage)
    }
}

#[cfg(test)]
mod tests;
