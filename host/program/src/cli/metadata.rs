//! What an image says about how it was made.

use restir::di::DiRender;
use restir::render::{RenderSettings, Rendered};
use restir::scene::{Camera, Environment, Scene};

use super::device::Device;
use super::render::{Technique, Work};
use super::settings::{di_pairs, on_or_off};

/// Pairs for [`restir::image::write_exr`]. Times are left out, so that equal renders give equal files.
pub(super) fn of_render(
    scene: &Scene,
    technique: Technique,
    work: &Work,
    device: &Device,
    rendered: &Rendered,
) -> Vec<(String, String)> {
    let description = device.executor.describe();
    let [width, height] = work.size();
    let pairs = [
        ("scene", scene.name.clone()),
        ("environment", scene.environment.as_ref().map_or_else(|| "none".to_owned(), environment)),
        ("lens", scene.camera.filter(|camera| camera.lens_radius > 0.0).map_or_else(|| "pinhole".to_owned(), lens)),
        ("technique", technique.name().to_owned()),
        ("width", width.to_string()),
        ("height", height.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("commit", env!("RESTIR_COMMIT").to_owned()),
        ("executor", description.executor.to_owned()),
        ("adapter", description.adapter.unwrap_or_else(|| "none".to_owned())),
        ("flavour", description.flavour.to_string()),
        ("parity", device.parity.clone()),
        ("dispatches", rendered.dispatches.to_string()),
        ("dropped_samples", rendered.dropped_samples.to_string()),
    ];
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).chain(of_technique(work)).collect()
}

fn of_technique(work: &Work) -> Vec<(String, String)> {
    let of_path = |settings: &RenderSettings| {
        vec![
            ("samples", settings.samples.to_string()),
            ("seed", settings.seed.to_string()),
            ("max_depth", settings.path.max_depth.to_string()),
            ("jitter", on_or_off(settings.path.jitter)),
            ("roulette", on_or_off(settings.path.roulette)),
            ("dispatch_samples", settings.dispatch_samples.map_or_else(|| "auto".to_owned(), |n| n.to_string())),
        ]
    };
    let of_di = |render: &DiRender| {
        vec![
            ("frames", render.frames.to_string()),
            ("accumulate", on_or_off(render.accumulate)),
            ("seed", render.seed.to_string()),
            ("max_depth", "2".to_owned()),
        ]
    };
    let (pairs, settings) = match work {
        Work::Path(settings) => (of_path(settings), Vec::new()),
        Work::RestirDi(render) => (of_di(render), di_pairs(&render.settings).collect()),
    };
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).chain(settings).collect()
}

fn environment(environment: &Environment) -> String {
    format!("{}, scale {}, turned {} degrees", environment.name, environment.scale, environment.rotation)
}

fn lens(camera: Camera) -> String {
    format!("radius {}, sharp at {}", camera.lens_radius, camera.distance_in_focus())
}
