//! ReSTIR PT as renders run it: reuse keeps the mean, and known-wrong forms of it do not.

use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::exec::{CpuExecutor, Executor, Step};
use restir_host::plan::{FramePlan, Pass};
use restir_host::render::Render;
use restir_host::technique::asked::asked_after;
use restir_host::technique::inspect::Layered;
use restir_host::technique::reuse::render_with_layers;
use restir_kernels::restir_pt::{pt_merge, pt_retrace, pt_shade, pt_shift, pt_trace};
use restir_kernels::{KernelDesc, NativeRow};
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::resample::mutual::{Record, ShiftRequest, ShiftResult};
use restir_shared::resample::params::Flags;
use restir_shared::shift::Hybrid;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};
use restir_shared::vec::luminance;
use restir_tests::chain::Chain;
use restir_tests::native::{changed, edit, film, plan};
use restir_tests::scenes::buffers;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::Trials;

restir_tests::suite! {
    later {
        layers_tell_whose_path_it_is rays_are_as_few_as_is_said sharing_keeps_the_mean wrong_sharing_is_seen chains_keep_the_mean wrong_chains_are_seen
    }
}

const SIDE: u32 = 24;
/// Frames, each of which is a picture of its own.
const FRAMES: u32 = 32;
/// Side of a tile.
const TILE: u32 = 8;
/// Rays do not go through the middles of pixels: in symmetrical scenes some of those end exactly where two walls meet.
const COMMON: &str = "temporal=off,tile=4,max_plane_distance=0.1,max_depth=7,jitter=on,sampler=independent";
const SHIFTS: [&str; 5] = [
    "shift=reconnection",
    "shift=replay,mis=pairwise-counted-defensive",
    "shift=hybrid",
    "shift=hybrid,min_distance=1.5,mis=pairwise-defensive",
    "shift=footprint,spatial=2",
];

/// Tests in a family: of each scene and shift, and of each chain, [`NUMBERS`].
const NUMBERS_OF_SHARING: f64 = (SCENES.len() * SHIFTS.len() * NUMBERS) as f64;
const NUMBERS_OF_CHAINS: f64 = (CHAINS.len() * NUMBERS) as f64;
const SCENES: [&str; 6] = ["cornell", "glossy", "glass", "tower", "ajar", "sheets"];
/// What is tested of a picture: its tiles, [`LENGTHS`], and its mean.
const NUMBERS: usize = ((SIDE / TILE) * (SIDE / TILE)) as usize + 4 + 1;

/// Lengths of paths that are counted, longer ones with the last.
const LENGTHS: std::ops::RangeInclusive<u32> = 2..=5;

/// The luminance of what each tile's pixels make of their paths; after the tiles, of paths of each of [`LENGTHS`], and of the whole picture.
fn by_paths(paths: &[PackedPath], direct: &[FilmPixel]) -> Vec<f64> {
    let tiles = SIDE / TILE;
    let mut sums = vec![0.0; (tiles * tiles) as usize];
    for ((i, path), direct) in (0..).zip(paths).zip(direct) {
        let radiance = Vec3::from_array(direct.sum) + path.value() * path.contribution_weight();
        let luminance = f64::from(luminance(radiance));
        let tile = (i / SIDE / TILE * tiles + i % SIDE / TILE) as usize;
        sums[tile] += luminance;
    }
    let picture = sums.iter().sum();
    let (shortest, longest) = LENGTHS.into_inner();
    let first = sums.len();
    sums.resize(first + LENGTHS.count(), 0.0);
    for path in paths.iter().filter(|path| path.contribution_weight() > 0.0) {
        let length = path.unpack().path.length.clamp(shortest, longest);
        sums[first + (length - shortest) as usize] += f64::from(luminance(path.value() * path.contribution_weight()));
    }
    sums.push(picture);
    sums
}

/// Of each tile, each length of paths and the picture what frames show with reuse less what they show of their own paths alone; and that of the picture.
fn gained(plan: FramePlan<'_>) -> Result<(Vec<Moments>, f64), Failed> {
    let (mut differences, mut alone) = (Vec::new(), Moments::default());
    let mut own = Vec::new();
    let mut see = |step: &Step<'_>| {
        if step.pass.kernel.name == pt_trace::DESC.name {
            own = by_paths(&step.plane("reservoirs")?, &step.plane("direct")?);
        } else if step.pass.kernel.name == pt_shade::DESC.name {
            let shared = by_paths(&step.plane("reservoirs")?, &step.plane("direct")?);
            differences.resize(own.len(), Moments::default());
            differences
                .iter_mut()
                .zip(shared.iter().zip(&own))
                .for_each(|(sum, (with, without))| sum.push(with - without));
            alone.push(own[own.len() - 1]);
        }
        Ok(())
    };
    CpuExecutor::inline().run_observed(plan, &mut see)?;
    Ok((differences, alone.mean()))
}

/// Tests of several frames, each of which shows a picture of its own.
fn tests(scene: &str, text: &str, count: u32, change: Change) -> Result<(Vec<ZTest>, f64), Failed> {
    let buffers = buffers(scene)?;
    let technique = Trials::of("restir-pt")?.with(&[COMMON, text].join(","))?;
    let render = Render { count, seed: 3, accumulate: true, ..Render::new([SIDE; 2], technique) };
    let (differences, alone) = gained(changed(plan(&buffers, &render), change))?;
    Ok((differences.into_iter().map(|moments| ZTest::new(moments, Moments::exact(0.0))).collect(), alone))
}

/// The mean of frames in which pixels share is that of their paths alone.
fn sharing_keeps_the_mean() -> Result<(), Failed> {
    let cells: Vec<_> = SCENES.iter().flat_map(|scene| SHIFTS.map(|text| (*scene, text))).collect();
    let tests: Vec<_> = cells.par_iter().map(|(scene, text)| tests(scene, text, FRAMES, |_| ())).collect();
    let mut family = Family::new("sharing", FAMILY_RATE);
    for ((scene, text), result) in cells.into_iter().zip(tests) {
        let (tests, alone) = result?;
        let picture = &tests[tests.len() - 1];
        let noticed = picture.detectable_bias(FAMILY_RATE / NUMBERS_OF_SHARING) / alone;
        println!("{scene}, {text}: {:.1} standard errors, {noticed:.3} is noticed", picture.z);
        tests.into_iter().enumerate().for_each(|(tile, test)| family.z_test(format!("{scene}, {text}, {tile}"), test));
    }
    family.verdict().map(drop).map_err(Failed::from)
}

/// What makes frames in which pixels share wrong.
struct Wrong {
    name: &'static str,
    scene: &'static str,
    settings: &'static str,
    change: Change,
}

/// Shifts that ask where a path may be joined of the path that is shifted, and not of what it becomes.
const fn criterion_of_one_path(settings: &'static str) -> Wrong {
    let change: Change = |pass| {
        if pass.kernel.name == pt_shift::DESC.name {
            edit(pass, |params: &mut PtParams| {
                params.hybrid = Hybrid { replays: params.hybrid.replays, ..Hybrid::RECONNECTION };
            });
        }
    };
    Wrong { name: "criterion asked of one path alone", scene: "cornell", settings, change }
}

/// A known-wrong merge: the right one, over what `change` makes of what became of the jobs. It is told the pixel that merges.
fn merge_wrongly(
    row: &mut NativeRow<'_>,
    change: fn(u32, &PtParams, &[PackedPath], &[ShiftRequest], &mut [ShiftResult]),
) {
    let params: PtParams = bytemuck::pod_read_unaligned(bytemuck::cast_slice(row.params));
    let [paths, jobs, shifted, returned] = [row.read[0], row.read[1], row.read[2], row.read[3]];
    for x in row.x..row.x + row.width {
        let mut tampered: Vec<ShiftResult> = bytemuck::pod_collect_to_vec(shifted);
        change(
            row.y * params.width + x,
            &params,
            bytemuck::cast_slice(paths),
            bytemuck::cast_slice(jobs),
            &mut tampered,
        );
        let at = (x - row.x) as usize * size_of::<PackedPath>() / 4;
        let mut own = [&mut row.own[0][at..at + size_of::<PackedPath>() / 4]];
        let read = [paths, jobs, bytemuck::cast_slice(&tampered), returned];
        (pt_merge::DESC.native)(&mut NativeRow { x, width: 1, read: &read, own: &mut own, ..*row });
    }
}

/// Declares kernels that stand for `pt_merge`.
macro_rules! wrong_merges {
    ($($name:ident in $scene:literal, $settings:literal: $change:expr;)*) => {
        const WRONG_MERGES: &[Wrong] = &[$({
            fn native(row: &mut NativeRow<'_>) {
                merge_wrongly(row, $change);
            }
            static DESC: KernelDesc = KernelDesc { native, ..pt_merge::DESC };
            Wrong {
                name: stringify!($name),
                scene: $scene,
                settings: $settings,
                change: |pass| {
                    if pass.kernel.name == DESC.name {
                        pass.kernel = &DESC;
                    }
                },
            }
        }),*];
    };
}

wrong_merges! {
    no_jacobian in "cornell", "shift=hybrid": |_, _, paths, jobs, shifted| {
        for (job, shifted) in jobs.iter().zip(shifted).filter(|(_, shifted)| shifted.partial_jacobian > 0.0) {
            shifted.partial_jacobian = paths[job.sample as usize].partial_jacobian();
        }
    };
    inverted_jacobian in "cornell", "shift=hybrid": |_, _, paths, jobs, shifted| {
        for (job, shifted) in jobs.iter().zip(shifted).filter(|(_, shifted)| shifted.partial_jacobian > 0.0) {
            let term = paths[job.sample as usize].partial_jacobian();
            shifted.partial_jacobian = term * (term / shifted.partial_jacobian);
        }
    };
    own_path_believed_unknown_to_neighbours in "cornell", "shift=hybrid": |pixel, _, _, jobs, shifted| {
        let ways_back = jobs.iter().zip(shifted).filter(|(job, _)| job.sample == pixel);
        ways_back.for_each(|(_, shifted)| *shifted = ShiftResult::default());
    };
    neighbours_counted_that_cannot_have_the_path in "cornell", "shift=hybrid": |pixel, _, paths, jobs, shifted| {
        let path = &paths[pixel as usize];
        let ways_back = jobs.iter().zip(shifted).filter(|(job, shifted)| job.sample == pixel && shifted.partial_jacobian == 0.0);
        ways_back.for_each(|(_, shifted)| {
            *shifted = ShiftResult { value: path.value().to_array(), partial_jacobian: path.partial_jacobian() };
        });
    };
    neighbours_counted_for_paths_without_a_reconnection_vertex in "glass", "shift=hybrid,replays=0":
    |pixel, _, paths, jobs, shifted| {
        let path = &paths[pixel as usize];
        let ways_back = jobs.iter().zip(shifted).filter(|(job, shifted)| job.sample == pixel && shifted.partial_jacobian == 0.0);
        if path.unpack().path.length > 0 && path.unpack().path.reconnection == 0 {
            ways_back.for_each(|(_, shifted)| {
                *shifted = ShiftResult { value: path.value().to_array(), partial_jacobian: path.partial_jacobian() };
            });
        }
    };
}

/// The same with other shifts.
const WRONG_SHIFTS: [Wrong; 2] =
    [criterion_of_one_path("shift=hybrid,min_distance=1.5"), criterion_of_one_path("shift=footprint,footprint=0.1")];

/// Frames in which something is wrong.
const WRONG_FRAMES: u32 = 256;

fn wrong_sharing_is_seen() -> Result<(), Failed> {
    let mut unseen = Vec::new();
    for Wrong { name, scene, settings, change } in WRONG_MERGES.iter().chain(&WRONG_SHIFTS) {
        let (tests, alone) = tests(scene, settings, WRONG_FRAMES, *change)?;
        let worst = tests.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())).ok_or("no tile")?;
        let picture = tests[tests.len() - 1].difference / alone;
        println!("{name}, {scene}, {settings}: {:.1} standard errors, {picture:+.4} of the picture", worst.z);
        unseen.extend((worst.p >= FAMILY_RATE / NUMBERS_OF_SHARING).then_some(*name));
    }
    ensure(unseen.is_empty(), || format!("not seen: {unseen:?}"))
}

/// Settings of chains.
const OF_CHAINS: &str = "tile=4,max_plane_distance=0.1,max_depth=6,sampler=independent";
const CHAINS: [Chain; 18] = [
    Chain::new("cornell", "jitter=on,shift=hybrid,feedback=on", 4, false),
    Chain::new("cornell", "jitter=on,shift=footprint,spatial=0", 5, true),
    Chain::new("cornell", "jitter=on,shift=replay,spatial=0,temporal_mis=pairwise-defensive", 4, true),
    Chain::new("cornell", "jitter=on,shift=hybrid,feedback=off,spatial=2,neighbours=2,confidence_cap=3", 5, true),
    Chain::new("cornell", "still=on,spatial=0", 4, false),
    Chain::new("glossy", "jitter=on,shift=hybrid,spatial=0", 4, true),
    Chain::new("glass", "jitter=on,shift=hybrid,spatial=0", 4, true),
    Chain::new("glass", "still=on,feedback=on", 3, false),
    Chain::new("ajar", "jitter=on,shift=footprint,spatial=0", 4, true),
    Chain::new("tower", "jitter=on,shift=hybrid", 3, true),
    Chain::new("sheets", "jitter=on,spatial=0", 4, true),
    Chain::new("moving", "jitter=on,shift=hybrid,spatial=0", 10, false),
    Chain::new("moving", "jitter=on,shift=replay", 10, true),
    Chain::new("moving-fast", "jitter=on,shift=hybrid,spatial=0", 6, false),
    Chain::new("moving", "jitter=on,shift=hybrid,spatial=0,changed=retrace", 10, false),
    Chain::new("moving-fast", "jitter=on,shift=footprint,spatial=0,changed=retrace", 6, true),
    Chain::new("toys", "jitter=on,shift=hybrid,spatial=0", 6, true),
    Chain::new("cornell-lens", "shift=hybrid", 4, true),
];
/// Independent chains.
const RESTARTS: u32 = 192;

/// What the last frame of a chain shows, against what that one's own paths do.
fn of_chain(chain: &Chain, restarts: u32, change: Change) -> Result<(Vec<ZTest>, f64), Failed> {
    let buffers = chain.buffers()?;
    let technique = Trials::of("restir-pt")?.with(&[OF_CHAINS, chain.settings].join(","))?;
    let cameras = chain.cameras(&buffers);
    let of_restart = |seed: u32| {
        let cameras = cameras.clone();
        let render = Render { count: chain.frames, seed, cameras, ..Render::new([SIDE; 2], technique.clone()) };
        gained(changed(plan(&buffers, &render), change))
    };
    let all: Vec<_> = (0..restarts).into_par_iter().map(of_restart).collect::<Result<_, _>>()?;
    let (mut sums, mut alone) = (vec![Moments::default(); all[0].0.len()], 0.0);
    for (differences, own) in &all {
        sums.iter_mut().zip(differences).for_each(|(sum, one)| sum.push(one.mean()));
        alone += own / f64::from(restarts);
    }
    Ok((sums.into_iter().map(|moments| ZTest::new(moments, Moments::exact(0.0))).collect(), alone))
}

/// What the last frame of a chain shows is in the mean what its own paths show.
fn chains_keep_the_mean() -> Result<(), Failed> {
    let mut family = Family::new("chains", FAMILY_RATE);
    for chain in &CHAINS {
        let name = chain.title();
        let (tests, alone) = of_chain(chain, RESTARTS, |_| ())?;
        let picture = &tests[tests.len() - 1];
        let noticed = picture.detectable_bias(FAMILY_RATE / NUMBERS_OF_CHAINS) / alone;
        println!("{name}: {:.1} standard errors, {noticed:.3} is noticed", picture.z);
        tests.into_iter().enumerate().for_each(|(tile, test)| family.z_test(format!("{name}, {tile}"), test));
    }
    family.verdict().map(drop).map_err(Failed::from)
}

/// What makes a pass wrong.
type Change = fn(&mut Pass);

/// Changes parameters of passes between frames.
fn between_frames(pass: &mut Pass, change: fn(&mut PtParams)) {
    if pass.params::<PtParams>().is_some_and(|params| params.flags.contains(Flags::OTHER_FRAME)) {
        edit(pass, change);
    }
}

fn wrong_chains_are_seen() -> Result<(), Failed> {
    const RETRACED: Chain = Chain::new("moving-fast", "jitter=on,shift=hybrid,spatial=0,changed=retrace", 6, false);
    let rows: [(&str, Chain, Change); 7] = [
        (
            "light that no longer arrives",
            Chain::new("moving", "jitter=on,shift=hybrid,spatial=0,changed=stale", 8, false),
            |_| (),
        ),
        ("the last frame in this scene", Chain::new("moving", "jitter=on,shift=hybrid,spatial=0", 10, false), |pass| {
            if pass.kernel.name == pt_shift::DESC.name {
                between_frames(pass, |params| {
                    params.other_scene = params.scene;
                    params.flags = params.flags.without(Flags::CHANGED);
                });
            }
        }),
        (
            "what has moved between vertex k and its light",
            Chain::new("moving-fast", "jitter=on,shift=hybrid,spatial=0", 6, false),
            |pass| {
                if pass.kernel.name == pt_shift::DESC.name {
                    between_frames(pass, |params| {
                        // the way back takes a path's light and area to the other frame by the same flag
                        if !params.flags.contains(Flags::BACK) {
                            params.flags = params.flags.without(Flags::CHANGED);
                        }
                    });
                }
            },
        ),
        ("light retraced one way: not where the pixel's own path is taken back", RETRACED, |pass| {
            // rays are traced in the arenas, where the parameters have them
            pass.frame.iter_mut().for_each(|frame| frame.scenes = None);
            if pass.kernel.name == pt_retrace::DESC.name {
                between_frames(pass, |params| {
                    // in this frame's scene it finds what it has
                    params.other_scene =
                        if params.flags.contains(Flags::BACK) { params.scene } else { params.other_scene };
                });
            }
        }),
        ("light retraced one way: the pixel's own path is not taken back", RETRACED, |pass| {
            if pass.kernel.name == pt_shift::DESC.name {
                between_frames(pass, |params| {
                    if params.flags.contains(Flags::BACK) {
                        params.flags = params.flags.without(Flags::TAKES_ALL);
                    }
                });
            }
        }),
        ("the last frame from here", Chain::new("cornell", "jitter=on,shift=hybrid,spatial=0", 4, true), |pass| {
            if pass.kernel.name == pt_shift::DESC.name {
                between_frames(pass, |params| params.flags = params.flags.without(Flags::BACK));
            }
        }),
        ("a view that only seems still", Chain::new("cornell", "still=on,jitter=on,spatial=0", 4, true), |pass| {
            between_frames(pass, |params| params.flags = params.flags | Flags::STILL);
        }),
    ];
    let mut unseen = Vec::new();
    for (name, chain, change) in rows {
        let (tests, alone) = of_chain(&chain, RESTARTS, change)?;
        let worst = tests.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())).ok_or("no tile")?;
        let picture = tests[tests.len() - 1].difference / alone;
        println!("{name}: {:.1} standard errors, {picture:+.4} of the picture", worst.z);
        unseen.extend((worst.p >= FAMILY_RATE / NUMBERS_OF_CHAINS).then_some(name));
    }
    ensure(unseen.is_empty(), || format!("not seen: {unseen:?}"))
}

/// Rays a pixel of frames after the first, as docs/restir-pt.md has them: they are counted, so that they are the same everywhere. Joined
/// at vertex 2, a path costs a shadow ray for each neighbour, and nothing else.
fn rays_are_as_few_as_is_said() -> Result<(), Failed> {
    const PIXELS: f64 = 64.0 * 48.0;
    let rows = [
        ("ajar", "", [11.80, 0.27]),
        ("tower", "", [3.64, 1.85]),
        ("cornell", "", [5.70, 1.66]),
        ("cornell", "shift=reconnection", [5.70, 1.64]),
        ("cornell", "still=off", [5.70, 2.94]),
    ];
    let mut others = Vec::new();
    for (scene, text, stated) in rows {
        let technique = Trials::of("restir-pt")?.with(text)?;
        let render = Render { count: 4, ..Render::new([64, 48], technique) };
        let asked = asked_after(&buffers(scene)?, &render, 1)?;
        let counts = [pt_trace::DESC.name, pt_shift::DESC.name].map(|name| asked[name].counts);
        let rays = counts.map(|counts| counts.rays() as f64 / PIXELS / 3.0);
        println!(
            "{scene}, {text}: {rays:.2?} rays a pixel, {:.2?} surfaces",
            counts.map(|c| c.surfaces as f64 / PIXELS / 3.0)
        );
        let near = rays.iter().zip(stated).all(|(found, stated)| (found - stated).abs() < 0.02);
        others.extend((!near).then(|| format!("{scene}, {text}: {rays:.2?} rays a pixel, and not {stated:?}")));
        ensure(!text.contains("reconnection") || counts[1].closest == 0, || "joined paths are replayed".to_owned())?;
    }
    ensure(others.is_empty(), || others.join("; "))
}

/// Without reuse a pixel has its own path of this frame; with it, paths of others and of frames before, and copies.
fn layers_tell_whose_path_it_is() -> Result<(), Failed> {
    const LAST: u32 = 3;
    let buffers = buffers("cornell")?;
    let mut copied = Vec::new();
    for text in ["temporal=off,spatial=0", "spatial=0", "temporal=off,tile=4", "feedback=on,tile=4"] {
        let technique = Trials::of("restir-pt")?.with(text)?;
        let render = Render { count: LAST + 1, seed: 5, ..Render::new([SIDE; 2], technique) };
        let Layered { rendered, layers } =
            render_with_layers::<PackedPath>(&mut CpuExecutor::inline(), &buffers, &render, &mut |_| Ok(()))?;
        let film = film(plan(&buffers, &render))?;
        let pixels = rendered.image.pixels.iter().zip(&film);
        ensure(pixels.clone().all(|(a, b)| *a == b.sum), || format!("{text}: layers change the picture"))?;
        let (mut strangers, mut older, mut count) = (0, 0, 0);
        for (i, stored) in (0..).zip(&layers.records).filter(|(_, stored)| stored.path.length > 0) {
            let (own, age) = ((i % SIDE) | (i / SIDE) << 16, LAST.wrapping_sub(stored.path.key.y));
            ensure(age <= LAST, || format!("{text}: a path of age {age}"))?;
            (strangers, older, count) =
                (strangers + u32::from(stored.path.key.x != own), older + u32::from(age > 0), count + 1);
        }
        let [temporal, spatial] = [!text.contains("temporal=off"), text.contains("tile")];
        println!(
            "{text}: of {count} paths {strangers} of others, {older} of frames before, {:.2} copied",
            layers.copied()
        );
        ensure((strangers > count / 3) == spatial && (strangers > 0) == spatial, || format!("{text}: {strangers}"))?;
        ensure((older > count / 3) == temporal && (older > 0) == temporal, || format!("{text}: {older} are older"))?;
        copied.push(layers.copied());
    }
    ensure(copied[..2] == [0.0; 2] && copied[2] > 0.1 && copied[3] > copied[2], || format!("copied: {copied:?}"))
}
