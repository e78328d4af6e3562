use super::simd::{LANES, Lanes, Portable, Row};
use super::{Node, SimdLevel, WideBvh};
use crate::buffers::SceneBuffers;
use crate::scene::Scene;
use glam::Vec3;
use restir_shared::geometry::{Ray, Solid};
use restir_shared::layout::NONE;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::scene::{Hierarchy, SceneView, Trace};
use std::mem::MaybeUninit;

/// Lanes listed from the highest, for every set of them.
fn assert_compresses<L: Lanes>() {
    let words: [u32; LANES] = std::array::from_fn(|lane| 100 + lane as u32);
    for lanes in 0..1 << LANES {
        let mut row = [MaybeUninit::new(u32::MAX); LANES];
        L::compress(&words, lanes, &mut row);
        let expected: Vec<u32> =
            (0..LANES as u32).rev().filter(|lane| lanes >> lane & 1 != 0).map(|lane| 100 + lane).collect();
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
        let [lower, upper]: &mut [Row; 2] = planes;
        (lower.0[slot], upper.0[slot]) = (f32::INFINITY, f32::NEG_INFINITY);
    }
}

#[test]
fn a_forgotten_child_is_seen() {
    let buffers = SceneBuffers::build(&Scene::load("cornell-mixed").unwrap()).unwrap();
    let view = buffers.view();
    for level in SimdLevel::available() {
        let tree = || WideBvh::new(&view).with_level(level);
        assert_eq!(differences(&view, &tree()), 0, "{level:?}");
        let children = tree().nodes[0].children.iter().filter(|&&child| child != NONE).count();
        for slot in 0..children {
            let mut forgetful = tree();
            forget(&mut forgetful.nodes[0], slot);
            assert!(differences(&view, &forgetful) > 0, "{level:?} without child {slot}");
        }
    }
}
