//! `restir export`

use std::path::{Path, PathBuf};

use restir::Error;
use restir::image::{Image, write_exr};
use restir::output::check_writable;
use restir::scene::{Environment, export};

use super::console;
use super::scene::{DEFAULT_SIZE, SceneArguments};

#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The .glb file to write.
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let output = &arguments.output;
    if !output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("glb")) {
        return Err(Error::Setting(format!("the output {} has to end in .glb", output.display())));
    }
    check_writable(output)?;
    let mut scene = arguments.scene.open()?;
    let size = scene.default_size.unwrap_or(DEFAULT_SIZE);
    arguments.scene.complete(&mut scene, size)?;
    let sky = scene.environment.as_ref().map(|environment| (environment, output.with_extension("env.exr")));
    export::write(&scene, output)?;
    let mut report = format!("wrote {}\n", output.display());
    if let Some((environment, path)) = &sky {
        write_environment(environment, path)?;
        report += &beside(environment, path);
    }
    if scene.camera.is_some_and(|camera| camera.lens_radius > 0.0) {
        report += "glTF has no lens: other programs see a pinhole camera, restir finds the lens in the file's extras\n";
    }
    console::print(&report)
}

fn write_environment(environment: &Environment, path: &Path) -> Result<(), Error> {
    let [width, height] = environment.size;
    write_exr(path, &Image { width, height, pixels: environment.pixels.to_vec() }, &[])
}

fn beside(environment: &Environment, path: &Path) -> String {
    let path = path.display();
    format!(
        "wrote {path}: glTF has no environment; render with --env {path} --env-scale {} --env-rotate {}\n",
        environment.scale, environment.rotation
    )
}
