//! ReSTIR DI through clear glass: what arrives is tinted, and is what integration says; where there is no glass nothing
//! changes.
//!
//! Tests of expectations have fixed seeds: a failure is a bug.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::replay::Recording;
use restir_host::technique::restir_di::DiSettings;
use restir_shared::bsdf::{Bsdf, Material, SPECULAR_TRANSMISSION};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::layout::FEATURES_ALL;
use restir_shared::num;
use restir_shared::resample::packed::LEVELS;
use restir_shared::scene::{AnyScene, LightAddress};
use restir_shared::technique::restir_di::{Stored, dithered};
use restir_shared::vec::{length, luminance};
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::native::{film, film_over, plan};
use restir_tests::panes::{Panes, stack, through_first};
use restir_tests::random::SplitMix;
use restir_tests::scenes::{self, path_params};
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_di::settings;
use restir_tests::wrong::{Fault, Faulty};
use std::sync::OnceLock;

/// How often a z-test of equal expectations, over tiles, channels and the image, fails.
const FAMILY_RATE: f64 = 1.0e-3;
const SIZE: [u32; 2] = [16, 16];
const GRID: TileGrid = TileGrid { width: SIZE[0], height: SIZE[1], tile: 4 };
const TEST: TileTest = TileTest { grid: GRID, family_rate: FAMILY_RATE };
const FRAMES: u32 = 3;
const RESTARTS: u32 = 1_536;
/// Chains of a test that is to see something wrong.
const GROSS: u32 = 128;
/// Images of the reference, of one point on a light a pixel.
const REFERENCE: u32 = 16_384;
/// Images of the path tracer, whose light through glass is found by scattering alone.
const PATHS: u32 = 8_192;
/// A bias of the image's mean that must be noticed with 99 % probability.
const GOAL_IMAGE: f64 = 0.045;
const BOTH: Panes = Panes { coloured: true, count: 2 };
const FULL: Stored = Stored {
    sample: LightAddress { light: 1, u: 2, v: 3 },
    contribution_weight: 1.0,
    confidence: 1.0,
    visibility: Vec3::ONE,
};

restir_tests::suite! {
    later {
        the_reference_agrees_with_paths every_use_of_visibility_is_unbiased averages_keep_the_colour_of_glass
        averages_by_channel_do_not_leak wrong_glass_is_seen what_goes_straight_is_what_the_bsdf_transmits
        twelve_sheets_pass_and_thirteen_do_not stored_colours_keep_their_mean without_glass_nothing_changes
    }
}

/// Integration of the light through both panes.
fn reference() -> &'static [Moments] {
    static REFERENCE_MOMENTS: OnceLock<Vec<Moments>> = OnceLock::new();
    REFERENCE_MOMENTS.get_or_init(|| BOTH.reference(GRID, draws(REFERENCE)))
}

fn render(settings: &DiSettings, frames: u32, seed: u32) -> Render {
    Render { count: frames, seed, ..Render::new(SIZE, settings.clone()) }
}

/// Moments of the last frames of chains: short ones, of few neighbours.
fn moments<S: AnyScene + Sync>(
    scene: &S,
    buffers: &SceneBuffers,
    text: &str,
    restarts: u32,
) -> Result<Vec<Moments>, Failed> {
    let settings = settings(&format!("{SMALL},{text}"));
    film_moments(GRID, restarts, |seed| film_over(scene, plan(buffers, &render(&settings, FRAMES, seed))))
}

const SMALL: &str = "candidates=8,neighbours=3,radius=5,confidence_cap=3,max_plane_distance=1000";

fn the_reference_agrees_with_paths() -> Result<(), Failed> {
    // behind one pane, paths of three segments hit the wall once
    let one = Panes { coloured: true, count: 1 };
    let buffers = SceneBuffers::build(&one.scene())?;
    let view = buffers.traced_view();
    let paths = path_moments(GRID, draws(PATHS), &view, path_params(&buffers, SIZE, 3));
    ensure_unbiased("paths", &TEST.compare(&paths, &one.reference(GRID, draws(REFERENCE))), f64::INFINITY)
}

/// Every way in which settings use visibility without bias.
const UNBIASED: [&str; 10] = [
    FINAL_RAY,
    "mis=talbot,still=off,scatter=off,visibility_reuse=off,visibility=ray,spatial=0",
    IN_WEIGHTS,
    "mis=contribution,still=off,visibility_reuse=weights,visibility=ray,shaded=0",
    "mis=1/z,still=off,visibility_reuse=weights,visibility=ray,shaded=0",
    IN_TARGET,
    "initial_rays=2",
    "still=off,temporal=fused,shaded=0",
    SELECTED,
    "mis=talbot,still=off,scatter=off,visibility_reuse=off,temporal=off,shaded=2",
];
const FINAL_RAY: &str = "mis=talbot,still=off,scatter=off,visibility_reuse=off,visibility=ray,shaded=0";
const IN_WEIGHTS: &str = "mis=talbot,still=off,visibility_reuse=weights,visibility=ray,shaded=0";
/// The default settings, but for what they know of a still view.
const IN_TARGET: &str = "still=off";
const SELECTED: &str = "mis=talbot,still=off,scatter=off,visibility_reuse=off,spatial=0,shaded=0";

fn every_use_of_visibility_is_unbiased() -> Result<(), Failed> {
    let test = TileTest { family_rate: FAMILY_RATE / UNBIASED.len() as f64, ..TEST };
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    UNBIASED.iter().try_for_each(|text| {
        let moments = moments(&buffers.traced_view(), &buffers, text, draws(RESTARTS))?;
        ensure_unbiased(text, &test.compare(&moments, reference()), bound(GOAL_IMAGE))
    })
}

/// Tokuyoshi's estimate, unbiased: no visibility but in shading; over time, or once in space.
const AVERAGED: [&str; 2] = [
    "mis=talbot,visibility=averaged,scatter=off,visibility_reuse=off,shaded=0,spatial=0",
    "mis=talbot,visibility=averaged,scatter=off,visibility_reuse=off,shaded=0,temporal=off",
];

/// White lights: over one target for all channels the mean visibility is that of each.
fn averages_keep_the_colour_of_glass() -> Result<(), Failed> {
    let white = Panes { coloured: false, ..BOTH };
    let buffers = SceneBuffers::build(&white.scene())?;
    let view = buffers.traced_view();
    let reference = white.reference(GRID, draws(REFERENCE));
    let test = TileTest { family_rate: FAMILY_RATE / AVERAGED.len() as f64, ..TEST };
    for text in AVERAGED {
        let right = moments(&view, &buffers, text, draws(RESTARTS))?;
        ensure_unbiased(text, &test.compare(&right, &reference), bound(GOAL_IMAGE))?;
        let grey = moments(&Faulty { scene: view, fault: GREY }, &buffers, text, GROSS)?;
        ensure_biased(&format!("glass without colour, {text}"), &test.compare(&grey, &reference))?;
    }
    Ok(())
}

/// Coloured lights leak, unless each channel has its own target.
fn averages_by_channel_do_not_leak() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    let of = |target| {
        moments(&buffers.traced_view(), &buffers, &format!("{},target={target}", AVERAGED[0]), draws(RESTARTS))
    };
    let channels = [of("red")?, of("green")?, of("blue")?];
    let own: Vec<Moments> = (0..reference().len()).map(|i| channels[i % 3][i]).collect();
    ensure_unbiased("by channel", &TEST.compare(&own, reference()), f64::INFINITY)
}

/// Glass dims by its luminance, in all channels.
const GREY: Fault = Fault {
    surface: |point, _| {
        if point.material.transmission > 0.0 {
            point.material.base_color = Vec3::splat(luminance(point.material.base_color));
        }
    },
    ..Fault::NONE
};
/// Glass reflects nothing.
const COATED: Fault = Fault {
    surface: |point, _| {
        if point.material.transmission > 0.0 {
            point.material.ior = 1.0;
        }
    },
    ..Fault::NONE
};

fn wrong_glass_is_seen() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    let view = buffers.traced_view();
    for text in [FINAL_RAY, IN_WEIGHTS, IN_TARGET, SELECTED] {
        let opaque = format!("{text},transmittance=off");
        let rows = [("grey", GREY, text), ("coated", COATED, text), ("opaque", Fault::NONE, opaque.as_str())];
        for (what, fault, text) in rows {
            let moments = moments(&Faulty { scene: view, fault }, &buffers, text, GROSS)?;
            ensure_biased(&format!("{what} glass, {text}"), &TEST.compare(&moments, reference()))?;
        }
    }
    Ok(())
}

/// Over angles, indices, tints and shares: weight times probability of the perfect lobe.
fn what_goes_straight_is_what_the_bsdf_transmits() -> Result<(), Failed> {
    let mut random = SplitMix::new(3);
    let mut unit = || random.unit() as f32;
    let mut compared = 0;
    for _ in 0..20_000 {
        let material = Material {
            base_color: Vec3::new(unit(), unit(), unit()),
            metallic: if unit() < 0.5 { 0.0 } else { unit() },
            roughness: 0.0,
            ior: 1.0 + unit(),
            transmission: unit(),
            thin: true,
            ..Material::diffuse(Vec3::ONE)
        };
        let cos = 0.001 + 0.999 * unit();
        let wo = Vec3::new(num::sqrt(1.0 - cos * cos), 0.0, cos);
        // of the specular lobes, by their choices' upper end the transmission
        let sample = Bsdf::new(&material, wo, true, FEATURES_ALL).sample(UVec4::new(0, 0, u32::MAX, u32::MAX));
        if sample.pdf == 0.0 || sample.lobe != SPECULAR_TRANSMISSION {
            continue;
        }
        compared += 1;
        let (lobe, straight) = (sample.weight * sample.pdf, material.straight(cos));
        let close = (lobe - straight).abs().max_element() <= 1.0e-5 * straight.max_element();
        ensure(close && sample.delta, || format!("{lobe} through {material:?} at {cos}, and straight {straight}"))?;
        ensure(length(sample.direction + wo) < 1.0e-6, || "it does not go straight".to_owned())?;
        let rough = Material { roughness: 0.1, ..material };
        let thick = Material { thin: false, ..material };
        ensure(rough.straight(cos) == Vec3::ZERO && thick.straight(cos) == Vec3::ZERO, || format!("{material:?}"))?;
    }
    ensure(compared > 19_000, || format!("only {compared} samples"))
}

/// The brightest pixel, of a wall under a stack of panes, over that without.
fn twelve_sheets_pass_and_thirteen_do_not() -> Result<(), Failed> {
    let brightest = |count: u32| -> Result<[f64; 3], Failed> {
        let buffers = SceneBuffers::build(&stack(count))?;
        let film = film(plan(&buffers, &Render { count: 2, seed: 1, ..Render::new([1, 1], DiSettings::default()) }))?;
        Ok(film[0].sum.map(f64::from))
    };
    let free = brightest(0)?;
    for count in [1_u32, 2, 12] {
        let through = brightest(count)?;
        for (channel, first) in through_first().into_iter().enumerate() {
            let (expected, found) = (first.powi(count as i32), through[channel] / free[channel]);
            ensure((found / expected - 1.0).abs() < 1.0e-5, || format!("{count} sheets: {found} for {expected}"))?;
        }
    }
    ensure(brightest(13)? == [0.0; 3], || "thirteen sheets pass".to_owned())
}

/// A reservoir's coloured visibility, over random numbers, and what it is in the end.
fn stored_colours_keep_their_mean() -> Result<(), Failed> {
    const DRAWS: u32 = 4096;
    const STEP: f64 = 1.0 / LEVELS as f64;
    let mut random = SplitMix::new(4);
    for _ in 0..100 {
        let wanted = Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32);
        let mut means = [Moments::default(); 3];
        for _ in 0..DRAWS {
            let stored = Stored { visibility: dithered(wanted, random.unit() as f32), ..FULL };
            let kept = Stored::unpack(stored.pack()).visibility;
            ensure(kept == stored.visibility, || format!("{stored:?} became {kept}"))?;
            ensure((kept - wanted).abs().max_element() < 1.0 / LEVELS, || format!("{kept} for {wanted}"))?;
            means.iter_mut().zip(kept.to_array()).for_each(|(mean, x)| mean.push(f64::from(x)));
        }
        // 300 means, false alarms: 1 in 5000 within 4.9 standard errors each
        for (mean, wanted) in means.iter().zip(wanted.to_array()) {
            let z = (mean.mean() - f64::from(wanted)) / mean.standard_error().max(STEP / f64::from(DRAWS));
            ensure(z.abs() < 4.9, || format!("{wanted} became {} on average, z {z}", mean.mean()))?;
        }
    }
    for ends in [Vec3::ZERO, Vec3::ONE, Vec3::new(1.0, 0.0, 1.0), Vec3::splat(0.3)] {
        let kept = (0..100).all(|_| dithered(ends, random.unit() as f32) == ends);
        ensure(kept, || format!("{ends} does not stay"))?;
    }
    Ok(())
}

/// The films have the same bits and cost the same queries.
fn without_glass_nothing_changes() -> Result<(), Failed> {
    let buffers = scenes::buffers("all-lights")?;
    let view = buffers.view();
    for preset in DiSettings::PRESETS.iter().filter_map(|name| DiSettings::preset(name)) {
        let of = |transmittance| -> Result<_, Failed> {
            let recording = Recording::new(&view);
            let settings = DiSettings { transmittance, ..preset.clone() };
            let film = film_over(&recording, plan(&buffers, &render(&settings, 2, 2)))?;
            Ok((film.iter().map(|p| p.sum.map(f32::to_bits)).collect::<Vec<_>>(), recording.counts()))
        };
        ensure(of(true)? == of(false)?, || format!("{preset:?}"))?;
    }
    Ok(())
}
