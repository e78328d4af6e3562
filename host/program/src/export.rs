//! `restir export`

use std::path::{Path, PathBuf};

use restir::Error;
use restir::advanced::output::check_writable;
use restir::image::{Image, write_exr};
use restir::scene::{Environment, export};

use super::parse::{ends_in, require};
use super::scene::{Additions, DEFAULT_SIZE, refuse_overwriting};
use super::{console, interrupt, progress::patiently};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene (see `restir scenes`), or a .gltf or .glb file.
    scene: PathBuf,
    #[command(flatten)]
    additions: Additions,
    /// The .glb file to write.
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { scene, additions, output } = arguments;
    require(ends_in(output, "glb"), format_args!("the output {} has to end in .glb", output.display()))?;
    check_writable(output)?;
    let inputs = additions.inputs(scene);
    refuse_overwriting(&inputs, [output])?;
    let mut scene = additions.open(scene)?;
    let beside = output.with_extension("env.exr");
    let written = scene.environment.is_some().then_some(&beside).into_iter().chain([output]);
    written.clone().try_for_each(|path| check_writable(path))?;
    refuse_overwriting(inputs.into_iter().chain(scene.files.iter().map(PathBuf::as_path)), written)?;
    let size = scene.default_size.unwrap_or(DEFAULT_SIZE);
    additions.complete(&mut scene, size)?;
    interrupt::check()?;
    interrupt::begin_writing();
    let environment =
        scene.environment.as_ref().map(|environment| write_environment(environment, &beside)).transpose()?;
    // the scene comes last: where it is, all is
    patiently("writing the scene", || export::write(&scene, output))?;
    let mut report = format!("wrote {}\n", output.display());
    report.extend(environment);
    report.extend(export::left_out(&scene).iter().map(|sentence| format!("{sentence}\n")));
    if scene.camera.is_some_and(|camera| camera.lens_radius > 0.0) {
        report += "glTF has no lens: other programs see a pinhole camera, restir finds the lens in the file's extras\n";
    }
    console::print_shortened(&report)
}

/// Writes the environment, and says how to render with it.
fn write_environment(environment: &Environment, path: &Path) -> Result<String, Error> {
    let Environment { size: [width, height], scale, rotation, .. } = *environment;
    write_exr(path, &Image { width, height, pixels: environment.pixels.to_vec() }, &[])?;
    let path = path.display();
    Ok(format!(
        "wrote {path}: glTF has no environment; render with --env {path} --env-scale {scale} --env-rotate {rotation}\n"
    ))
}
