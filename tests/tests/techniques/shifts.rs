//! Shifts of paths, on whole scenes: what a stored path says of itself, ways there and back, and that what arrives by shifts is
//! what was to be found there. The suite `shift_twin` has the formulas in `f64`.

use libtest_mimic::Failed;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_kernels::restir_pt::{pt_shift, pt_trace};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{DVec3, UVec2, UVec4, Vec2, Vec3};
use restir_shared::num::{FLUSH_BELOW, UNIT_ROUNDOFF};
use restir_shared::resample::mutual::{Record, Shift, ShiftRequest, ShiftResult};
use restir_shared::resample::params::{Flags, ReuseParams};
use restir_shared::scene::{AddressedLights, LightKind, SceneFrames, SceneView, Surface, Trace};
use restir_shared::shift::{Cause, Hybrid, Path, PathOrigin};
use restir_shared::technique::path::{self, PathParams};
use restir_shared::technique::restir_pt::{self, PackedPath, PathNumbers, PtParams, Stored};
use restir_shared::vec::{length, luminance};
use restir_tests::scenes::buffers;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::Trials;
use restir_tests::technique::restir_pt::{Arrivals, Found, Picture, Returns, Wrong, followed};

restir_tests::suite! {
    later {
        candidates_add_up_to_the_path replay_at_the_source_gives_the_same_bits a_stored_path_gives_its_value_again what_arrives_is_traced_once_more
        one_candidate_stands_for_all shifts_are_undone starts_lie_off_edges shifts_to_another_frame_are_undone recalled_paths_are_measured_over_new_areas what_arrives_was_to_be_found wrong_shifts_are_seen what_cannot_be_shifted_is_not records_keep_paths
    }
}

const SIDE: u32 = 24;
const DEPTH: u32 = 7;
const SCENES: [&str; 6] = ["cornell", "glossy", "all-lights", "glass", "ajar", "tower"];
const CRITERIA: [(&str, Hybrid); 5] = [
    ("reconnection", Hybrid::RECONNECTION),
    ("replay", Hybrid::REPLAY),
    ("hybrid", Hybrid::new(0.2, 0.1)),
    ("far", FAR),
    ("footprint", Hybrid::by_footprint(0.02, 0.1)),
];
/// A length that many segments have, more or less.
const FAR: Hybrid = Hybrid::new(0.2, 1.5);
/// How far the pixels of a pair are apart.
const STEP: [u32; 2] = [3, 2];

fn places() -> impl Iterator<Item = [u32; 2]> {
    (0..SIDE * SIDE).map(|i| [i % SIDE, i / SIDE])
}

/// Calls `check` for every scene and criterion.
fn everywhere(check: impl FnMut(&str, &Picture<'_>) -> Result<(), Failed>) -> Result<(), Failed> {
    of_scenes(&SCENES, SIDE, check)
}

/// The same of some scenes, in pictures of `side` by `side` pixels.
fn of_scenes(
    scenes: &[&str],
    side: u32,
    mut check: impl FnMut(&str, &Picture<'_>) -> Result<(), Failed>,
) -> Result<(), Failed> {
    for name in scenes {
        let buffers = buffers(name)?;
        for (criterion, hybrid) in CRITERIA {
            check(&format!("{name}, {criterion}"), &Picture::new(&buffers, side, DEPTH, hybrid))?;
        }
    }
    Ok(())
}

fn candidates_add_up_to_the_path() -> Result<(), Failed> {
    everywhere(|name, picture| {
        for at in places() {
            let [sum, radiance] = picture.sums(at, 0);
            let bits = |v: Vec3| v.to_array().map(f32::to_bits);
            ensure(bits(sum) == bits(radiance), || format!("{name}, {at:?}: {sum} for {radiance}"))?;
        }
        Ok(())
    })
}

/// Of replay alone the integrand has the bits of path tracing, and with it everything up to the last vertex. A direction of the
/// environment, of which an address is stored, is that of a lattice.
fn replay_at_the_source_gives_the_same_bits() -> Result<(), Failed> {
    let mut compared = [0; 2];
    for name in SCENES {
        let buffers = buffers(name)?;
        let picture = Picture::new(&buffers, SIDE, DEPTH, Hybrid::REPLAY);
        let lattice = |path: &Path| {
            path.keeps_light() && picture.scene.light_at(path.light).sample.kind == LightKind::Environment
        };
        for (at, start) in places().filter_map(|at| Some((at, picture.start(at)?))) {
            for found in (0..4).flat_map(|frame| picture.found(at, frame)) {
                let path = found.stored.unpack().path;
                let shifted = picture.shift(&found.stored, &start);
                let same = shifted.value == found.value && shifted.term == path.term;
                ensure(same || lattice(&path), || format!("{name}, {at:?}: {shifted:?} for {}", found.value))?;
                compared[usize::from(path.reconnection == 0)] += u32::from(!lattice(&path));
            }
        }
    }
    println!("{} paths by replay alone, {} with a sampled light", compared[1], compared[0]);
    ensure(compared.iter().all(|&n| n > 2_000), || format!("{compared:?} are too few"))
}

/// The luminance of a path times its contribution weight is that of all candidates; a colour is so in the mean. Without the weight
/// it is not.
fn one_candidate_stands_for_all() -> Result<(), Failed> {
    let mut family = Family::new("initial paths", FAMILY_RATE);
    let mut wrong = 0.0_f64;
    for name in ["cornell", "all-lights", "glass", "tower"] {
        let buffers = buffers(name)?;
        let picture = Picture::new(&buffers, SIDE, DEPTH, CRITERIA[2].1);
        let (mut red, mut unweighted) = (Moments::default(), Moments::default());
        for (at, frame) in places().flat_map(|at| (0..64).map(move |frame| (at, frame))) {
            let params = PtParams { reuse: ReuseParams { frame, ..picture.params.reuse }, ..picture.params };
            let traced = restir_pt::trace(&picture.scene, &params, at);
            let Stored { value, contribution_weight, path, .. } = traced.path.unpack();
            let mut radiance = Vec3::ZERO;
            path::trace(&picture.scene, &as_path(&params), at, frame, &mut radiance);
            let direct = Vec3::from_array(traced.direct.sum);
            let all = direct + value * contribution_weight;
            let error = (luminance(all) - luminance(radiance)).abs();
            ensure(error <= 1.0e-5 * luminance(radiance), || format!("{name}, {at:?}: {all} for {radiance}"))?;
            let key = UVec2::new(at[0] | at[1] << 16, frame);
            let sound = if contribution_weight == 0.0 { path.length == 0 } else { path.key == key };
            ensure(sound, || format!("{name}, {at:?}: {path:?}"))?;
            red.push(f64::from(all.x - radiance.x));
            unweighted.push(f64::from(direct.x + value.x - radiance.x));
        }
        let zero = Moments::exact(0.0);
        family.z_test(name, ZTest::new(red, zero));
        wrong = wrong.max(ZTest::new(unweighted, zero).z.abs());
    }
    println!("{}", family.verdict()?);
    ensure(wrong > 10.0, || format!("without weights, {wrong} standard errors"))
}

/// The same picture by path tracing.
fn as_path(params: &PtParams) -> PathParams {
    let PtParams { reuse: ReuseParams { scene, camera, width, height, seed, .. }, max_depth, .. } = *params;
    PathParams { scene, camera, width, height, seed, max_depth, ..PathParams::default() }
}

/// The largest of the numbers, and the one that all but a hundredth are below.
fn quantiles(mut numbers: Vec<f32>) -> [f32; 2] {
    numbers.sort_by(f32::total_cmp);
    let at = |share: f64| numbers[(share * (numbers.len() - 1) as f64) as usize];
    [at(1.0), at(0.99)]
}

/// The largest error of an integrand by what is lost in storing a path: a direction and coordinates of 24 bits, of near points and of
/// smooth lobes. All but a hundredth are below the other one. Directions of an environment are those of a lattice.
const VALUE: [f32; 2] = [5.0e-3, 1.0e-5];
const VALUE_OF_ENVIRONMENT: [f32; 2] = [5.0e-3, 1.0e-4];
/// The same of the term of the density, which consists of densities and distances, where only rough lobes are joined.
const TERM: [f32; 2] = [5.0e-3, 3.0e-5];
/// The same where plain reconnection joins lobes of a roughness of 0.05, whose densities turn with the stored direction.
const TERM_OF_SMOOTH: [f32; 2] = [1.0e-2, 2.0e-3];

/// Where a path is shifted to its own pixel, it is what path tracing found.
fn a_stored_path_gives_its_value_again() -> Result<(), Failed> {
    everywhere(|name, picture| {
        let (mut values, mut terms, mut failed) = (Vec::new(), Vec::new(), 0);
        for (at, start) in places().filter_map(|at| Some((at, picture.start(at)?))) {
            for found in (0..16).flat_map(|frame| picture.found(at, frame)) {
                let path = found.stored.unpack().path;
                if path.last_replayed() - 1 > picture.params.hybrid.replays {
                    continue;
                }
                let shifted = picture.shift(&found.stored, &start);
                failed += u32::from(shifted.term == 0.0);
                values.push((shifted.value - found.value).abs().max_element() / found.value.max_element());
                terms.push((shifted.term / path.term - 1.0).abs());
            }
        }
        let count = values.len();
        let (values, terms) = (quantiles(values), quantiles(terms));
        let [[value, most_values], [term, most_terms]] = [values, terms];
        println!("{name}: {count} paths, errors {value:.1e} {most_values:.1e}, of terms {term:.1e} {most_terms:.1e}");
        let of_values = if name.starts_with("tower") { VALUE_OF_ENVIRONMENT } else { VALUE };
        let smooth = picture.params.hybrid == Hybrid::RECONNECTION;
        let within = |[worst, most]: [f32; 2], bounds: [f32; 2]| worst <= bounds[0] && most <= bounds[1];
        ensure(failed == 0 && count > 500, || format!("{name}: {failed} of {count} fail"))?;
        ensure(within(values, of_values), || format!("{name}: values are off by {values:?}"))?;
        ensure(within(terms, if smooth { TERM_OF_SMOOTH } else { TERM }), || {
            format!("{name}: terms are off by {terms:?}")
        })
    })
}

/// Of what arrives at vertex k, the share of paths that may be something else once the direction and the place are stored: where an edge lies
/// within a rounding.
const AT_AN_EDGE: f64 = 2.0e-4;

/// What arrives at vertex k is what was found there: to the bit from where and whither the path was traced, and from what is stored of that but
/// for roundings. In another frame's scene it is what path tracing finds there, to the bit, and mostly something else.
fn what_arrives_is_traced_once_more() -> Result<(), Failed> {
    let mut failed = Vec::new();
    for (name, moves) in SCENES.map(|name| (name, false)).into_iter().chain([("moving", true), ("moving-fast", true)]) {
        let scene = buffers(name)?;
        let [here, there] = if moves { [scene.at(3.0)?, scene.at(4.0)?] } else { [scene.clone(), scene] };
        for hybrid in [Hybrid::RECONNECTION, Hybrid::by_footprint(0.02, 0.1)] {
            let picture = Picture::new(&here, SIDE, DEPTH, hybrid);
            let mut again = Again::default();
            for found in places().flat_map(|at| (0..8).flat_map(|frame| picture.found(at, frame)).collect::<Vec<_>>()) {
                if found.path.keeps_arrival() {
                    again.add(&picture, &there.view(), &found);
                }
            }
            let Again { count, others, lost, wrong, changed, errors } = again;
            let [worst, most] = quantiles(errors);
            let others_are =
                format!("{others} are others, {lost} lost as stored, others off by {worst:.1e} {most:.1e}");
            println!(
                "{name}: of {count} {others_are}; in the other frame {wrong} are wrong, {changed} are not what they were"
            );
            let same = count > 100 && others == 0 && f64::from(lost) <= 1.0 + AT_AN_EDGE * f64::from(count);
            let right = wrong == 0 && if moves { 20 * changed > count } else { changed == lost };
            failed.extend((!(same && right && most <= 10.0 * VALUE[1])).then(|| format!("{name}, {hybrid:?}")));
        }
    }
    ensure(failed.is_empty(), || failed.join("; "))
}

/// What was traced once more.
#[derive(Debug, Default)]
struct Again {
    count: u32,
    /// Which is not to the bit what was found.
    others: u32,
    /// As it is stored: which is off by more than [`LOST`].
    lost: u32,
    /// The errors of all others, as they are stored.
    errors: Vec<f32>,
    /// In the other frame's scene: which is not what path tracing finds there.
    wrong: u32,
    /// Which is off by more than [`LOST`] from what it was.
    changed: u32,
}

/// A relative error that is none of roundings.
const LOST: f32 = 0.01;

impl Again {
    fn add(&mut self, picture: &Picture<'_>, there: &SceneView<'_>, found: &Found) {
        let (path, stored) = (found.path, found.stored.unpack().path);
        let numbers = PathNumbers::of_key(path.key, picture.params.seed, picture.params.flags.sampler());
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        let off = |arrives: Vec3| (arrives - path.radiance).abs().max_element() / path.radiance.max_element();
        let exact = restir_pt::arriving(&picture.scene, &numbers, &path);
        let rounded = off(restir_pt::arriving(&picture.scene, &numbers, &stored));
        let other = restir_pt::arriving(there, &numbers, &stored);
        self.count += 1;
        self.others += u32::from(bits(exact) != bits(path.radiance));
        self.lost += u32::from(rounded > LOST);
        self.errors.extend((rounded <= LOST).then_some(rounded));
        self.wrong += u32::from(bits(other) != bits(followed(there, &numbers, &stored)));
        self.changed += u32::from(off(other) > LOST);
    }
}

/// A path's density at vertex k is per area, and the area around it may be another one in the next frame: a recalled path is measured over that, by the
/// triangles' corners in double precision.
fn recalled_paths_are_measured_over_new_areas() -> Result<(), Failed> {
    let scene = buffers("toys")?;
    let [last, now] = [scene.at(8.0)?, scene.at(30.0)?];
    let (own, other) = (now.view(), last.view());
    let geometry = [own.geometry, other.geometry].concat();
    let attributes = [own.attributes, other.attributes].concat();
    let frames = SceneFrames {
        this: SceneView { geometry: &geometry, attributes: &attributes, ..own },
        other: other.header.moved(own.geometry.len() as u32, own.attributes.len() as u32),
        other_tracer: None,
    };
    let area = |view: &SceneView<'_>, triangle: u32| {
        let at = view.header.triangle_word(triangle);
        let [a, b, c] = [0, 1, 2].map(|corner| {
            let word = view.geometry[at + corner];
            DVec3::from([word.x, word.y, word.z].map(|x| f64::from(f32::from_bits(x))))
        });
        (b - a).cross(c - a).length()
    };
    let picture = Picture::new(&last, SIDE, DEPTH, Hybrid::RECONNECTION);
    let params = picture.params.with_flags(Flags::TAKES_ALL);
    let (mut deformed, mut worst) = (0, 0.0_f64);
    for found in places().flat_map(|at| (0..4).flat_map(|frame| picture.found(at, frame)).collect::<Vec<_>>()) {
        let recalled = restir_pt::recall(&frames, &params, found.stored);
        if !(found.path.keeps_surface() && recalled.partial_jacobian() > 0.0) {
            continue;
        }
        let triangle = found.path.hit.id;
        let grown = area(&own, triangle) / area(&other, triangle);
        let measured = f64::from(found.stored.partial_jacobian()) / f64::from(recalled.partial_jacobian());
        worst = worst.max((measured / grown - 1.0).abs());
        deformed += u32::from((grown - 1.0).abs() > 0.01);
    }
    println!("{deformed} of the paths lie on triangles that have grown or shrunk by a hundredth; off by {worst:.1e}");
    ensure(deformed > 100, || format!("{deformed} are too few"))?;
    ensure(worst < 1.0e-5, || format!("a path is off by {worst:e}"))
}

/// Of shifts of a scene that give a path, the share that may not be undone, and the share of the light that goes with them, which bounds
/// what they change of the mean: by roundings at thresholds and at edges of shadows.
const ONE_SIDED: f64 = 1.0e-4;
/// Of paths that come back, the share that may be off by more than [`INTEGRAND`](restir_tests::technique::restir_pt::INTEGRAND): the same
/// hundredth as of those that have not been elsewhere, of which [`VALUE`] bounds the error.
const OFF: f64 = 0.01;

/// The rooms in which rays through the middles of pixels meet edges of walls exactly, in pictures of [`MEETS_EDGES`] pixels a side.
const SYMMETRICAL: [&str; 2] = ["moving", "cornell-mitsuba"];
const MEETS_EDGES: u32 = 32;

/// What comes back is the path that path tracing found, by its words and by its integrand; from the middles of pixels as well.
fn shifts_are_undone() -> Result<(), Failed> {
    for at_middles in [false, true] {
        let (mut shifted, mut failed) = (0, Vec::new());
        let (scenes, side) = if at_middles { (&SYMMETRICAL[..], MEETS_EDGES) } else { (&SCENES[..], SIDE) };
        of_scenes(scenes, side, |name, picture| {
            let aside = picture.with(picture.params.hybrid);
            let picture = if at_middles { aside.through_middles() } else { aside };
            let returns = Returns::of(&picture, &picture.pairs(STEP), 16, Wrong::Not);
            let [one_sided, lost, off] = [returns.one_sided_share(), returns.lost_share(), returns.off_share()];
            let Returns { changed, worst, .. } = returns;
            println!(
                "{name}, middles: {at_middles}: {one_sided:.1e} are not undone, {lost:.1e} of the light; {off:.4} are off, by {worst:.1e}"
            );
            shifted += returns.shifted();
            let lattice = name.starts_with("tower");
            let right = changed == 0 && worst <= f64::from(VALUE[0]) && (lattice || off <= OFF);
            let undone = one_sided <= ONE_SIDED && lost <= ONE_SIDED;
            failed.extend((!right || !undone).then(|| format!("{name}, middles: {at_middles}, {changed} are others")));
            Ok(())
        })?;
        ensure(shifted > 100_000, || format!("{shifted} shifts are too few"))?;
        ensure(failed.is_empty(), || failed.join("; "))?;
    }
    let buffers = buffers("cornell")?;
    let picture = Picture::new(&buffers, SIDE, DEPTH, FAR);
    let wrong = Returns::of(&picture, &picture.pairs(STEP), 16, Wrong::ForwardOnly);
    let share = wrong.one_sided_share();
    ensure(share > 100.0 * ONE_SIDED, || format!("joined by what is asked of one path alone, {share} are not undone"))
}

/// A start on an edge is moved off it on its own triangle, by no more than twice the offset of rays; any other keeps its bits.
fn starts_lie_off_edges() -> Result<(), Failed> {
    let off_edge = |corners: [Vec3; 3], p: Vec3| {
        let edge = |i: usize| (corners[i], corners[(i + 1) % 3] - corners[i]);
        let distances = (0..3).map(edge).map(|(from, along)| length(along.cross(p - from)) / length(along));
        distances.fold(f32::INFINITY, f32::min)
    };
    for name in SYMMETRICAL {
        let buffers = buffers(name)?;
        let picture = Picture::new(&buffers, MEETS_EDGES, DEPTH, Hybrid::RECONNECTION).through_middles();
        let scene = &picture.scene;
        let mut moved = 0;
        for start in (0..MEETS_EDGES * MEETS_EDGES).filter_map(|i| picture.start([i % MEETS_EDGES, i / MEETS_EDGES])) {
            let met = scene.closest(&Ray { origin: picture.params.camera.position.into(), ..start.ray() });
            let hit = start.hit.unpack();
            let [from, to] = [met, hit].map(|hit| scene.location(&hit));
            let corner = |uv| scene.location(&Hit { uv, ..hit }).position;
            let corners = [Vec2::ZERO, Vec2::X, Vec2::Y].map(corner);
            let same = hit.uv == met.uv;
            moved += u32::from(!same);
            let least = if same { 1.0 / 32.0 } else { 0.25 } * to.offset;
            let near = length(to.position - from.position) <= 4.0 * to.offset;
            let off = off_edge(corners, to.position);
            ensure(hit.id == met.id && near && off >= least, || format!("{name}: {met:?} becomes {hit:?}, {off} off"))?;
        }
        println!("{name}: {moved} of {} starts are on edges", MEETS_EDGES * MEETS_EDGES);
        ensure((4..100).contains(&moved), || format!("{name}: {moved} starts are moved"))?;
    }
    Ok(())
}

/// Paths that were found in a frame, in the next one and back, in a room where things move by a lot and lights go out: what comes back is what
/// was found, and has the density that it had. Where the way back is one in this frame's scene, it is not.
fn shifts_to_another_frame_are_undone() -> Result<(), Failed> {
    let mut rows = ["moving", "moving-fast"].into_iter().flat_map(|scene| [(scene, "drop"), (scene, "retrace")]);
    rows.try_for_each(|(scene, changed)| shifts_to_the_next_frame_are_undone(scene, changed))
}

fn shifts_to_the_next_frame_are_undone(scene: &str, changed: &str) -> Result<(), Failed> {
    let buffers = buffers(scene)?;
    let technique = Trials::of("restir-pt")?.with(&format!("spatial=0,max_depth=6,jitter=on,changed={changed}"))?;
    let render = Render { count: 12, seed: 4, ..Render::new([2 * SIDE; 2], technique) };
    let (mut right, mut wrong) = (Across::default(), Across::default());
    // paths as they were found, before anything else has been made of them
    let (mut found, mut last): (Vec<PackedPath>, Vec<PackedPath>) = (Vec::new(), Vec::new());
    let mut starts: Vec<PathOrigin> = Vec::new();
    CpuExecutor::inline().run_observed(render.plan(&buffers), &mut |step| {
        let kernel = step.pass.kernel.name;
        if kernel == pt_trace::DESC.name {
            (last, found) = (std::mem::take(&mut found), step.plane("reservoirs")?);
            starts = step.plane("origins")?;
        }
        let is_back = |params: &PtParams| params.flags.contains(Flags::BACK) && kernel == pt_shift::DESC.name;
        let Some(params) = step.pass.params::<PtParams>().filter(is_back) else { return Ok(()) };
        let arenas = ["geometry", "attributes", "texels"].map(|role| step.plane::<UVec4>(role));
        let [geometry, attributes, texels] = arenas;
        let (geometry, attributes, texels) = (geometry?, attributes?, texels?);
        let features = buffers.features;
        let this = SceneView {
            header: params.scene,
            geometry: &geometry,
            attributes: &attributes,
            texels: &texels,
            features,
            tracer: None,
        };
        let frames = SceneFrames { this, other: params.other_scene, other_tracer: None };
        let jobs: Vec<ShiftRequest> = step.plane("requests")?;
        let of_last: Vec<PathOrigin> = step.plane("origins")?;
        let starts = [&starts[..], &of_last];
        right.add(&frames, &params, (&frames, &params), starts, (&jobs, &last));
        // the way back in this frame's scene, as if it were the last one's
        let same = SceneFrames { other: params.scene, ..frames };
        let unchanged =
            PtParams { reuse: ReuseParams { flags: params.flags.without(Flags::CHANGED), ..params.reuse }, ..params };
        wrong.add(&frames, &params, (&same, &unchanged), starts, (&jobs, &last));
        Ok(())
    })?;
    let [left_out, of_light] = right.left_out.map(|[out, all]| out / all);
    let name = format!("{scene}, changed={changed}");
    println!("{name}: {right:?}; with a way back in this frame: {wrong:?}");
    println!("{name}: {left_out:.3} of the paths, {of_light:.3} of their light are not taken to the next frame");
    ensure(right.returned > 1_000, || format!("{right:?} are too few"))?;
    let one_sided = right.one_sided as f64 / f64::from(right.returned + right.one_sided);
    ensure(one_sided <= ONE_SIDED, || format!("{right:?}"))?;
    ensure(f64::from(right.off) <= OFF * f64::from(right.returned), || format!("{right:?} are off"))?;
    ensure(f64::from(wrong.off + wrong.one_sided) > 10.0 * OFF * f64::from(wrong.returned), || {
        format!("{wrong:?} pass")
    })
}

/// What became of paths that were taken to the next frame and back.
#[derive(Debug, Default)]
struct Across {
    returned: u32,
    one_sided: u32,
    /// Whose integrand or term is not that in the frame where they were found.
    off: u32,
    /// Paths that no shift takes to the next frame, and all; the same of their light.
    left_out: [[f64; 2]; 2],
}

impl Across {
    /// Takes the paths of the last frame to the starts of this one as the jobs say, and to those of the last one as `back` has it.
    fn add(
        &mut self,
        frames: &SceneFrames<'_>,
        params: &PtParams,
        back: (&SceneFrames<'_>, &PtParams),
        starts: [&[PathOrigin]; 2],
        (jobs, last): (&[ShiftRequest], &[PackedPath]),
    ) {
        let here =
            PtParams { reuse: ReuseParams { flags: params.flags.without(Flags::BACK), ..params.reuse }, ..*params };
        // what is not taken along is not retraced in a render, and what becomes of it here does not matter
        let mut paths: Vec<PackedPath> = last.iter().map(|path| restir_pt::retrace(frames, &here, *path)).collect();
        for (before, after) in last.iter().zip(&paths).filter(|(before, _)| before.partial_jacobian() > 0.0) {
            let light = f64::from(luminance(before.value()) * before.contribution_weight());
            for (sums, of) in self.left_out.iter_mut().zip([1.0, light]) {
                sums[0] += if after.partial_jacobian() > 0.0 { 0.0 } else { of };
                sums[1] += of;
            }
        }
        for job in
            jobs.iter().filter(|job| **job != ShiftRequest::NONE && last[job.sample as usize].partial_jacobian() > 0.0)
        {
            let [own, origin] = [job.pixel, job.sample].map(|pixel| pixel as usize);
            let there = paths[origin].shifted(frames, &here, &starts[0][own]);
            if there.term == 0.0 {
                continue;
            }
            let recalled = paths[own];
            paths[own] = restir_pt::retrace(back.0, back.1, paths[origin].moved(&ShiftResult::of(&there)));
            let back = paths[own].shifted(back.0, back.1, &starts[1][origin]);
            paths[own] = recalled;
            self.one_sided += u32::from(back.term == 0.0);
            self.returned += u32::from(back.term > 0.0);
            let value = last[origin].value();
            let off = (back.value - value).abs().max_element() / value.max_element();
            let of_term = (back.term / last[origin].partial_jacobian() - 1.0).abs();
            self.off += u32::from(back.term > 0.0 && (off > VALUE[1] || of_term > TERM[1]));
        }
    }
}

/// Frames whose differences are tested.
const FRAMES: u32 = 192;

fn what_arrives_was_to_be_found() -> Result<(), Failed> {
    let mut family = Family::new("arrivals", FAMILY_RATE);
    everywhere(|name, picture| {
        let arrivals = Arrivals::of(picture, &picture.pairs(STEP), FRAMES, Wrong::Not);
        let bias = arrivals.test().detectable_bias(FAMILY_RATE / 30.0) / arrivals.own.mean();
        println!(
            "{name}: {:.1} standard errors; a bias of {bias:.2} is noticed with probability {POWER}",
            arrivals.test().z
        );
        family.z_test(name, arrivals.test());
        Ok(())
    })?;
    family.verdict().map(drop).map_err(Failed::from)
}

fn wrong_shifts_are_seen() -> Result<(), Failed> {
    let buffers = buffers("cornell")?;
    for (wrong, hybrid) in [
        (Wrong::NoJacobian, Hybrid::RECONNECTION),
        (Wrong::Inverted, Hybrid::RECONNECTION),
        (Wrong::ForwardOnly, FAR),
        (Wrong::ForwardOnly, Hybrid::by_footprint(0.1, 0.1)),
    ] {
        let picture = Picture::new(&buffers, SIDE, DEPTH, hybrid);
        let arrivals = Arrivals::of(&picture, &picture.pairs(STEP), FRAMES, wrong);
        let test = arrivals.test();
        println!("{wrong:?}: {:.1} standard errors, a bias of {:.3}", test.z, test.difference / arrivals.own.mean());
        ensure(test.p < FAMILY_RATE / 30.0, || format!("{wrong:?} passes with {:.1} standard errors", test.z))?;
    }
    Ok(())
}

/// A pixel that sees nothing, no path, a path without a term, and one that would have to be replayed.
fn what_cannot_be_shifted_is_not() -> Result<(), Failed> {
    let buffers = buffers("cornell")?;
    let picture = Picture::new(&buffers, SIDE, DEPTH, Hybrid::REPLAY);
    let start = picture.start([12, 12]).ok_or("the middle sees nothing")?;
    let long = |path: &Path| path.last_replayed() > 1;
    let found: Vec<Found> = (0..64).flat_map(|frame| picture.found([12, 12], frame)).collect();
    let found = found.iter().find(|f| long(&f.stored.unpack().path)).ok_or("no path is replayed")?;
    let stored = found.stored;
    let none = PathOrigin { hit: PathOrigin::NONE.hit, ..start };
    ensure(picture.shift(&stored, &start).term == 1.0 || stored.unpack().path.light_sampled, || "it is a path".into())?;
    let short = picture.with(Hybrid { replays: 0, ..Hybrid::REPLAY });
    let with_term = |term| stored.moved(&ShiftResult { value: found.value.to_array(), partial_jacobian: term });
    for (what, shifted) in [
        ("a pixel that sees nothing", picture.shift(&stored, &none)),
        ("no path", picture.shift(&PackedPath::default(), &start)),
        ("a path without a term", picture.shift(&with_term(0.0), &start)),
        ("a path with a term that is no number", picture.shift(&with_term(f32::NAN), &start)),
        ("a path with a negative term", picture.shift(&with_term(-1.0), &start)),
        ("a path that may not be replayed", short.shift(&stored, &start)),
    ] {
        let refused = shifted.term == 0.0 && shifted.value == Vec3::ZERO && shifted.cause == Cause::Unshiftable;
        ensure(refused, || format!("{what}: {shifted:?}"))?;
    }
    Ok(())
}

/// What goes into 64 bytes comes out again: paths that keep a light and paths that keep what arrives of it.
fn records_keep_paths() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    let picture = Picture::new(&buffers, SIDE, DEPTH, FAR);
    let mut kinds = [0; 3];
    for found in places().flat_map(|at| picture.found(at, 3)) {
        let once = found.stored.unpack();
        let again = once.pack().unpack();
        let turned = (once.path.direction - again.path.direction).as_dvec3().length();
        let same = Stored { path: Path { direction: again.path.direction, ..once.path }, ..once } == again;
        ensure(same && turned < 8.0e-7, || format!("{once:?} becomes {again:?}"))?;
        let moved = found.stored.moved(&ShiftResult { value: [1.0; 3], partial_jacobian: 2.0 }).unpack();
        let expected = Stored { path: Path { term: 2.0, ..once.path }, value: Vec3::ONE, ..once };
        ensure(moved == expected, || format!("{once:?} is moved to {moved:?}"))?;
        kinds[if once.path.reconnection == 0 { 0 } else { 1 + usize::from(once.path.keeps_light()) }] += 1;
    }
    ensure(kinds.iter().all(|&n| n > 20), || format!("{kinds:?} are too few"))?;
    // weights are kept within the range of all weights; one below it, or that is no number, is that of no path
    let path = Path { length: 2, reconnection: 2, light_sampled: true, term: 1.0, ..Path::NONE };
    let (last, least, most) = (1.0 - UNIT_ROUNDOFF, FLUSH_BELOW, 1.0 / FLUSH_BELOW);
    for (weight, kept_as) in [
        (f32::NAN, 0.0),
        (f32::NEG_INFINITY, 0.0),
        (-1.0, 0.0),
        (0.0, 0.0),
        (least / 2.0, 0.0),
        (least, least),
        (1.0, 1.0),
        (f32::MAX, most),
        (f32::INFINITY, most),
    ] {
        let hit = Hit { id: 3, uv: Vec2::new(last, UNIT_ROUNDOFF / 4.0), ..Hit::MISS };
        let stored =
            Stored { path: Path { hit, ..path }, value: Vec3::ONE, contribution_weight: weight, confidence: 300.0 };
        let kept = stored.pack().unpack();
        let expected = (kept_as, if kept_as > 0.0 { 2 } else { 0 });
        let found = (kept.contribution_weight, kept.path.length);
        ensure(found == expected && kept.confidence == 255.0, || format!("{weight}: {kept:?}"))?;
        let again = stored.pack().weighted(weight, -1.0).unpack();
        ensure((again.contribution_weight, again.confidence) == (expected.0, 0.0), || format!("{weight}: {again:?}"))?;
        // coordinates at the ends of the lattice
        ensure(kept.path.hit.uv == Vec2::new(last, 0.0) || kept_as == 0.0, || format!("{:?}", kept.path.hit))?;
    }
    Ok(())
}
