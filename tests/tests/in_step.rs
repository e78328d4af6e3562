//! Paths in step have the bits of paths one by one, with the registers of any processor.

use libtest_mimic::{Arguments, Failed, Trial};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Material, Scene, builtin};
use restir_shared::camera::primary_ray;
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::glam::Vec2;
use restir_shared::lanes::{LANES, Registers, Stage};
use restir_shared::layout::{FEATURE_ENVIRONMENT, FEATURES_DIFFUSE, FEATURES_UNTEXTURED, FilmPixel};
use restir_shared::scene::{SceneView, Trace};
use restir_shared::technique::path::{
    PATH_BLACKMAN_HARRIS, PATH_JITTER, PATH_ROULETTE, PATH_SOBOL, PathParams, pixel, pixels,
};
use restir_tests::scenes::buffers;
use restir_tests::suite::ensure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut trials: Vec<_> =
        builtin::NAMES.iter().map(|&(name, _)| Trial::test(name, move || same_bits(&buffers(name)?, name))).collect();
    trials.push(Trial::test("plaster under a sky", plaster_under_a_sky));
    trials.push(Trial::test("other numbers are seen", other_numbers));
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// Stages as the compiler of the tests compiles them.
#[derive(Clone, Copy)]
struct Any;

impl Registers for Any {
    fn run<S: Stage>(self, stage: &S, from: &S::From, to: &mut S::To) {
        stage.run(from, to);
    }
}

/// Images of 133 x 29 pixels, so that no row is a multiple of the lanes.
const SIZE: [u32; 2] = [133, 29];
/// Features without textures, with an environment.
const SKY: u32 = FEATURES_UNTEXTURED | FEATURE_ENVIRONMENT;
/// Some rows of them.
const ROWS: [u32; 3] = [2, 13, 22];

/// Settings that each take a way of their own: blocks of one sample and of more than the largest, samples from further on, paths of no
/// segment, of one, and of many, and all flags. The pixels of a row take three batches where blocks are the largest.
fn settings(base: PathParams) -> [PathParams; 9] {
    let all = PATH_JITTER | PATH_ROULETTE | PATH_SOBOL;
    [
        base,
        PathParams { block_log2: 0, flags: all, ..base },
        PathParams { block_log2: 2, first_sample: 12, flags: PATH_JITTER, ..base },
        PathParams { block_log2: 3, max_depth: 0, ..base },
        PathParams { block_log2: 1, max_depth: 1, flags: all, ..base },
        PathParams { block_log2: 5, max_depth: 1, flags: PATH_JITTER | PATH_SOBOL, ..base },
        PathParams { block_log2: 4, max_depth: 2, flags: PATH_BLACKMAN_HARRIS | PATH_SOBOL, ..base },
        PathParams { block_log2: 3, max_depth: 40, flags: all, ..base },
        PathParams { block_log2: MAX_BLOCK_LOG2 + 3, first_sample: 64, max_depth: 3, flags: all, ..base },
    ]
}

fn same_bits(scene: &SceneBuffers, name: &str) -> Result<(), Failed> {
    // with the tree for processors, which knows where there are emitters
    let view = scene.traced_view();
    let base = PathParams { block_log2: 3, ..PathParams::new(scene.camera.params(SIZE[0], SIZE[1]), SIZE, 5) };
    for params in settings(base) {
        rows(&view, &params, name)?;
        // the variants that kernels are compiled for
        view.within::<FEATURES_UNTEXTURED>().map_or(Ok(()), |view| rows(&view, &params, name))?;
        view.within::<SKY>().map_or(Ok(()), |view| rows(&view, &params, name))?;
        view.within::<FEATURES_DIFFUSE>().map_or(Ok(()), |view| rows(&view, &params, name))?;
        view.within::<FEATURE_ENVIRONMENT>().map_or(Ok(()), |view| rows(&view, &params, name))?;
    }
    Ok(())
}

/// A diffuse scene with an environment alone has a variant of its own, and no built-in scene is one. Of its pixels many, one beside the
/// other, show nothing but the sky: these paths end together.
fn plaster_under_a_sky() -> Result<(), Failed> {
    let mut scene = Scene::load("tower")?;
    scene.materials.fill(Material::diffuse("plaster", [0.7, 0.6, 0.5]));
    let buffers = SceneBuffers::build(&scene)?;
    let view = buffers.view();
    ensure(view.within::<FEATURE_ENVIRONMENT>().is_some(), || format!("features {:#x}", view.features))?;
    let camera = buffers.camera.params(SIZE[0], SIZE[1]);
    let misses =
        |x: u32| !view.closest(&primary_ray(&camera, Vec2::new(x as f32, ROWS[0] as f32), Vec2::ZERO)).is_hit();
    ensure((0..3 * LANES as u32).all(misses), || "something is before the sky".to_owned())?;
    same_bits(&buffers, "plaster")
}

fn rows<const COMPILED: u32>(view: &SceneView<'_, COMPILED>, params: &PathParams, name: &str) -> Result<(), Failed> {
    for y in ROWS {
        let single: Vec<_> = (0..SIZE[0]).map(|x| pixel(view, params, x, y)).collect();
        // a part of the row, too
        for first in [0, LANES as u32 + 3] {
            let mut film = vec![FilmPixel::default(); (SIZE[0] - first) as usize];
            pixels(view, params, [first, y], &mut film, Any);
            let differ = differing(&film, &single[first as usize..]);
            ensure(differ == 0, || format!("{name}: {differ} words of row {y} from {first} on differ, of {params:?}"))?;
        }
    }
    Ok(())
}

/// Of the pixels of a row that have light, those with another seed have other words.
fn other_numbers() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let params = PathParams::new(scene.camera.params(SIZE[0], SIZE[1]), SIZE, 5);
    let mut film = vec![FilmPixel::default(); SIZE[0] as usize];
    pixels(&scene.view(), &params, [0, ROWS[1]], &mut film, Any);
    let other = PathParams { seed: 6, ..params };
    let single: Vec<_> = (0..SIZE[0]).map(|x| pixel(&scene.view(), &other, x, ROWS[1])).collect();
    let lit = film.iter().zip(&single).filter(|(a, b)| a.sum != [0.0; 3] || b.sum != [0.0; 3]).count();
    let differ = differing(&film, &single);
    ensure(lit > LANES && differ > 2 * lit, || format!("{differ} words differ of {lit} pixels with light"))
}

fn differing(a: &[FilmPixel], b: &[FilmPixel]) -> usize {
    let words = |film| bytemuck::cast_slice::<FilmPixel, u32>(film);
    words(a).iter().zip(words(b)).filter(|(a, b)| a != b).count()
}
