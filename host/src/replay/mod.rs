//! Replays single samples of a render natively, and shows what happened in them.
//!
//! There is no second copy of the algorithm: the technique itself runs over a scene that writes down what it was
//! asked ([`Recording`]), and once more for each source of light over a scene in which only that source shines
//! ([`Source`]). Radiance is linear in emission, so what each run gives is exactly what the source has added, and the
//! sum in the order of the path has the bits of the sample.

mod genealogy;
mod isolated;
mod layers;
mod lineage;
mod path;
mod recording;
mod two_frames;

pub use genealogy::{Generation, LightSource, Reuse, check_genealogy, genealogy};
pub use isolated::{Isolated, Source};
pub use layers::{Layers, render_with_layers};
pub use lineage::Origin;
pub use path::{Emission, Escape, NextEvent, Path, Vertex, explain};
pub use recording::{Counts, Event, Recording};

use std::ops::ControlFlow;

use restir_shared::layout::FilmPixel;
use restir_shared::scene::{AnyScene, Lights, Still, Surface, Trace};
use restir_shared::technique;
use restir_shared::technique::path::PathParams;

use crate::Error;
use crate::buffers::SceneBuffers;
use crate::exec::{CpuExecutor, Executor, Step, shown};
use crate::plan::{FramePlan, Pass};
use crate::render::{self, RenderSettings};

/// One sample of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Column of the pixel, from the left.
    pub x: u32,
    /// Row of the pixel, from the top.
    pub y: u32,
    /// Index of the sample.
    pub index: u32,
}

/// The parameters of a pass of path tracing that traces the sample `index` of every pixel.
///
/// # Errors
/// As of [`render::check`].
pub fn params(scene: &SceneBuffers, settings: &RenderSettings, index: u32) -> Result<PathParams, Error> {
    let (_, pass) = sample_pass(scene, settings, index)?;
    Ok(bytemuck::pod_read_unaligned(bytemuck::cast_slice(&pass.params)))
}

/// The film of an executor after the sample `index` of every pixel, rows from top to bottom.
///
/// # Errors
/// As of [`render::check`] and of the executor.
pub fn film(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    settings: &RenderSettings,
    index: u32,
) -> Result<Vec<FilmPixel>, Error> {
    let (buffers, pass) = sample_pass(scene, settings, index)?;
    let outputs = vec![pass.bound("film")?];
    let plan =
        FramePlan { buffers, passes: Box::new(std::iter::once(Ok(pass))), pass_count: 1, outputs, scene: Some(scene) };
    let words = executor.run(plan, &mut |_| ControlFlow::Continue(()))?;
    Ok(bytemuck::cast_slice(words.first().map_or(&[], |words| words)).to_vec())
}

/// Runs a plan natively over a scene that stands still, of any type: one that counts what it is asked, or writes it down.
/// `show` sees each pass when it is done, and may end the work with an error.
///
/// # Errors
/// As of [`CpuExecutor::run_over`] and of `show`.
pub fn run(
    scene: &dyn AnyScene,
    plan: FramePlan<'_>,
    show: &mut dyn FnMut(&Step<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    shown(|observe| CpuExecutor::run_over(&Still(scene), plan, observe).map(drop), show)
}

/// Traces one sample natively over any scene; `params` are those of [`params`] for that sample.
pub fn trace(scene: &(impl Trace + Surface + Lights), params: &PathParams, x: u32, y: u32) -> FilmPixel {
    technique::path::pixel(scene, params, x, y)
}

/// The first pass of a render of one sample, moved to the sample `index`, with the plan's buffers.
fn sample_pass(
    scene: &SceneBuffers,
    settings: &RenderSettings,
    index: u32,
) -> Result<(Vec<crate::plan::Buffer>, Pass), Error> {
    let settings = RenderSettings { samples: 1, ..settings.clone() };
    render::check(scene, &settings)?;
    let mut plan = render::path_plan(scene, &settings);
    let Some(Ok(mut pass)) = plan.passes.next() else {
        return Err(Error::Setting("a plan without a pass cannot be replayed; correct the plan".to_owned()));
    };
    let mut params: PathParams = bytemuck::pod_read_unaligned(bytemuck::cast_slice(&pass.params));
    params.first_sample = index;
    pass.params = bytemuck::cast_slice(&[params]).to_vec();
    drop(plan.passes);
    Ok((plan.buffers, pass))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::PathSettings;
    use crate::scene::Scene;
    use restir_shared::glam::Vec3;

    fn settings(roulette: bool) -> RenderSettings {
        let path = PathSettings { max_depth: 8, jitter: true, roulette };
        RenderSettings { width: 12, height: 10, samples: 1, seed: 5, path, dispatch_samples: None }
    }

    fn bits(v: Vec3) -> [u32; 3] {
        v.to_array().map(f32::to_bits)
    }

    #[test]
    fn a_replayed_path_has_the_bits_of_the_film_and_so_has_the_sum_of_its_parts() {
        let mut cpu = CpuExecutor::new(Some(1)).unwrap();
        for (name, roulette) in [("cornell", false), ("cornell", true), ("furnace", false)] {
            let scene = SceneBuffers::build(&Scene::load(name).unwrap()).unwrap();
            let settings = settings(roulette);
            for index in [0, 7] {
                let film = film(&mut cpu, &scene, &settings, index).unwrap();
                for (i, pixel) in film.iter().enumerate() {
                    let sample = Sample { x: i as u32 % 12, y: i as u32 / 12, index };
                    let path = explain(&scene, &settings, sample).unwrap();
                    assert_eq!(bits(path.radiance), pixel.sum.map(f32::to_bits), "{name} {sample:?}");
                    assert_eq!(bits(path.radiance), bits(path.sum_of_parts()), "{name} {sample:?}");
                }
            }
        }
    }

    #[test]
    fn a_path_through_the_furnace_is_as_it_must_be() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let settings = settings(false);
        let path = explain(&scene, &settings, Sample { x: 3, y: 4, index: 2 }).unwrap();
        // closed, so every path has its full length; it reflects half and emits 1
        assert_eq!(path.vertices.len(), 8);
        for (i, vertex) in path.vertices.iter().enumerate() {
            assert_eq!(vertex.throughput, Vec3::splat(1.0 / (1 << i) as f32));
            assert_eq!(vertex.emission.radiance, Vec3::ONE);
            assert_eq!(vertex.next_event.is_some(), i < 7, "the last vertex gathers nothing");
            let weight = vertex.emission.weight;
            assert!(if i == 0 { weight == 1.0 } else { weight > 0.0 && weight < 1.0 });
        }
        // Lambertian: the density of a direction is its cosine over pi
        for pair in path.vertices.windows(2) {
            let cos = restir_shared::vec::dot(pair[0].normal, pair[1].direction).abs();
            let expected = f64::from(cos) * std::f64::consts::FRAC_1_PI;
            assert!((f64::from(pair[1].scatter_pdf) / expected - 1.0).abs() < 1e-4, "{}", pair[1].scatter_pdf);
        }
    }

    #[test]
    fn queries_are_counted() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let settings = settings(false);
        let view = scene.view();
        let recording = Recording::new(&view);
        trace(&recording, &params(&scene, &settings, 0).unwrap(), 1, 1);
        let counts = recording.counts();
        assert_eq!((counts.closest, counts.surfaces, counts.light_samples), (8, 8, 7));
        assert!(counts.shadow <= 7 && counts.shadow > 0);
    }

    #[test]
    fn samples_out_of_range_are_refused() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let message = explain(&scene, &settings(false), Sample { x: 12, y: 0, index: 0 }).unwrap_err().to_string();
        assert!(message.contains("(12, 0)") && message.contains("12 x 10"), "{message}");
    }
}
