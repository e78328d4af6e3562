//! ReSTIR SSS where light goes far in relation to a body, or hardly anywhere: the mean is that of path tracing, and at the ends of what scenes can hold
//! frames have numbers, the same on every device.

use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::technique::Technique;
use restir_tests::bias::ensure_unbiased;
use restir_tests::bodies;
use restir_tests::device;
use restir_tests::lockstep::{first_divergence, trace};
use restir_tests::native::plan;
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{FAMILY_RATE, Moments, TileGrid, TileTest};
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::Trials;

const GRID: TileGrid = TileGrid { width: 24, height: 18, tile: 6 };
/// Enough for a history that has a history. What is compared is the mean of all.
const FRAMES: u32 = 6;
/// Of each row; a draw is a restart of so many frames, or of so many samples of the reference.
const DRAWS: u32 = 2048;
const SAMPLES: u32 = 12;
/// Mean free paths in diameters, settings, and the bias of the image that all draws notice with [`POWER`](restir_tests::stats::POWER): fewer notice
/// one that is larger by the root. `cargo lab unbiased --cell restir-sss/ball-0.1 --goal 0.5` (10 min) excludes less.
const ROWS: [(f32, &str, f64); 6] = [
    (1.0e-3, "", 0.02),
    (1.0e-3, LAMBERTIAN, 0.002),
    (1.0e-2, "", 0.02),
    (0.1, "", 0.02),
    (1.0, "", 0.025),
    (10.0, "", 0.06),
];
/// All that is less than some pixels stays where it enters, here all channels.
const LAMBERTIAN: &str = "lambert_below=3.4";
/// Beyond what is compared: the smallest and the largest.
const BEYOND: [(f32, &str); 3] = [(1.0e-6, ""), (1.0e-6, LAMBERTIAN), (1.0e3, "")];

pub(crate) fn trials() -> Vec<Trial> {
    let compared = ROWS.map(|(diameters, settings, noticed)| {
        let title = format!("light that flies {diameters:e} diameters, {settings}: the mean of path tracing");
        Trial::test(title, move || is_path_tracing(diameters, settings, noticed))
    });
    let mut trials: Vec<Trial> = compared.into_iter().collect();
    trials.extend(BEYOND.map(|(diameters, settings)| {
        let title = format!("light that flies {diameters:e} diameters, {settings}: numbers");
        Trial::test(title, move || has_numbers(diameters, settings))
    }));
    trials.extend(device::trials(|adapter| {
        let rows = ROWS.map(|(diameters, settings, _)| (diameters, settings)).into_iter().chain(BEYOND);
        let trial = |(diameters, settings)| {
            let title = format!("light that flies {diameters:e} diameters, {settings}");
            adapter.trial(&title, move |executor| is_the_same(executor, diameters, settings))
        };
        rows.map(trial).collect()
    }));
    trials
}

fn buffers(diameters: f32) -> Result<SceneBuffers, Failed> {
    Ok(SceneBuffers::build(&bodies::ball(diameters))?)
}

fn technique(name: &str, texts: &[&str]) -> Result<Box<dyn Technique>, Failed> {
    Ok(Trials::of(name)?.with(&[&["max_depth=3,jitter=off"], texts].concat().join(","))?)
}

/// The images of so many renders, whose seeds begin there.
fn moments(scene: &SceneBuffers, render: &Render, first: u32, restarts: u32) -> Result<Vec<Moments>, Failed> {
    let picture = |restart| {
        let render = Render { seed: first + restart, ..render.clone() };
        let rendered = render.render(scene, &mut CpuExecutor::inline())?;
        ensure(rendered.dropped_samples == 0, || "samples were dropped".to_owned())?;
        Ok::<_, Failed>(rendered.image.pixels.iter().map(|pixel| pixel.map(f64::from)).collect())
    };
    let all: Vec<Vec<[f64; 3]>> = (0..restarts).into_par_iter().map(picture).collect::<Result<_, _>>()?;
    Ok(GRID.moments_of(&all))
}

fn is_path_tracing(diameters: f32, settings: &str, noticed: f64) -> Result<(), Failed> {
    let (scene, size) = (buffers(diameters)?, [GRID.width, GRID.height]);
    let restarts = draws(DRAWS);
    let frames = Render { count: FRAMES, accumulate: true, ..Render::new(size, technique("restir-sss", &[settings])?) };
    let path = technique("path", &["subsurface=diffusion,profile_paths=off", settings])?;
    let samples = Render { count: SAMPLES, ..Render::new(size, path) };
    let [found, reference] =
        [(&frames, 0), (&samples, 1 << 31)].map(|(render, first)| moments(&scene, render, first, restarts));
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE / ROWS.len() as f64 };
    ensure_unbiased(&format!("{diameters:e}, {settings}"), &test.compare(&found?, &reference?), bound(noticed))
}

fn frames(settings: &str, preset: &str) -> Result<Render, Failed> {
    let preset = format!("preset={preset}");
    Ok(Render { count: FRAMES, seed: 4, ..Render::new([12, 9], technique("restir-sss", &[&preset, settings])?) })
}

const PRESETS: [&str; 6] = ["hybrid", "reconnection", "delayed", "sequential", "pathtracing", "published"];

fn has_numbers(diameters: f32, settings: &str) -> Result<(), Failed> {
    let scene = buffers(diameters)?;
    for preset in PRESETS {
        let render = Render { count: 32, ..frames(settings, preset)? };
        let rendered = render.render(&scene, &mut CpuExecutor::inline())?;
        let values = rendered.image.pixels.as_flattened();
        let sound = values.iter().all(|value| value.is_finite() && *value >= 0.0);
        ensure(sound && rendered.dropped_samples == 0, || format!("{preset}: {:?}", rendered.image))?;
    }
    Ok(())
}

fn is_the_same(executor: &mut dyn Executor, diameters: f32, settings: &str) -> Result<(), Failed> {
    let scene = buffers(diameters)?;
    for preset in ["hybrid", "sequential"] {
        let render = frames(settings, preset)?;
        let host = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
        if let Some(divergence) = first_divergence(executor, plan(&scene, &render), &host)? {
            return Err(format!("{preset}: {divergence}").into());
        }
    }
    Ok(())
}
