//! Meshes that other programs made, in a folder beside the workspace.

use restir_host::Error;
use restir_host::scene::{Camera, Scene};
use std::path::{Path, PathBuf};

/// The folder, if it is there.
pub fn folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    folder.is_dir().then_some(folder)
}

/// A mesh under the default light, seen as the program shows it in an image of the given aspect ratio.
///
/// # Errors
/// What the importer reports.
pub fn lit_mesh(path: &Path, aspect: f64) -> Result<Scene, Error> {
    let mut scene = Scene::load(&path.to_string_lossy())?;
    scene.camera = Some(Camera::framing(scene.bounds(), aspect));
    scene.add_default_light();
    Ok(scene)
}
