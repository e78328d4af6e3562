//! What an image says about how it was made.

use super::device::Device;
use super::render::Technique;
use crate::render::{RenderSettings, Rendered};
use crate::scene::{Camera, Environment, Scene};

/// Pairs for [`crate::image::write_exr`]. Times are left out, so that equal renders give equal files.
pub(super) fn of_render(
    scene: &Scene,
    technique: Technique,
    settings: &RenderSettings,
    device: &Device,
    rendered: &Rendered,
) -> Vec<(String, String)> {
    let description = device.executor.describe();
    let pairs = [
        ("scene", scene.name.clone()),
        ("environment", scene.environment.as_ref().map_or_else(|| "none".to_owned(), environment)),
        ("lens", scene.camera.filter(|camera| camera.lens_radius > 0.0).map_or_else(|| "pinhole".to_owned(), lens)),
        ("technique", technique.name().to_owned()),
        ("width", settings.width.to_string()),
        ("height", settings.height.to_string()),
        ("samples", settings.samples.to_string()),
        ("seed", settings.seed.to_string()),
        ("max_depth", settings.path.max_depth.to_string()),
        ("jitter", on_off(settings.path.jitter)),
        ("roulette", on_off(settings.path.roulette)),
        ("dispatch_samples", settings.dispatch_samples.map_or_else(|| "auto".to_owned(), |n| n.to_string())),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("commit", env!("RESTIR_COMMIT").to_owned()),
        ("executor", description.executor.to_owned()),
        ("adapter", description.adapter.unwrap_or_else(|| "none".to_owned())),
        ("flavour", description.flavour.to_string()),
        ("parity", device.parity.clone()),
        ("dispatches", rendered.dispatches.to_string()),
        ("dropped_samples", rendered.dropped_samples.to_string()),
    ];
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn environment(environment: &Environment) -> String {
    format!("{}, scale {}, turned {} degrees", environment.name, environment.scale, environment.rotation)
}

fn lens(camera: Camera) -> String {
    format!("radius {}, sharp at {}", camera.lens_radius, camera.distance_in_focus())
}

fn on_off(value: bool) -> String {
    if value { "on" } else { "off" }.to_owned()
}
