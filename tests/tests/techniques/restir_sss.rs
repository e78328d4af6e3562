//! ReSTIR SSS: shifts of points and lights are undone and have the densities that they say, reuse keeps the mean of path tracing, and known-wrong forms of
//! it do not.

use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::plan::Pass;
use restir_host::render::{Render, Rendered};
use restir_host::scene::{Camera, Scene};
use restir_kernels::restir_sss::sss_merge;
use restir_shared::diffusion::{Disk, DiskNumbers, Profile, TAIL};
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::num::FLUSH_BELOW;
use restir_shared::resample::mis::Mis;
use restir_shared::resample::mutual::{Cause, Record};
use restir_shared::scene::Surface;
use restir_shared::technique::restir_sss::{Initial, Kind, PackedSubsurface, SssOrigin, SssParams};
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments};
use restir_tests::bodies;
use restir_tests::native;
use restir_tests::random::SplitMix;
use restir_tests::scenes;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, POWER, TileGrid, TileTest, ZTest, sidak};
use restir_tests::suite::ensure;
use restir_tests::technique::Trials;
use restir_tests::technique::restir_sss::{Arrivals, LABELS, Picture, Returns, Wrong, density_of};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

restir_tests::suite! {
    later {
        shifts_are_undone what_cannot_be_shifted_is_not areas_are_what_densities_say records_say_their_densities
        what_arrives_was_to_be_found wrong_shifts_are_seen one_candidate_stands_for_all records_keep_samples
        images_are_those_of_path_tracing known_wrong_images_are_seen odd_images_are_rendered
        scenes_without_bodies_are_path_traced
    }
}

const SIZE: [u32; 2] = [24, 18];
const FIRST: &str = "max_depth=3";

fn buffers(name: &str) -> Result<SceneBuffers, Failed> {
    let scene = scenes::buffers(name)?;
    Ok(if name == "moving-media" { scene.at(3.0)? } else { scene })
}

/// Settings by the name of what they do with a point.
const SHIFTS: [(&str, &str); 4] = [
    ("reconnection", "shift=reconnection"),
    ("delayed", "shift=delayed"),
    ("hybrid", "shift=hybrid"),
    ("hybrid by lengths", "shift=hybrid,reconnected_beyond=1.0e6"),
];

/// Of samples that arrive, the share that may not return: a rounding of a kept point moves it over the distance from which on points are kept.
const ONE_SIDED: f64 = 2.0e-4;

/// What comes back is what was found. Replay from stored numbers gives the same bits; of kept points coordinates of 24 bits are stored.
fn shifts_are_undone() -> Result<(), Failed> {
    let mut counts = [0; 3];
    let mut failed = Vec::new();
    let rows = [
        ("slab", "", 24),
        ("candles", "", 192),
        ("marble-statue", "", 16),
        ("torus", "", 96),
        ("ball", "lambert_below=3.4", 96),
    ];
    for (scene, settings, frames) in rows {
        let buffers = buffers(scene)?;
        for (shift, text) in SHIFTS {
            let picture = Picture::new(&buffers, SIZE, &[FIRST, text, settings].join(","))?;
            let returns = Returns::of(&picture, &picture.pairs([2, 1]), frames);
            let of_kinds = [Kind::Kept, Kind::Replayed, Kind::AtEntry].map(|kind| returns.shifted(kind));
            let beyond = returns.kept.iter().filter(|error| **error > LOST).count() as f64;
            let worst = returns.kept.iter().fold(0.0, |worst: f64, error| worst.max(*error));
            let Returns { there, one_sided, jacobian, replayed, .. } = &returns;
            println!(
                "{scene}, {shift}: {there:?}, {one_sided} are not undone; products of Jacobians {jacobian:.1e}, values {replayed:.1e}, kept ones {worst:.2} of what storing loses"
            );
            counts.iter_mut().zip(of_kinds).for_each(|(sum, count)| *sum += count);
            let undone = *one_sided as f64 <= ONE_SIDED * of_kinds.iter().sum::<u64>() as f64;
            let right = undone && *jacobian < 1.0e-15 && *replayed == 0.0 && beyond <= 0.02 * returns.kept.len() as f64;
            failed.extend((!right).then(|| format!("{scene}, {shift}")));
        }
    }
    println!("kept, replayed, at entries: {counts:?}");
    ensure(counts.iter().all(|&count| count > 1_000), || format!("{counts:?} are too few"))?;
    ensure(failed.is_empty(), || failed.join("; "))
}

/// How many times what a profile loses by storing its point the integrand may, but for two in a hundred: the cosines of light that grazes have their own
/// share.
const LOST: f64 = 16.0;

/// No sample, a pixel that enters no body, and one of another body.
fn what_cannot_be_shifted_is_not() -> Result<(), Failed> {
    let buffers = buffers("candles")?;
    for shift in ["shift=reconnection", "shift=delayed"] {
        let picture = Picture::new(&buffers, SIZE, shift)?;
        let places = picture.entering().into_iter().flat_map(|at| (0..32).map(move |frame| (at, frame)));
        let found: Vec<_> = places.map(|(at, frame)| picture.initial(at, frame)).collect();
        let first = found.iter().find(|initial| initial.reservoir.contribution_weight() > 0.0).ok_or("no light")?;
        for (what, record, origin) in [
            ("no sample", PackedSubsurface::default(), first.origin),
            ("a weight of zero", first.reservoir.weighted(0.0, 1.0), first.origin),
            ("a pixel that enters nothing", first.reservoir, SssOrigin::NONE),
        ] {
            let shifted = picture.shift(&record, &origin);
            ensure(shifted.term == 0.0 && shifted.cause == Cause::Unshiftable, || format!("{what}: {shifted:?}"))?;
        }
        let body = |origin: &SssOrigin| picture.scene.interior(&origin.hit.unpack()).body;
        let strange = |to: &SssOrigin| to.hit.unpack().is_hit() && body(to) != body(&first.origin);
        let others: Vec<_> = found.iter().filter(|other| strange(&other.origin)).collect();
        let refused = |other: &&&Initial| picture.shift(&first.reservoir, &other.origin).term == 0.0;
        let count = others.iter().filter(refused).count();
        println!("{shift}: {count} entries of other bodies take no sample");
        ensure(count == others.len() && count > 100, || format!("of {} other entries {count} refuse", others.len()))?;
    }
    Ok(())
}

/// The density of a point over areas by an axis and a channel.
fn density(disk: &Disk, numbers: &DiskNumbers, at: DVec3, normal: DVec3) -> f64 {
    density_of(disk, numbers, at, normal) / (8.0 * std::f64::consts::PI * f64::from(1.0 - TAIL))
}

/// Where a segment first meets the unit sphere, in `f64` from its ends on.
fn on_sphere(disk: &Disk, numbers: &DiskNumbers) -> DVec3 {
    let ray = disk.segment(numbers);
    let (from, along) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
    let (b, c) = (from.dot(along), from.length_squared() - 1.0);
    from + along * (-b - (b * b - c).sqrt())
}

/// The area on a sphere by area of radius and turn: one over the density by one axis and channel. So the ratio of areas of a delayed
/// shift is that of these densities, and the mixture's is what records keep.
fn areas_are_what_densities_say() -> Result<(), Failed> {
    // roundings of 6e-8 over steps that move points by some 1e-2; the error of the fourth order is smaller
    const ERROR: f64 = 1.0e-3;
    const STEP: f32 = 1.0 / 256.0;
    let profile = Profile::new(Vec3::new(0.9, 0.7, 0.5), Vec3::new(0.12, 0.09, 0.06));
    let mut random = SplitMix::new(7);
    let (mut worst, mut worst_mixture, mut least, mut count) = (0.0_f64, 0.0_f64, f64::MAX, 0);
    while count < 400 {
        let centre = DVec3::from_array([0; 3].map(|_| 2.0 * random.unit() - 1.0)).normalize().as_vec3();
        let disk = Disk::new(centre, centre, profile);
        let [axis, channel] = [0; 2].map(|_| (3.0 * random.unit()) as u32);
        let numbers = DiskNumbers {
            axis,
            channel,
            radius: (0.2 + 0.6 * random.unit()) as f32,
            turn: (0.1 + 0.8 * random.unit()) as f32,
        };
        let at = |du: f32, dt: f32| {
            on_sphere(
                &disk,
                &DiskNumbers { radius: numbers.radius + du * STEP, turn: numbers.turn + dt * STEP, ..numbers },
            )
        };
        let slope =
            |f: &dyn Fn(f32) -> DVec3| (8.0 * (f(1.0) - f(-1.0)) - (f(2.0) - f(-2.0))) / (12.0 * f64::from(STEP));
        let (by_radius, by_turn, point) = (slope(&|d| at(d, 0.0)), slope(&|d| at(0.0, d)), at(0.0, 0.0));
        let axis_of = [disk.frame.n, disk.frame.s, disk.frame.t][axis as usize].as_dvec3();
        // where a segment grazes the sphere, or misses it, or begins in it, areas are not smooth
        if point.dot(axis_of).abs() < 0.4 || !point.is_finite() || point.dot(centre.as_dvec3()) < 0.5 {
            continue;
        }
        let of_all = (0..9).map(|i| {
            let numbers = DiskNumbers { axis: i / 3, channel: i % 3, ..numbers };
            [0.5, 0.25, 0.25][i as usize / 3] / 3.0 * density(&disk, &numbers, point, point)
        });
        let mixture = of_all.sum::<f64>() / f64::from(disk.density(point.as_vec3(), point.as_vec3())) - 1.0;
        let single = density(&disk, &numbers, point, point);
        worst = worst.max((by_radius.cross(by_turn).length() * single - 1.0).abs());
        worst_mixture = worst_mixture.max(mixture.abs());
        least = least.min(single / f64::from(disk.density(point.as_vec3(), point.as_vec3())));
        count += 1;
    }
    println!(
        "areas times densities are 1 to {worst:.1e}, mixtures are sums to {worst_mixture:.1e}; by one technique down to {least:.2} of the mixture"
    );
    ensure(worst < ERROR, || format!("areas are off by {worst}"))?;
    // positions are rounded to 6e-8, near points are 1e-2 away
    ensure(worst_mixture < 1.0e-4, || format!("mixtures are off by {worst_mixture}"))?;
    ensure(least < 0.7, || "one technique is like the mixture".to_owned())
}

/// Replayed samples say where they are found, and where they are shifted to, one over the density of all axes and channels over the address, times
/// the probability of their channel; all others say 1.
fn records_say_their_densities() -> Result<(), Failed> {
    // some twenty roundings
    const ERROR: f64 = 20.0 / 16_777_216.0;
    let mut count = [0; 2];
    let mut worst = 0.0_f64;
    for (scene, settings) in [("ball", "lambert_below=3.4"), ("ball", "radius_channel=albedo"), ("marble-statue", "")] {
        let buffers = buffers(scene)?;
        let picture = Picture::new(&buffers, SIZE, &format!("shift=hybrid,reconnected_beyond=1.0e6,{settings}"))?;
        for ([x, y], frame) in
            picture.pairs([2, 1]).into_iter().flat_map(|pair| (0..64).map(move |frame| (pair, frame)))
        {
            let (home, away) = (picture.initial(x, frame), picture.initial(y, frame));
            let Some(stored) = Some(home.reservoir.unpack()).filter(|stored| stored.contribution_weight > 0.0) else {
                continue;
            };
            let shifted = picture.shift(&home.reservoir, &away.origin);
            let terms = [(home.origin, stored.sample.partial_jacobian), (away.origin, shifted.term)];
            for (end, (origin, term)) in terms.into_iter().enumerate().filter(|(_, (_, term))| *term > 0.0) {
                if stored.sample.kind != Kind::Replayed {
                    ensure(term == 1.0, || format!("{scene}: {:?} says {term}", stored.sample.kind))?;
                    continue;
                }
                let (disk, at) =
                    (picture.disk(&origin).0, picture.scene.location(&picture.hit(&stored.sample, &origin)));
                let probability = disk.profile.probability[stored.sample.numbers.channel as usize];
                let density = f64::from(disk.density(at.position, at.normal)) * f64::from(at.extent);
                worst = worst.max((f64::from(term) * density / f64::from(probability) - 1.0).abs());
                count[end] += 1;
            }
        }
    }
    println!("{count:?} densities, off by {worst:.1e}");
    ensure(count.iter().all(|&count| count > 300), || format!("{count:?} are too few"))?;
    ensure(worst <= ERROR, || format!("off by {worst}"))
}

/// Scenes and settings in which samples arrive, with the frames of each pair.
const ARRIVALS: [(&str, &str, u32); 13] = [
    ("slab", "shift=delayed", 192),
    ("slab", "shift=hybrid", 192),
    ("ball", "shift=reconnection", 1024),
    ("ball", "shift=delayed", 1024),
    ("ball", "shift=hybrid", 1024),
    ("ball", "shift=hybrid,reconnected_beyond=1.0e6,crossings=one,segments=2", 512),
    ("ball", "shift=delayed,lambert_below=3.4", 1024),
    ("ball", "shift=delayed,traced=single,profile=clamped", 768),
    ("candles", "shift=hybrid", 512),
    ("marble-statue", "shift=hybrid,reconnected_beyond=1.0e6", 192),
    ("block", "shift=delayed", 1024),
    ("torus", "shift=hybrid,reconnected_beyond=1.0e6", 512),
    ("touching", "shift=delayed", 512),
];

/// A pair is tested by kind if so many of its frames have something to say: fewer are far from a normal distribution.
const FRAMES_THAT_SAY: f64 = 0.2;

/// For each kind of samples a test of all pairs, of those of each sixth of the picture, and of each pair.
fn arrival_tests(arrivals: &Arrivals) -> Vec<(String, ZTest)> {
    let zero = Moments::exact(0.0);
    let count = arrivals.pairs.len();
    let sixth = |pair: usize| arrivals.at[pair][0] / (SIZE[0] / 2) + arrivals.at[pair][1] / (SIZE[1] / 3) * 2;
    let mut tests = Vec::new();
    for kind in LABELS.into_iter().filter(|kind| arrivals.count.get(kind).is_some_and(|&count| count > 500)) {
        let of_pair = |pair: usize| arrivals.pairs[pair].get(kind).copied().unwrap_or_default();
        let of = |pairs: &dyn Fn(usize) -> bool| {
            (0..count).filter(|pair| pairs(*pair)).map(of_pair).fold(Moments::default(), Moments::merge)
        };
        tests.push((kind.to_owned(), ZTest::new(of(&|_| true), zero)));
        let sums =
            (0..6).map(|part| (part, of(&|pair| sixth(pair) == part))).filter(|(_, sum)| sum.variance_of_mean() > 0.0);
        tests.extend(sums.map(|(part, sum)| (format!("{kind}, part {part}"), ZTest::new(sum, zero))));
        let says = |pair: &usize| arrivals.said[*pair].get(kind).is_some_and(|said| *said > FRAMES_THAT_SAY);
        tests.extend(
            (0..count).filter(says).map(|pair| (format!("{kind}, pair {pair}"), ZTest::new(of_pair(pair), zero))),
        );
    }
    tests.retain(|(_, test)| test.standard_error.is_finite());
    tests
}

fn arrivals(scene: &str, settings: &str, frames: u32, wrong: Wrong) -> Result<Arrivals, Failed> {
    let buffers = buffers(scene)?;
    let picture = Picture::new(&buffers, SIZE, &[FIRST, settings].join(","))?;
    Ok(Arrivals::of(&picture, &picture.pairs([2, 1]), frames, wrong))
}

fn what_arrives_was_to_be_found() -> Result<(), Failed> {
    let mut family = Family::new("arrivals", FAMILY_RATE);
    for (scene, settings, frames) in ARRIVALS {
        let arrivals = arrivals(scene, settings, frames, Wrong::Not)?;
        let tests = arrival_tests(&arrivals);
        ensure(!tests.is_empty(), || format!("{scene}, {settings}: nothing arrives"))?;
        for (name, test) in tests {
            if let Some(own) = arrivals.own.get(name.as_str()) {
                let bias = test.detectable_bias(FAMILY_RATE / 1000.0) * arrivals.pairs.len() as f64 / own;
                println!(
                    "{scene}, {settings}, {name}: {:.1} standard errors, a bias of {bias:.3} is noticed with probability {POWER}",
                    test.z
                );
            }
            family.z_test(format!("{scene}, {settings}, {name}"), test);
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Wrong Jacobians, each in a picture where it matters: on a plane, under a sky, all of them are 1. That of a single technique is seen by the toy of
/// `restir_shared::sampling::mixture`.
fn wrong_shifts_are_seen() -> Result<(), Failed> {
    let mut unseen = Vec::new();
    for (wrong, scene, settings, frames) in [
        (Wrong::SolidAngle, "ball", "shift=delayed", 4096),
        (Wrong::SameProbability, "ball", "shift=delayed,lambert_below=3.4", 1536),
    ] {
        let tests = arrival_tests(&arrivals(scene, settings, frames, wrong)?);
        let share = sidak(FAMILY_RATE, tests.len());
        let (name, worst) = tests.iter().min_by(|a, b| a.1.p.total_cmp(&b.1.p)).ok_or("no test")?;
        println!("{wrong:?}, {scene}: {:.1} standard errors of {name}, alarm below p {share:.1e}", worst.z);
        unseen.extend((worst.p >= share).then(|| format!("{wrong:?} in {scene}")));
    }
    ensure(unseen.is_empty(), || format!("not seen: {}", unseen.join(", ")))
}

/// One candidate, by its contribution weight, stands for the light of all that path tracing finds by the same numbers, channel by channel. The same
/// without the weight does not.
fn one_candidate_stands_for_all() -> Result<(), Failed> {
    let mut family = Family::new("initial samples", FAMILY_RATE);
    let mut wrong = 0.0_f64;
    for (scene, settings, frames) in [
        ("slab", "", 48),
        ("candles", "", 256),
        ("ball", "segments=3", 96),
        ("ball", "crossings=one,lambert_below=3.4", 192),
        ("ball", "traced=single,profile=searchlight,radius_channel=albedo", 96),
        ("moving-media", "max_depth=5", 96),
    ] {
        let buffers = buffers(scene)?;
        let picture = Picture::new(&buffers, SIZE, settings)?;
        let of_pixel = |at: &[u32; 2]| {
            let mut sums = [Moments::default(); 7];
            for frame in 0..frames {
                let (all, reservoir) = (picture.gathered(*at, frame), picture.initial(*at, frame).reservoir);
                let (value, weight) = (reservoir.value(), reservoir.contribution_weight());
                let one = value * weight;
                let numbers = [
                    one.x - all.x,
                    one.y - all.y,
                    one.z - all.z,
                    if weight > 0.0 { value.y } else { 0.0 } - all.y,
                    all.x,
                    all.y,
                    all.z,
                ];
                sums.iter_mut().zip(numbers).for_each(|(sum, number)| sum.push(f64::from(number)));
            }
            sums
        };
        let all: Vec<[Moments; 7]> = picture.entering().par_iter().map(of_pixel).collect();
        let sum = |i: usize| all.iter().fold(Moments::default(), |sum, pixel| sum.merge(pixel[i]));
        let zero = Moments::exact(0.0);
        for (i, channel) in ["red", "green", "blue"].into_iter().enumerate() {
            let (test, of_all) = (ZTest::new(sum(i), zero), sum(4 + i).mean());
            let bias = test.detectable_bias(FAMILY_RATE / 18.0) / of_all;
            println!(
                "{scene}, {settings}, {channel}: {:.1} standard errors, {:+.4} of the light; a bias of {bias:.4} is noticed",
                test.z,
                test.difference / of_all
            );
            family.z_test(format!("{scene}, {settings}, {channel}"), test);
        }
        wrong = wrong.max(ZTest::new(sum(3), zero).z.abs());
    }
    println!("{}; without weights {wrong:.0} standard errors", family.verdict()?);
    ensure(wrong > 10.0, || format!("without weights, {wrong} standard errors"))
}

/// All words that records have come out again, and a weight that is none is kept as that of no sample.
fn records_keep_samples() -> Result<(), Failed> {
    let mut random = SplitMix::new(3);
    let mut word = || (random.unit() * 4_294_967_296.0) as u32;
    for _ in 0..100_000 {
        let mut words = [0; 12].map(|_: u32| word());
        // a contribution weight in range, and one of three kinds
        words[0] = (1.0 + (words[0] >> 8) as f32).to_bits();
        words[11] = (words[11] & 0xff_ffff) | ((words[11] >> 24) % 3) << 24;
        let record = PackedSubsurface { words };
        // of coordinates the nearest multiple of 2^-24 is stored, in whose sum with a half the last bit may be rounded up
        let again = record.unpack().pack();
        let near = |i: usize| {
            again.words[i] & 0xff_ffff == words[i] & 0xff_ffff || (words[i] & 1 == 1 && again.words[i] == words[i] + 1)
        };
        let same = (0..12).all(|i| again.words[i] == words[i] || (matches!(i, 6 | 7) && near(i)));
        ensure(same, || format!("{record:?} becomes {again:?}"))?;
        let (weight, confidence) = (2.0, (words[1] % 256) as f32);
        let weighted = record.weighted(weight, confidence);
        let mut expected = record;
        expected.words[0] = f32::to_bits(weight);
        expected.words[6] = (words[6] & 0xff_ffff) | (words[1] % 256) << 24;
        ensure(weighted == expected, || format!("{record:?} weighted is {weighted:?}"))?;
    }
    for (weight, kept_as) in [
        (f32::NAN, 0.0),
        (-1.0, 0.0),
        (0.0, 0.0),
        (FLUSH_BELOW / 2.0, 0.0),
        (1.0, 1.0),
        (f32::INFINITY, 1.0 / FLUSH_BELOW),
    ] {
        let kept = PackedSubsurface::default().weighted(weight, 300.0);
        let found = (kept.contribution_weight(), kept.confidence());
        ensure(found == (kept_as, 255.0), || format!("{weight} is kept as {found:?}"))?;
    }
    Ok(())
}

/// A chain of frames, whose last one is looked at.
struct Chain {
    scene: &'static str,
    settings: &'static str,
    /// The path tracing that it is compared with.
    path: &'static str,
    /// The camera moves.
    moves: bool,
    restarts: u32,
}

const fn chain(scene: &'static str, settings: &'static str, moves: bool, restarts: u32) -> Chain {
    Chain { scene, settings, path: "subsurface=diffusion", moves, restarts }
}

const FRAMES: u32 = 6;
const GRID: TileGrid = TileGrid { width: 24, height: 18, tile: 6 };
/// Samples of a picture by path tracing, and pictures.
const REFERENCE: [u32; 2] = [32, 48];

/// The last pictures of renders with other seeds.
fn pictures(
    restarts: u32,
    render: impl Fn(u32) -> Result<Rendered, restir_host::Error> + Sync,
) -> Result<Vec<Moments>, Failed> {
    let picture = |seed| {
        let Rendered { image, dropped_samples, .. } = render(seed)?;
        ensure(dropped_samples == 0, || "samples were dropped".to_owned())?;
        Ok::<_, Failed>(image.pixels.iter().map(|pixel| pixel.map(f64::from)).collect())
    };
    let all: Vec<Vec<[f64; 3]>> = (0..restarts).into_par_iter().map(picture).collect::<Result<_, _>>()?;
    Ok(GRID.moments_of(&all))
}

impl Chain {
    fn cameras(&self, buffers: &SceneBuffers) -> Vec<Camera> {
        let camera = |frame| Camera {
            position: buffers.camera.position + DVec3::X * (0.03 * f64::from(frame)),
            ..buffers.camera
        };
        if self.moves { (0..FRAMES).map(camera).collect() } else { Vec::new() }
    }

    fn moments(&self, buffers: &SceneBuffers) -> Result<Vec<Moments>, Failed> {
        let technique = Trials::of("restir-sss")?.with(self.settings)?;
        let cameras = self.cameras(buffers);
        pictures(self.restarts, |seed| {
            let render =
                Render { count: FRAMES, seed, cameras: cameras.clone(), ..Render::new(SIZE, technique.clone()) };
            render.render(buffers, &mut CpuExecutor::inline())
        })
    }

    /// The same with passes changed.
    fn changed_moments(&self, buffers: &SceneBuffers, change: fn(&mut Pass)) -> Result<Vec<Moments>, Failed> {
        let technique = Trials::of("restir-sss")?.with(self.settings)?;
        film_moments(GRID, self.restarts, |seed| {
            let render = Render { count: FRAMES, seed, ..Render::new(SIZE, technique.clone()) };
            native::film(native::changed(native::plan(buffers, &render), change))
        })
    }

    fn reference(&self, buffers: &SceneBuffers) -> Result<Vec<Moments>, Failed> {
        let technique = Trials::of("path")?.with(&format!("profile_paths=off,max_depth=3,jitter=off,{}", self.path))?;
        let cameras: Vec<Camera> = self.cameras(buffers).last().copied().into_iter().collect();
        let [count, pictures_of] = REFERENCE;
        pictures(pictures_of, |seed| {
            let render =
                Render { count, seed: 1000 + seed, cameras: cameras.clone(), ..Render::new(SIZE, technique.clone()) };
            render.render(buffers, &mut CpuExecutor::inline())
        })
    }
}

const PLAIN: &str = "feedback=off,shading=selected,sampler=independent";

/// Every shift, in still pictures and in moving ones; profiles less what is traced.
fn images_are_those_of_path_tracing() -> Result<(), Failed> {
    let chains = [
        (chain("slab", "", true, 48), 0.1),
        (chain("slab", "shift=delayed,feedback=off,shading=selected", false, 48), 0.1),
        (chain("ball", "shift=reconnection", true, 48), 0.1),
        (chain("ball", "shift=delayed,lambert_below=3.4", true, 48), 0.15),
        (chain("ball", "", true, 48), 0.1),
        (chain("ball", PLAIN, false, 48), 0.1),
        (chain("ball", "traced=single", false, 48), 0.1),
        (chain("candles", "", true, 48), 0.15),
        (chain("torus", "", true, 48), 0.15),
        (chain("touching", "", true, 48), 0.1),
        (chain("comb", "", false, 48), 0.15),
        (chain("open", "shift=delayed", false, 48), 0.15),
    ];
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE / chains.len() as f64 };
    let (mut failed, mut references) = (Vec::new(), BTreeMap::new());
    for (chain, noticed) in chains {
        let Chain { scene, settings, moves, .. } = chain;
        let path = match settings {
            _ if settings.contains("traced=single") => "subsurface=hybrid",
            _ if settings.contains("lambert_below") => "subsurface=diffusion,lambert_below=3.4",
            _ => chain.path,
        };
        let (chain, buffers) = (Chain { path, ..chain }, buffers(scene)?);
        let key = (scene, path, moves);
        if let Entry::Vacant(place) = references.entry(key) {
            place.insert(chain.reference(&buffers)?);
        }
        let verdict = test.compare(&chain.moments(&buffers)?, &references[&key]);
        failed.extend(ensure_unbiased(&format!("{scene}, {settings}, moves: {moves}"), &verdict, noticed).err());
    }
    ensure(failed.is_empty(), || format!("{failed:?}"))
}

/// Where the camera was before, and samples that are merged by confidence alone, show something else.
fn known_wrong_images_are_seen() -> Result<(), Failed> {
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    let scene = buffers("ball")?;
    let still = chain("ball", "", false, 48);
    let reference = still.reference(&scene)?;
    let moved = chain("ball", "", true, 48).moments(&scene)?;
    ensure_biased("the camera has moved", &test.compare(&moved, &reference))?;
    let unweighted = still.changed_moments(&scene, |pass| {
        if pass.kernel.name == sss_merge::DESC.name {
            native::edit(pass, |params: &mut SssParams| {
                params.reuse.flags = params.reuse.flags.with_form(Mis::CONSTANT)
            });
        }
    })?;
    ensure_biased("merged by confidence alone", &test.compare(&unweighted, &reference))
}

/// Images of a row, a column and a pixel, and a camera inside of a body: all presets, without a number that is none.
fn odd_images_are_rendered() -> Result<(), Failed> {
    let inside = |mut scene: Scene| {
        scene.camera = Some(Camera::pinhole(DVec3::new(0.1, 0.0, 0.1), DVec3::X, DVec3::Y, 0.9));
        SceneBuffers::build(&scene)
    };
    let scenes = [buffers("comb")?, buffers("touching")?, inside(bodies::named("ball").ok_or("a body")?)?];
    for (scene, preset) in (0..scenes.len()).flat_map(|scene| PRESETS.map(|preset| (scene, preset))) {
        for size in [[1, 48], [48, 1], [1, 1], [7, 5]] {
            let technique = Trials::of("restir-sss")?.with(&format!("preset={preset},max_depth=5"))?;
            let render = Render { count: 4, ..Render::new(size, technique) };
            let Rendered { image, dropped_samples, .. } = render.render(&scenes[scene], &mut CpuExecutor::inline())?;
            let sound = image.pixels.as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0);
            ensure(sound && dropped_samples == 0, || format!("scene {scene}, {preset}, {size:?}: {image:?}"))?;
        }
    }
    Ok(())
}

const PRESETS: [&str; 6] = ["hybrid", "reconnection", "delayed", "sequential", "pathtracing", "published"];

/// Without a body there is nothing to resample: no plane and no pass, and frames have the bits of path tracing's samples.
fn scenes_without_bodies_are_path_traced() -> Result<(), Failed> {
    let cornell = buffers("cornell")?;
    let render = |name: &str, text: &str, count, accumulate| -> Result<Render, Failed> {
        Ok(Render { count, accumulate, seed: 9, ..Render::new(SIZE, Trials::of(name)?.with(text)?) })
    };
    let (count, common) = (5, "max_depth=4,jitter=off");
    let sss = render("restir-sss", common, count, true)?;
    let plan = native::plan(&cornell, &sss);
    let planes: Vec<_> = plan.buffers.iter().map(|buffer| buffer.name).collect();
    let kernels: Vec<_> = plan.passes.map(|pass| pass.map(|pass| pass.kernel.name)).collect::<Result<_, _>>()?;
    println!("planes {planes:?}, passes {kernels:?}");
    let own = ["reservoirs", "origins", "surfaces", "requests", "results", "together", "entries"];
    ensure(!planes.iter().any(|plane| own.contains(plane)), || format!("{planes:?}"))?;
    ensure(kernels.iter().all(|kernel| !kernel.starts_with("sss_") && !kernel.starts_with("reuse_")), || {
        format!("{kernels:?}")
    })?;
    // one sample has the same bits; sums of several are made in another order
    for (count, error) in [(1, 0.0), (5, 1.0e-6)] {
        let of = |name| -> Result<Vec<[f32; 3]>, Failed> {
            Ok(render(name, common, count, true)?.render(&cornell, &mut CpuExecutor::inline())?.image.pixels)
        };
        let (found, path) = (of("restir-sss")?, of("path")?);
        let off = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).abs() / f64::from(*b).max(1.0e-6);
        let worst = found.as_flattened().iter().zip(path.as_flattened()).map(off).fold(0.0, f64::max);
        println!("{count} frames are off from as many samples by {worst:.1e}");
        ensure(worst <= error, || format!("{count} frames are off from as many samples by {worst:e}"))?;
    }
    // the slab has all of them
    let slab = buffers("slab")?;
    let with_bodies = native::plan(&slab, &sss)
        .passes
        .filter_map(Result::ok)
        .filter(|pass| pass.kernel.name.starts_with("sss_"))
        .count();
    ensure(with_bodies > 3, || format!("{with_bodies} passes where there is a body"))
}
