//! Shifts of paths, on whole scenes: what a stored path says of itself, ways there and back, and that what arrives by shifts is
//! what was to be found there. The suite `shift_twin` has the formulas in `f64`.

use libtest_mimic::Failed;
use restir_shared::glam::{UVec2, Vec3};
use restir_shared::scene::{AddressedLights, LightKind};
use restir_shared::shift::{Cause, Hybrid, Path, Start};
use restir_shared::technique::path::{self, PathParams};
use restir_shared::technique::restir_pt::{self, PackedPath, PtParams, Stored};
use restir_shared::vec::luminance;
use restir_tests::scenes::buffers;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_pt::{Arrivals, Found, Picture, Returns, Wrong};

restir_tests::suite! {
    candidates_add_up_to_the_path replay_at_the_source_gives_the_same_bits a_stored_path_gives_its_value_again
    one_candidate_stands_for_all shifts_are_undone what_arrives_was_to_be_found wrong_shifts_are_seen what_cannot_be_shifted_is_not records_keep_paths
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
fn everywhere(mut check: impl FnMut(&str, &Picture<'_>) -> Result<(), Failed>) -> Result<(), Failed> {
    for name in SCENES {
        let buffers = buffers(name)?;
        for (criterion, hybrid) in CRITERIA {
            check(&format!("{name}, {criterion}"), &Picture::new(&buffers, SIDE, DEPTH, hybrid))?;
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
            let params = PtParams { frame, ..picture.params };
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
    let PtParams { scene, camera, width, height, seed, max_depth, .. } = *params;
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
        ensure(smooth || within(terms, TERM), || format!("{name}: terms are off by {terms:?}"))
    })
}

/// Of shifts that give a path, the share that may not be undone, by roundings at thresholds and at edges of shadows.
const ONE_SIDED: f64 = 1.0e-4;

/// What comes back is the path, bit for bit.
fn shifts_are_undone() -> Result<(), Failed> {
    let (mut shifted, mut one_sided, mut lost) = (0, 0, 0.0_f64);
    everywhere(|name, picture| {
        let returns = Returns::of(picture, &picture.pairs(STEP), 16, Wrong::Not);
        ensure(returns.changed == 0, || format!("{name}: {} come back as others", returns.changed))?;
        (shifted, one_sided) = (shifted + returns.shifted(), one_sided + returns.one_sided());
        lost = lost.max(returns.lost_share());
        Ok(())
    })?;
    println!("{one_sided} of {shifted} shifts are not undone; at most {lost:.1e} of a scene's light");
    ensure(shifted > 100_000, || format!("{shifted} shifts are too few"))?;
    ensure(one_sided as f64 <= ONE_SIDED * shifted as f64, || format!("{one_sided} of {shifted} are not undone"))?;
    let buffers = buffers("cornell")?;
    let picture = Picture::new(&buffers, SIDE, DEPTH, FAR);
    let wrong = Returns::of(&picture, &picture.pairs(STEP), 16, Wrong::ForwardOnly);
    let share = wrong.one_sided() as f64 / wrong.shifted() as f64;
    ensure(share > 100.0 * ONE_SIDED, || format!("joined by what is asked of one path alone, {share} are not undone"))
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
    for (wrong, hybrid) in
        [(Wrong::NoJacobian, Hybrid::RECONNECTION), (Wrong::Inverted, Hybrid::RECONNECTION), (Wrong::ForwardOnly, FAR)]
    {
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
    let none = Start { hit: Start::NONE.hit, ..start };
    ensure(picture.shift(&stored, &start).term == 1.0 || stored.unpack().path.light_sampled, || "it is a path".into())?;
    let short = picture.with(Hybrid { replays: 0, ..Hybrid::REPLAY });
    for (what, shifted) in [
        ("a pixel that sees nothing", picture.shift(&stored, &none)),
        ("no path", picture.shift(&PackedPath::default(), &start)),
        ("a path without a term", picture.shift(&stored.moved(found.value, 0.0), &start)),
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
        let moved = found.stored.moved(Vec3::ONE, 2.0).unpack();
        let expected = Stored { path: Path { term: 2.0, ..once.path }, value: Vec3::ONE, ..once };
        ensure(moved == expected, || format!("{once:?} is moved to {moved:?}"))?;
        kinds[if once.path.reconnection == 0 { 0 } else { 1 + usize::from(once.path.keeps_light()) }] += 1;
    }
    ensure(kinds.iter().all(|&n| n > 20), || format!("{kinds:?} are too few"))?;
    let broken = Stored { path: Path::NONE, value: Vec3::ONE, contribution_weight: f32::NAN, confidence: 300.0 };
    let kept = broken.pack().unpack();
    ensure(kept.contribution_weight == 0.0 && kept.confidence == 255.0 && kept.path.length == 0, || format!("{kept:?}"))
}
