//! Lamps that lie in other surfaces: all techniques see the same of them, and what scattering finds alone.
//!
//! Tests of expectations have fixed seeds: a failure is a bug.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_shared::technique::path::PathParams;
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::coincident::{ARRANGEMENTS, as_they_are};
use restir_tests::native::{film, plan};
use restir_tests::scenes::path_params;
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::suite::ensure;
use restir_tests::technique::configured;
use restir_tests::wrong::{Fault, Faulty};

const SIZE: [u32; 2] = [16, 16];
const GRID: TileGrid = TileGrid { width: SIZE[0], height: SIZE[1], tile: 4 };
/// How often a comparison of equal images fails, over tiles, channels and the image.
const TEST: TileTest = TileTest { grid: GRID, family_rate: 1.0e-4 };
const DEPTH: u32 = 3;
const PATHS: u32 = 32_768;
const CHAINS: u32 = 8_192;
const FRAMES: u32 = 2;
/// Chains of a test that is to see something wrong.
const GROSS: u32 = 512;
/// A bias of the image's mean that is noticed with 99 % probability.
const GOAL: f64 = 0.02;
const OTHER_SEED: u32 = 1 << 31;

restir_tests::suite! {
    later { all_techniques_see_the_same surfaces_that_stay_where_they_are_are_seen lamps_shine_from_where_they_are }
}

const TECHNIQUES: [(&str, &str); 3] = [
    ("restir-di", "candidates=4,neighbours=2,radius=4,max_plane_distance=1000"),
    ("restir-pt", "max_depth=3,tile=8,neighbours=2,max_plane_distance=1000"),
    ("restir-pt", "max_depth=3,shift=reconnection,temporal=off,max_plane_distance=1000"),
];

/// No light is sampled.
const SCATTERING_ALONE: Fault = Fault { light: |light| light.density = 0.0, density: |_| 0.0, ..Fault::NONE };

fn params(buffers: &SceneBuffers, depth: u32, seed: u32) -> PathParams {
    PathParams { seed, ..path_params(buffers, SIZE, depth) }
}

fn by_scattering(buffers: &SceneBuffers, depth: u32) -> Vec<Moments> {
    let scene = Faulty { scene: buffers.traced_view(), fault: SCATTERING_ALONE };
    path_moments(GRID, draws(2 * PATHS), &scene, params(buffers, depth, OTHER_SEED))
}

fn by_paths(buffers: &SceneBuffers, depth: u32, count: u32) -> Vec<Moments> {
    path_moments(GRID, count, &buffers.traced_view(), params(buffers, depth, 0))
}

fn by_chains(buffers: &SceneBuffers, (name, settings): (&str, &str), count: u32) -> Result<Vec<Moments>, Failed> {
    let render = Render { count: FRAMES, ..Render::new(SIZE, configured(name, settings)?) };
    film_moments(GRID, count, |seed| film(plan(buffers, &Render { seed, ..render.clone() })))
}

/// By samples of lights and by resampling, in both orders of the file, against what scattering finds alone.
fn all_techniques_see_the_same() -> Result<(), Failed> {
    for arrangement in ARRANGEMENTS {
        for reversed in [false, true] {
            let buffers = SceneBuffers::build(&arrangement.scene(reversed))?;
            let what = |technique: &str| format!("{arrangement:?}, reversed: {reversed}, {technique}");
            let [direct, longer] = [2, DEPTH].map(|depth| by_paths(&buffers, depth, draws(PATHS)));
            let verdict = TEST.compare(&by_scattering(&buffers, DEPTH), &longer);
            ensure_unbiased(&what("scattering alone"), &verdict, bound(GOAL))?;
            for technique in TECHNIQUES {
                let expected = if technique.0 == "restir-di" { &direct } else { &longer };
                let verdict = TEST.compare(&by_chains(&buffers, technique, draws(CHAINS))?, expected);
                ensure_unbiased(&what(technique.0), &verdict, bound(GOAL))?;
            }
        }
    }
    Ok(())
}

/// Of surfaces that lie in each other samples of lights find both, and scattering one.
fn surfaces_that_stay_where_they_are_are_seen() -> Result<(), Failed> {
    for arrangement in ARRANGEMENTS {
        let buffers = as_they_are(&arrangement.scene(false))?;
        let expected = by_scattering(&buffers, 2);
        let what = |technique: &str| format!("{arrangement:?} as it is, {technique}");
        ensure_biased(&what("path"), &TEST.compare(&by_paths(&buffers, 2, 2 * GROSS), &expected))?;
        let verdict = TEST.compare(&by_chains(&buffers, TECHNIQUES[0], GROSS)?, &expected);
        ensure_biased(&what(TECHNIQUES[0].0), &verdict)?;
    }
    Ok(())
}

/// In front of what does not emit, and of lamps that come later; nowhere else.
fn lamps_shine_from_where_they_are() -> Result<(), Failed> {
    for arrangement in ARRANGEMENTS {
        for reversed in [false, true] {
            let buffers = SceneBuffers::build(&arrangement.scene(reversed))?;
            let image = by_paths(&buffers, 2, 64);
            let [red, green] = [0, 1].map(|of| image.iter().skip(of).step_by(3).map(Moments::mean).sum::<f64>());
            // a lamp alone has eight times as much of its own colour
            let [is_red, is_green] = [red > 7.9 * green, green > 7.9 * red];
            let right = match arrangement.brightest(reversed) {
                Some(0) => is_red,
                Some(_) => is_green,
                None => !is_red && !is_green,
            };
            ensure(right, || format!("{arrangement:?}, reversed: {reversed}: red {red}, green {green}"))?;
            let named = buffers.stats().coincident_lamps;
            ensure(!named.is_empty(), || format!("{arrangement:?} is not named"))?;
        }
    }
    Ok(())
}
