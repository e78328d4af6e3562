//! Meshes and environment maps that other programs made, in the folder `assets`.

use restir_host::Error;
use restir_host::scene::{Camera, Scene};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets")
}

/// Where a file of the folder is.
pub fn path(name: &str) -> PathBuf {
    folder().join(name)
}

/// A mesh as it is.
///
/// # Errors
/// What the importer reports.
pub fn mesh(name: &str) -> Result<Scene, Error> {
    Scene::open(&path(name))
}

/// A mesh under the default light, seen as the program shows it in an image of the given aspect ratio.
///
/// # Errors
/// What the importer reports.
pub fn lit_mesh(name: &str, aspect: f64) -> Result<Scene, Error> {
    let mut scene = mesh(name)?;
    scene.camera = Some(Camera::framing(scene.bounds(), aspect));
    scene.add_default_light();
    Ok(scene)
}
