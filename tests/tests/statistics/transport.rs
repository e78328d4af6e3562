//! Light transport: the path tracer against an independent one, against closed forms, and against wrong variants.

use libtest_mimic::Failed;
use restir_host::scene::Material;
use restir_shared::technique::path::{self, PathFlags, PathParams};
use restir_tests::bias::{ensure_biased, ensure_unbiased, path_moments};
use restir_tests::checks;
use restir_tests::scenes::{self, Quad, Setting, path_params, room, terrace};
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict};
use restir_tests::suite::{Trial, ensure};
use restir_tests::wrong::{Fault, Faulty};
use std::sync::OnceLock;

/// How often the suite's z-tests of equal expectations fail, test by test. Seeds are fixed: a failure is a bug.
const FAMILY_RATE: f64 = 1.0e-3;
const TILE: u32 = 16;
/// Images by the oracle, one path a pixel.
const ORACLE_RESTARTS: u32 = 8_192;
/// Images by the technique, one path a pixel. `cargo lab unbiased --cell path/cornell` takes as many as it is given.
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

pub(crate) fn trials() -> Vec<Trial> {
    let mut tests = checks! {
        later {
            room_and_terrace_agree_with_the_oracle roulette_keeps_the_mean furnace_has_its_known_radiance
            single_bounce_has_its_form_factor depth_limits_are_segments
        }
    };
    tests.extend(WRONG.iter().map(|(case, what, restarts, fault)| {
        let name = format!("{}: {what} is seen", case.name);
        Trial::test(name, || ensure_biased(what, &case.verdict(*fault, *restarts, PathFlags::NONE)))
    }));
    tests
}

/// A scene in both forms; the oracle's images are made once.
struct Case {
    name: &'static str,
    setting: fn() -> Setting,
    reference: OnceLock<Vec<Moments>>,
}

static ROOM: Case = Case { name: "room", setting: room, reference: OnceLock::new() };
static TERRACE: Case = Case { name: "terrace", setting: terrace, reference: OnceLock::new() };

/// What must be seen, and in how many images.
static WRONG: [(&Case, &str, u32, Fault); 10] = [
    (&ROOM, "throughput x 1.01", SUBTLE, THROUGHPUT),
    (&TERRACE, "throughput x 1.01", SUBTLE, THROUGHPUT),
    (&ROOM, "light density x 1.02", SUBTLE, Fault::DENSITY),
    (&TERRACE, "light density x 1.02", SUBTLE, Fault::DENSITY),
    // the weights of hit emitters use another density than those of sampled ones
    (&ROOM, "hit density x 1.1", SUBTLE, Fault { density: |density| density * 1.1, ..Fault::NONE }),
    // emitters that are hit count in full, as if they were not sampled as well
    (&TERRACE, "counting emitters twice", GROSS, Fault { density: |_| 0.0, ..Fault::NONE }),
    (&TERRACE, "emission from both sides", GROSS, BOTH_SIDES),
    (&TERRACE, "a tint of sampled emitters by 2 %", SUBTLE, Fault { light: |l| l.emission.x *= 1.02, ..Fault::NONE }),
    (&ROOM, "a lack of shadows", GROSS, NO_SHADOWS),
    (&TERRACE, "a lack of shadows", GROSS, NO_SHADOWS),
];

/// At every bounce.
const THROUGHPUT: Fault = Fault { surface: |point, _| point.material.base_color *= 1.01, ..Fault::NONE };
const BOTH_SIDES: Fault = Fault {
    surface: |point, reversed| point.emission = point.emission.max(reversed().emission),
    light: |light| light.two_sided = true,
    ..Fault::NONE
};
const NO_SHADOWS: Fault = Fault { occluded: |_| false, ..Fault::NONE };

fn test([width, height]: [u32; 2]) -> TileTest {
    TileTest { grid: TileGrid { width, height, tile: TILE }, family_rate: FAMILY_RATE }
}

impl Case {
    fn reference(&self) -> &[Moments] {
        self.reference.get_or_init(|| {
            let oracle = (self.setting)().oracle();
            let grid = test(oracle.camera.size).grid;
            grid.moments(ORACLE_RESTARTS, |restart, x, y| oracle.pixel(restart, x, y))
        })
    }

    fn verdict(&self, fault: Fault, restarts: u32, flags: PathFlags) -> Verdict {
        let setting = (self.setting)();
        let buffers = setting.buffers();
        let test = test(setting.size);
        let scene = Faulty { scene: buffers.view(), fault };
        let params = setting.params(&buffers, PathFlags::JITTER | flags);
        test.compare(&path_moments(test.grid, restarts, &scene, params), self.reference())
    }
}

fn room_and_terrace_agree_with_the_oracle() -> Result<(), Failed> {
    for case in [&ROOM, &TERRACE] {
        let verdict = case.verdict(Fault::NONE, RESTARTS, PathFlags::NONE);
        ensure_unbiased(case.name, &verdict, GOAL_IMAGE)?;
        ensure(verdict.detectable_in_tile <= GOAL_TILE, || format!("too few samples: {verdict}"))?;
    }
    Ok(())
}

fn roulette_keeps_the_mean() -> Result<(), Failed> {
    [&ROOM, &TERRACE].into_iter().try_for_each(|case| {
        let verdict = case.verdict(Fault::NONE, ROULETTE_RESTARTS, PathFlags::ROULETTE);
        ensure_unbiased(&format!("{} with roulette", case.name), &verdict, GOAL_ROULETTE)
    })
}

/// With emission 1 and reflectance 1/2 paths of up to n segments carry 2 (1 - 2^-n) everywhere.
fn furnace_has_its_known_radiance() -> Result<(), Failed> {
    let buffers = scenes::buffers("furnace")?;
    let test = test([32, 32]);
    for max_depth in [1, 2, 3, 5, 8] {
        let params = PathParams { flags: PathFlags::JITTER, ..path_params(&buffers, [32, 32], max_depth) };
        let exact = 2.0 * (1.0 - 0.5_f64.powi(max_depth as i32));
        let traced = path_moments(test.grid, 1_024, &buffers.view(), params);
        ensure_exact(&format!("furnace at depth {max_depth}"), test, &traced, &test.grid.exact(|_, _| [exact; 3]))?;
    }
    Ok(())
}

/// Of the tiles, and of the image's mean, which the moments hold last, in green.
fn ensure_exact(what: &str, test: TileTest, traced: &[Moments], exact: &[Moments]) -> Result<(), Failed> {
    ensure_unbiased(what, &test.compare(traced, exact), f64::INFINITY)?;
    let [image, exact] = [traced, exact].map(|moments| moments[moments.len() - 2]);
    let rounding = 1.0e-6 * exact.mean();
    let error = image.standard_error().hypot(rounding);
    let z = (image.mean() - exact.mean()) / error;
    println!("{what}: {:.6} +- {error:.6} for {:.6}", image.mean(), exact.mean());
    ensure(z.abs() <= 3.0, || format!("{what}: {} is {z:.1} standard errors from {}", image.mean(), exact.mean()))
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
    Setting {
        name: "wall before light",
        quads: vec![Quad { corners: rectangle(2.0, 2.0, 0.0), material: 0 }, Quad { corners: light, material: 1 }],
        materials: vec![
            Material::diffuse("wall", [REFLECTANCE; 3]),
            Material::emitter("light", [0.0; 3], [RADIANCE; 3]),
        ],
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
        let direction = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let point = camera.position - direction * (camera.position.z / direction.z);
        [lit_wall(point.x, point.y); 3]
    });
    let traced = path_moments(test.grid, 2_048, &buffers.view(), setting.params(&buffers, PathFlags::NONE));
    ensure_exact("wall before light", test, &traced, &exact)
}

/// Depth 0 sees nothing, depth 1 emission alone.
fn depth_limits_are_segments() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let lit = |max_depth: u32| {
        let params = PathParams { max_depth, ..setting.params(&buffers, PathFlags::NONE) };
        (0..32 * 32).filter(|i| path::pixel(&buffers.view(), &params, i % 32, i / 32).sum != [0.0; 3]).count()
    };
    let mut direct = setting.oracle();
    (direct.max_depth, direct.jitter) = (1, false);
    let emitters = (0..32 * 32).filter(|i| direct.pixel(0, i % 32, i / 32) != [0.0; 3]).count();
    ensure(lit(0) == 0, || "depth 0 is not black".to_owned())?;
    ensure(emitters > 0 && lit(1) == emitters, || format!("depth 1: {} pixels for {emitters}", lit(1)))?;
    ensure(lit(2) > emitters, || "depth 2 adds nothing".to_owned())
}
