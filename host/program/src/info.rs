//! `restir info`

use std::path::PathBuf;

use restir::Error;
use restir::advanced::part::{Header, PartFile};
use restir::buffers::{SceneBuffers, SceneStats};
use restir::image::{Content, read_exr_content};
use restir::scene::{Camera, Environment, LightKind, Scene, Texture};
use restir::shared::glam::DVec3;

use super::console::{self, harmless};
use super::{parse::ends_in, progress::patiently};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, a .gltf or .glb file, or an image or a part of one as `render` writes it.
    scene: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    if ends_in(&arguments.scene, "exr") {
        return console::print(&image(&read_exr_content(&arguments.scene)?));
    }
    if ends_in(&arguments.scene, "part") {
        return console::print(&part(PartFile::open(&arguments.scene)?.header()));
    }
    let scene = patiently("reading the scene", || Scene::open(&arguments.scene))?;
    let stats = patiently("building the scene", || SceneBuffers::build(&scene))?.stats();
    console::print(&describe(&scene, &stats))
}

/// An image and how it was made.
fn image(content: &Content) -> String {
    let [width, height] = content.size;
    let rows = [("image", format!("{width} x {height} pixels")), ("channels", content.channels.join(", "))];
    let rows = rows.map(|(name, value)| (name.to_owned(), value));
    rows.iter()
        .chain(&content.metadata)
        .map(|(name, value)| format!("{:16} {}\n", harmless(name), harmless(value)))
        .collect()
}

/// A part of an image, and of which.
fn part(header: &Header) -> String {
    let ([width, height], Header { unit, range, tile, .. }) = (header.size, header);
    let rows = [
        ("part of", format!("{width} x {height} pixels with at least {} {}", header.count, unit.name())),
        ("range", format!("--{} {}..{}", unit.name(), range.start, range.end - 1)),
        ("tile", format!("--tile {tile}")),
    ];
    let rows = rows.map(|(name, value)| (name.to_owned(), value));
    let notes = header.notes.iter().filter(|(key, _)| key != unit.name());
    let pairs = rows.iter().chain(notes);
    pairs.map(|(name, value)| format!("{:16} {}\n", harmless(name), harmless(value))).collect()
}

fn describe(scene: &Scene, stats: &SceneStats) -> String {
    let [lo, hi] = stats.bounds.map(|corner| in_world(scene, corner));
    let features = if stats.features.is_empty() { "none".to_owned() } else { stats.features.join(", ") };
    let rows = [
        ("scene", scene.name.clone()),
        ("meshes", scene.meshes.len().to_string()),
        ("instances", scene.instances.len().to_string()),
        ("triangles", stats.triangles.to_string()),
        ("skipped", format!("{} degenerate triangles", stats.skipped_triangles)),
        ("lights", lights(scene, stats)),
        ("environment", scene.environment.as_ref().map_or_else(|| "none".to_owned(), environment)),
        ("materials", stats.materials.to_string()),
        ("textures", textures(&scene.textures)),
        ("BVH", format!("{} nodes, depth {}", stats.nodes, stats.bvh_depth)),
        ("buffers", format!("{} bytes", stats.bytes)),
        ("bounds", format!("{lo} to {hi}")),
        ("origin", origin(scene)),
        ("features", features),
        ("camera", scene.camera.map_or_else(|| "none: framed automatically".to_owned(), camera)),
    ];
    let of_buffers = stats.warnings();
    let warnings = scene.warnings.iter().chain(&of_buffers).map(|warning| format!("warning: {}\n", harmless(warning)));
    rows.iter().map(|(name, value)| format!("{name:16} {}\n", harmless(value))).chain(warnings).collect()
}

/// A position as the file has it.
fn in_world(scene: &Scene, position: [f32; 3]) -> String {
    if scene.origin == DVec3::ZERO {
        return format!("{position:?}");
    }
    let position = scene.origin + DVec3::from_array(position.map(f64::from));
    format!("{:?}", position.to_array())
}

fn origin(scene: &Scene) -> String {
    if scene.origin == DVec3::ZERO {
        return "that of the world".to_owned();
    }
    format!("{:?}, relative to which the scene is rendered", scene.origin.to_array())
}

fn lights(scene: &Scene, stats: &SceneStats) -> String {
    let count = |is_kind: fn(&LightKind) -> bool| scene.lights.iter().filter(|light| is_kind(&light.kind)).count();
    let punctual = [
        ("point", count(|kind| matches!(kind, LightKind::Point { .. }))),
        ("spot", count(|kind| matches!(kind, LightKind::Spot { .. }))),
        ("directional", count(|kind| matches!(kind, LightKind::Directional { .. }))),
    ];
    let present = punctual.iter().filter(|(_, count)| *count > 0).map(|(kind, count)| format!(", {count} {kind}"));
    format!("{} triangles{}", stats.emissive_triangles, present.collect::<String>())
}

fn environment(environment: &Environment) -> String {
    let [width, height] = environment.size;
    format!("{width} x {height} pixels, scale {}, turned {} degrees", environment.scale, environment.rotation)
}

fn textures(textures: &[Texture]) -> String {
    let texels: usize = textures.iter().map(|texture| texture.texels.count()).sum();
    if textures.is_empty() { "none".to_owned() } else { format!("{} with {texels} texels", textures.len()) }
}

fn camera(camera: Camera) -> String {
    if camera.lens_radius > 0.0 {
        let distance = camera.distance_in_focus();
        return format!("from the scene, with a lens of radius {}, sharp at {distance}", camera.lens_radius);
    }
    "from the scene".to_owned()
}
