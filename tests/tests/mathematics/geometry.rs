//! Rays against triangles: the hierarchy equals brute force bit for bit, closed meshes are tight, and a traversal
//! that is wrong at boxes or edges is noticed.

use glam::Vec3;
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{AlphaMode, Filter, Mesh, Scene};
use restir_host::wide_bvh::{SimdLevel, WideBvh};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::lanes::{LANES, Lanes};
use restir_shared::scene::{Probe, SceneView, Trace};
use restir_tests::brute::Triangles;
use restir_tests::crossings::{self, Tally};
use restir_tests::data;
use restir_tests::gltf_motion::{MOTIONS, TIMES};
use restir_tests::meshes::{
    buffers, cube, far_grid, scaled, slivers, soup, sphere, stack, together, torus, with_alpha,
};
use restir_tests::random::SplitMix;
use restir_tests::rays::adversarial;
use restir_tests::suite;
use restir_tests::suite::ensure;
use restir_tests::watertight::{self, on_edge};
use std::array::from_fn;
use std::collections::BTreeSet;

/// Rays against each procedural mesh; there are ten.
const RAYS: u64 = 100_000;
/// Rays against each moment of a scene that moves; there are five of one and three of each file.
const MOVED_RAYS: u64 = 20_000;
/// Rays against each procedural mesh under a mask, and blended.
const MASKED_RAYS: u64 = 100_000;
const BLENDED_RAYS: u64 = 20_000;
/// Rays against a mesh from a file, and how many of its triangles.
const FILE_RAYS: u64 = 2_000;
/// Rays from the inside of each closed mesh; there are four.
const INSIDE_RAYS: u64 = 400_000;
/// Rays from the inside of a mesh from a file.
const ORGANIC_RAYS: u64 = 1 << 20;
/// Segments against each scene of objects; there are twelve.
const SEGMENTS: u64 = 20_000;
/// Huge coordinates, up to the 2^30 that the host takes: a mesh around the origin, and one that is small against its
/// distance from it, where coordinates are 64 apart.
const HUGE: f32 = 1.0e9;
const FAR: f32 = 1_073_741_824.0 - FAR_HALF;
const FAR_HALF: f32 = 131_072.0;

suite! {
    later {
        refitted_hierarchies_equal_fresh_ones hierarchy_equals_brute_force hierarchy_equals_brute_force_under_alpha closed_meshes_are_tight
        boxes_without_padding_are_seen open_edges_are_seen the_lower_id_wins_among_equal_hits
        hits_lie_on_their_triangles probes_equal_brute_force groups_of_a_material_are_objects hierarchy_equals_brute_force_on_a_file
        a_closed_organic_mesh_is_tight
    }
}

fn bits(hit: &Hit) -> [u32; 4] {
    [hit.t.to_bits(), hit.id, hit.uv.x.to_bits(), hit.uv.y.to_bits()]
}

fn describe(ray: &Ray) -> String {
    format!("from {} along {} up to {:e}", ray.origin, ray.direction, ray.t_max)
}

/// The wide BVH at every level that the processor has, and that of a better binary tree.
fn wide_trees(view: &SceneView<'_>) -> Vec<(String, WideBvh)> {
    let tree = |level| (format!("wide, {level:?}"), WideBvh::new(view).with_level(level));
    let thorough = ("wide, thorough".to_owned(), WideBvh::thorough(view));
    SimdLevel::available().into_iter().map(tree).chain([thorough]).collect()
}

/// Every traversal of a scene: that of the arena, and those of `wide` trees.
fn traversals<'a>(view: SceneView<'a>, wide: &'a [(String, WideBvh)]) -> Vec<(&'a str, SceneView<'a>)> {
    let traced = wide.iter().map(|(name, tree)| (name.as_str(), SceneView { tracer: Some(tree), ..view }));
    std::iter::once(("arena", view)).chain(traced).collect()
}

/// Compares `closest` and `occluded` of all traversals with brute force, of single rays and of sixteen, all or some of which are asked for;
/// gives the share of rays that hit.
fn compare(what: &str, buffers: &SceneBuffers, rays: u64, stream: u64) -> f64 {
    let view = buffers.view();
    let (triangles, wide) = (Triangles::new(view), wide_trees(&view));
    let traversals = traversals(view, &wide);
    let hits = |group: u64| {
        let number = |lane: usize| group * LANES as u64 + lane as u64;
        let of_lanes = Lanes::from_fn(|lane| adversarial(&triangles, &mut SplitMix::new(stream << 40 | number(lane))));
        let of = Lanes::from_fn(|lane| group.is_multiple_of(2) || !(group as usize + lane).is_multiple_of(3));
        let expected: [Hit; LANES] = from_fn(|lane| triangles.closest(&of_lanes.get(lane)));
        for (name, tracer) in &traversals {
            let (closest, occluded) = (tracer.closest_each(&of_lanes, &of), tracer.occluded_each(&of_lanes, &of));
            for lane in 0..LANES {
                let (ray, expected) = (of_lanes.get(lane), expected[lane]);
                let at = || format!("{what}, {name}: ray {} {}", number(lane), describe(&ray));
                let found = tracer.closest(&ray);
                assert!(bits(&found) == bits(&expected), "{}: {found:?}, by brute force {expected:?}", at());
                assert!(tracer.occluded(&ray) == expected.is_hit(), "{}: occluded differs from closest", at());
                let (found, asked) = (closest.get(lane), if of.get(lane) { expected } else { Hit::MISS });
                assert!(bits(&found) == bits(&asked), "{}: one of sixteen {found:?}, by brute force {asked:?}", at());
                assert!(occluded.get(lane) == asked.is_hit(), "{}: occluded differs, as one of sixteen", at());
            }
        }
        expected.iter().filter(|hit| hit.is_hit()).count()
    };
    assert!(rays.is_multiple_of(LANES as u64), "{rays} rays");
    let share = (0..rays / LANES as u64).into_par_iter().map(hits).sum::<usize>() as f64 / rays as f64;
    println!("{what}: {} triangles, {rays} rays, {:.0} % hit", buffers.header.triangle_count, 100.0 * share);
    assert!(share > 0.1, "{what}: {share} of the rays hit");
    share
}

fn meshes() -> [Mesh; 10] {
    [
        sphere(1.0, 24, 12),
        torus(2.0, 0.5, 24, 12),
        cube(1.0, 6),
        soup(400, 5),
        soup(3, 6),
        slivers(300),
        stack(40),
        far_grid(1.0, 4, 4096.0),
        scaled(torus(0.75, 0.1875, 24, 12), HUGE),
        far_grid(FAR_HALF, 4, FAR),
    ]
}

fn hierarchy_equals_brute_force() {
    for (stream, mesh) in meshes().into_iter().enumerate() {
        let name = mesh.name.clone();
        let share = compare(&name, &buffers(mesh), RAYS, stream as u64 + 1);
        assert!(share < 0.99, "{name}: {share} of the rays hit");
    }
}

/// Masks, and surfaces of which a ray's own bits and key say whether it meets them.
fn hierarchy_equals_brute_force_under_alpha() {
    let modes = [
        ("masked", AlphaMode::Mask { cutoff: 0.4 }, Filter::Nearest, MASKED_RAYS),
        ("blended", AlphaMode::Blend, Filter::Linear, BLENDED_RAYS),
    ];
    for (mode, (name, alpha, filter, rays)) in (0..).zip(modes) {
        for (stream, mesh) in meshes().into_iter().enumerate() {
            let what = format!("{name} {}", mesh.name);
            let opaque = buffers(mesh.clone());
            let partial = with_alpha(mesh, alpha, filter);
            compare(&what, &partial, rays, 400 + 100 * mode + stream as u64);
            let missed = missed(&opaque, &partial, rays / 10, 400 + 100 * mode + stream as u64);
            assert!(missed > 0.1, "{what}: {missed} of the hits do not count");
        }
    }
}

/// The share of a scene's hits that are none in another one of the same triangles.
fn missed(opaque: &SceneBuffers, partial: &SceneBuffers, rays: u64, stream: u64) -> f64 {
    let triangles = Triangles::new(opaque.view());
    let ray = |i| adversarial(&triangles, &mut SplitMix::new(stream << 40 | i));
    let hits: Vec<(Ray, Hit)> = (0..rays)
        .map(ray)
        .map(|ray| (ray, opaque.traced_view().closest(&ray)))
        .filter(|(_, hit)| hit.is_hit())
        .collect();
    let other = |(ray, hit): &&(Ray, Hit)| bits(&partial.traced_view().closest(ray)) != bits(hit);
    hits.iter().filter(other).count() as f64 / hits.len() as f64
}

/// A scene that has moved: the refitted tree gives the hits of brute force, and those of a tree that is built anew, where
/// triangles have other ids.
fn refitted_hierarchies_equal_fresh_ones() -> Result<(), Failed> {
    refitted_hierarchy_equals_a_fresh_one(&Scene::load("moving")?, &[0.0, 3.5, 8.0, 16.0, 29.25])?;
    for motion in MOTIONS {
        let scene = motion.scene()?;
        refitted_hierarchy_equals_a_fresh_one(&scene, &TIMES.map(|time| time * scene.animation.frame_rate))?;
    }
    Ok(())
}

fn refitted_hierarchy_equals_a_fresh_one(scene: &Scene, frames: &[f64]) -> Result<(), Failed> {
    let first = SceneBuffers::build(scene)?;
    for (stream, &time) in frames.iter().enumerate() {
        let (moved, fresh) = (first.at(time)?, SceneBuffers::build(&scene.at(time))?);
        compare(&format!("{}, frame {time}", scene.name), &moved, MOVED_RAYS, 200 + stream as u64);
        let [here, there] = [&moved, &fresh].map(|buffers| Triangles::new(buffers.view()));
        let mut others = 0;
        for i in 0..MOVED_RAYS {
            let ray = adversarial(&here, &mut SplitMix::new((300 + stream as u64) << 40 | i));
            let (a, b) = (moved.traced_view().closest(&ray), fresh.traced_view().closest(&ray));
            let same = a.t.to_bits() == b.t.to_bits() && a.is_hit() == b.is_hit();
            assert!(same, "time {time}: {}: {a:?}, anew {b:?}", describe(&ray));
            // at the same t, another triangle may have the lower id
            others += u64::from(a.is_hit() && here.get(a.id as usize) != there.get(b.id as usize));
        }
        println!("time {time}: {others} of {MOVED_RAYS} on a triangle at the same place");
        assert!(others < MOVED_RAYS / 4, "time {time}: {others} elsewhere");
    }
    Ok(())
}

fn hierarchy_equals_brute_force_on_a_file() -> Result<(), Failed> {
    compare("bunny", &SceneBuffers::build(&data::mesh("bunny.glb")?)?, FILE_RAYS, 99);
    Ok(())
}

/// A closed mesh.
struct Closed {
    buffers: SceneBuffers,
    /// A point well inside.
    inside: Vec3,
    /// Points up to an eighth of this from it, along each axis, are inside too.
    size: f32,
}

impl Closed {
    fn new(mesh: Mesh, inside: Vec3, size: f32) -> Self {
        Self { buffers: buffers(mesh), inside, size }
    }
}

/// A ray from inside a closed mesh at a vertex or a point of an edge.
fn from_inside(triangles: &Triangles, closed: &Closed, random: &mut SplitMix) -> Ray {
    let at = on_edge(triangles, random);
    let mut shift = || {
        if random.below(4) == 0 { 0.0 } else { random.range(-0.125, 0.125) as f32 }
    };
    let origin = closed.inside + Vec3::new(shift(), shift(), shift()) * closed.size;
    Ray { origin, direction: at - origin, t_max: Ray::FAR, key: 0 }
}

/// From within the torus even a ray through its hole has to hit.
fn closed() -> [Closed; 6] {
    let in_torus = Vec3::new(2.0, 0.0, 0.0);
    [
        Closed::new(sphere(1.0, 32, 16), Vec3::ZERO, 1.0),
        Closed::new(torus(2.0, 0.5, 40, 16), in_torus, 1.0),
        Closed::new(cube(1.0, 8), Vec3::ZERO, 1.0),
        Closed::new(far_grid(1.0, 8, 64.0), Vec3::splat(64.0), 1.0),
        Closed::new(far_grid(FAR_HALF, 8, FAR), Vec3::splat(FAR), FAR_HALF),
        Closed::new(scaled(torus(0.75, 0.1875, 40, 16), HUGE), 0.375 * HUGE * in_torus, 0.375 * HUGE),
    ]
}

/// How many of the rays from inside leave the mesh unnoticed.
fn escapes(closed: &Closed, hit: impl Fn(&Triangles, &Ray) -> bool + Sync) -> u64 {
    let triangles = Triangles::new(closed.buffers.view());
    (0..INSIDE_RAYS)
        .into_par_iter()
        .filter(|&i| !hit(&triangles, &from_inside(&triangles, closed, &mut SplitMix::new(7 << 40 | i))))
        .count() as u64
}

fn closed_meshes_are_tight() {
    for closed in &closed() {
        let tracer = closed.buffers.traced_view();
        let count = escapes(closed, |_, ray| tracer.closest(ray).is_hit() && tracer.occluded(ray));
        let Closed { inside, buffers, .. } = closed;
        println!("around {inside}: {} triangles: {count} of {INSIDE_RAYS} rays escape", buffers.header.triangle_count);
        assert!(count == 0, "{count} rays escape from the mesh around {inside}");
    }
}

/// The reduced form of `cargo lab watertight`.
fn a_closed_organic_mesh_is_tight() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&data::mesh("bunny.glb")?)?;
    let closed = watertight::Closed::new(&buffers).map_err(|open| format!("{open} open edges"))?;
    let streams = ORGANIC_RAYS / watertight::Closed::RAYS;
    let escaping: Vec<Ray> = (0..streams).into_par_iter().flat_map_iter(|stream| closed.escaping(stream)).collect();
    println!("bunny: {} of {ORGANIC_RAYS} rays from {streams} points inside escape", escaping.len());
    assert!(escaping.is_empty(), "{}", escaping.iter().map(describe).collect::<Vec<_>>().join("\n"));
    Ok(())
}

fn boxes_without_padding_are_seen() {
    let (mut tight, mut padded) = (0, 0);
    for closed in &closed() {
        padded += escapes(closed, |triangles, ray| triangles.any_hit(ray));
        tight += escapes(closed, |triangles, ray| triangles.any_hit_in_tight_boxes(ray));
    }
    println!("escapes: {tight} from boxes without padding, {padded} with");
    assert!(padded == 0 && tight > 0, "{padded} escapes with padding, {tight} without");
}

fn open_edges_are_seen() {
    let open: u64 =
        closed().iter().map(|closed| escapes(closed, |triangles, ray| triangles.any_hit_with_open_edges(ray))).sum();
    println!("escapes: {open} through open edges");
    assert!(open > 0, "edges that belong to neither side go unnoticed");
}

fn the_lower_id_wins_among_equal_hits() {
    let buffers = buffers(stack(16));
    let view = buffers.view();
    let triangles = Triangles::new(view);
    let mut random = SplitMix::new(3);
    for _ in 0..1000 {
        let mut shift = || random.range(-0.2, 0.2) as f32;
        let ray = Ray { origin: Vec3::new(shift(), shift() - 0.3, -1.0), direction: Vec3::Z, t_max: Ray::FAR, key: 0 };
        let hit = view.closest(&ray);
        let twin = (0..triangles.len()).find(|&id| triangles.get(id) == triangles.get(hit.id as usize));
        assert!(twin == Some(hit.id as usize), "{hit:?}, but {twin:?} is the same triangle");
    }
}

/// The error of a hit point, relative to the scene and to the distance, is a few roundings.
fn hits_lie_on_their_triangles() {
    let closed = Closed::new(sphere(1.0, 24, 12), Vec3::ZERO, 1.0);
    let view = closed.buffers.view();
    let triangles = Triangles::new(view);
    let mut worst = 0.0_f64;
    for i in 0..100_000 {
        let ray = from_inside(&triangles, &closed, &mut SplitMix::new(i));
        let hit = view.closest(&ray);
        let [a, b, c] = triangles.get(hit.id as usize).map(|v| v.as_dvec3());
        let (u, v) = (f64::from(hit.uv.x), f64::from(hit.uv.y));
        let on_triangle = a * (1.0 - u - v) + b * u + c * v;
        let on_ray = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t);
        worst = worst.max((on_triangle - on_ray).length());
    }
    println!("hit points differ by {worst:.1e} at most");
    // 2^-19 of the reach is the padding to which t is limited; the reach is 1.2
    assert!(worst < 1.2 / 524_288.0 * 3.0_f64.sqrt(), "off by {worst}");
}

/// The reduced form of `cargo lab crossings`.
fn probes_equal_brute_force() -> Result<(), Failed> {
    let mut all = Tally::default();
    for (stream, (name, buffers)) in (500..).zip(crossings::scenes()) {
        let tally = crossings::compare(&name, &buffers, SEGMENTS, stream);
        println!("{name}: {tally:?}");
        all = all.plus(tally);
    }
    println!("{all:?}");
    ensure(all.differing == 0, || format!("{} of {} segments differ", all.differing, all.segments))?;
    // what has to be there, or the comparison means nothing
    let share = |count: u64| count as f64 / all.segments as f64;
    let shares = [share(all.hit), share(all.overflowing), share(all.tied)];
    ensure(shares[0] > 0.3 && shares[0] < 0.9 && shares[1] > 0.02 && shares[2] > 0.02, || format!("{shares:?}"))?;
    ensure(all.seen > 0, || "boxes without padding go unnoticed".to_owned())
}

fn groups_of_a_material_are_objects() -> Result<(), Failed> {
    let groups = [Some(7), None, Some(7), Some(8), None];
    let buffers = together(groups.map(|group| (cube(1.0, 1), group)).into());
    let view = buffers.view();
    let triangles = Triangles::new(view);
    let objects: BTreeSet<u32> = (0..triangles.len()).map(|id| triangles.object(id)).collect();
    ensure(objects == BTreeSet::from([0, 1, 3, 4]), || format!("{objects:?}"))?;
    let ray = Ray { origin: Vec3::new(0.3, 0.1, -2.0), direction: Vec3::Z, t_max: 4.0, key: 0 };
    let counts = [0, 1, 3, 4].map(|object| view.probe(&ray, object).count);
    // both sides of each cube
    ensure(counts == [4, 2, 2, 2], || format!("{counts:?}"))?;
    let hit = view.closest(&ray);
    ensure(view.object(&hit) == triangles.object(hit.id as usize), || format!("{hit:?}"))
}
