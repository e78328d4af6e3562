//! Light transport: the path tracer against an independent one, against closed forms, and against wrong variants.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Scene;
use restir_shared::scene::{Lights, Surface, Trace};
use restir_shared::technique::path;
use restir_shared::technique::path::{PATH_JITTER, PATH_ROULETTE, PathParams};
use restir_tests::scenes::{Paint, Quad, Setting, room, terrace};
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict};
use restir_tests::suite::{ensure, run};
use restir_tests::wrong::{
    BothSides, CountedTwice, Density, Fault, Faulty, HitDensity, NoShadows, Right, Throughput, Tinted,
};
use std::process::ExitCode;
use std::sync::OnceLock;

/// How often the suite's z-tests of equal expectations fail, test by test. Seeds are fixed: a failure is a bug.
const FAMILY_RATE: f64 = 1.0e-3;
const TILE: u32 = 16;
/// Images by the oracle, one path a pixel.
const ORACLE_RESTARTS: u32 = 8_192;
/// Images by the technique, one path a pixel. `cargo xtask unbiased --cell path/cornell` takes as many as it is given.
const RESTARTS: u32 = 4_096;
/// Images with roulette.
const ROULETTE_RESTARTS: u32 = 2_048;
/// Images by its wrong variants: by those that are off by a percent, and by those that are far off.
const SUBTLE: u32 = 1_024;
const GROSS: u32 = 256;
/// Design goals: a bias of a tile and of the image that is noticed with 99 % probability.
const GOAL_TILE: f64 = 0.02;
const GOAL_IMAGE: f64 = 0.004;
/// The same of the image with roulette.
const GOAL_ROULETTE: f64 = 0.005;

fn main() -> ExitCode {
    run(&[
        ("room_agrees_with_the_oracle", || agrees(&ROOM)),
        ("terrace_agrees_with_the_oracle", || agrees(&TERRACE)),
        ("roulette_keeps_the_mean", roulette_keeps_the_mean),
        ("throughput_scaled_by_1_01_is_seen", throughput_scaled_is_seen),
        ("wrong_light_densities_are_seen", wrong_light_densities_are_seen),
        ("wrong_emitters_are_seen", wrong_emitters_are_seen),
        ("missing_shadows_are_seen", missing_shadows_are_seen),
        ("furnace_has_its_known_radiance", furnace_has_its_known_radiance),
        ("single_bounce_has_its_form_factor", single_bounce_has_its_form_factor),
        ("depth_limits_are_segments", depth_limits_are_segments),
    ])
}

/// A scene in both forms; the oracle's images are made once.
struct Case {
    setting: fn() -> Setting,
    reference: OnceLock<Vec<Moments>>,
}

static ROOM: Case = Case { setting: room, reference: OnceLock::new() };
static TERRACE: Case = Case { setting: terrace, reference: OnceLock::new() };

fn test(size: [u32; 2]) -> TileTest {
    let [width, height] = size;
    TileTest { grid: TileGrid { width, height, tile: TILE }, family_rate: FAMILY_RATE }
}

/// Moments of the technique's images; a restart is a seed.
fn trace(
    grid: TileGrid,
    restarts: u32,
    scene: &(impl Trace + Surface + Lights + Sync),
    params: PathParams,
) -> Vec<Moments> {
    grid.moments(restarts, |restart, x, y| {
        let params = PathParams { seed: restart, ..params };
        path::pixel(scene, &params, x, y).sum.map(f64::from)
    })
}

impl Case {
    fn reference(&self) -> &[Moments] {
        self.reference.get_or_init(|| {
            let oracle = (self.setting)().oracle();
            let grid = test(oracle.camera.size).grid;
            grid.moments(ORACLE_RESTARTS, |restart, x, y| oracle.pixel(restart, x, y))
        })
    }

    fn verdict(&self, fault: impl Fault, restarts: u32, flags: u32) -> Verdict {
        let setting = (self.setting)();
        let buffers = setting.buffers();
        let test = test(setting.size);
        let scene = Faulty { scene: buffers.view(), fault };
        let params = setting.params(&buffers, PATH_JITTER | flags);
        test.compare(&trace(test.grid, restarts, &scene, params), self.reference())
    }

    fn ensure_seen(&self, what: &str, fault: impl Fault, restarts: u32) -> Result<(), Failed> {
        let verdict = self.verdict(fault, restarts, 0);
        println!("{}, {what}: {verdict}", (self.setting)().name);
        ensure(!verdict.passed(), || format!("{what} went unnoticed: {verdict}"))
    }
}

fn agrees(case: &Case) -> Result<(), Failed> {
    let verdict = case.verdict(Right, RESTARTS, 0);
    println!("{}: {verdict}", (case.setting)().name);
    ensure(verdict.passed(), || verdict.to_string())?;
    ensure(verdict.detectable_in_tile <= GOAL_TILE, || format!("too few samples: {verdict}"))?;
    ensure(verdict.detectable_in_image <= GOAL_IMAGE, || format!("too few samples: {verdict}"))
}

fn roulette_keeps_the_mean() -> Result<(), Failed> {
    for case in [&ROOM, &TERRACE] {
        let verdict = case.verdict(Right, ROULETTE_RESTARTS, PATH_ROULETTE);
        println!("{} with roulette: {verdict}", (case.setting)().name);
        ensure(verdict.passed(), || verdict.to_string())?;
        ensure(verdict.detectable_in_image <= GOAL_ROULETTE, || format!("too few samples: {verdict}"))?;
    }
    Ok(())
}

fn throughput_scaled_is_seen() -> Result<(), Failed> {
    ROOM.ensure_seen("throughput x 1.01", Throughput(1.01), SUBTLE)?;
    TERRACE.ensure_seen("throughput x 1.01", Throughput(1.01), SUBTLE)
}

fn wrong_light_densities_are_seen() -> Result<(), Failed> {
    ROOM.ensure_seen("density x 1.02", Density(1.02), SUBTLE)?;
    TERRACE.ensure_seen("density x 1.02", Density(1.02), SUBTLE)?;
    ROOM.ensure_seen("density of hits x 1.1", HitDensity(1.1), SUBTLE)?;
    TERRACE.ensure_seen("emitters counted twice", CountedTwice, GROSS)
}

fn wrong_emitters_are_seen() -> Result<(), Failed> {
    TERRACE.ensure_seen("both sides emit", BothSides, GROSS)?;
    TERRACE.ensure_seen("sampled emitters tinted by 2 %", Tinted, SUBTLE)
}

fn missing_shadows_are_seen() -> Result<(), Failed> {
    ROOM.ensure_seen("no shadows", NoShadows, GROSS)?;
    TERRACE.ensure_seen("no shadows", NoShadows, GROSS)
}

/// With emission 1 and reflectance 1/2 paths of up to n segments carry 2 (1 - 2^-n) everywhere.
fn furnace_has_its_known_radiance() -> Result<(), Failed> {
    let scene = Scene::load("furnace")?;
    let buffers = SceneBuffers::build(&scene)?;
    let test = test([32, 32]);
    let camera = buffers.camera.params(32, 32);
    for max_depth in [1, 2, 3, 5, 8] {
        let params = PathParams {
            scene: buffers.header,
            camera,
            width: 32,
            height: 32,
            max_depth,
            flags: PATH_JITTER,
            ..PathParams::default()
        };
        let exact = 2.0 * (1.0 - 0.5_f64.powi(max_depth as i32));
        let traced = trace(test.grid, 1_024, &buffers.view(), params);
        let verdict = test.compare(&traced, &test.grid.exact(|_, _| [exact; 3]));
        println!("furnace at depth {max_depth}: {verdict}");
        ensure(verdict.passed(), || format!("depth {max_depth}: {verdict}"))?;
        within_three_errors("furnace", &traced, exact)?;
    }
    Ok(())
}

/// The image's mean, which the moments hold last, in green.
fn within_three_errors(what: &str, moments: &[Moments], exact: f64) -> Result<(), Failed> {
    let image = moments[moments.len() - 2];
    let rounding = 1.0e-6 * exact;
    let error = image.standard_error().hypot(rounding);
    let z = (image.mean() - exact) / error;
    println!("{what}: {:.6} +- {error:.6} for {exact:.6}", image.mean());
    ensure(z.abs() <= 3.0, || format!("{what}: {} is {z:.1} standard errors from {exact}", image.mean()))
}

const LIGHT: [f32; 2] = [0.5, 0.25];
const LIGHT_DISTANCE: f32 = 1.5;
const RADIANCE: f32 = 4.0;
const REFLECTANCE: f32 = 0.5;

/// A wall at z = 0 and a light parallel to it, behind the viewer.
fn wall_before_light() -> Setting {
    let [a, b] = LIGHT;
    let rectangle = |x: f32, y: f32, z: f32| [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]];
    let mut light = rectangle(a, b, LIGHT_DISTANCE);
    light.reverse();
    let paint = |reflectance: f32, emission: f32| Paint {
        reflectance: [reflectance; 3],
        emission: [emission; 3],
        two_sided: false,
    };
    Setting {
        name: "wall before light",
        quads: vec![Quad { corners: rectangle(2.0, 2.0, 0.0), material: 0 }, Quad { corners: light, material: 1 }],
        materials: vec![paint(REFLECTANCE, 0.0), paint(0.0, RADIANCE)],
        eye: [0.25, 0.1, 1.0],
        half_height: 0.9,
        size: [32, 32],
        max_depth: 2,
    }
}

/// The fraction of what leaves a point of a plane that reaches a parallel rectangle with one corner straight
/// above it: sides x and y at distance 1, signed (Howell, "A Catalog of Radiation Heat Transfer Configuration
/// Factors", B-3).
fn corner_factor(x: f64, y: f64) -> f64 {
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / std::f64::consts::TAU
}

/// Reflected radiance at a point of the wall.
fn lit_wall(x: f64, y: f64) -> f64 {
    let [a, b] = LIGHT.map(f64::from);
    let distance = f64::from(LIGHT_DISTANCE);
    let corner = |lx: f64, ly: f64| corner_factor((lx - x) / distance, (ly - y) / distance);
    let factor = corner(a, b) - corner(-a, b) - corner(a, -b) + corner(-a, -b);
    f64::from(REFLECTANCE) * f64::from(RADIANCE) * factor
}

fn single_bounce_has_its_form_factor() -> Result<(), Failed> {
    let setting = wall_before_light();
    let buffers = setting.buffers();
    let test = test(setting.size);
    let camera = setting.oracle().camera;
    // through the pixels' centres, so that every pixel has one point
    let exact = test.grid.exact(|x, y| {
        let [dx, dy, dz] = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let t = -camera.position[2] / dz;
        [lit_wall(camera.position[0] + t * dx, camera.position[1] + t * dy); 3]
    });
    let traced = trace(test.grid, 2_048, &buffers.view(), setting.params(&buffers, 0));
    let verdict = test.compare(&traced, &exact);
    println!("wall before light: {verdict}");
    ensure(verdict.passed(), || verdict.to_string())?;
    within_three_errors("wall before light", &traced, exact[exact.len() - 2].mean())
}

/// Depth 0 sees nothing, depth 1 emission alone.
fn depth_limits_are_segments() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let oracle = setting.oracle();
    let lit = |max_depth: u32| {
        let params = PathParams { max_depth, ..setting.params(&buffers, 0) };
        (0..32 * 32).filter(|i| path::pixel(&buffers.view(), &params, i % 32, i / 32).sum != [0.0; 3]).count()
    };
    let mut direct = oracle.clone();
    (direct.max_depth, direct.jitter) = (1, false);
    let emitters = (0..32 * 32).filter(|i| direct.pixel(0, i % 32, i / 32) != [0.0; 3]).count();
    ensure(lit(0) == 0, || "depth 0 is not black".to_owned())?;
    ensure(emitters > 0 && lit(1) == emitters, || format!("depth 1: {} pixels for {emitters}", lit(1)))?;
    ensure(lit(2) > emitters, || "depth 2 adds nothing".to_owned())
}
