//! `restir info`

use std::path::PathBuf;

use super::console;
use crate::Error;
use crate::buffers::{SceneBuffers, SceneStats};
use crate::scene::Scene;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, or a .gltf or .glb file.
    scene: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let scene = Scene::open(&arguments.scene)?;
    let stats = SceneBuffers::build(&scene)?.stats();
    console::print(&describe(&scene, &stats))
}

fn describe(scene: &Scene, stats: &SceneStats) -> String {
    let [lo, hi] = stats.bounds;
    let features = if stats.features.is_empty() { "none".to_owned() } else { stats.features.join(", ") };
    let rows = [
        ("scene", scene.name.clone()),
        ("meshes", scene.meshes.len().to_string()),
        ("instances", scene.instances.len().to_string()),
        ("triangles", stats.triangles.to_string()),
        ("skipped", format!("{} degenerate triangles", stats.skipped_triangles)),
        ("lights", format!("{} triangles", stats.lights)),
        ("materials", stats.materials.to_string()),
        ("BVH", format!("{} nodes, depth {}", stats.nodes, stats.bvh_depth)),
        ("buffers", format!("{} bytes", stats.bytes)),
        ("bounds", format!("{lo:?} to {hi:?}")),
        ("features", features),
        ("camera", if scene.camera.is_some() { "from the scene" } else { "none: framed automatically" }.to_owned()),
    ];
    let warnings = scene.warnings.iter().map(|warning| format!("warning: {warning}\n"));
    rows.iter().map(|(name, value)| format!("{name:16} {value}\n")).chain(warnings).collect()
}
