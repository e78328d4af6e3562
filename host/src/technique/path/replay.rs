//! Replays single samples of a render natively, and shows what happened in them.
//!
//! There is no second copy of the algorithm: the technique itself runs, and what it finds goes to a receiver that writes it down
//! ([`explain_sample`](super::explain_sample)). The sum of that in the order of the path has the bits of the sample.

use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::PathParams;
use std::sync::Arc;

use crate::plan::{Buffer, FramePlan, Pass};
use crate::render::Render;
use crate::{Error, buffers::SceneBuffers, exec::Executor};

/// The parameters of a pass of path tracing that traces the sample `index` of every pixel.
///
/// # Errors
/// As of [`Render::check`].
pub fn params(scene: &SceneBuffers, render: &Render, index: u32) -> Result<PathParams, Error> {
    sample_pass(scene, render, index).map(|(_, _, params)| params)
}

/// The film of an executor after the sample `index` of every pixel, rows from top to bottom.
///
/// # Errors
/// As of [`Render::check`] and of the executor.
pub fn film(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    index: u32,
) -> Result<Vec<FilmPixel>, Error> {
    let (buffers, pass, _) = sample_pass(scene, render, index)?;
    let outputs = vec![pass.bound("film")?];
    let plan = FramePlan { scene: Some(Arc::new(scene.clone())), ..FramePlan::of(buffers, vec![pass], outputs) };
    let words = executor.run(plan)?;
    Ok(bytemuck::cast_slice(words.first().map_or(&[], |words| words)).to_vec())
}

/// The first pass of a render of one sample, moved to the sample `index`, with the plan's buffers and its parameters.
fn sample_pass(scene: &SceneBuffers, render: &Render, index: u32) -> Result<(Vec<Buffer>, Pass, PathParams), Error> {
    let render = Render { count: 1, ..render.clone() };
    render.technique.inspect().check_explained(scene, &render)?;
    let FramePlan { buffers, mut passes, .. } = render.plan(scene);
    let first = passes.next().transpose()?.and_then(|pass| Some((pass.params::<PathParams>()?, pass)));
    let Some((params, pass)) = first else {
        let problem = "a plan without a pass of path tracing cannot be replayed; correct the plan".to_owned();
        return Err(Error::Plan { problem });
    };
    let params = PathParams { first_sample: index, ..params };
    Ok((buffers, Pass { params: bytemuck::cast_slice(&[params]).to_vec(), ..pass }, params))
}

#[cfg(test)]
mod tests {
    use super::super::{PathSettings, explain_sample};
    use super::*;
    use crate::exec::CpuExecutor;
    use crate::replay::Recording;
    use crate::scene::Scene;
    use crate::technique::explain::Place;
    use restir_shared::glam::Vec3;
    use restir_shared::technique::path;

    fn settings(roulette: bool) -> Render {
        let path = PathSettings { roulette, ..PathSettings::default() };
        Render { seed: 5, ..Render::new([12, 10], path) }
    }

    fn bits(v: Vec3) -> [u32; 3] {
        v.to_array().map(f32::to_bits)
    }

    #[test]
    fn a_replayed_path_has_the_bits_of_the_film_and_so_has_the_sum_of_its_parts() {
        let mut cpu = CpuExecutor::with_threads(1).unwrap();
        for (name, roulette) in [("cornell", false), ("cornell", true), ("furnace", false), ("foliage", false)] {
            let source = Scene::load(name).unwrap();
            let scene = SceneBuffers::build(&source).unwrap();
            let settings = settings(roulette);
            for index in [0, 7] {
                let film = film(&mut cpu, &scene, &settings, index).unwrap();
                for (i, pixel) in film.iter().enumerate() {
                    let place = Place { x: i as u32 % 12, y: i as u32 / 12, sample: index };
                    let path = explain_sample(&scene, &settings, place).unwrap();
                    assert_eq!(bits(path.radiance), pixel.sum.map(f32::to_bits), "{name} {place:?}");
                    assert_eq!(bits(path.radiance), bits(path.sum_of_parts()), "{name} {place:?}");
                    let instances = source.instances.len() as u32;
                    assert!(path.vertices.iter().all(|vertex| vertex.instance < instances), "{name} {place:?}");
                }
            }
        }
    }

    #[test]
    fn a_path_through_the_furnace_is_as_it_must_be() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let settings = settings(false);
        let path = explain_sample(&scene, &settings, Place { x: 3, y: 4, sample: 2 }).unwrap();
        // closed, so every path has its full length; it reflects half and emits 1
        assert_eq!(path.vertices.len(), 8);
        for (i, vertex) in path.vertices.iter().enumerate() {
            assert_eq!(vertex.throughput, Vec3::splat(1.0 / (1 << i) as f32));
            let emission = vertex.emission.expect("all of the furnace emits");
            assert_eq!(emission.radiance, Vec3::ONE);
            assert_eq!(vertex.light.is_some(), i < 7, "the last vertex gathers nothing");
            let weight = emission.weight;
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
        path::pixel(&recording, &params(&scene, &settings, 0).unwrap(), 1, 1);
        let counts = recording.counts();
        assert_eq!((counts.closest, counts.surfaces, counts.light_samples), (8, 8, 7));
        assert!(counts.shadow <= 7 && counts.shadow > 0);
    }

    #[test]
    fn samples_out_of_range_are_refused() {
        let scene = SceneBuffers::build(&Scene::load("furnace").unwrap()).unwrap();
        let message =
            explain_sample(&scene, &settings(false), Place { x: 12, y: 0, sample: 0 }).unwrap_err().to_string();
        assert!(message.contains("(12, 0)") && message.contains("12 x 10"), "{message}");
    }
}
