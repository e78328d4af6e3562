//! Paths, and the passes of ReSTIR DI, by SIMD have the bits of those one by one, with the registers of any processor.

mod levels;
mod passes;

use bytemuck::Pod;
use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Material, Scene, builtin};
use restir_shared::camera::primary_ray;
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::glam::Vec2;
use restir_shared::lanes::{LANES, LaneKernel, SimdToken};
use restir_shared::layout::{CameraParams, FEATURE_ENVIRONMENT, FEATURES_DIFFUSE, FEATURES_UNTEXTURED, FilmPixel};
use restir_shared::resample::params::ReuseParams;
use restir_shared::scene::{SceneView, Trace};
use restir_shared::technique::path::{PathFlags, PathParams, pixel, pixels};
use restir_shared::technique::restir_di::{
    DiParams, Flags, PackedHit, PackedReservoir, Stored, TileParams, TileWords, initial, initial_row, presample,
    primary,
};
use restir_tests::scenes::buffers;
use restir_tests::suite::{Trial, ensure};

pub(crate) fn trials() -> Vec<Trial> {
    let names = || builtin::NAMES.iter().map(|&(name, _)| name);
    let mut trials: Vec<_> = names().map(|name| Trial::test(name, move || same_bits(&buffers(name)?, name))).collect();
    trials.push(Trial::test("plaster under a sky", plaster_under_a_sky));
    trials.push(Trial::test("other numbers are seen", other_numbers));
    trials.extend(names().map(|name| Trial::test(format!("candidates of {name}"), move || same_candidates(name))));
    trials.push(Trial::test("other candidates are seen", other_candidates));
    trials.push(Trial::test("other rounds of candidates are seen", other_rounds));
    trials.extend(names().map(|name| Trial::test(format!("passes of {name}"), move || passes::same_bits(name))));
    let moving = ["moving", "toys"];
    trials.extend(moving.map(|name| Trial::test(format!("two scenes of {name}"), move || passes::of_two_scenes(name))));
    trials.push(Trial::test("other passes are seen", passes::others_are_seen));
    trials.extend(names().map(|name| Trial::test(format!("levels of {name}"), move || levels::same_films(name))));
    trials.push(Trial::test("levels are in order", levels::in_order));
    trials.push(Trial::test("levels are as asked", levels::as_asked));
    trials
}

/// Stages as the compiler of the tests compiles them, arranged for instructions that gather, or for others.
#[derive(Clone, Copy)]
struct Any<const GATHERS: bool>;

impl<const GATHERS: bool> SimdToken for Any<GATHERS> {
    const GATHERS: bool = GATHERS;

    fn run<K: LaneKernel>(self, kernel: &K, input: &K::In, output: &mut K::Out) {
        kernel.run(input, output);
    }
}

/// The number of words that differ, which must be equal in both arrangements of stages.
macro_rules! by_either {
    ($token:ident => $words:expr) => {{
        let gathering = {
            let $token = Any::<true>;
            $words
        };
        let $token = Any::<false>;
        assert_eq!(gathering, $words, "words that differ with and without gathering");
        gathering
    }};
}
use by_either;

/// Images of 133 x 29 pixels, so that no row is a multiple of the lanes.
const SIZE: [u32; 2] = [133, 29];
/// Features without textures, with an environment.
const SKY: u32 = FEATURES_UNTEXTURED | FEATURE_ENVIRONMENT;
/// Some rows of them.
const ROWS: [u32; 3] = [2, 13, 22];

/// Settings that each take a way of their own: blocks of one sample and of more than the largest, samples from further on, paths of no
/// segment, of one, and of many, and all flags. The pixels of a row take three batches where blocks are the largest.
fn settings(base: PathParams) -> [PathParams; 9] {
    let all = PathFlags::JITTER | PathFlags::ROULETTE | PathFlags::SOBOL;
    [
        base,
        PathParams { block_log2: 0, flags: all, ..base },
        PathParams { block_log2: 2, first_sample: 12, flags: PathFlags::JITTER, ..base },
        PathParams { block_log2: 3, max_depth: 0, ..base },
        PathParams { block_log2: 1, max_depth: 1, flags: all, ..base },
        PathParams { block_log2: 5, max_depth: 1, flags: PathFlags::JITTER | PathFlags::SOBOL, ..base },
        PathParams { block_log2: 4, max_depth: 2, flags: PathFlags::BLACKMAN_HARRIS | PathFlags::SOBOL, ..base },
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
            let differ = by_either!(token => {
                let mut film = vec![FilmPixel::default(); (SIZE[0] - first) as usize];
                pixels(view, params, [first, y], &mut film, token);
                differing(&film, &single[first as usize..])
            });
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
    pixels(&scene.view(), &params, [0, ROWS[1]], &mut film, Any::<true>);
    let other = PathParams { seed: 6, ..params };
    let single: Vec<_> = (0..SIZE[0]).map(|x| pixel(&scene.view(), &other, x, ROWS[1])).collect();
    let lit = film.iter().zip(&single).filter(|(a, b)| a.sum != [0.0; 3] || b.sum != [0.0; 3]).count();
    let differ = differing(&film, &single);
    ensure(lit > LANES && differ > 2 * lit, || format!("{differ} words differ of {lit} pixels with light"))
}

fn differing<T: Pod>(a: &[T], b: &[T]) -> usize {
    let words = |of| bytemuck::cast_slice::<T, u32>(of);
    words(a).iter().zip(words(b)).filter(|(a, b)| a != b).count()
}

/// Candidates that fill lanes, fewer and more; in one group and in some that end between lanes; from tiles; with and without one from
/// scattering, rays, and what is seen; in several rounds where gloss is seen from elsewhere than before.
fn ways(base: DiParams) -> [DiParams; 9] {
    let averaged = base.flags | Flags::AVERAGE_VISIBILITY | Flags::JITTER;
    let tiled = base.flags | Flags::TILES;
    let renewed = base.renewed_after(elsewhere(base.camera), 15);
    [
        base,
        DiParams { candidates: 1, ..base },
        DiParams { reuse: ReuseParams { frame: 3, flags: averaged, ..base.reuse }, candidates: 37, group: 5, ..base },
        DiParams {
            reuse: ReuseParams { flags: base.flags.without(Flags::SCATTER_CANDIDATE), ..base.reuse },
            candidates: 32,
            ..base
        },
        DiParams {
            reuse: ReuseParams { flags: base.flags.without(Flags::INITIAL_VISIBILITY | Flags::SOBOL), ..base.reuse },
            candidates: 7,
            ..base
        },
        DiParams {
            reuse: ReuseParams { flags: tiled, ..base.reuse },
            candidates: 40,
            group: 10,
            tiles: 3,
            tile_size: 51,
            ..base
        },
        DiParams {
            reuse: ReuseParams { flags: base.flags | Flags::PRIMARY_EMISSION_EXTERNAL, ..base.reuse },
            candidates: 16,
            ..base
        },
        renewed,
        DiParams {
            reuse: ReuseParams { flags: tiled, ..renewed.reuse },
            candidates: 7,
            group: 3,
            tiles: 3,
            tile_size: 51,
            ..renewed
        },
    ]
}

/// The camera, a tenth of the way nearer to the origin.
fn elsewhere(camera: CameraParams) -> CameraParams {
    CameraParams { position: camera.position.map(|x| 0.9 * x), ..camera }
}

fn same_candidates(name: &str) -> Result<(), Failed> {
    let scene = buffers(name)?;
    let view = scene.traced_view();
    for params in ways(DiParams::new(scene.camera.params(SIZE[0], SIZE[1]), SIZE, 5)) {
        let tiles = tiles(&view, &params);
        for y in ROWS {
            let row = Row::one_by_one(&view, &params, &tiles, y);
            row.is_that_of(&view, &params, &tiles, name)?;
            view.within::<FEATURES_UNTEXTURED>().map_or(Ok(()), |view| row.is_that_of(&view, &params, &tiles, name))?;
        }
    }
    Ok(())
}

fn tiles(view: &SceneView<'_>, params: &DiParams) -> Vec<TileWords> {
    let DiParams { reuse: ReuseParams { frame, seed, flags, .. }, tile_size, tiles, .. } = *params;
    let of_tiles = TileParams { tile_size, tiles, frame, seed, flags, ..TileParams::default() };
    let tile = |tile| (0..tile_size).map(move |index| presample(view, &of_tiles, index, tile));
    (0..tiles).flat_map(tile).collect()
}

/// What is found for a row of pixels.
struct Row {
    y: u32,
    hits: Vec<PackedHit>,
    reservoirs: Vec<PackedReservoir>,
    direct: Vec<FilmPixel>,
}

impl Row {
    fn one_by_one(view: &SceneView<'_>, params: &DiParams, tiles: &[TileWords], y: u32) -> Self {
        let hits: Vec<_> = (0..SIZE[0]).map(|x| primary(view, params, [x, y])).collect();
        let made = (0..).zip(&hits).map(|(x, &hit)| initial(view, params, tiles, hit, [x, y]));
        let (reservoirs, direct) = made.map(|made| (made.reservoir, made.direct)).unzip();
        Self { y, hits, reservoirs, direct }
    }

    /// Words that are others by SIMD.
    fn differing<const COMPILED: u32>(
        &self,
        view: &SceneView<'_, COMPILED>,
        params: &DiParams,
        tiles: &[TileWords],
    ) -> usize {
        let mut reservoirs = vec![PackedReservoir::default(); self.hits.len()];
        let mut direct = vec![FilmPixel::default(); self.hits.len()];
        initial_row(view, params, tiles, (&self.hits, [0, self.y]), (&mut reservoirs, &mut direct), Any::<true>);
        differing(&reservoirs, &self.reservoirs) + differing(&direct, &self.direct)
    }

    fn is_that_of<const COMPILED: u32>(
        &self,
        view: &SceneView<'_, COMPILED>,
        params: &DiParams,
        tiles: &[TileWords],
        name: &str,
    ) -> Result<(), Failed> {
        let differ = self.differing(view, params, tiles);
        ensure(differ == 0, || format!("{name}: {differ} words of row {} differ, of {params:?}", self.y))
    }
}

/// With another seed pixels that keep a candidate keep another one.
fn other_candidates() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let (view, params) = (scene.traced_view(), DiParams::new(scene.camera.params(SIZE[0], SIZE[1]), SIZE, 5));
    let row = Row::one_by_one(&view, &params, &[], ROWS[1]);
    let kept = row.reservoirs.iter().filter(|reservoir| Stored::unpack(**reservoir).has_sample()).count();
    let differ = row.differing(&view, &DiParams { reuse: ReuseParams { seed: 6, ..params.reuse }, ..params }, &[]);
    ensure(kept > LANES && differ > kept, || format!("{differ} words differ of {kept} pixels with a sample"))
}

/// Glossy pixels that are seen from elsewhere than before keep other candidates in one round than in several.
fn other_rounds() -> Result<(), Failed> {
    let scene = buffers("glossy")?;
    let view = scene.traced_view();
    let base = DiParams::new(scene.camera.params(SIZE[0], SIZE[1]), SIZE, 5);
    let renewed = base.renewed_after(elsewhere(base.camera), 7);
    let differ = ROWS.map(|y| Row::one_by_one(&view, &renewed, &[], y).differing(&view, &base, &[]));
    ensure(differ.iter().sum::<usize>() > LANES, || format!("words that differ by rows: {differ:?}"))
}
