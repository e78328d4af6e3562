use super::beam::{Beam, traverse};
use super::brute_force::BruteForce;
use super::node::{Node, Tree};
use super::packet::RayPacket16;
use super::simd::{self, Array8, Portable, WIDTH};
use super::{SimdLevel, WideBvh};
use crate::buffers::SceneBuffers;
use crate::scene::Scene;
use glam::{Vec2, Vec3};
use restir_shared::camera::{camera_ray, primary_ray, rays_about_pixel};
use restir_shared::geometry::{Coverage, Hit, Ray, Solid};
use restir_shared::lanes::{LANES, LaneKernel, Lanes, SimdToken};
use restir_shared::layout::{CameraParams, NONE};
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::scene::{Hierarchy, SceneView, Trace};
use std::mem::MaybeUninit;
use std::sync::Arc;

/// Lanes listed from the highest, for every set of them.
fn assert_compresses<L: simd::F32x8>() {
    let words: [u32; WIDTH] = std::array::from_fn(|lane| 100 + lane as u32);
    for lanes in 0..1 << WIDTH {
        let mut row = [MaybeUninit::new(u32::MAX); WIDTH];
        L::compress(&words, lanes, &mut row);
        let expected: Vec<u32> =
            (0..WIDTH as u32).rev().filter(|lane| lanes >> lane & 1 != 0).map(|lane| 100 + lane).collect();
        // SAFETY: made of written words
        let found = row.map(|word| unsafe { word.assume_init() });
        assert_eq!(found[..expected.len()], expected, "of {lanes:#b}");
    }
}

#[test]
fn lanes_are_compressed_from_the_highest() {
    assert_compresses::<Portable>();
    #[cfg(target_arch = "x86_64")]
    if SimdLevel::available().contains(&SimdLevel::Avx2) {
        assert_compresses::<super::simd::Avx2>();
    }
}

/// Segments between points in and a little around the bounds.
fn segments(view: &SceneView<'_>) -> Vec<Ray> {
    let [lo, hi] = [view.header.bounds_lo, view.header.bounds_hi].map(Vec3::from_array);
    let point = |i, seed| {
        let words = Rng::new(i, 0, 0, seed, Sampler::Independent).draw(0);
        let at = Vec3::new(unit(words.x), unit(words.y), unit(words.z)) * 1.2 - 0.1;
        lo + (hi - lo) * at
    };
    let segment = |i| {
        let origin = point(i, 1);
        Ray { origin, direction: point(i, 2) - origin, t_max: 1.0, key: 0 }
    };
    (0..20_000).map(segment).collect()
}

/// Of how many segments a tree says something else than the arena.
fn differences(view: &SceneView<'_>, tree: &WideBvh) -> usize {
    segments(view).iter().filter(|ray| tree.occluded(ray, &Solid) != view.occluded(ray)).count()
}

/// Nothing hits the child any more, as if a traversal forgot it.
fn forget(node: &mut Node, slot: usize) {
    for planes in &mut node.planes {
        let [lower, upper]: &mut [Array8; 2] = planes;
        (lower.0[slot], upper.0[slot]) = (f32::INFINITY, f32::NEG_INFINITY);
    }
}

#[test]
fn a_forgotten_child_is_seen() {
    let buffers = SceneBuffers::build(&Scene::load("cornell-mixed").unwrap()).unwrap();
    let view = buffers.view();
    for level in SimdLevel::available() {
        let tree = || WideBvh::thorough(&view).with_level(level);
        assert_eq!(differences(&view, &tree()), 0, "{level:?}");
        let children = tree().tree.nodes[0].children.iter().filter(|&&child| child != NONE).count();
        for slot in 0..children {
            let mut forgetful = tree();
            forget(&mut Arc::get_mut(&mut forgetful.tree).unwrap().nodes[0], slot);
            assert!(differences(&view, &forgetful) > 0, "{level:?} without child {slot}");
        }
    }
}

/// Of how many segments, sixteen at a time, a tree says something else than the arena, or says anything of those it is not asked for.
fn differences_of_each(view: &SceneView<'_>, tree: &WideBvh) -> usize {
    let differs = |(at, segments): (usize, &[Ray])| {
        let (mut rays, mut of) = (Lanes::ZERO, Lanes::ZERO);
        for (lane, ray) in segments.iter().enumerate() {
            rays.set(lane, *ray);
            of.set(lane, (at + lane) % 3 != 0);
        }
        let (hits, occluded) = (tree.closest_each(&rays, &of, &Solid), tree.occluded_each(&rays, &of, &Solid));
        let asked = |lane: usize| if of.get(lane) { view.closest(&rays.get(lane)) } else { Hit::MISS };
        (0..LANES).filter(|&lane| hits.get(lane) != asked(lane) || occluded.get(lane) != asked(lane).is_hit()).count()
    };
    segments(view).chunks_exact(LANES).enumerate().map(differs).sum()
}

#[test]
fn rays_that_are_prepared_together_have_their_hits() {
    let buffers = SceneBuffers::build(&Scene::load("cornell-mixed").unwrap()).unwrap();
    let view = buffers.view();
    for level in SimdLevel::available() {
        let tree = || WideBvh::thorough(&view).with_level(level);
        assert_eq!(differences_of_each(&view, &tree()), 0, "{level:?}");
        let mut forgetful = tree();
        forget(&mut Arc::get_mut(&mut forgetful.tree).unwrap().nodes[0], 0);
        assert!(differences_of_each(&view, &forgetful) > 0, "{level:?} without a child");
    }
}

/// The registers that every processor has.
#[derive(Clone, Copy)]
struct Any;

impl SimdToken for Any {
    const GATHERS: bool = false;

    fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out) {
        kernel.run(input, output);
    }
}

/// Of how many groups of segments some answer is not the arena's, if all triangles are tested.
fn differences_of_few(view: &SceneView<'_>, few: &BruteForce) -> usize {
    let differs = |(at, segments): &(usize, &[Ray])| {
        let endless = |lane: usize| Ray { t_max: f32::INFINITY, ..segments[lane] };
        let rays = Lanes::from_fn(|lane| if lane % 5 == 0 { endless(lane) } else { segments[lane] });
        let of = Lanes::from_fn(|lane| (at + lane) % 3 != 0);
        let (hits, occluded) = (few.closest(&rays, &of, Any), few.occluded(&rays, &of, Any));
        let asked = |lane: usize| if of.get(lane) { view.closest(&rays.get(lane)) } else { Hit::MISS };
        (0..LANES).any(|lane| hits.get(lane) != asked(lane) || occluded.get(lane) != asked(lane).is_hit())
    };
    segments(view).chunks_exact(LANES).enumerate().filter(differs).count()
}

#[test]
fn few_triangles_are_tested_without_a_tree() {
    for scene in ["cornell", "furnace"] {
        let buffers = SceneBuffers::build(&Scene::load(scene).unwrap()).unwrap();
        let view = buffers.view();
        let tree = WideBvh::thorough(&view);
        let few = || BruteForce::new(&tree.tree.leaves, tree.tree.bounds).unwrap();
        assert_eq!(differences_of_few(&view, &few()), 0, "{scene}");
        for forgotten in 0..view.header.triangle_count as usize {
            let mut forgetful = few();
            forgetful.triangles.remove(forgotten);
            assert!(differences_of_few(&view, &forgetful) > 0, "{scene} without triangle {forgotten}");
        }
    }
}

#[test]
fn few_triangles_are_tested_where_it_pays() {
    let used = |scene: &Scene, level: SimdLevel, rays: usize| {
        let buffers = SceneBuffers::build(scene).unwrap();
        let tree = WideBvh::thorough(&buffers.view()).with_level(level);
        tree.brute_force(&Lanes::from_fn(|lane| lane < rays)).is_some()
    };
    let cornell = Scene::load("cornell").unwrap();
    for level in SimdLevel::available() {
        assert_eq!(used(&cornell, level, LANES), level == SimdLevel::Avx512, "{level:?}");
        assert!(!used(&cornell, level, 1), "one ray, {level:?}");
        assert!(!used(&cornell.clone().subdivided(1), level, LANES), "four times as many triangles, {level:?}");
        assert!(!used(&Scene::load("moving").unwrap(), level, LANES), "{level:?}");
    }
}

/// Pixels along a side of the pictures of beams.
const SIDE: u32 = 64;

/// Groups of rays as a camera has them: of a pixel, with and without a lens, in the middle of the picture, where directions change
/// their signs, and all over it.
fn beams(camera: &CameraParams) -> Vec<Lanes<Ray>> {
    let side = SIDE as f32;
    let ray = |group: u32, lane: u32| {
        let of_group = Rng::new(group, 0, 0, 1, Sampler::Independent).draw(0);
        let words = Rng::new(group, lane, 0, 2, Sampler::Independent).draw(0);
        let pixel = Vec2::new(unit(of_group.x), unit(of_group.y)) * side;
        let within = Vec2::new(unit(words.x), unit(words.y));
        let lens = Vec2::new(unit(words.z), unit(words.w)) - 0.5;
        let (at, lens) = match group % 4 {
            0 => (pixel + within, Vec2::ZERO),
            1 => (pixel + within, lens),
            2 => (within + (side / 2.0 - 0.5), Vec2::ZERO),
            _ => (within * side, Vec2::ZERO),
        };
        primary_ray(camera, at, lens)
    };
    let beam = |group| {
        let mut rays = Lanes::ZERO;
        (0..LANES).for_each(|lane| rays.set(lane, ray(group, lane as u32)));
        rays
    };
    (0..400).map(beam).collect()
}

/// Of how many beams some ray hits something else than what the arena says.
fn others(view: &SceneView<'_>, beams: &[Lanes<Ray>], closest_together: impl Fn(&Lanes<Ray>) -> Lanes<Hit>) -> usize {
    let differs = |rays: &&Lanes<Ray>| {
        let hits = closest_together(rays);
        (0..LANES).any(|lane| hits.get(lane) != view.closest(&rays.get(lane)))
    };
    beams.iter().filter(differs).count()
}

/// A beam that is the first of its rays, for all of them: it passes by what only others hit.
fn as_the_first(tree: &Tree, rays: &Lanes<Ray>, coverage: &impl Coverage) -> Lanes<Hit> {
    let mut first = Lanes::ZERO;
    (0..LANES).for_each(|lane| first.set(lane, rays.get(0)));
    let (first, each) = (RayPacket16::new(&first, tree.bounds), RayPacket16::new(rays, tree.bounds));
    let order = each.order().or(first.order()).unwrap();
    traverse::<_, _, false>(tree, &Beam::<Portable>::new(&first), &each, order, rays, coverage)
}

#[test]
fn beams_have_the_hits_of_their_rays() {
    for scene in ["cornell-mixed", "many-lights", "foliage", "statue"] {
        let buffers = SceneBuffers::build(&Scene::load(scene).unwrap()).unwrap();
        let view = buffers.view();
        let beams = beams(&CameraParams { lens_right: 0.05, lens_up: 0.05, ..buffers.camera.params(SIDE, SIDE) });
        for level in SimdLevel::available() {
            let tree = WideBvh::thorough(&view).with_level(level);
            assert_eq!(others(&view, &beams, |rays| tree.closest_together(rays, &view)), 0, "{level:?}");
        }
        let tree = WideBvh::thorough(&view);
        assert!(others(&view, &beams, |rays| as_the_first(&tree.tree, rays, &view)) > 0, "too small a beam passes");
    }
}

/// Of how many pixels a tree says that no ray through them meets an emitter although one of 64 does, and of how many that one may.
fn overlooked(view: &SceneView<'_>, camera: &CameraParams, between: impl Fn(&Lanes<Ray>) -> bool) -> [usize; 2] {
    let emits = |hit: &Hit| hit.is_hit() && view.geometry[view.header.triangle_word(hit.id) + 1].w != NONE;
    let mut counts = [0; 2];
    for index in 0..SIDE * SIDE {
        let (x, y) = (index % SIDE, index / SIDE);
        let sees = |sample| {
            let rng = Rng::new(x, y, sample, 3, Sampler::Sobol);
            emits(&view.closest(&camera_ray(camera, true, |u| u, 0, &rng, x, y)))
        };
        if between(&rays_about_pixel(camera, [x, y])) {
            counts[1] += 1;
        } else {
            counts[0] += usize::from((0..64).any(sees));
        }
    }
    counts
}

#[test]
fn no_emitter_is_overlooked() {
    for scene in ["cornell", "many-lights", "moving"] {
        let buffers = SceneBuffers::build(&Scene::load(scene).unwrap()).unwrap();
        let (view, camera) = (buffers.view(), buffers.camera.params(SIDE, SIDE));
        for level in SimdLevel::available() {
            let tree = WideBvh::new(&view).with_level(level);
            let [overlooked, may] = overlooked(&view, &camera, |rays| tree.emitters_between(rays));
            assert_eq!(overlooked, 0, "{scene}, {level:?}");
            assert!(may < (SIDE * SIDE) as usize, "{scene}, {level:?}: {may} pixels may see one");
        }
        // a tree that has forgotten all of them
        let mut forgetful = WideBvh::new(&view);
        Arc::get_mut(&mut forgetful.tree).unwrap().nodes.iter_mut().for_each(|node| node.emitters = 0);
        assert!(overlooked(&view, &camera, |rays| forgetful.emitters_between(rays))[0] > 0, "{scene}");
    }
}
