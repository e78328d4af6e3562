//! Meshes that other programs made, in a folder beside the workspace.

use libtest_mimic::Trial;
use restir_host::Error;
use restir_host::scene::{Camera, Scene};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data")
}

/// A test that needs the meshes. Without the folder it is ignored, visibly, even where an adapter is required: the
/// folder is no part of the repository.
pub fn trial(trial: Trial) -> Trial {
    if folder().is_dir() {
        return trial;
    }
    trial.with_kind("no ../shared/data beside the workspace").with_ignored_flag(true)
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
