//! The contract between the parts: layout, film, features, embedding, subnormal numbers.

use libtest_mimic::Failed;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRng, TestRunner};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::Material;
use restir_host::settings::Choice as _;
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_kernels::check::diffusion_check;
use restir_kernels::spirv::{self, Flavour};
use restir_shared::bsdf;
use restir_shared::camera::primary_ray;
use restir_shared::color;
use restir_shared::film::{MAX_BLOCK_LOG2, sum_block};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::layout::{
    CameraParams, FEATURE_LIGHT_TABLE, FEATURES_ALL, FilmPixel, LIGHT_WORDS, NONE, TRIANGLE_WORDS,
};
use restir_shared::num::{self, FLUSH_BELOW, soft};
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{SceneView, Surface, SurfacePoint, Trace};
use restir_shared::technique::path::{self, PathFlags, PathParams};
use restir_tests::brute::Triangles;
use restir_tests::cases;
use restir_tests::flush::with_flush_to_zero;
use restir_tests::foreign::HollowSphere;
use restir_tests::lockstep::{self, trace};
use restir_tests::native::plan;
use restir_tests::parity;
use restir_tests::random::SplitMix;
use restir_tests::scenes::{self, Quad, Setting, path_params, room, terrace};
use restir_tests::stats::Moments;
use restir_tests::suite::ensure;
use restir_tests::technique::Trials;
use std::collections::HashSet;
use std::hint::black_box;

restir_tests::suite! {
    first {
        every_kernel_is_embedded_in_both_flavours
    }
    later {
        any_split_into_blocks_has_the_same_bits a_running_sum_is_not_a_film dropped_samples_are_counted
        blocks_of_a_pixel_merge_to_the_pixel arenas_hold_the_scene a_frozen_feature_changes_no_bit
        a_foreign_scene_can_be_traced a_stored_hit_can_be_seen_from_elsewhere flush_to_zero_changes_no_film_word
        flush_to_zero_changes_no_word_of_any_technique flush_to_zero_changes_no_word_of_media an_unflushed_sum_is_seen
        flush_to_zero_changes_no_function flush_to_zero_changes_no_diffusion_probe
    }
}

fn every_kernel_is_embedded_in_both_flavours() {
    for kernel in restir_kernels::all().iter().filter(|kernel| kernel.name != "size_probe") {
        for flavour in Flavour::ALL {
            let path = format!("{flavour}/{}.spv", kernel.name);
            assert!(spirv::file(&path).is_some(), "{path}");
        }
    }
    assert!(spirv::file("manifest.json").is_some() && spirv::file("").is_none());
}

fn words(pixel: FilmPixel) -> [u32; 4] {
    bytemuck::cast(pixel)
}

/// Radiance of all magnitudes, some of it not finite.
fn radiance(seed: u64, sample: u32) -> Vec3 {
    let mut random = SplitMix::new(seed << 32 | u64::from(sample));
    let scale = f64::exp2(random.range(-140.0, 60.0));
    match random.below(40) {
        0 => Vec3::new(f32::NAN, 1.0, 1.0),
        1 => Vec3::new(1.0, f32::INFINITY, 1.0),
        _ => Vec3::new((scale * random.unit()) as f32, random.unit() as f32, (10.0 * random.unit()) as f32),
    }
}

/// The sum over 2^`log2` samples: in one block where it is small enough and `split` says so, else of two halves.
fn sum_in_parts(first: u32, log2: u32, seed: u64, split: &mut SplitMix) -> FilmPixel {
    if log2 == 0 || (log2 <= MAX_BLOCK_LOG2 && split.below(3) == 0) {
        return sum_block(first, log2, |sample| radiance(seed, sample));
    }
    let half = 1 << (log2 - 1);
    // the right half may be computed first: on another thread or machine
    let right = sum_in_parts(first + half, log2 - 1, seed, split);
    sum_in_parts(first, log2 - 1, seed, split).merge(right)
}

fn any_split_into_blocks_has_the_same_bits() -> Result<(), Failed> {
    let config = Config { cases: 500, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(Default::default()))
        .run(&(0_u32..11, 0_u32..1000, any::<u32>(), any::<u64>()), |(log2, block, seed, split)| {
            let first = block << log2;
            let one = sum_in_parts(first, log2, u64::from(seed), &mut SplitMix::new(split));
            let other = sum_in_parts(first, log2, u64::from(seed), &mut SplitMix::new(!split));
            prop_assert_eq!(words(one), words(other));
            Ok(())
        })
        .map_err(Failed::from)
}

/// The check above sees a sum whose shape depends on the split.
fn a_running_sum_is_not_a_film() -> Result<(), Failed> {
    let running = |range: std::ops::Range<u32>| {
        let zero = FilmPixel::from_radiance(Vec3::ZERO);
        range.fold(zero, |sum, sample| sum.merge(FilmPixel::from_radiance(radiance(1, sample))))
    };
    let whole = running(0..64);
    let halves = running(0..32).merge(running(32..64));
    ensure(words(whole) != words(halves), || "a running sum does not depend on the split".to_owned())
}

fn dropped_samples_are_counted() -> Result<(), Failed> {
    let wrong = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let pixel = sum_block(0, 3, |sample| Vec3::new(1.0, wrong.get(sample as usize).copied().unwrap_or(1.0), 1.0));
    ensure(pixel.dropped == 3.0 && pixel.sum == [5.0; 3], || format!("{pixel:?}"))
}

fn blocks_of_a_pixel_merge_to_the_pixel() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let pixel = |first_sample: u32, block_log2: u32, x: u32, y: u32| {
        let params = PathParams { first_sample, block_log2, ..setting.params(&buffers, PathFlags::JITTER) };
        path::pixel(&buffers.view(), &params, x, y)
    };
    for (x, y) in [(3, 20), (15, 10), (31, 31)] {
        let whole = pixel(64, 6, x, y);
        let parts = pixel(64, 5, x, y).merge(pixel(96, 4, x, y).merge(pixel(112, 4, x, y)));
        ensure(words(whole) == words(parts), || format!("({x}, {y}): {whole:?} is not {parts:?}"))?;
    }
    Ok(())
}

/// Every triangle of the setting is in the arenas once, with its material, and lights and triangles refer to each
/// other.
fn arenas_hold_the_scene() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let view = buffers.view();
    let triangles = Triangles::new(view);
    let halves = |quad: &Quad| {
        let [a, b, c, d] = quad.corners.map(|corner| corner.map(f32::to_bits));
        [[a, b, c], [a, c, d]].map(|corners| (corners, quad.material as u32))
    };
    let mut expected: HashSet<_> = setting.quads.iter().flat_map(halves).collect();
    ensure(triangles.len() == expected.len(), || format!("{} triangles", triangles.len()))?;
    let mut lights = HashSet::new();
    for id in 0..triangles.len() {
        let at = (view.header.triangle_base + id as u32 * TRIANGLE_WORDS) as usize;
        let (material, light) = (view.geometry[at].w, view.geometry[at + 1].w);
        let corners = triangles.get(id).map(|v| v.to_array().map(f32::to_bits));
        ensure(expected.remove(&(corners, material)), || format!("triangle {id} is not of the scene"))?;
        let Material { base_color, emission, .. } = setting.materials[material as usize];
        ensure((light != NONE) == (emission != [0.0; 3]), || format!("triangle {id} has light {light}"))?;
        if light != NONE {
            let record = view.attributes[(view.header.light_base + light * LIGHT_WORDS) as usize];
            ensure(record.x == id as u32 && lights.insert(light), || format!("light {light} is not triangle {id}"))?;
        }
        let [a, b, c] = triangles.get(id);
        let normal = (b - a).cross(c - a);
        let ray = Ray { origin: (a + b + c) * (1.0 / 3.0) + normal, direction: -normal, t_max: Ray::FAR, key: 0 };
        let hit = Hit { t: 1.0, id: id as u32, uv: Vec2::splat(0.25) };
        let point = view.surface(&ray, &hit);
        let found = [point.material.base_color, point.emission].map(|rgb| rgb.to_array());
        ensure(found == [base_color, emission], || format!("triangle {id} has another material"))?;
    }
    ensure(lights.len() == view.header.light_count as usize, || "lights without triangles".to_owned())
}

fn film(view: &SceneView<'_>, params: &PathParams) -> Vec<u32> {
    let pixels = (0..params.height).flat_map(|y| (0..params.width).map(move |x| (x, y)));
    pixels.flat_map(|(x, y)| words(path::pixel(view, params, x, y))).collect()
}

fn a_frozen_feature_changes_no_bit() -> Result<(), Failed> {
    for setting in [room(), terrace()] {
        let buffers = setting.buffers();
        let params = PathParams { block_log2: 2, ..setting.params(&buffers, PathFlags::JITTER) };
        let with = |features: u32| SceneView { features, ..buffers.view() };
        let needs_table = buffers.features & FEATURE_LIGHT_TABLE != 0;
        println!("{}: alias table {needs_table}", setting.name);
        // the two halves of the room's light have equal power, the emitters of the terrace differ
        ensure(needs_table == (setting.name == "terrace"), || "the features do not fit the scene".to_owned())?;
        let frozen = film(&with(buffers.features), &params);
        ensure(frozen == film(&with(FEATURES_ALL), &params), || format!("{}: general differs", setting.name))?;
        let without = film(&with(buffers.features & !FEATURE_LIGHT_TABLE), &params);
        ensure((without == frozen) != needs_table, || format!("{}: the feature has no effect", setting.name))?;
    }
    Ok(())
}

fn a_foreign_scene_can_be_traced() -> Result<(), Failed> {
    let sphere = HollowSphere { radius: 2.0, reflectance: 0.5, emission: 1.0 };
    let max_depth = 4;
    let ray = Ray { origin: Vec3::new(0.3, -0.2, 0.1), direction: Vec3::Z, t_max: Ray::FAR, key: 0 };
    let estimate = |i: u32| path::radiance(&sphere, ray, &Rng::new(0, 0, i, 1, Sampler::Independent), max_depth, false);
    let moments: Moments = (0..100_000).map(|i| f64::from(estimate(i).y)).collect();
    let exact = 2.0 * (1.0 - 0.5_f64.powi(max_depth as i32));
    println!("hollow sphere: {:.5} +- {:.5} for {exact}", moments.mean(), moments.standard_error());
    let params = PathParams {
        camera: CameraParams { forward: [0.0, 0.0, 1.0], ..CameraParams::default() },
        width: 1,
        height: 1,
        max_depth: 1,
        ..PathParams::default()
    };
    ensure(path::pixel(&sphere, &params, 0, 0).sum == [1.0; 3], || "emission is not seen".to_owned())?;
    // the spawn offset of 10^-4 radii changes form factors by its square
    let z = (moments.mean() - exact) / moments.standard_error();
    ensure(z.abs() <= 3.0, || format!("{} is {z:.1} standard errors from {exact}", moments.mean()))
}

/// The place of a point, its normal, and how far off a ray begins, bit by bit.
fn place<M>(point: &SurfacePoint<M>) -> [u32; 7] {
    let ([x, y, z], [a, b, c]) = (point.position.to_array(), point.normal.to_array());
    [x, y, z, a, b, c, point.offset].map(f32::to_bits)
}

/// Whether what is at a hit is the same when it is asked for along a ray that was never traced.
fn keeps_its_place(scene: &(impl Trace + Surface), ray: Ray) -> bool {
    let hit = scene.closest(&ray);
    let from_elsewhere = Ray { origin: ray.origin + Vec3::splat(0.4), direction: -ray.direction, ..ray };
    let stored = Hit { t: 0.0, ..hit };
    place(&scene.surface(&ray, &hit)) == place(&scene.surface(&from_elsewhere, &stored))
}

/// A scene whose points lie where the ray happens to end.
struct AlongTheRay<S>(S);

impl<S: Trace> Trace for AlongTheRay<S> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.0.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }
}

impl<S: Surface<Material = bsdf::Material>> Surface for AlongTheRay<S> {
    type Material = bsdf::Material;

    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        SurfacePoint { position: ray.origin + ray.direction * hit.t, ..self.0.surface(ray, hit) }
    }
}

fn a_stored_hit_can_be_seen_from_elsewhere() -> Result<(), Failed> {
    let sphere = HollowSphere { radius: 2.0, reflectance: 0.5, emission: 1.0 };
    let buffers = restir_tests::scenes::buffers("all-lights")?;
    let camera = buffers.camera.params(16, 16);
    for i in 0..256 {
        let primary = primary_ray(&camera, Vec2::new((i % 16) as f32, (i / 16) as f32), Vec2::ZERO);
        let inside = Ray { origin: Vec3::new(0.3, -0.2, 0.1), ..primary };
        ensure(keeps_its_place(&sphere, inside), || format!("sphere, ray {i}"))?;
        let hits = buffers.view().closest(&primary).is_hit();
        ensure(!hits || keeps_its_place(&buffers.view(), primary), || format!("all-lights, ray {i}"))?;
        ensure(!keeps_its_place(&AlongTheRay(sphere), inside), || "a point along the ray goes unnoticed".to_owned())?;
    }
    Ok(())
}

/// What light is multiplied by to be just above what counts as zero.
const DIM: f32 = 1.0e-29;

/// A room so dim that what it reflects is subnormal.
fn dim() -> Setting {
    let mut setting = room();
    setting.name = "dim room";
    for material in &mut setting.materials {
        material.base_color = material.base_color.map(|x| x * 1.0e-13);
        material.emission = material.emission.map(|x| x * 1.0e-26);
    }
    setting
}

/// Buffers of a scene and parameters for a small image of it.
fn flush_cases() -> Result<Vec<(&'static str, SceneBuffers, PathParams)>, Failed> {
    let settings = [room(), terrace(), dim()].map(|setting| {
        let buffers = setting.buffers();
        let params = setting.params(&buffers, PathFlags::JITTER | PathFlags::ROULETTE);
        Ok((setting.name, buffers, params))
    });
    let builtin = ["cornell", "cornell-mitsuba", "furnace", "masks", "sheets"].map(|name| {
        let buffers = scenes::buffers(name)?;
        let params = PathParams { flags: PathFlags::JITTER, ..path_params(&buffers, [32, 32], 12) };
        Ok((name, buffers, params))
    });
    settings.into_iter().chain(builtin).collect()
}

/// Whether the mode is on: the smallest normal number halved is zero.
#[inline(never)]
fn flushes() -> bool {
    black_box(black_box(f32::MIN_POSITIVE) * black_box(0.5)) == 0.0
}

fn flush_to_zero_changes_no_film_word() -> Result<(), Failed> {
    ensure(!flushes(), || "subnormal numbers are flushed without being asked".to_owned())?;
    for (name, buffers, params) in flush_cases()? {
        let params = PathParams { block_log2: 4, ..params };
        let view = buffers.view();
        let usual = film(black_box(&view), black_box(&params));
        let Some((on, flushed)) = with_flush_to_zero(|| (flushes(), film(black_box(&view), black_box(&params)))) else {
            println!("SKIPPED: this processor's flush-to-zero mode is not known");
            return Ok(());
        };
        ensure(on, || "the mode had no effect".to_owned())?;
        let changed = usual.iter().zip(&flushed).filter(|(a, b)| a != b).count();
        println!("{name}: {changed} of {} film words change", usual.len());
        ensure(changed == 0, || format!("{name}: {changed} film words change"))?;
    }
    Ok(())
}

/// All planes after every pass, by all settings that are tried of a technique, on scenes with all kinds of surfaces and lights.
fn flush_to_zero_changes_no_word_of_any_technique() -> Result<(), Failed> {
    for name in ["moving", "glass", "foliage"] {
        let buffers = scenes::buffers(name)?;
        // the tree is the same either way, and is made once
        buffers.tracer();
        for (what, technique) in Trials::all().iter().flat_map(Trials::rows) {
            let render = Render { count: 3, accumulate: true, ..Render::new([10, 8], technique) };
            flush_to_zero_changes_no_word(&format!("{name}, {what}"), &buffers, &render, Compared::AllBuffers)?;
        }
    }
    Ok(())
}

/// The same of light inside of bodies: walks, which make throughputs small, profiles, and clear borders. Of light that is nearly subnormal it is the
/// film that has the same words: what walkers have found so far may be below what counts as zero, and is flushed when it gets there.
fn flush_to_zero_changes_no_word_of_media() -> Result<(), Failed> {
    for name in ["moving-media", "clear-media", "slab"] {
        let usual = scenes::named(name).ok_or("no such scene")?;
        let mut dim = usual.clone();
        dim.materials.iter_mut().for_each(|material| material.emission = material.emission.map(|x| x * DIM));
        dim.lights.iter_mut().for_each(|light| light.intensity = light.intensity.map(|x| x * DIM));
        dim.environment.iter_mut().for_each(|environment| environment.scale *= DIM);
        for (light, scene, what) in [("usual", usual, Compared::AllBuffers), ("dim", dim, Compared::Film)] {
            let buffers = SceneBuffers::build(&scene)?;
            buffers.tracer();
            for subsurface in [Subsurface::Walk, Subsurface::Hybrid, Subsurface::Diffusion] {
                let settings = PathSettings { longest_walk: 200, subsurface, ..PathSettings::default() };
                let render = Render { count: 3, ..Render::new([10, 8], settings) };
                let title = format!("{name}, {light} light, {}", subsurface.name());
                flush_to_zero_changes_no_word(&title, &buffers, &render, what)?;
            }
        }
    }
    Ok(())
}

/// In which words nothing may change.
#[derive(Clone, Copy, PartialEq)]
enum Compared {
    /// After every pass.
    AllBuffers,
    /// After the last.
    Film,
}

fn flush_to_zero_changes_no_word(
    title: &str,
    buffers: &SceneBuffers,
    render: &Render,
    what: Compared,
) -> Result<(), Failed> {
    let run = || trace(&mut CpuExecutor::inline(), plan(buffers, render));
    let usual = run()?;
    let Some(flushed) = with_flush_to_zero(run) else { return Ok(()) };
    let (flushed, film) = (flushed?, plan(buffers, render).outputs[0]);
    let last = |trace: &lockstep::Trace| trace.last().map(|buffers| buffers[film].clone());
    let same = match what {
        Compared::AllBuffers => usual == flushed,
        Compared::Film => last(&usual) == last(&flushed),
    };
    ensure(same, || format!("{title}: words change"))?;
    // light that is flushed altogether would show nothing
    ensure(last(&usual).is_some_and(|film| film.iter().any(|word| *word != 0)), || format!("{title}: no light"))
}

/// The check above sees a technique that leaves out the film's named point of flushing.
fn an_unflushed_sum_is_seen() -> Result<(), Failed> {
    let setting = dim();
    let buffers = setting.buffers();
    let view = buffers.view();
    let params = setting.params(&buffers, PathFlags::NONE);
    let unflushed = || -> Vec<u32> {
        let sample = |i: u32| {
            let ray = primary_ray(&params.camera, Vec2::new((i % 32) as f32, 24.5), Vec2::ZERO);
            path::radiance(black_box(&view), ray, &Rng::new(i, 24, 0, 1, Sampler::Independent), 3, false)
        };
        (0..1024).flat_map(|i| sample(i).to_array().map(f32::to_bits)).collect()
    };
    match with_flush_to_zero(unflushed) {
        Some(flushed) => ensure(flushed != unflushed(), || "subnormal radiance goes unnoticed".to_owned()),
        None => Ok(()),
    }
}

/// Results of every scalar function for one pair of operands of magnitude 2^-100 and more.
fn functions(a: f32, b: f32) -> [u32; 25] {
    let flushed = |x: f32| num::flush(x).to_bits();
    let (sin, cos) = num::sin_cos(a);
    [
        num::exp(a).to_bits(),
        num::ln(num::abs(a)).to_bits(),
        flushed(sin),
        flushed(cos),
        flushed(num::atan2(a, b)),
        flushed(num::div(a, b)),
        flushed(soft::div(a, b)),
        flushed(soft::recip(a)),
        flushed(soft::sqrt(num::abs(a))),
        flushed(soft::rsqrt(num::abs(a))),
        flushed(num::recip(a)),
        flushed(num::sqrt(num::abs(a))),
        flushed(num::rsqrt(num::abs(a))),
        flushed(num::exp2(a)),
        flushed(num::expm1(a)),
        flushed(num::log2(num::abs(a))),
        flushed(num::ln_1p(a)),
        flushed(num::sinh(a)),
        flushed(num::asinh(a)),
        flushed(num::acos(a)),
        flushed(num::asin(a)),
        flushed(num::cbrt(a)),
        flushed(num::pow(num::abs(a), b)),
        flushed(color::srgb_encode(a)),
        flushed(color::srgb_decode(a)),
    ]
}

/// Profiles and their samples far from where light enters, where densities are nearly zero.
fn flush_to_zero_changes_no_diffusion_probe() -> Result<(), Failed> {
    for case in cases::of_kernel(&diffusion_check::DESC)? {
        let probed = || parity::run(&mut CpuExecutor::inline(), case);
        let Some(flushed) = with_flush_to_zero(probed) else { return Ok(()) };
        let (usual, flushed) = (probed()?.concat(), flushed?.concat());
        let changed = usual.iter().zip(&flushed).filter(|(a, b)| a != b).count();
        ensure(changed == 0, || format!("{}: {changed} words change", case.name))?;
    }
    Ok(())
}

fn flush_to_zero_changes_no_function() -> Result<(), Failed> {
    let number = |random: &mut SplitMix| loop {
        let x = f32::from_bits(random.word() as u32);
        if x.is_finite() && num::abs(x) >= FLUSH_BELOW {
            return x;
        }
    };
    let mut random = SplitMix::new(1);
    let pairs: Vec<_> = (0..1_000_000).map(|_| (number(&mut random), number(&mut random))).collect();
    let all = || -> Vec<_> { black_box(&pairs).iter().map(|&(a, b)| functions(a, b)).collect() };
    let usual = all();
    let Some(flushed) = with_flush_to_zero(all) else {
        println!("SKIPPED: this processor's flush-to-zero mode is not known");
        return Ok(());
    };
    for ((a, b), (x, y)) in pairs.iter().zip(usual.iter().zip(&flushed)) {
        ensure(x == y, || format!("{a:e}, {b:e}: {x:08x?} becomes {y:08x?}"))?;
    }
    Ok(())
}
