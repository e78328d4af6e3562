//! Filters of pixels: what path tracing's image is the mean of, against the convolution with the filter in `f64`.

use glam::{DAffine3, DVec3};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::{Camera, Environment, Instance, Material, Mesh, Scene};
use restir_host::technique::PixelFilter;
use restir_host::technique::path::PathSettings;
use restir_tests::stats::effort::draws;
use restir_tests::stats::{FAMILY_RATE, Family, ZTest, two_sided_p};
use std::f64::consts::TAU;
use std::sync::Arc;

restir_tests::suite! {
    later {
        an_edge_is_convolved_with_the_filter what_is_constant_stays centres_are_not_filtered
    }
}

const SIZE: [u32; 2] = [6, 5];
/// With them a false alarm has the rate [`FAMILY_RATE`], and an error of 0.003 in any pixel's share of light, 0.008 of fewer [`draws`], is seen for
/// certain: it is at least 8 standard errors, which are largest where half of the samples are lit, and 4.2 fail.
const SAMPLES: u32 = 1 << 21;

/// Coefficients of the four-term window (Harris 1978).
const WINDOW: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];

/// A filter's share before a distance from its middle, in pixels.
type Share = fn(f64) -> f64;

/// That of the Blackman-Harris filter of 3 pixels.
fn blackman_harris(pixels: f64) -> f64 {
    let x = (pixels / 3.0).clamp(-0.5, 0.5);
    let wave = |k: usize| WINDOW[k] / WINDOW[0] * (TAU * k as f64 * x).sin() / (TAU * k as f64);
    0.5 + x + wave(1) + wave(2) + wave(3)
}

/// That of the box.
fn uniform(pixels: f64) -> f64 {
    (pixels + 0.5).clamp(0.0, 1.0)
}

/// The corner of a lamp, in pixels from the upper left corner of the image: it fills what is left of and above it.
const CORNER: [f64; 2] = [2.8, 2.3];

/// The lamp before a black sky.
fn corner() -> Scene {
    let camera = Camera::pinhole(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.5);
    let params = camera.params(SIZE[0], SIZE[1]);
    let half = [f64::from(params.right[0]), f64::from(params.up[1])].map(|x| x / f64::from(-params.forward[2]));
    let x = (CORNER[0] / f64::from(SIZE[0]) * 2.0 - 1.0) * half[0];
    let y = (1.0 - CORNER[1] / f64::from(SIZE[1]) * 2.0) * half[1];
    let origin = DVec3::new(x - 4.0, y, -1.0);
    let mut scene = Scene { name: "corner".to_owned(), camera: Some(camera), ..Scene::default() };
    scene.add_quad_light(origin, [DVec3::X * 4.0, DVec3::Y * 4.0], [1.0; 3], true);
    scene
}

fn settings(filter: PixelFilter) -> PathSettings {
    PathSettings { max_depth: 1, filter, ..PathSettings::default() }
}

/// The green channel of every pixel.
fn image(scene: &Scene, filter: PixelFilter, samples: u32) -> Vec<f64> {
    let scene = SceneBuffers::build(scene).expect("a valid scene");
    let render_of = Render { count: samples, seed: 3, ..Render::new(SIZE, settings(filter)) };
    let mut cpu = CpuExecutor::new().expect("a processor");
    let rendered = render_of.render(&scene, &mut cpu).expect("an image");
    rendered.image.pixels.iter().map(|rgb| f64::from(rgb[1])).collect()
}

/// The pixels of an image of the corner against their shares of light, by the distribution function of the filter.
fn family(image: &[f64], share: Share) -> Family {
    let mut family = Family::new("edges", FAMILY_RATE);
    for (i, &found) in image.iter().enumerate() {
        let at = [i % SIZE[0] as usize, i / SIZE[0] as usize];
        let [x, y] = [0, 1].map(|axis| share(CORNER[axis] - 0.5 - at[axis] as f64));
        let lit = x * y;
        // of a hit or a miss; a cell of random numbers, and the rounding of the lamp's corner, move edges by 1e-6 of a pixel
        let standard_error = (lit * (1.0 - lit) / f64::from(draws(SAMPLES))).sqrt().max(1.0e-6);
        let (difference, z) = (found - lit, (found - lit) / standard_error);
        family.z_test(format!("pixel {at:?}"), ZTest { difference, standard_error, z, p: two_sided_p(z) });
    }
    family
}

fn an_edge_is_convolved_with_the_filter() {
    let [plain, filtered] =
        [PixelFilter::Box, PixelFilter::BlackmanHarris].map(|filter| image(&corner(), filter, draws(SAMPLES)));
    family(&plain, uniform).assert();
    family(&filtered, blackman_harris).assert();
    // a window that is too wide by 2 %
    let wide = |pixels: f64| blackman_harris(pixels / 1.02);
    let others: [Share; 3] = [blackman_harris, uniform, wide];
    for (image, share) in [&plain, &filtered, &filtered].into_iter().zip(others) {
        assert!(!family(image, share).passed(), "another filter is taken for this one");
    }
}

/// The sky of one colour has it in every pixel, bit for bit.
fn what_is_constant_stays() {
    let sky = |value: f32| Environment {
        name: "sky".to_owned(),
        size: [2, 1],
        pixels: vec![[value; 3]; 2].into(),
        scale: 1.0,
        rotation: 0.0,
    };
    // behind the camera, for a scene has a surface
    let mesh = Mesh::quad(DVec3::new(0.0, 0.0, 5.0), [DVec3::X, DVec3::Y]);
    let scene = Scene {
        name: "sky".to_owned(),
        camera: Some(Camera::pinhole(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.5)),
        materials: vec![Material::diffuse("unseen", [0.5; 3])],
        meshes: vec![Arc::new(mesh)],
        instances: vec![Instance::new(0, DAffine3::IDENTITY)],
        environment: Some(sky(0.75)),
        ..Scene::default()
    };
    let filtered = image(&scene, PixelFilter::BlackmanHarris, 64);
    assert_eq!(filtered, vec![0.75; (SIZE[0] * SIZE[1]) as usize]);
}

fn centres_are_not_filtered() {
    let scene = SceneBuffers::build(&corner()).expect("a valid scene");
    let settings = PathSettings { jitter: false, ..settings(PixelFilter::BlackmanHarris) };
    let problem = Render::new(SIZE, settings).check(&scene).expect_err("a filter of centres").to_string();
    assert!(problem.contains("filter") && problem.contains("jitter=off"), "{problem}");
}
