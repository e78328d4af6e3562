//! Surfaces that are not everywhere: a mask is geometry that is cut along it, what is blended dims by its alpha, and whoever asks
//! again gets the same answer.
//!
//! Tests of expectations have fixed seeds: a failure is a bug.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::scene::{AlphaMode, Material, builtin};
use restir_host::technique::restir_di::DiSettings;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::Vec3;
use restir_shared::layout::{FEATURE_ALPHA, FEATURE_BLEND};
use restir_shared::scene::{AnyScene, SceneView, Trace};
use restir_shared::technique::path::PathParams;
use restir_shared::vec::length;
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::masks::{self, Form};
use restir_tests::native::{film_over, plan};
use restir_tests::random::SplitMix;
use restir_tests::scenes::path_params;
use restir_tests::sheets::Sheets;
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{Moments, TileGrid, TileTest, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_di::settings;
use restir_tests::wrong::{Fault, Faulty, Mixed};
use std::sync::OnceLock;

/// How often a z-test of equal expectations, over tiles, channels and the image, fails.
const FAMILY_RATE: f64 = 1.0e-3;
const SIZE: [u32; 2] = [16, 16];
const GRID: TileGrid = TileGrid { width: SIZE[0], height: SIZE[1], tile: 4 };
const TEST: TileTest = TileTest { grid: GRID, family_rate: FAMILY_RATE };
const FRAMES: u32 = 3;
/// A bias of the image's mean that must be noticed with 99 % probability, by paths and the default settings.
const GOAL: f64 = 0.01;
const PATHS: u32 = 12_288;
const MASKED_PATHS: u32 = 4_096;
const RESTARTS: u32 = 6_144;
/// The same of other settings, with fewer chains.
const COARSE_GOAL: f64 = 0.03;
const COARSE: u32 = 2_048;
/// Images of the reference, of one point on a light a pixel.
const REFERENCE: u32 = 16_384;
/// Images or chains of a test that is to see something wrong.
const GROSS: u32 = 256;
/// Rays that are compared one by one.
const RAYS: u64 = 100_000;
const OTHER_SEED: u32 = 1 << 31;

restir_tests::suite! {
    later {
        rays_see_a_mask_as_geometry_that_is_cut paths_see_a_mask_as_geometry_that_is_cut
        restir_sees_a_mask_as_geometry_that_is_cut masks_that_are_ignored_are_seen
        blended_surfaces_dim_paths blended_surfaces_dim_restir blended_surfaces_dim_beside_glass
        answers_of_wrong_rays_are_seen chances_are_uniform what_is_everywhere_is_not_asked bad_alpha_is_refused
    }
}

fn built(form: Form) -> Result<SceneBuffers, Failed> {
    Ok(SceneBuffers::build(&masks::scene(form))?)
}

/// A scene as if it had no alpha.
fn solid(view: SceneView<'_>) -> SceneView<'_> {
    SceneView { features: view.features & !FEATURE_ALPHA, ..view }
}

/// A random ray out of a ball around what the camera looks at, of either kind.
fn ray(random: &mut SplitMix) -> Ray {
    let mut point = |radius: f64| Vec3::from_array([0; 3].map(|_| random.range(-radius, radius) as f32));
    let (origin, target) = (point(2.5), point(0.8) + Vec3::new(0.0, 1.0, 0.0));
    Ray { origin, direction: target - origin, t_max: Ray::FAR, key: 0 }
}

/// The same point, up to rounding.
fn alike(ray: &Ray, a: &Hit, b: &Hit) -> bool {
    let apart = length(ray.direction * (a.t - b.t));
    a.is_hit() == b.is_hit() && (!a.is_hit() || apart < 1.0e-5)
}

/// But for rays at the very edge of a texel.
fn rays_see_a_mask_as_geometry_that_is_cut() -> Result<(), Failed> {
    let [masked, cut] = [built(Form::Masked)?, built(Form::Cut)?];
    let [masked, cut] = [masked.traced_view(), cut.traced_view()];
    let (mut other, mut solid_other) = (0, 0);
    for i in 0..RAYS {
        let ray = ray(&mut SplitMix::new(i));
        let expected = cut.closest(&ray);
        other += u64::from(!alike(&ray, &masked.closest(&ray), &expected));
        other += u64::from(masked.occluded(&ray) != expected.is_hit());
        solid_other += u64::from(!alike(&ray, &solid(masked).closest(&ray), &expected));
    }
    println!("{other} of {RAYS} rays differ, {solid_other} without the masks");
    ensure(other <= RAYS / 10_000 && solid_other > RAYS / 50, || format!("{other} of {RAYS}, {solid_other}"))
}

fn params(buffers: &SceneBuffers, max_depth: u32, seed: u32) -> PathParams {
    PathParams { seed, ..path_params(buffers, SIZE, max_depth) }
}

fn paths<S: AnyScene + Sync>(scene: &S, buffers: &SceneBuffers, depth: u32, count: u32, seed: u32) -> Vec<Moments> {
    path_moments(GRID, count, scene, params(buffers, depth, seed))
}

/// Moments of the last frames of chains: short ones, of few neighbours.
fn chains<S: AnyScene + Sync>(
    scene: &S,
    buffers: &SceneBuffers,
    text: &str,
    count: u32,
    seed: u32,
) -> Result<Vec<Moments>, Failed> {
    let settings: DiSettings = settings(&format!("{SMALL},{text}"));
    let render = |seed| Render { count: FRAMES, seed, ..Render::new(SIZE, settings.clone()) };
    film_moments(GRID, count, |restart| film_over(scene, plan(buffers, &render(seed + restart))))
}

const SMALL: &str = "candidates=8,neighbours=3,radius=5,confidence_cap=3,max_plane_distance=1000";

/// Ways in which settings use visibility without bias.
const UNBIASED: [&str; 9] = [
    DEFAULTS,
    FINAL_RAY,
    IN_WEIGHTS,
    "mis=contribution,visibility_reuse=weights,visibility=ray,shaded=0",
    "initial_rays=2,tiles=4x64",
    FUSED,
    "mis=pairwise,visibility_reuse=selection,visibility=selected,spatial=0,shaded=8",
    "mis=talbot,scatter=off,visibility_reuse=off,temporal=off,shaded=2",
    "preset=quality,candidates=8,neighbours=3",
];
/// Reuse in time and space, with visibility in the selection.
const DEFAULTS: &str = "";
const FINAL_RAY: &str = "mis=talbot,scatter=off,visibility_reuse=off,visibility=ray,shaded=0";
/// With a candidate from scattering.
const IN_WEIGHTS: &str = "mis=talbot,visibility_reuse=weights,visibility=ray,shaded=0";

const FUSED: &str = "temporal=fused,shaded=0";

const fn family(count: usize) -> TileTest {
    TileTest { family_rate: FAMILY_RATE / count as f64, ..TEST }
}

fn paths_see_a_mask_as_geometry_that_is_cut() -> Result<(), Failed> {
    let [masked, cut] = [built(Form::Masked)?, built(Form::Cut)?];
    let a = paths(&masked.traced_view(), &masked, 5, draws(MASKED_PATHS), 0);
    let b = paths(&cut.traced_view(), &cut, 5, draws(MASKED_PATHS), OTHER_SEED);
    ensure_unbiased("paths", &TEST.compare(&a, &b), bound(GOAL))
}

fn restir_sees_a_mask_as_geometry_that_is_cut() -> Result<(), Failed> {
    let [masked, cut] = [built(Form::Masked)?, built(Form::Cut)?];
    let reference = chains(&cut.traced_view(), &cut, DEFAULTS, 2 * draws(COARSE), OTHER_SEED)?;
    [DEFAULTS, FINAL_RAY, IN_WEIGHTS, FUSED].iter().try_for_each(|text| {
        let moments = chains(&masked.traced_view(), &masked, text, draws(COARSE), 0)?;
        ensure_unbiased(text, &family(4).compare(&moments, &reference), bound(GOAL))
    })
}

/// By shadow rays, by all rays, by lights.
fn masks_that_are_ignored_are_seen() -> Result<(), Failed> {
    let [masked, cut] = [built(Form::Masked)?, built(Form::Cut)?];
    let right = masked.traced_view();
    let wrong = solid(right);
    let rows = [
        ("shadow rays", Mixed { seen: right, blocking: wrong, shining: right }),
        ("all rays", Mixed { seen: wrong, blocking: wrong, shining: right }),
        ("lights", Mixed { seen: right, blocking: right, shining: wrong }),
    ];
    let by_paths = paths(&cut.traced_view(), &cut, 5, draws(MASKED_PATHS), OTHER_SEED);
    let by_chains = chains(&cut.traced_view(), &cut, DEFAULTS, draws(COARSE), OTHER_SEED)?;
    for (what, scene) in rows {
        let moments = paths(&scene, &masked, 5, 2 * GROSS, 0);
        ensure_biased(&format!("{what}, paths"), &TEST.compare(&moments, &by_paths))?;
        let moments = chains(&scene, &masked, DEFAULTS, GROSS, 0)?;
        ensure_biased(&format!("{what}, defaults"), &TEST.compare(&moments, &by_chains))?;
    }
    Ok(())
}

const SHEETS: Sheets = Sheets { glass: false };

/// Integration of the light past the sheets.
fn reference() -> &'static [Moments] {
    static REFERENCE_MOMENTS: OnceLock<Vec<Moments>> = OnceLock::new();
    REFERENCE_MOMENTS.get_or_init(|| SHEETS.reference(GRID, draws(REFERENCE)))
}

/// Paths through the middles of pixels, which are the same in every sample.
fn blended_surfaces_dim_paths() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&SHEETS.scene())?;
    let moments = paths(&buffers.traced_view(), &buffers, 2, draws(PATHS), 0);
    ensure_unbiased("paths", &TEST.compare(&moments, reference()), bound(GOAL))
}

fn blended_surfaces_dim_restir() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&SHEETS.scene())?;
    UNBIASED.iter().try_for_each(|text| {
        // through the middles of pixels, as the reference
        let (count, goal) = if *text == DEFAULTS { (RESTARTS, GOAL) } else { (COARSE, COARSE_GOAL) };
        let moments = chains(&buffers.traced_view(), &buffers, text, draws(count), 0)?;
        ensure_unbiased(text, &family(UNBIASED.len()).compare(&moments, reference()), bound(goal))
    })
}

fn blended_surfaces_dim_beside_glass() -> Result<(), Failed> {
    let both = Sheets { glass: true };
    let buffers = SceneBuffers::build(&both.scene())?;
    let reference = both.reference(GRID, draws(REFERENCE));
    [DEFAULTS, IN_WEIGHTS].iter().try_for_each(|text| {
        let moments = chains(&buffers.traced_view(), &buffers, text, draws(COARSE), 0)?;
        ensure_unbiased(text, &family(2).compare(&moments, &reference), bound(COARSE_GOAL))
    })
}

/// Every shadow ray to the lamp has the same key.
const ONE_KEY: Fault = Fault { light: |light| light.key = 0, ..Fault::NONE };
/// A blended light shines as if it were everywhere.
const EVERYWHERE: Fault =
    Fault { light: |light| light.emission *= if light.blended { 2.0 } else { 1.0 }, ..Fault::NONE };
/// The ray of scattering meets blended surfaces by a chance of its own.
const OWN_CHANCE: Fault = Fault {
    ray: |ray| {
        if ray.key == Ray::THROUGH {
            ray.key = 1;
        }
    },
    ..Fault::NONE
};
/// Scattering counts on finding blended lights, through which its ray looks.
const FOUND: Fault = Fault { light: |light| light.blended = false, ..Fault::NONE };

fn answers_of_wrong_rays_are_seen() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&SHEETS.scene())?;
    let view = buffers.traced_view();
    for (what, fault, text) in [
        ("one key for the lamp", ONE_KEY, DEFAULTS),
        ("blended lights are everywhere", EVERYWHERE, DEFAULTS),
        ("scattering has a chance of its own", OWN_CHANCE, SCATTERING),
        ("scattering finds blended lights", FOUND, SCATTERING),
    ] {
        let moments = chains(&Faulty { scene: view, fault }, &buffers, text, draws(COARSE), 0)?;
        ensure_biased(what, &TEST.compare(&moments, reference()))?;
    }
    Ok(())
}

/// Few candidates from lights, so that scattering counts.
const SCATTERING: &str = "candidates=1,scatter=on";

/// A material whose alpha leaves nothing out has no feature, nor has one that no triangle has.
fn what_is_everywhere_is_not_asked() -> Result<(), Failed> {
    let features = |alpha: f32, alpha_mode: AlphaMode| -> Result<u32, Failed> {
        let mut scene = builtin::scene("cornell").ok_or("built in")?;
        scene.add_material(Material {
            alpha_mode: AlphaMode::Blend,
            alpha: 0.5,
            ..Material::diffuse("unused", [0.5; 3])
        });
        (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (alpha, alpha_mode);
        Ok(SceneBuffers::build(&scene)?.features & (FEATURE_ALPHA | FEATURE_BLEND))
    };
    for (alpha, mode, expected) in [
        (0.3, AlphaMode::Opaque, 0),
        (1.0, AlphaMode::Blend, 0),
        (0.6, AlphaMode::Mask { cutoff: 0.5 }, 0),
        (0.4, AlphaMode::Mask { cutoff: 0.5 }, FEATURE_ALPHA),
        (1.0, AlphaMode::Mask { cutoff: 1.5 }, FEATURE_ALPHA),
        (0.9, AlphaMode::Blend, FEATURE_ALPHA | FEATURE_BLEND),
    ] {
        ensure(features(alpha, mode)? == expected, || format!("{alpha}, {mode:?}"))?;
    }
    Ok(())
}

fn bad_alpha_is_refused() -> Result<(), Failed> {
    for (alpha, alpha_mode) in [
        (f32::NAN, AlphaMode::Blend),
        (1.5, AlphaMode::Blend),
        (1.0, AlphaMode::Mask { cutoff: f32::NAN }),
        (1.0, AlphaMode::Mask { cutoff: -0.5 }),
    ] {
        let mut scene = masks::scene(Form::Cut);
        (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (alpha, alpha_mode);
        let refused = SceneBuffers::build(&scene).err().ok_or("it is taken")?.to_string();
        ensure(refused.contains("alpha"), || refused.clone())?;
    }
    Ok(())
}

/// What becomes of a ray at triangle 3 in a step, of a size and with a number: a ray and a triangle.
type Way = fn(Ray, f32, u32) -> (Ray, u32);

/// Over keys, origins, directions and triangles alike, and as often below alpha as alpha says.
fn chances_are_uniform() -> Result<(), Failed> {
    let fixed = Ray { origin: Vec3::new(0.1, 0.2, 0.3), direction: Vec3::Z, t_max: 1.0, key: 7 };
    let step = |i: u32| i as f32 * f32::EPSILON;
    let ways: [(&str, Way); 4] = [
        ("keys", |ray, _, i| (Ray { key: i, ..ray }, 3)),
        ("origins", |ray, x, _| (Ray { origin: ray.origin + Vec3::X * x, ..ray }, 3)),
        ("directions", |ray, x, _| (Ray { direction: ray.direction + Vec3::Z * x, ..ray }, 3)),
        ("triangles", |ray, _, i| (ray, i)),
    ];
    for (what, way) in ways {
        let chance = |i: u32| {
            let (ray, triangle) = way(fixed, step(i), i);
            assert_eq!(ray.chance(triangle).to_bits(), ray.chance(triangle).to_bits());
            f64::from(ray.chance(triangle))
        };
        let chances: Vec<f64> = (0..RAYS as u32).map(chance).collect();
        // 16 tests, of which one fails by chance in 1 of 1000 suites at 4 standard errors
        for alpha in [0.1, 0.5, 0.9] {
            let met: Moments = chances.iter().map(|&chance| f64::from(u8::from(chance < alpha))).collect();
            let z = ZTest::new(met, Moments::exact(alpha)).z;
            ensure(z.abs() < 4.0, || format!("{what}: {} for {alpha}, z {z}", met.mean()))?;
        }
        let follows: Moments = chances.windows(2).map(|pair| (pair[0] - 0.5) * (pair[1] - 0.5)).collect();
        let z = ZTest::new(follows, Moments::exact(0.0)).z;
        ensure(z.abs() < 4.0, || format!("{what}: neighbours go together, z {z}"))?;
    }
    let through = Ray { key: Ray::THROUGH, ..fixed };
    ensure(through.chance(3) == 1.0, || "it meets something".to_owned())
}
