//! ReSTIR DI through clear glass: what arrives is tinted, and is what integration says; where there is no glass nothing
//! changes.
//!
//! Tests of expectations have fixed seeds: a failure is a bug.

use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::replay::Recording;
use restir_host::technique::restir_di::{DiSettings, Target, Temporal, Visibility, VisibilityReuse};
use restir_shared::bsdf::{Bsdf, Material, SPECULAR_TRANSMISSION};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::layout::{FEATURES_ALL, FilmPixel};
use restir_shared::num;
use restir_shared::resample::mis::Mis;
use restir_shared::resample::packed::LEVELS;
use restir_shared::scene::{AnyScene, LightAddress, SurfacePoint};
use restir_shared::technique::path;
use restir_shared::technique::path::PathParams;
use restir_shared::technique::restir_di::{Stored, dithered};
use restir_shared::vec::{length, luminance};
use restir_tests::native::{film, film_over, plan};
use restir_tests::panes::{Panes, stack, through_first};
use restir_tests::random::SplitMix;
use restir_tests::scenes::named;
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::suite::ensure;
use restir_tests::wrong::{Fault, Faulty};
use std::sync::OnceLock;

/// How often a z-test of equal expectations, over tiles, channels and the image, fails.
const FAMILY_RATE: f64 = 1.0e-3;
const SIZE: [u32; 2] = [16, 16];
const GRID: TileGrid = TileGrid { width: SIZE[0], height: SIZE[1], tile: 4 };
const TEST: TileTest = TileTest { grid: GRID, family_rate: FAMILY_RATE };
const FRAMES: u32 = 3;
const RESTARTS: u32 = 384;
/// Chains of a test that is to see something wrong.
const GROSS: u32 = 128;
/// Images of the reference, of one point on a light a pixel.
const REFERENCE: u32 = 8192;
/// Images of the path tracer, whose light through glass is found by scattering alone.
const PATHS: u32 = 8_192;
/// A bias of the image's mean that must be noticed with 99 % probability.
const GOAL_IMAGE: f64 = 0.09;
const BOTH: Panes = Panes { coloured: true, count: 2 };
const FULL: Stored = Stored {
    sample: LightAddress { light: 1, u: 2, v: 3 },
    contribution_weight: 1.0,
    confidence: 1.0,
    visibility: Vec3::ONE,
};

restir_tests::suite! {
    the_reference_agrees_with_paths every_use_of_visibility_is_unbiased averages_keep_the_colour_of_glass
    averages_by_channel_do_not_leak wrong_glass_is_seen what_goes_straight_is_what_the_bsdf_transmits
    twelve_sheets_pass_and_thirteen_do_not stored_colours_keep_their_mean without_glass_nothing_changes
}

/// Integration of the light through both panes.
fn reference() -> &'static [Moments] {
    static REFERENCE_MOMENTS: OnceLock<Vec<Moments>> = OnceLock::new();
    REFERENCE_MOMENTS.get_or_init(|| BOTH.reference(GRID, REFERENCE))
}

fn render(settings: &DiSettings, frames: u32, seed: u32) -> Render {
    Render { count: frames, seed, ..Render::new(SIZE, settings.clone()) }
}

/// Moments of the last frames of chains.
fn moments<S: AnyScene + Sync>(
    scene: &S,
    buffers: &SceneBuffers,
    settings: &DiSettings,
    restarts: u32,
) -> Result<Vec<Moments>, Failed> {
    let film = |seed| film_over(scene, plan(buffers, &render(settings, FRAMES, seed)));
    let films: Vec<Vec<FilmPixel>> = (0..restarts).into_par_iter().map(film).collect::<Result<_, _>>()?;
    ensure(films.iter().flatten().all(|p| p.dropped == 0.0), || format!("dropped samples: {settings:?}"))?;
    Ok(GRID.moments(restarts, |restart, x, y| films[restart as usize][(y * SIZE[0] + x) as usize].sum.map(f64::from)))
}

fn small(settings: DiSettings) -> DiSettings {
    DiSettings {
        candidates: 8,
        neighbours: 3,
        shaded: settings.shaded.min(4),
        radius: 5.0,
        confidence_cap: 3,
        max_plane_distance: 1.0e3,
        ..settings
    }
}

fn the_reference_agrees_with_paths() -> Result<(), Failed> {
    // behind one pane, paths of three segments hit the wall once
    let one = Panes { coloured: true, count: 1 };
    let buffers = SceneBuffers::build(&one.scene())?;
    let view = buffers.traced_view();
    let [width, height] = SIZE;
    let camera = buffers.camera.params(width, height);
    let params = PathParams { scene: buffers.header, camera, width, height, max_depth: 3, ..PathParams::default() };
    let paths =
        GRID.moments(PATHS, |seed, x, y| path::pixel(&view, &PathParams { seed, ..params }, x, y).sum.map(f64::from));
    let verdict = TEST.compare(&paths, &one.reference(GRID, REFERENCE));
    println!("{verdict}");
    ensure(verdict.passed(), || verdict.to_string())
}

/// Every way in which settings use visibility without bias.
fn unbiased() -> [(&'static str, DiSettings); 10] {
    let ray = DiSettings { mis: Mis::TALBOT, still: false, ..DiSettings::visibility_in_shading() };
    let in_mis = DiSettings { visibility_reuse: VisibilityReuse::Weights, scatter: true, ..ray.clone() };
    let selected = DiSettings { visibility: Visibility::Selected, ..ray.clone() };
    let still = DiSettings { initial_rays: 2, ..DiSettings::default() };
    let default = DiSettings { still: false, ..DiSettings::default() };
    [
        ("a final ray", ray.clone()),
        ("a final ray, neighbours shaded", DiSettings { shaded: 4, spatial: 0, ..ray }),
        ("visibility in MIS, talbot", in_mis.clone()),
        ("visibility in MIS, contribution", DiSettings { mis: Mis::CONTRIBUTION, ..in_mis.clone() }),
        ("visibility in MIS, 1/z", DiSettings { mis: Mis::ONE_OVER_Z, ..in_mis }),
        ("visibility in the target", default.clone()),
        ("visibility in the target, a still view", still),
        ("visibility in the target, fused", DiSettings { temporal: Temporal::Fused, shaded: 0, ..default }),
        ("the selected sample's, temporal", DiSettings { spatial: 0, ..selected.clone() }),
        ("the selected sample's, spatial", DiSettings { temporal: Temporal::Off, shaded: 2, ..selected }),
    ]
}

fn every_use_of_visibility_is_unbiased() -> Result<(), Failed> {
    let test = TileTest { family_rate: FAMILY_RATE / unbiased().len() as f64, ..TEST };
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    for (name, settings) in unbiased() {
        let verdict =
            test.compare(&moments(&buffers.traced_view(), &buffers, &small(settings), RESTARTS)?, reference());
        println!("{name}: {verdict}");
        ensure(verdict.passed(), || format!("{name}: {verdict}"))?;
        ensure(verdict.detectable_in_image <= GOAL_IMAGE, || format!("{name}: too few samples: {verdict}"))?;
    }
    Ok(())
}

/// Tokuyoshi's estimate, unbiased: no visibility but in shading.
fn averaged() -> DiSettings {
    let averaged =
        DiSettings { mis: Mis::TALBOT, visibility: Visibility::Averaged, ..DiSettings::visibility_in_shading() };
    small(averaged)
}

/// White lights: over one target for all channels the mean visibility is that of each; over time, or once in space.
fn averages_keep_the_colour_of_glass() -> Result<(), Failed> {
    let white = Panes { coloured: false, ..BOTH };
    let buffers = SceneBuffers::build(&white.scene())?;
    let view = buffers.traced_view();
    let reference = white.reference(GRID, REFERENCE);
    let rows = [
        ("temporal", DiSettings { spatial: 0, ..averaged() }),
        ("spatial", DiSettings { temporal: Temporal::Off, ..averaged() }),
    ];
    let test = TileTest { family_rate: FAMILY_RATE / rows.len() as f64, ..TEST };
    for (name, settings) in rows {
        let verdict = test.compare(&moments(&view, &buffers, &settings, RESTARTS)?, &reference);
        println!("{name}: {verdict}");
        ensure(verdict.passed(), || format!("{name}: {verdict}"))?;
        ensure(verdict.detectable_in_image <= GOAL_IMAGE, || format!("{name}: too few samples: {verdict}"))?;
        let wrong =
            test.compare(&moments(&Faulty { scene: view, fault: Grey }, &buffers, &settings, GROSS)?, &reference);
        println!("{name}, by luminance alone: {wrong}");
        ensure(!wrong.passed(), || format!("{name}: glass without colour went unnoticed: {wrong}"))?;
    }
    Ok(())
}

/// Coloured lights leak, unless each channel has its own target.
fn averages_by_channel_do_not_leak() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    let view = buffers.traced_view();
    let temporal = DiSettings { spatial: 0, ..averaged() };
    for (channel, target) in [Target::Red, Target::Green, Target::Blue].into_iter().enumerate() {
        let only = |moments: &[Moments]| moments.iter().copied().skip(channel).step_by(3).collect::<Vec<_>>();
        let settings = DiSettings { target, ..temporal.clone() };
        let verdict = TEST.compare(&only(&moments(&view, &buffers, &settings, RESTARTS)?), &only(reference()));
        println!("{}: max |z| {:.2} of {:.2}", target.name(), verdict.max_z, verdict.threshold);
        ensure(verdict.passed(), || format!("{}: max |z| {:.2}", target.name(), verdict.max_z))?;
    }
    Ok(())
}

/// Glass dims by its luminance, in all channels.
struct Grey;
impl Fault for Grey {
    fn surface(&self, point: &mut SurfacePoint, _: impl Fn() -> SurfacePoint) {
        if point.material.transmission > 0.0 {
            point.material.base_color = Vec3::splat(luminance(point.material.base_color));
        }
    }
}

/// Glass reflects nothing.
struct Coated;
impl Fault for Coated {
    fn surface(&self, point: &mut SurfacePoint, _: impl Fn() -> SurfacePoint) {
        if point.material.transmission > 0.0 {
            point.material.ior = 1.0;
        }
    }
}

fn wrong_glass_is_seen() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&BOTH.scene())?;
    let view = buffers.traced_view();
    let [ray, _, in_mis, _, _, in_target, _, _, selected, _] = unbiased();
    for (name, settings) in [ray, in_mis, in_target, selected] {
        let settings = small(settings);
        let opaque = DiSettings { transmittance: false, ..settings.clone() };
        let rows = [
            ("grey", moments(&Faulty { scene: view, fault: Grey }, &buffers, &settings, GROSS)?),
            ("coated", moments(&Faulty { scene: view, fault: Coated }, &buffers, &settings, GROSS)?),
            ("opaque", moments(&view, &buffers, &opaque, GROSS)?),
        ];
        for (what, moments) in rows {
            let verdict = TEST.compare(&moments, reference());
            println!("{name}, {what}: {verdict}");
            ensure(!verdict.passed(), || format!("{name}: {what} glass went unnoticed: {verdict}"))?;
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
        Ok(film[0].sum[..3].try_into().map(|rgb: [f32; 3]| rgb.map(f64::from))?)
    };
    let free = brightest(0)?;
    for count in [1_u32, 2, 12] {
        let through = brightest(count)?;
        for channel in 0..3 {
            let expected = through_first()[channel].powi(count as i32);
            let found = through[channel] / free[channel];
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
    let buffers = SceneBuffers::build(&named("all-lights").ok_or("no scene")?)?;
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
