//! Segments that are hard to probe: all hits of one object, by every traversal and by brute force.

use crate::brute::Triangles;
use crate::meshes::{cube, far_grid, slivers, soup, sphere, stack, together, together_with_alpha, torus};
use crate::random::SplitMix;
use crate::rays::adversarial;
use glam::Vec3;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{AlphaMode, Filter, Mesh};
use restir_host::wide_bvh::{SimdLevel, WideBvh};
use restir_kernels::Case;
use restir_kernels::check::crossing_check::{self, CrossingCheckParams, Segment};
use restir_shared::geometry::{Crossings, Hit, Ray};
use restir_shared::scene::{Probe, SceneView};

/// Meshes, each with its group.
type Parts = Vec<(Mesh, Option<u32>)>;

/// Objects that touch, lie in each other, are there twice, have many sheets, or are far away.
fn parts() -> Vec<(&'static str, Parts)> {
    let apart = |meshes: Vec<Mesh>| meshes.into_iter().map(|mesh| (mesh, None)).collect::<Parts>();
    let shells = |count: u32| (1..=count).map(|i| sphere(f64::from(i) * 0.125, 12, 6));
    let corners = (0..8).map(|i| [0, 1, 2].map(|axis| (i >> axis & 1) as f32 - 0.5));
    let boxes = corners.map(|at| moved(cube(0.5, 2), Vec3::from_array(at)));
    vec![
        ("shells", shells(7).map(|shell| (shell, Some(3))).chain([(sphere(0.5, 12, 6), None)]).collect()),
        ("touching boxes", apart(boxes.chain([moved(cube(0.5, 2), Vec3::splat(0.5))]).collect())),
        ("stacks", apart(vec![stack(40), stack(12)])),
        ("soups", (5..9).map(|stream| (soup(80, stream), Some(stream as u32 % 2))).collect()),
        ("slivers", apart(vec![slivers(120), soup(40, 2)])),
        ("rings", apart(vec![torus(2.0, 0.5, 16, 8), moved(torus(2.0, 0.5, 16, 8), Vec3::new(2.0, 0.0, 0.25))])),
        ("few", apart(vec![soup(1, 6), soup(1, 7)])),
        ("far boxes", apart(vec![far_grid(1.0, 3, 4096.0), moved(far_grid(1.0, 3, 4096.0), Vec3::new(2.0, 0.0, 0.0))])),
    ]
}

fn moved(mut mesh: Mesh, by: Vec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|at| *at = (Vec3::from_array(*at) + by).to_array());
    mesh
}

/// The scenes, with their names; some of them also under a mask and blended.
pub fn scenes() -> Vec<(String, SceneBuffers)> {
    let mut scenes: Vec<(String, SceneBuffers)> =
        parts().into_iter().map(|(name, parts)| (name.to_owned(), together(parts))).collect();
    for (mode, alpha) in [("masked", AlphaMode::Mask { cutoff: 0.4 }), ("blended", AlphaMode::Blend)] {
        let partial = parts().into_iter().take(2);
        scenes.extend(
            partial.map(|(name, parts)| (format!("{mode} {name}"), together_with_alpha(parts, alpha, Filter::Nearest))),
        );
    }
    scenes
}

/// A segment at or through the triangles of a scene, and one of its objects.
pub fn segment(triangles: &Triangles, random: &mut SplitMix) -> (Ray, u32) {
    let object = triangles.object(random.below(triangles.len()));
    let ray = adversarial(triangles, random);
    // through most of the scene, so that there is much to count
    let long = Ray { t_max: 2.0 * triangles.extent() / ray.direction.abs().max_element().max(1.0e-30), ..ray };
    (if random.below(3) == 0 { long } else { ray }, object)
}

/// What a number of segments have met.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Segments.
    pub segments: u64,
    /// Those with a hit.
    pub hit: u64,
    /// Those with more hits than are listed.
    pub overflowing: u64,
    /// Those with two hits at the same distance.
    pub tied: u64,
    /// Those that boxes without padding answer otherwise.
    pub seen: u64,
    /// Those that some traversal answers otherwise.
    pub differing: u64,
}

impl Tally {
    fn of(crossings: &Crossings, is_seen: bool, differs: bool) -> Self {
        let tied = |pair: &[Hit]| pair[1].is_hit() && pair[0].t == pair[1].t;
        Self {
            segments: 1,
            hit: u64::from(crossings.count > 0),
            overflowing: u64::from(crossings.count as usize > Crossings::LISTED),
            tied: u64::from(crossings.nearest.windows(2).any(tied)),
            seen: u64::from(is_seen),
            differing: u64::from(differs),
        }
    }

    /// Both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            segments: self.segments + other.segments,
            hit: self.hit + other.hit,
            overflowing: self.overflowing + other.overflowing,
            tied: self.tied + other.tied,
            seen: self.seen + other.seen,
            differing: self.differing + other.differing,
        }
    }
}

/// The bits of an answer.
pub fn bits(crossings: &Crossings) -> (u32, [[u32; 4]; Crossings::LISTED]) {
    let of_hit = |hit: Hit| [hit.t.to_bits(), hit.id, hit.uv.x.to_bits(), hit.uv.y.to_bits()];
    (crossings.count, crossings.nearest.map(of_hit))
}

/// Compares every traversal of a scene with brute force on so many segments of a stream.
pub fn compare(what: &str, buffers: &SceneBuffers, segments: u64, stream: u64) -> Tally {
    let view = buffers.view();
    let triangles = Triangles::new(view);
    let trees: Vec<WideBvh> =
        SimdLevel::available().into_iter().map(|level| WideBvh::thorough(&view).with_level(level)).collect();
    let tally = |i: u64| {
        let (ray, object) = segment(&triangles, &mut SplitMix::new(stream << 40 | i));
        let expected = triangles.crossings(&ray, object);
        let wide = trees.iter().map(|tree| SceneView { tracer: Some(tree), ..view }.probe(&ray, object));
        let answers: Vec<Crossings> = std::iter::once(view.probe(&ray, object)).chain(wide).collect();
        let wrong = answers.iter().find(|found| bits(found) != bits(&expected));
        if let Some(found) = wrong {
            let Ray { origin, direction, t_max, .. } = ray;
            eprintln!("{what}, segment {i} from {origin} along {direction} up to {t_max:e}, object {object}:");
            eprintln!("{found:?}, by brute force {expected:?}");
        }
        let tight = triangles.crossings_in_tight_boxes(&ray, object);
        Tally::of(&expected, bits(&tight) != bits(&expected), wrong.is_some())
    };
    (0..segments).into_par_iter().map(tally).reduce(Tally::default, Tally::plus)
}

/// So many segments of a stream as a case of the kernel.
pub fn case(name: &str, buffers: &SceneBuffers, segments: u64, stream: u64) -> Case {
    let triangles = Triangles::new(buffers.view());
    let segment = |i| {
        let (ray, object) = segment(&triangles, &mut SplitMix::new(stream << 40 | i));
        Segment::new(&ray, object)
    };
    let params = CrossingCheckParams { scene: buffers.header, count: segments as u32, reserved: [0; 3] };
    Case::new(&crossing_check::DESC, name, params.count, 1)
        .with(&[params])
        .with(&buffers.geometry)
        .with(&buffers.attributes)
        .with(&buffers.texels)
        .with(&(0..segments).map(segment).collect::<Vec<_>>())
        .output()
}

/// Segments of a parity case.
const SEGMENTS: u64 = 512;

/// The parity cases of the kernel.
pub(crate) fn cases() -> Vec<Case> {
    (1..).zip(scenes()).map(|(stream, (name, buffers))| case(&name, &buffers, SEGMENTS, stream)).collect()
}
