//! Suffix ReSTIR: the mean of its frames is path tracing's, known-wrong forms of it are seen, prefixes and neighbours never ask a suffix, the grid finds
//! what a search of all points finds, and devices give the host's bits.

use libtest_mimic::Failed;
use restir_host::compact::{Sorting, sort};
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{Buffer, FramePlan, Pass};
use restir_host::render::Render;
use restir_kernels::restir_pt::{pt_merge, pt_shift};
use restir_kernels::restir_suffix::{
    suffix_canonical, suffix_find, suffix_keep, suffix_pair, suffix_point, suffix_prefix, suffix_trace,
};
use restir_shared::glam::Vec3;
use restir_shared::layout::CameraParams;
use restir_shared::resample::mutual::Record;
use restir_shared::resample::params::{Flags, ReuseParams};
use restir_shared::technique::path::{PathFlags, PathParams};
use restir_shared::technique::restir_pt::{self, PtParams};
use restir_shared::technique::restir_suffix::{
    self, EndRule, MAX_BORROWED, Nearest, PrefixGrid, PrefixPoint, SuffixParams,
};
use restir_tests::bias::{film_moments, path_moments};
use restir_tests::chain::Chain;
use restir_tests::checks;
use restir_tests::device;
use restir_tests::lockstep::{first_divergence, trace};
use restir_tests::native::{changed, edit, film, plan};
use restir_tests::random::SplitMix;
use restir_tests::scenes::{buffers, path_params};
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict};
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::Trials;

pub(crate) fn trials() -> Vec<Trial> {
    let mut all = checks! {
        later {
            frames_have_the_mean_of_path_tracing what_is_wrong_is_seen no_suffix_is_asked a_suffix_of_one_segment_is_the_whole_path the_grid_finds_what_all_points_have pairs_are_mutual_and_near
        }
    };
    all.extend(device::trials(|adapter| {
        let of_scene = |scene| {
            let title = format!("{scene}, 16 frames of a camera that moves, all buffers after every pass");
            adapter.trial(&title, move |executor| on_device(executor, scene))
        };
        ["moving", "ajar"].map(of_scene).into()
    }));
    all
}

const GRID: TileGrid = TileGrid { width: 24, height: 24, tile: 8 };
/// How often the tests that agree fail, all scenes together, although nothing is wrong.
const FAMILY_RATE: f64 = 1.0e-3;
const RESTARTS: u32 = 160;
/// Seeds of references lie beyond those of the chains.
const REFERENCE_SEED: u32 = 1 << 31;
const REFERENCE_RESTARTS: u32 = 4096;
const DEPTH: u32 = 5;

/// What is done to passes.
type Change = fn(&mut Pass);

/// Rays do not go through the middles of pixels: in symmetrical scenes some of those end exactly where two walls meet.
const COMMON: &str = "max_depth=5,jitter=on,sampler=independent";
const CHAINS: [Chain; 11] = [
    Chain::new("cornell", "preset=mmis", 1, false),
    Chain::new("cornell", "prefixes=3,canonical=2,kept_for=3,spatial=2", 4, false),
    Chain::new("cornell", "prefixes=2,canonical=1,borrowed=4,feedback=on", 3, true),
    Chain::new("cornell", "min_segments=1,prefixes=1,borrowed=1", 3, false),
    Chain::new("ajar", "prefixes=4", 3, true),
    Chain::new("tower", "prefixes=2", 3, false),
    Chain::new("glass", "prefixes=2,borrowed=3", 3, false),
    Chain::new("glossy", "prefixes=2,shift=hybrid", 3, true),
    Chain::new("moving", "prefixes=2,kept_for=10", 6, true),
    Chain::new("cornell", "prefixes=2,direct=restir-di", 3, true),
    Chain::new("glossy", "min_segments=1,prefixes=1,direct=restir-di", 2, false),
];

/// The last frame of independent chains.
fn last_frames(chain: &Chain, restarts: u32, change: Change) -> Result<Vec<Moments>, Failed> {
    let scene = chain.buffers()?;
    let technique = Trials::of("restir-suffix")?.with(&[chain.settings, COMMON].join(","))?;
    film_moments(GRID, restarts, |seed| {
        let cameras = chain.cameras(&scene);
        let size = [GRID.width, GRID.height];
        let render = Render { count: chain.frames, seed, cameras, ..Render::new(size, technique.clone()) };
        film(changed(plan(&scene, &render), change))
    })
}

/// The same moment by path tracing.
fn path_traced(chain: &Chain) -> Result<Vec<Moments>, Failed> {
    let scene = chain.buffers()?;
    let size = [GRID.width, GRID.height];
    let moved = scene.at(f64::from(chain.frames - 1))?;
    let camera = chain.cameras(&scene).last().copied().unwrap_or(moved.camera).params(size[0], size[1]);
    let flags = PathFlags::JITTER;
    let params = PathParams { seed: REFERENCE_SEED, camera, flags, ..path_params(&moved, size, DEPTH) };
    Ok(path_moments(GRID, REFERENCE_RESTARTS, &moved.traced_view(), params))
}

fn compare(chain: &Chain, restarts: u32, change: Change) -> Result<Verdict, Failed> {
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE / CHAINS.len() as f64 };
    Ok(test.compare(&last_frames(chain, restarts, change)?, &path_traced(chain)?))
}

/// The last frame of a chain is in the mean what path tracing finds, in all tiles and channels.
fn frames_have_the_mean_of_path_tracing() -> Result<(), Failed> {
    let mut biased = Vec::new();
    for chain in &CHAINS {
        let verdict = compare(chain, RESTARTS, |_| ())?;
        println!("{}: {verdict}", chain.title());
        biased.extend((!verdict.passed()).then(|| chain.title()));
    }
    ensure(biased.is_empty(), || format!("biased: {biased:?}"))
}

/// Changes the parameters of the passes of a kernel.
fn of_kernel<P: bytemuck::Pod>(pass: &mut Pass, name: &str, change: impl Fn(&mut P)) {
    if pass.kernel.name == name {
        edit(pass, |params: &mut P| change(params));
    }
}

fn what_is_wrong_is_seen() -> Result<(), Failed> {
    const FRESH: Chain = Chain::new("cornell", "preset=mmis", 1, false);
    // what is wrong, in which chain, over how many times as many restarts, and what makes it so
    let rows: [(&str, Chain, u32, Change); 5] = [
        ("no canonical suffix", FRESH, 1, |pass| {
            of_kernel(pass, suffix_canonical::DESC.name, |params: &mut SuffixParams| params.canonical_share = 0.0);
        }),
        ("roulette that is not made up for", FRESH, 1, |pass| {
            of_kernel(pass, suffix_canonical::DESC.name, |params: &mut SuffixParams| {
                params.canonical_share /= params.prefixes as f32;
            });
        }),
        (
            "lenders whose confidence the canonical suffix does not know",
            Chain::new("cornell", "kept_for=1000", 4, false),
            1,
            |pass| {
                of_kernel(pass, suffix_canonical::DESC.name, |params: &mut SuffixParams| params.confidence_cap = 1.0);
            },
        ),
        // the canonical suffix is drawn by the numbers by which its prefix was: the seeds differ by what tells the two apart
        (
            "a suffix that shares random numbers with its prefix",
            Chain::new("cornell", "preset=mmis,prefixes=1", 1, false),
            6,
            |pass| {
                of_kernel(pass, suffix_trace::DESC.name, |params: &mut PtParams| {
                    params.seed = SuffixParams::seed_of_prefix(params.seed)
                });
                of_kernel(pass, pt_shift::DESC.name, |params: &mut PtParams| {
                    params.seed = SuffixParams::seed_of_prefix(params.seed);
                });
            },
        ),
        (
            "the last frame's suffixes where they did not begin",
            Chain::new("cornell", "kept_for=1,prefixes=2,spatial=0", 4, false),
            1,
            |pass| {
                of_kernel(pass, pt_merge::DESC.name, |params: &mut PtParams| {
                    params.flags = params.flags | Flags::STILL
                });
            },
        ),
    ];
    let mut unseen = Vec::new();
    for (name, chain, times, change) in rows {
        let verdict = compare(&chain, times * RESTARTS, change)?;
        println!("{name}: {verdict}");
        unseen.extend(verdict.passed().then_some(name));
    }
    ensure(unseen.is_empty(), || format!("not seen: {unseen:?}"))
}

/// Other suffixes, and the same prefixes, lenders and pairs: whom a pixel borrows from is decided without a look at what it borrows.
fn no_suffix_is_asked() -> Result<(), Failed> {
    let scene = buffers("moving")?;
    let technique = Trials::of("restir-suffix")?.with("prefixes=2,spatial=2,kept_for=3,max_depth=5")?;
    let render = Render { count: 5, ..Render::new([24, 18], technique) };
    let decided = |change: Change| -> Result<[Vec<Vec<u32>>; 2], Failed> {
        let (mut decisions, mut suffixes) = (Vec::new(), Vec::new());
        let plan = changed(plan(&scene, &render), change);
        CpuExecutor::new()?.run_observed(plan, &mut |step| {
            let planes: &[&str] = match step.pass.kernel.name {
                name if name == suffix_keep::DESC.name => &["origins", "requests"],
                name if name == suffix_point::DESC.name => &["points", "words"],
                name if name == suffix_pair::DESC.name => &["requests"],
                name if name == suffix_prefix::DESC.name => &["ends", "throughputs"],
                name if name == suffix_find::DESC.name => &["nearest"],
                _ => &[],
            };
            for plane in planes {
                decisions.push(step.plane::<u32>(plane)?);
            }
            if step.pass.kernel.name == suffix_trace::DESC.name {
                suffixes.push(step.plane::<u32>("reservoirs")?);
            }
            Ok(())
        })?;
        Ok([decisions, suffixes])
    };
    let [decisions, suffixes] = decided(|_| ())?;
    let [same, others] = decided(|pass| {
        of_kernel(pass, suffix_trace::DESC.name, |params: &mut PtParams| params.seed = params.seed.wrapping_add(99));
    })?;
    ensure(suffixes != others, || "the suffixes are the same".to_owned())?;
    ensure(!decisions.is_empty() && decisions == same, || "a suffix was asked".to_owned())
}

/// From what the camera sees on, a suffix has the bits of the path that ReSTIR PT keeps.
fn a_suffix_of_one_segment_is_the_whole_path() -> Result<(), Failed> {
    let mut paths = 0;
    for scene in ["cornell", "glass", "glossy", "ajar", "tower", "all-lights"] {
        let scene = buffers(scene)?;
        let (view, size) = (scene.view(), [32, 24]);
        let reuse = ReuseParams::new(scene.camera.params(size[0], size[1]), size, 5);
        // without it paths may begin beside edges
        let flags = reuse.flags | Flags::JITTER;
        let params =
            PtParams { reuse: ReuseParams { flags, ..reuse }, max_depth: 6, ..PtParams::new(reuse.camera, size, 5) };
        let rule = EndRule { min_segments: 1, ..EndRule::default() };
        let of_prefixes = SuffixParams { path: params, ends: rule, prefixes: 1, ..SuffixParams::default() };
        for at in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
            let whole = restir_pt::trace(&view, &params, at);
            let prefix = restir_suffix::prefix(&view, &of_prefixes, &params.rng(at), true, at);
            let suffix = restir_suffix::suffix(&view, &params, &prefix.end, at);
            let seen = prefix.end.segments() != 0;
            ensure(!seen || prefix.end == whole.origin, || {
                format!("{at:?}: {:?}, not {:?}", prefix.end, whole.origin)
            })?;
            ensure(!seen || suffix == whole.path, || format!("{at:?}: another path"))?;
            ensure(prefix.light == whole.direct, || format!("{at:?}: {:?}, not {:?}", prefix.light, whole.direct))?;
            paths += u32::from(suffix.contribution_weight() > 0.0);
        }
    }
    println!("{paths} paths");
    ensure(paths > 1000, || format!("only {paths} paths"))
}

/// The shortest prefixes of points.
const LENGTH: f32 = 10.0;

/// Points around a few places, some at the very same, with several radii.
fn points(random: &mut SplitMix, params: &SuffixParams, count: usize, spread: f32) -> Vec<PrefixPoint> {
    let mut unit = move || random.unit() as f32;
    let places: Vec<Vec3> =
        (0..8).map(|_| Vec3::new(unit(), unit(), unit()) * spread - Vec3::splat(spread * 0.5)).collect();
    (0..count)
        .map(|i| {
            let near =
                Vec3::new(unit(), unit(), unit()) * (if i % 7 == 0 { 0.0 } else { 2.0 * LENGTH * params.radius });
            let normal = if unit() < 0.8 { Vec3::Y } else { Vec3::X };
            let reach = LENGTH * (1.0 + (unit() * 3.0).floor());
            PrefixPoint::of(params, places[i % places.len()] + near, normal, if i % 11 == 0 { 0.0 } else { reach })
        })
        .collect()
}

fn parameters(count: usize, radius: f32, buckets: u32) -> SuffixParams {
    let camera = CameraParams::pinhole(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.1, [64, 48]);
    let reuse = ReuseParams { min_normal_cos: 0.5, ..ReuseParams::new(camera, [count as u32, 1], 7) };
    let path = PtParams { reuse, ..PtParams::default() };
    SuffixParams { path, radius, buckets, borrowed: MAX_BORROWED, ..SuffixParams::default() }
}

/// The pixels by their buckets, and where each begins, as the host's plan has them.
fn sorted(points: &[PrefixPoint], digits: u32) -> Result<(Vec<u32>, Vec<u32>), Failed> {
    let buckets = 1 << (6 * digits);
    let words: Vec<u32> = points.iter().map(|point| point.bucket(buckets)).collect();
    let mut buffers = vec![Buffer { name: "words", words: words.len(), contents: Some(words.as_slice().into()) }];
    let Sorting { passes, order, starts, .. } = sort(&mut buffers, 0, words.len() as u32, digits)?;
    let results = CpuExecutor::new()?.run(FramePlan::of(buffers, passes, vec![order, starts]))?;
    let [mut order, mut starts] = <[Vec<u32>; 2]>::try_from(results).map_err(|_| "not two outputs")?;
    order.truncate(words.len());
    starts.truncate(buckets as usize + 1);
    let mut expected: Vec<u32> = (0..words.len() as u32).collect();
    expected.sort_by_key(|item| words[*item as usize]);
    ensure(order == expected, || "the sort is wrong".to_owned())?;
    Ok((order, starts))
}

/// A million queries against a search of all points by the same rule: level, distance, normal; of a bucket with many points every second, third, ... one.
fn the_grid_finds_what_all_points_have() -> Result<(), Failed> {
    let mut random = SplitMix::new(11);
    let mut found = [0_u64; 2];
    // points, digits of buckets, how far the places are apart, and the radius
    for (count, digits, spread, radius, queries) in [
        (300, 2, 20.0, 1.0, 700_000),
        (300, 1, 1.0, 40.0, 150_000),
        (2500, 3, 4.0, 3.0, 100_000),
        (64, 1, 3.0e7, 1.0, 50_000),
    ] {
        let params = parameters(count, radius, 1 << (6 * digits));
        let points = points(&mut random, &params, count, spread);
        let (order, starts) = sorted(&points, digits)?;
        let grid = PrefixGrid { points: &points, order: &order, starts: &starts };
        let looked_at = looked_at(&points, &order, &starts);
        for query in 0..queries {
            let to = points[query % count].beside(Vec3::splat((query / count) as f32 * 1.0e-3));
            let expected = brute(&params, &points, &looked_at, &to);
            let nearest = grid.nearest(&params, &to);
            ensure(nearest == expected, || format!("{count} points, query {query}: {nearest:?}, not {expected:?}"))?;
            found[usize::from(nearest.pixels[0] != u32::MAX)] += 1;
        }
    }
    println!("{} queries have no neighbour, {} have", found[0], found[1]);
    ensure(found.iter().all(|count| *count > 10_000), || format!("a test of nothing: {found:?}"))
}

/// Which points are ever looked at: of each bucket at most 32, a stride apart.
fn looked_at(points: &[PrefixPoint], order: &[u32], starts: &[u32]) -> Vec<bool> {
    let mut looked = vec![false; points.len()];
    for range in starts.windows(2) {
        let of_bucket = &order[range[0] as usize..range[1] as usize];
        let stride = of_bucket.len().div_ceil(32).max(1);
        of_bucket.iter().step_by(stride).for_each(|pixel| looked[*pixel as usize] = true);
    }
    looked
}

fn brute(params: &SuffixParams, points: &[PrefixPoint], looked_at: &[bool], to: &PrefixPoint) -> Nearest {
    let mut near: Vec<(f32, u32)> = (0..)
        .zip(points)
        .filter(|(pixel, _)| looked_at[*pixel as usize])
        .filter_map(|(pixel, point)| {
            let distance = to.distance(point, params.min_normal_cos);
            (distance < f32::MAX).then_some((distance, pixel))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut pixels = [u32::MAX; MAX_BORROWED as usize];
    pixels.iter_mut().zip(&near).for_each(|(pixel, (_, found))| *pixel = *found);
    Nearest { pixels }
}

/// Who is paired with whom is so both ways, and both are near each other.
fn pairs_are_mutual_and_near() -> Result<(), Failed> {
    let params = parameters(900, 3.0, 64);
    let points = points(&mut SplitMix::new(5), &params, 900, 4.0);
    let (order, starts) = sorted(&points, 1)?;
    let grid = PrefixGrid { points: &points, order: &order, starts: &starts };
    let mut pairs = 0;
    for merge in 1..4 {
        let mut params = params;
        params.merge = merge;
        let partner = |pixel: u32| grid.pair(&params, [pixel, 0]).sample;
        for pixel in (0..900).filter(|pixel| partner(*pixel) != u32::MAX) {
            let other = partner(pixel);
            let near = points[pixel as usize].distance(&points[other as usize], params.min_normal_cos) < f32::MAX;
            ensure(other != pixel && partner(other) == pixel && near, || format!("{pixel} and {other}"))?;
            pairs += 1;
        }
    }
    println!("{pairs} of {} have partners", 3 * 900);
    ensure(pairs > 500, || format!("only {pairs} pairs"))
}

/// Sixteen frames of a camera that moves.
fn on_device(executor: &mut dyn Executor, scene: &'static str) -> Result<(), Failed> {
    let chain = Chain::new(scene, "prefixes=2,max_depth=5", 16, true);
    let scene = chain.buffers()?;
    let technique = Trials::of("restir-suffix")?.with(chain.settings)?;
    let cameras = chain.cameras(&scene);
    let render = Render { count: chain.frames, seed: 3, cameras, ..Render::new([18, 12], technique) };
    let host = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
    match first_divergence(executor, plan(&scene, &render), &host)? {
        Some(divergence) => Err(divergence.to_string().into()),
        None => Ok(()),
    }
}
