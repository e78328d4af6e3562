//! `restir export-plan`

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use restir::Error;
use restir::advanced::output::check_writable_in;
use restir::advanced::plan_file::{Form, NAME, Plan};
use restir::denoise::Denoise;
use restir::render::{Render, Shows};
use restir::scene::CameraPath;
use restir::technique::Repeats;

use super::job::JobArguments;
use super::parse::{natural, require};
use super::scene::{Additions, refuse_overwriting};
use super::technique::{cameras, refuse_unused};
use super::{console, interrupt, progress::patiently};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene (see `restir scenes`), or a .gltf or .glb file.
    scene: PathBuf,
    #[command(flatten)]
    additions: Additions,
    /// The folder to write, which is made if it is not there.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// What the kernels are written as: spirv gives the CPU's bits on Vulkan, the others the same image within rounding. docs/plans.md says which
    /// of them have been executed.
    #[arg(long, value_name = "FORM,...", value_delimiter = ',', default_value = "spirv", value_parser = forms())]
    to: Vec<Form>,
    #[command(flatten)]
    job: JobArguments,
    /// Move the camera once around its target in this many frames (ReSTIR).
    #[arg(long, value_name = "FRAMES", value_parser = natural::<u32>, conflicts_with_all = ["camera_path", "frames"])]
    turntable: Option<u32>,
    /// Denoise the image; each frame is, if it is not the mean of all.
    #[arg(long)]
    denoise: bool,
}

fn forms() -> impl TypedValueParser<Value = Form> {
    let values = Form::all().into_iter().map(|form| PossibleValue::new(form.name()));
    let named = |name: String| Form::all().into_iter().find(|form| form.name() == name).ok_or("there is no such form");
    PossibleValuesParser::new(values).try_map(named)
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { scene, additions, output, job, .. } = arguments;
    check_writable_in(output, [NAME])?;
    let document = output.join(NAME);
    let inputs = additions.inputs(scene).into_iter().chain(job.technique.camera_path.as_deref());
    refuse_overwriting(inputs, [&document])?;
    job.technique.frame_count()?;
    let mut scene = additions.open(scene)?;
    refuse_overwriting(&scene.files, [&document])?;
    let render = job.render(&scene)?;
    let is_moved = arguments.turntable.is_some() || job.technique.camera_path.is_some();
    let option = if arguments.turntable.is_some() { "--turntable" } else { "--camera-path" };
    refuse_unused(render.technique.as_ref(), &[(option, is_moved, Repeats::Frames)])?;
    require(
        arguments.turntable != Some(0),
        format_args!("a turntable of 0 frames shows nothing; give --turntable at least 1"),
    )?;
    additions.complete(&mut scene, [render.width, render.height])?;
    let buffers = additions.buffers(&scene)?;
    let path = match arguments.turntable {
        Some(frames) => Some(CameraPath::Turntable(frames)),
        None => job.technique.path(&buffers)?,
    };
    let count = arguments.turntable.unwrap_or(render.count);
    let cameras = cameras(path.as_ref(), buffers.camera, count)?;
    let denoise = arguments.denoise.then(Denoise::default);
    // each frame has its image, for whoever shows them
    let shows = if render.technique.about().repeats == Repeats::Frames { Shows::Each } else { Shows::Last };
    let render = Render { count, cameras, denoise, shows, ..render };
    let mut plan = patiently("writing the kernels", || Plan::of(&render, &buffers, &arguments.to))?;
    plan.document.about.insert("scene".to_owned(), scene.name.clone());
    interrupt::check()?;
    interrupt::begin_writing();
    patiently("writing the files", || plan.write(output))?;
    report(&plan, output)
}

fn report(plan: &Plan, folder: &std::path::Path) -> Result<(), Error> {
    let Plan { document, files } = plan;
    let bytes: usize = files.values().map(|contents| contents.bytes().len()).sum();
    let (passes, kernels, frames) = (document.passes.len(), document.kernels.len(), document.frames);
    let megabytes = bytes as f64 / 1e6;
    console::print(&format!(
        "wrote {}: {passes} passes of {kernels} kernels, {frames} frames, {} files of {megabytes:.1} MB\n",
        folder.join(NAME).display(),
        files.len()
    ))
}
