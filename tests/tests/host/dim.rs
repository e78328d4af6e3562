//! The range of brightness in which light is kept: pictures by brighter and dimmer lights have the same bits but for the factor, which is
//! a power of two.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{EMISSION_RANGE, Scene, builtin};
use restir_host::technique;
use restir_tests::suite::Trial;

/// Lit by surfaces, by small lights as well, and by an environment.
const SCENES: [&str; 3] = ["cornell", "moving", "glass"];
const TECHNIQUES: [&str; 4] = ["path", "restir-di", "restir-pt", "restir-suffix"];
/// A part of light so dim is lost: at least this one.
const DIM: f32 = 1.0e-28;
const LOST: f64 = 0.01;

pub(crate) fn trials() -> Vec<Trial> {
    let pairs = SCENES.iter().flat_map(|scene| TECHNIQUES.map(|technique| (*scene, technique)));
    let trial = |(scene, technique)| {
        Trial::test(format!("{scene}/{technique}"), move || light_is_kept_in_the_range(scene, technique))
    };
    pairs.map(trial).collect()
}

/// The scene with all its light times a factor.
fn scaled(scene: &Scene, factor: f64) -> Scene {
    let factor = factor as f32;
    let mut scene = scene.clone();
    scene.materials.iter_mut().for_each(|material| material.emission = material.emission.map(|x| x * factor));
    scene.lights.iter_mut().for_each(|light| light.intensity = light.intensity.map(|x| x * factor));
    scene.environment.iter_mut().for_each(|environment| environment.scale *= factor);
    scene
}

fn brightest(scene: &Scene) -> f32 {
    let surfaces = scene.materials.iter().flat_map(|material| material.emission);
    let lights = scene.lights.iter().flat_map(|light| light.intensity);
    surfaces.chain(lights).fold(0.0, f32::max)
}

/// The factor, a power of two, that takes the brightest emission to a bound and not beyond it.
fn factor(scene: &Scene, bound: f32) -> f64 {
    let ratio = f64::from(bound) / f64::from(brightest(scene));
    let steps = if ratio > 1.0 { ratio.log2().floor() } else { ratio.log2().ceil() };
    steps.exp2()
}

fn picture(scene: &Scene, technique: &str) -> Result<Image, Failed> {
    let technique = technique::named(technique)?;
    let render = Render { count: 4, ..Render::new([24, 18], technique) };
    Ok(render.render(&SceneBuffers::build(scene)?, &mut CpuExecutor::new()?)?.image)
}

fn mean(image: &Image) -> f64 {
    image.pixels.iter().flatten().copied().map(f64::from).sum::<f64>() / image.pixels.len() as f64
}

/// The warnings of light.
fn warned(mut scene: Scene) -> bool {
    scene.warn_of_dim_light();
    scene.warnings.iter().any(|warning| warning.contains("single precision"))
}

fn light_is_kept_in_the_range(name: &str, technique: &str) -> Result<(), Failed> {
    let scene = builtin::scene(name).ok_or("no such scene")?;
    let right = picture(&scene, technique)?;
    for bound in EMISSION_RANGE {
        let factor = factor(&scene, bound);
        let scene = scaled(&scene, factor);
        let found = picture(&scene, technique)?;
        let same = |(found, right): (&f32, &f32)| f64::from(*found) == f64::from(*right) * factor;
        let kept = found.pixels.as_flattened().iter().zip(right.pixels.as_flattened()).all(same);
        assert!(kept, "light of {bound:e} is not kept: {:e}", mean(&found) / mean(&right) / factor - 1.0);
        assert!(!warned(scene), "light of {bound:e} is warned of");
    }
    let [factor, above] = [DIM, 4.0 * EMISSION_RANGE[1]].map(|bound| factor(&scene, bound));
    let dim = scaled(&scene, factor);
    let lost = 1.0 - mean(&picture(&dim, technique)?) / mean(&right) / factor;
    println!("{name}: of {DIM:e} a part of {lost:.2} is lost");
    assert!(lost > LOST && warned(dim) && warned(scaled(&scene, above)));
    Ok(())
}
