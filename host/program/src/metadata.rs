//! What an image says about how it was made.

use restir::advanced::part::{Merged, Noise, PartFile};
use restir::advanced::settings::{Choice as _, Settings as _};
use restir::advanced::{reference::Reference, settings::Value};
use restir::denoise::Denoise;
use restir::exec::Description;
use restir::render::{Render, Rendered};
use restir::scene::{Camera, Environment, Scene};
use restir::shared::glam::DVec3;
use restir::technique::{Integral, Repeats};

use super::device::parity;

/// Pairs for [`restir::image::write_exr`], and `more`. Times are left out, so that equal renders give equal files.
pub(super) fn of_render(
    scene: &Scene,
    render: &Render,
    executor: &Description,
    rendered: &Rendered,
    more: Vec<(&'static str, String)>,
) -> Vec<(String, String)> {
    let (about, parity) = (render.technique.about(), parity(executor));
    let mut pairs = vec![
        ("scene", scene.name.clone()),
        ("environment", scene.environment.as_ref().map_or_else(|| "none".to_owned(), environment)),
        ("lens", scene.camera.filter(|camera| camera.lens_radius > 0.0).map_or_else(|| "pinhole".to_owned(), lens)),
        ("technique", about.name.to_owned()),
        ("width", render.width.to_string()),
        ("height", render.height.to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("commit", env!("RESTIR_COMMIT").to_owned()),
        ("executor", executor.executor.to_owned()),
        ("adapter", executor.adapter.clone().unwrap_or_else(|| "none".to_owned())),
        ("flavour", executor.flavour.to_string()),
        ("parity", parity),
        ("dispatches", rendered.dispatches.to_string()),
        ("dropped_samples", rendered.dropped_samples.to_string()),
        (about.repeats.name(), render.count.to_string()),
        ("seed", render.seed.to_string()),
    ];
    if scene.origin != DVec3::ZERO {
        pairs.push(("origin", vector(scene.origin)));
    }
    pairs.extend(rendered.counts.iter().map(|(name, count)| (*name, count.to_string())));
    let animation = &scene.animation;
    if !animation.is_still() {
        pairs.extend([("time", animation.start.to_string()), ("frame_rate", animation.frame_rate.to_string())]);
    }
    if about.repeats == Repeats::Frames {
        pairs.push(("accumulate", render.accumulate.write()));
    }
    if let Some(denoise) = &render.denoise {
        pairs.push(("denoise", of_denoiser(denoise)));
    }
    // what techniques without such a setting have by themselves
    if render.technique.value("max_depth").is_none() {
        pairs.push(("max_depth", render.technique.integral().max_depth.to_string()));
    }
    pairs.extend(more);
    pairs.extend(render.technique.entries().into_iter().map(|entry| (entry.key, entry.value)));
    owned(pairs)
}

/// Pairs of an image that was merged: those of the first part, where all agree, and what is of all.
pub(super) fn of_merged(parts: &[PartFile], merged: &Merged, noise: Option<&Noise>) -> Vec<(String, String)> {
    let mut pairs: Vec<(String, String)> = parts[0].header().notes.clone();
    for (key, value) in &mut pairs {
        let notes = parts.iter().flat_map(|part| &part.header().notes).filter(|(other, _)| other == key);
        let mut values: Vec<&str> = notes.map(|(_, value)| value.as_str()).collect();
        values.sort_unstable();
        values.dedup();
        *value = values.join(", ");
    }
    let mut set = |key: &str, value: String| match pairs.iter_mut().find(|(of, _)| of == key) {
        Some(pair) => pair.1 = value,
        None => pairs.push((key.to_owned(), value)),
    };
    set(merged.unit.name(), merged.count.to_string());
    set("merged_parts", parts.len().to_string());
    set("dispatches", merged.dispatches.to_string());
    set("dropped_samples", merged.dropped_samples.to_string());
    merged.counts.iter().for_each(|(name, count)| set(name, count.to_string()));
    if let Some(noise) = noise {
        set("noise", format!("{:.6}", noise.relative));
    }
    pairs
}

/// The settings of the denoiser.
pub(super) fn of_denoiser(denoise: &Denoise) -> String {
    let entries = denoise.entries().into_iter().map(|entry| format!("{}={}", entry.key, entry.value));
    entries.collect::<Vec<_>>().join(",")
}

/// Pairs of a picture of a reference.
pub(super) fn of_reference(scene: &str, integral: Integral, reference: &Reference) -> Vec<(String, String)> {
    owned(vec![
        ("scene", scene.to_owned()),
        ("technique", "path".to_owned()),
        ("samples", reference.samples().to_string()),
        ("max_depth", integral.max_depth.to_string()),
        ("jitter", integral.jitter.to_string()),
        ("filter", integral.filter.name().to_owned()),
        ("multiscatter", integral.multiscatter.to_string()),
        ("dropped_samples", reference.dropped_samples().to_string()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("commit", env!("RESTIR_COMMIT").to_owned()),
    ])
}

fn owned(pairs: Vec<(&str, String)>) -> Vec<(String, String)> {
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// A point as --camera has it.
pub(super) fn vector(point: DVec3) -> String {
    format!("{},{},{}", point.x, point.y, point.z)
}

fn environment(environment: &Environment) -> String {
    format!("{}, scale {}, turned {} degrees", environment.name, environment.scale, environment.rotation)
}

fn lens(camera: Camera) -> String {
    format!("radius {}, sharp at {}", camera.lens_radius, camera.distance_in_focus())
}
