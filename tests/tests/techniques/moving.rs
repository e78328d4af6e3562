//! Scenes that move, by ReSTIR DI: the same bits on every executor, and no bias by what the last frame was like.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{FramePlan, Pass};
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene};
use restir_host::settings::Choice as _;
use restir_host::technique::Technique;
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_host::technique::restir_di::{
    DiSettings, MAX_CANDIDATES, MAX_CONFIDENCE_CAP, MAX_INITIAL_RAYS, MAX_NEIGHBOURS, MAX_SHADED, MAX_SPATIAL_PASSES,
    MAX_TILE_SIZE, MAX_TILES,
};
use restir_host::technique::restir_pt::{
    MAX_CONFIDENCE_CAP as MAX_PATH_CAP, MAX_DEPTH, MAX_SPATIAL_PASSES as MAX_PATH_PASSES,
};
use restir_kernels::KernelDesc;
use restir_kernels::path::{path_exits, path_media, path_media_clear, path_profile};
use restir_kernels::restir_di::{di_combine, di_initial, di_primary, di_tiles};
use restir_shared::glam::DVec3;
use restir_shared::layout::{Extent, NONE, SceneHeader};
use restir_shared::resample::mutual::MAX_NEIGHBOURS as MAX_PATH_NEIGHBOURS;
use restir_shared::technique::path::PathParams;
use restir_shared::technique::restir_di::{DiParams, Flags, MAX_GLOSS_RENEWAL, PackedReservoir, Stored, TileParams};
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::device;
use restir_tests::lockstep::{first_divergence, trace};
use restir_tests::native::{changed, edit, film, plan};
use restir_tests::scenes::{buffers, named, path_params};
use restir_tests::stats::effort::draws;
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::Trials;
use restir_tests::technique::restir_di::settings;
use std::sync::OnceLock;

/// Frames of the comparison: the whole period of the scene.
const FRAMES: u32 = 32;
const SIZE: [u32; 2] = [18, 12];
/// Of the tests for bias. Frame 9 sees the sign again, has lost the bulb for two frames, and everything has moved.
const LAST_FRAME: u32 = 9;
const GRID: TileGrid = TileGrid { width: 32, height: 32, tile: 8 };
/// How often each of the tests that agree fails although nothing is wrong.
const FAMILY_RATE: f64 = 1.0e-3;
const RESTARTS: u32 = 1_024;
/// Of what is wrong, by a fifth.
const GROSS: u32 = 32;
/// Seeds of the reference lie beyond those of the chains.
const REFERENCE_SEED: u32 = 1 << 31;
const REFERENCE_RESTARTS: u32 = 4096;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials: Vec<Trial> = vec![
        Trial::test("a scene that stands still pays nothing", a_still_scene_pays_nothing),
        Trial::test(format!("quality: {FRAMES} frames by any tracer"), || any_tracer_gives_the_same("moving")),
        Trial::test(format!("alpha, quality: {FRAMES} frames by any tracer"), || {
            any_tracer_gives_the_same("moving-alpha")
        }),
        Trial::test("what differs for one pass is found there", what_differs_is_found),
        Trial::test("rounds of candidates are as many as rays allow", rounds_of_candidates),
    ];
    trials.extend(VARIANTS.iter().map(|&(subject, name, text, change, wrong)| {
        let title = format!("{}, frame {LAST_FRAME} {name}", subject.name);
        Trial::test(title, move || against_path_tracing(subject, name, text, change, wrong))
    }));
    trials.extend(device::trials(|adapter| {
        let largest = LARGEST.map(|text| {
            adapter.trial(&format!("{text}, the largest there are"), move |executor| largest_settings(executor, text))
        });
        let of_paths = LARGEST_OF_PATHS.map(|text| {
            let title = format!("restir-pt, {text}, the largest there are");
            adapter.trial(&title, move |executor| largest_in(executor, "restir-pt", text, &BEYOND_OF_PATHS))
        });
        let largest = largest.into_iter().chain(of_paths);
        let media = MEDIA.map(|(scene, subsurface, kernel)| {
            let (name, all) = (subsurface.name(), "all buffers after every pass");
            let title = format!("path, media of {scene}, {name}: {FRAMES} moments, {all}");
            adapter.trial(&title, move |executor| media_on_device(executor, scene, subsurface, kernel))
        });
        let trials = |trials: Trials| {
            let rows = trials.rows().into_iter();
            rows.map(move |(name, technique)| {
                let title = format!("{}, {name}: {FRAMES} repeats, all buffers after every pass", trials.name());
                adapter.trial(&title, move |executor| same_on_device(executor, frames(technique)))
            })
        };
        let of_paths = Trials::of("restir-pt").map(|trials| trials.rows()).unwrap_or_default();
        let indoors = of_paths.into_iter().map(|(name, technique)| {
            let title = format!("restir-pt, {name}: 16 frames of ajar, all buffers after every pass");
            adapter.trial(&title, move |executor| light_from_next_door(executor, technique))
        });
        let rows = Trials::all().into_iter().flat_map(trials);
        largest.chain(media).chain(indoors).chain(rows).collect()
    }));
    trials
}

/// What scatters light and moves, some of it with textures, how light is followed in there, and a kernel that does so.
const MEDIA: [(&str, Subsurface, &KernelDesc); 5] = [
    ("moving-media", Subsurface::Walk, &path_media::DESC),
    ("moving-media", Subsurface::Hybrid, &path_exits::DESC),
    ("moving-media", Subsurface::Diffusion, &path_profile::DESC),
    ("moving-mist", Subsurface::Walk, &path_media_clear::DESC),
    ("moving-mist", Subsurface::Hybrid, &path_exits::DESC),
];

/// A sample of each frame's moment, seen by a camera that stands still: all that differs between two pictures is what moves.
fn media_on_device(
    executor: &mut dyn Executor,
    scene: &str,
    subsurface: Subsurface,
    kernel: &KernelDesc,
) -> Result<(), Failed> {
    let scene = buffers(scene)?;
    let settings = PathSettings { max_depth: 5, longest_walk: 70, subsurface, ..PathSettings::default() };
    let render = Render { seed: 3, ..Render::new(SIZE, settings) };
    let kernels: Vec<&str> = plan(&scene, &render).passes.flatten().map(|pass| pass.kernel.name).collect();
    ensure(kernels.contains(&kernel.name), || format!("{kernels:?} without {}", kernel.name))?;
    let mut films = Vec::new();
    for frame in 0..FRAMES {
        let moment = scene.at(f64::from(frame))?;
        render.check(&moment)?;
        let output = plan(&moment, &render).outputs[0];
        let mut host = trace(&mut CpuExecutor::new()?, plan(&moment, &render))?;
        if let Some(divergence) = first_divergence(executor, plan(&moment, &render), &host)? {
            return Err(format!("moment {frame}: {divergence}").into());
        }
        films.extend(host.pop().map(|mut buffers| buffers.swap_remove(output)));
    }
    let same = films.windows(2).position(|films| films[0] == films[1]);
    ensure(same.is_none() && films.len() == FRAMES as usize, || format!("nothing moves after moment {same:?}"))
}

/// A camera that flies past, at every frame.
fn frames(technique: impl Into<Box<dyn Technique>>) -> Render {
    let camera = |frame: u32| {
        let along = f64::from(frame) / f64::from(FRAMES);
        let position = DVec3::new(-0.6 + 1.3 * along, 0.3 - 0.5 * along, 3.6 - 0.4 * along);
        Camera::pinhole(position, DVec3::new(0.1 * along, 0.0, 0.0), DVec3::Y, 0.7)
    };
    let cameras = (0..FRAMES).map(camera).collect();
    Render { count: FRAMES, accumulate: true, seed: 3, cameras, ..Render::new(SIZE, technique) }
}

/// Settings at the ends of their ranges ([`MAX_CANDIDATES`], [`MAX_INITIAL_RAYS`], [`MAX_TILES`], [`MAX_TILE_SIZE`], [`MAX_SHADED`], [`MAX_SPATIAL_PASSES`],
/// [`MAX_NEIGHBOURS`], [`MAX_CONFIDENCE_CAP`], [`MAX_GLOSS_RENEWAL`]).
const LARGEST: [&str; 10] = [
    "candidates=1024",
    "candidates=1024,initial_rays=64",
    MOST_ROUNDS,
    "tiles=3x90,candidates=5,initial_rays=2,gloss_fade=1e6,gloss_renewal=15",
    "tiles=1024x8",
    "tiles=2x32768,candidates=1024",
    "shaded=128",
    "spatial=8,feedback=off",
    "neighbours=7,confidence_cap=255",
    "temporal=fused,neighbours=7",
];

/// 16 rounds would have 1024 candidates, and 64 rays for them. As a little of each history is left, and a share of rounds is rounded down, there are 15.
const MOST_ROUNDS: &str = "candidates=64,initial_rays=4,gloss_fade=1e6,gloss_renewal=15";

/// Settings beyond these ends.
const BEYOND: [(&str, &str); 9] = [
    ("candidates", "1025"),
    ("initial_rays", "65"),
    ("tiles", "1025x8"),
    ("tiles", "2x32769"),
    ("shaded", "130"),
    ("spatial", "9"),
    ("neighbours", "8"),
    ("confidence_cap", "256"),
    ("gloss_renewal", "16"),
];

/// The same of ReSTIR PT ([`MAX_PATH_PASSES`], [`MAX_PATH_NEIGHBOURS`], [`MAX_PATH_CAP`], [`MAX_DEPTH`]).
const LARGEST_OF_PATHS: [&str; 3] =
    ["neighbours=8,spatial=4", "tile=256,confidence_cap=255", "max_depth=63,shift=replay,neighbours=1"];
const BEYOND_OF_PATHS: [(&str, &str); 5] =
    [("neighbours", "9"), ("spatial", "5"), ("tile", "512"), ("confidence_cap", "256"), ("max_depth", "64")];

/// What they are is found, they can be rendered with the same bits everywhere, and more is refused.
fn largest_settings(executor: &mut dyn Executor, text: &str) -> Result<(), Failed> {
    let ends = [
        MAX_INITIAL_RAYS,
        MAX_CANDIDATES,
        MAX_TILES,
        MAX_TILE_SIZE,
        MAX_SHADED,
        MAX_SPATIAL_PASSES,
        MAX_NEIGHBOURS,
        MAX_CONFIDENCE_CAP,
        MAX_GLOSS_RENEWAL,
    ];
    ensure(ends == [64, 1024, 1024, 32768, 128, 8, 7, 255, 15], || {
        format!("the largest settings are others: {ends:?}")
    })?;
    let of_paths = [MAX_PATH_PASSES, MAX_PATH_NEIGHBOURS, MAX_PATH_CAP, MAX_DEPTH];
    ensure(of_paths == [4, 8, 255, 63], || format!("the largest settings of restir-pt are others: {of_paths:?}"))?;
    largest_in(executor, "restir-di", text, &BEYOND)
}

/// A pixel's own reservoir counts for its rounds of candidates: one less than the setting asks for, or than keep the pixel within the
/// limits of rays, of candidates and of its tile, for a little of each history is left; one where there is no history, though a lens sees from many places.
fn rounds_of_candidates() -> Result<(), Failed> {
    let scene = buffers("moving")?;
    for (text, expected) in [
        (MOST_ROUNDS.to_owned(), 15),
        (format!("{MOST_ROUNDS},initial_rays=16"), 3),
        (format!("{MOST_ROUNDS},candidates=300"), 2),
        (format!("{MOST_ROUNDS},tiles=3x200"), 2),
        (format!("{MOST_ROUNDS},candidates=1024,initial_rays=64"), 1),
        (format!("{MOST_ROUNDS},gloss_renewal=0"), 1),
        (format!("{MOST_ROUNDS},temporal=off"), 1),
    ] {
        let lens = |camera: &Camera| Camera { lens_radius: 0.05, ..*camera };
        let cameras = frames(settings("")).cameras.iter().map(lens).collect();
        let render = Render { count: 3, cameras, ..frames(settings(&text)) };
        let mut most = 0.0_f32;
        CpuExecutor::new()?.run_observed(plan(&scene, &render), &mut |step| {
            if step.pass.kernel.name == di_initial::DESC.name {
                let reservoirs = step.plane::<PackedReservoir>("reservoirs")?;
                most = reservoirs.iter().map(|&word| Stored::unpack(word).confidence).fold(most, f32::max);
            }
            Ok(())
        })?;
        ensure(most as u32 == expected, || format!("{text}: {most} rounds, not {expected}"))?;
    }
    Ok(())
}

/// Frames with the settings are rendered with the same bits everywhere, and settings beyond are refused.
fn largest_in(executor: &mut dyn Executor, name: &str, text: &str, beyond: &[(&str, &str)]) -> Result<(), Failed> {
    let trials = Trials::of(name)?;
    let render = Render { count: 3, cameras: frames(settings("")).cameras, ..Render::new([7, 5], trials.with(text)?) };
    let host = film(plan(&buffers("moving")?, &render))?;
    let finite = host.iter().all(|pixel| pixel.dropped == 0.0 && pixel.sum.iter().all(|x| x.is_finite()));
    ensure(finite && host.iter().any(|pixel| pixel.sum[1] > 0.0), || format!("{text}: no picture"))?;
    for (key, value) in beyond {
        let mut beyond = Render { technique: trials.technique.clone(), ..render.clone() };
        let refused = beyond.technique.set(key, value).is_err() || beyond.check(&buffers("moving")?).is_err();
        ensure(refused, || format!("{key}={value} is taken"))?;
    }
    same_on_device(executor, render)
}

fn same_on_device(executor: &mut dyn Executor, render: Render) -> Result<(), Failed> {
    same_on_device_in(executor, "moving", render)
}

/// Light that comes round a corner, seen by a camera that moves.
fn light_from_next_door(executor: &mut dyn Executor, technique: Box<dyn Technique>) -> Result<(), Failed> {
    let (camera, size) = (buffers("ajar")?.camera, [12, 8]);
    let step = |frame: u32| DVec3::X * (0.02 * f64::from(frame));
    let cameras = (0..16).map(|frame| Camera { position: camera.position + step(frame), ..camera }).collect();
    let render = Render { count: 16, accumulate: true, seed: 3, cameras, ..Render::new(size, technique) };
    same_on_device_in(executor, "ajar", render)
}

fn same_on_device_in(executor: &mut dyn Executor, scene: &str, render: Render) -> Result<(), Failed> {
    let scene = buffers(scene)?;
    render.check(&scene)?;
    let host = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
    let found = first_divergence(executor, plan(&scene, &render), &host)?;
    found.map_or(Ok(()), |divergence| Err(divergence.to_string().into()))
}

/// One bit in what a frame uploads, and one random number in a pass: each is found in the pass, the buffer and the word that
/// it is in, also where the last picture has nothing of it.
fn what_differs_is_found() -> Result<(), Failed> {
    const FRAME: u32 = 5;
    let (scene, mut cpu) = (buffers("moving")?, CpuExecutor::new()?);
    let render = Render { count: FRAME + 2, accumulate: false, ..frames(settings("preset=quality")) };
    let host = trace(&mut cpu, plan(&scene, &render))?;
    let same = first_divergence(&mut cpu, plan(&scene, &render), &host)?;
    ensure(same.is_none(), || format!("a run differs from itself: {same:?}"))?;
    let mut divergence = |change: Change| {
        first_divergence(&mut cpu, changed(plan(&scene, &render), change), &host)?
            .ok_or_else(|| Failed::from("nothing differs"))
    };
    let flipped = divergence(|pass| {
        let is_frame = pass.params::<DiParams>().is_some_and(|p| p.frame == FRAME);
        let uploads = pass.frame.as_mut().filter(|_| is_frame).map(|frame| &mut frame.uploads);
        if let Some(upload) = uploads.and_then(|uploads| uploads.last_mut()) {
            let mut words = upload.words.to_vec();
            words[6] ^= 1 << 20;
            upload.words = words.into();
        }
    })?;
    println!("one bit: {flipped}");
    let at = (flipped.frame, flipped.kernel, flipped.difference.buffer, flipped.difference.word, flipped.differing);
    ensure(at == (FRAME, di_primary::DESC.name, "attributes", 2, 1), || format!("one bit: {flipped}"))?;
    ensure(flipped.difference.host ^ flipped.difference.device == 1 << 20, || format!("one bit: {flipped}"))?;
    let reseeded = divergence(|pass| {
        edit_temporal(pass, |params| params.seed += u32::from(params.frame == FRAME));
    })?;
    println!("another seed: {reseeded}");
    let at = (reseeded.frame, reseeded.kernel, reseeded.difference.buffer);
    ensure(at == (FRAME, di_combine::DESC.name, "reservoirs") && reseeded.pixel.is_some(), || {
        format!("another seed: {reseeded}")
    })
}

/// The wide trees of both frames, or the arenas that hold both.
fn any_tracer_gives_the_same(scene: &str) -> Result<(), Failed> {
    let (scene, render) = (buffers(scene)?, frames(settings("preset=quality")));
    let wide = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
    let in_arenas = FramePlan { scene: None, ..changed(plan(&scene, &render), by_arenas) };
    let found = first_divergence(&mut CpuExecutor::with_threads(1)?, in_arenas, &wide)?;
    ensure(found.is_none(), || format!("{found:?}"))?;
    let film = wide.last().and_then(|buffers| buffers.last());
    ensure(film.is_some_and(|film| film.iter().any(|word| *word != 0)), || "the picture is black".to_owned())
}

fn a_still_scene_pays_nothing() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let render = Render { count: 4, ..Render::new([4, 4], DiSettings::default()) };
    let plan = plan(&scene, &render);
    let arenas = [&scene.geometry, &scene.attributes, &scene.texels].map(|words| words.len());
    ensure(plan.buffers.iter().take(3).map(|buffer| buffer.words).eq(arenas), || "an arena has grown".to_owned())?;
    for pass in plan.passes {
        ensure(pass?.frame.is_none(), || "a frame of a still scene".to_owned())?;
    }
    Ok(())
}

/// A scene whose frames are tested for bias.
struct Subject {
    name: &'static str,
    /// Frames in a unit of its time.
    frame_rate: f64,
    reference: OnceLock<Vec<Moments>>,
}

static MOVING: Subject = Subject { name: "moving", frame_rate: 1.0, reference: OnceLock::new() };
static ALPHA: Subject = Subject { name: "moving-alpha", frame_rate: 1.0, reference: OnceLock::new() };
/// So few that its meshes deform visibly from one to the next.
static TOYS: Subject = Subject { name: "toys", frame_rate: 6.0, reference: OnceLock::new() };

impl Subject {
    fn buffers(&self) -> Result<SceneBuffers, Failed> {
        let mut scene = named(self.name).map_or_else(|| Scene::load(self.name), Ok)?;
        scene.animation.frame_rate = self.frame_rate;
        Ok(SceneBuffers::build(&scene)?)
    }
}

/// Direct light at the time of the last frame, by path tracing.
fn reference(subject: &'static Subject, scene: &SceneBuffers) -> Result<&'static [Moments], Failed> {
    let moved = scene.at(f64::from(LAST_FRAME))?;
    let params = PathParams { seed: REFERENCE_SEED, ..path_params(&moved, [GRID.width, GRID.height], 2) };
    Ok(subject.reference.get_or_init(|| path_moments(GRID, draws(REFERENCE_RESTARTS), &moved.traced_view(), params)))
}

/// The last frame of independent chains.
fn against_path_tracing(
    subject: &'static Subject,
    name: &str,
    text: &str,
    change: Change,
    biased: bool,
) -> Result<(), Failed> {
    let scene = subject.buffers()?;
    let settings = settings(&format!("candidates=4,neighbours=2,{text}"));
    let restarts = if biased { GROSS } else { draws(RESTARTS) };
    let chains = film_moments(GRID, restarts, |seed| {
        let size = [GRID.width, GRID.height];
        let render = Render { count: LAST_FRAME + 1, seed, ..Render::new(size, settings.clone()) };
        film(changed(plan(&scene, &render), change))
    })?;
    let verdict = TileTest { grid: GRID, family_rate: FAMILY_RATE }.compare(&chains, reference(subject, &scene)?);
    if biased { ensure_biased(name, &verdict) } else { ensure_unbiased(name, &verdict, f64::INFINITY) }
}

/// What is done to the passes.
type Change = fn(&mut Pass);

/// Scene, name, settings, what is done, and whether that is wrong.
static VARIANTS: [(&Subject, &str, &str, Change, bool); 10] = [
    (&MOVING, "is unbiased", "", |_| (), false),
    (&MOVING, "is unbiased where the history of gloss fades at once", "gloss_fade=1e6", |_| (), false),
    (&TOYS, "is unbiased", "", |_| (), false),
    (&TOYS, "is biased by the last frame seen in this one's geometry", "", in_this_geometry, true),
    (&MOVING, "is biased by the last frame seen in this one's geometry", "", in_this_geometry, true),
    (&MOVING, "is biased by lights that are taken for others", "", without_translation, true),
    (&MOVING, "is unbiased with tiles", "tiles=4x256", |_| (), false),
    (&MOVING, "is biased by the last frame's tiles", "tiles=4x256", without_new_tiles, true),
    (&ALPHA, "is unbiased", "", |_| (), false),
    (&ALPHA, "is biased by the last frame seen in this one's geometry", "", in_this_geometry, true),
];

/// All candidates but one are those of the frame before.
fn without_new_tiles(pass: &mut Pass) {
    if pass.kernel.name == di_tiles::DESC.name {
        edit(pass, |params: &mut TileParams| {
            if params.frame == LAST_FRAME {
                (params.tile_size, params.tiles) = (1, 1);
            }
        });
        pass.grid = pass.params::<TileParams>().map_or(pass.grid, |params| params.extent());
    }
}

fn edit_temporal(pass: &mut Pass, change: impl Fn(&mut DiParams)) {
    edit(pass, |params: &mut DiParams| {
        if params.flags.contains(Flags::OTHER_FRAME) {
            change(params);
        }
    });
}

/// Rays are traced in the arenas, as the parameters have it.
fn by_arenas(pass: &mut Pass) {
    pass.frame.iter_mut().for_each(|frame| frame.scenes = None);
}

fn in_this_geometry(pass: &mut Pass) {
    by_arenas(pass);
    edit_temporal(pass, |params| {
        let SceneHeader { light_base, alias_base, light_count, punctual_base, material_base, counterpart_base, .. } =
            params.other_scene;
        params.other_scene = SceneHeader {
            light_base,
            alias_base,
            light_count,
            punctual_base,
            material_base,
            counterpart_base,
            ..params.scene
        };
    });
}

/// Where lights come back, so that the indices of the last frame's are in range.
fn without_translation(pass: &mut Pass) {
    edit_temporal(pass, |params| {
        if params.other_scene.light_count < params.scene.light_count {
            params.other_scene.counterpart_base = NONE;
        }
    });
}
