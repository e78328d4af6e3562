//! The program `restir`: renders scenes, compares images, measures techniques, lists devices and scenes.
//!
//! It is a library for one reason: the project's laboratory begins, ends and reads command lines by the same modules, and they are public
//! for it alone. Embed the crate `restir` instead, whose interface is kept stable.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod advise;
pub mod candidate;
mod compare;
pub mod console;
mod denoise;
pub mod device;
mod devices;
pub mod ending;
mod environment;
mod explain;
mod export;
mod export_plan;
mod info;
pub mod interrupt;
mod job;
mod merge;
mod metadata;
pub mod parse;
pub mod program;
pub mod progress;
pub mod reference;
mod render;
pub mod scene;
mod scenes;
pub mod scrambles;
mod settings;
mod technique;
mod tev;
pub mod trial;

use ending::Ending;

/// Version and commit of this build.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("RESTIR_COMMIT"), ")");

/// ReSTIR and path tracing with bit-identical results on CPU and GPU.
#[derive(Parser)]
#[command(name = "restir", version = VERSION)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to an EXR file.
    Render(Box<render::Arguments>),
    /// Merge parts of an image that were rendered apart, to the bits of one render.
    Merge(merge::Arguments),
    /// Write a scene as a .glb file, for other renderers.
    ///
    /// An environment is written as an EXR file beside it. The camera that a render would choose is written if the scene
    /// has none.
    Export(export::Arguments),
    /// Write a render as data, for programs in other languages: buffers, passes, and kernels.
    ///
    /// docs/plans.md describes what is written; the folder runners has programs that render it.
    ExportPlan(Box<export_plan::Arguments>),
    /// List the built-in scenes.
    Scenes(scenes::Arguments),
    /// List the GPU adapters, and whether their results have the same bits as the CPU's.
    Devices,
    /// Describe a scene, or an image and how it was made.
    Info(info::Arguments),
    /// Denoise an image that was rendered before, here or elsewhere, by its layers.
    Denoise(denoise::Arguments),
    /// Compare an image with a reference.
    ///
    /// Exits with 0 whenever the images could be compared, also if they differ, and with 1 if one has pixels that are not finite.
    Compare(compare::Arguments),
    /// Make or continue the reference image of a scene, with its standard error, in a cache.
    Reference(reference::Arguments),
    /// Find the technique and the settings with the least error for their time on a scene, by trying them.
    Advise(advise::Arguments),
    /// List the settings of a technique with their defaults, and its presets.
    Settings(settings::Arguments),
    /// Explain one pixel: its path, where its reservoir's sample came from, or what each pass wrote.
    Explain(explain::Arguments),
}

/// Runs the program.
pub fn main() -> ExitCode {
    program::main(run)
}

fn run(Arguments { command }: Arguments) -> Result<(), Ending> {
    let done = match command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::ExportPlan(arguments) => export_plan::run(&arguments),
        Command::Scenes(arguments) => scenes::run(&arguments),
        Command::Devices => devices::run(),
        Command::Info(arguments) => info::run(&arguments),
        Command::Denoise(arguments) => denoise::run(&arguments),
        Command::Compare(arguments) => return compare::run(&arguments),
        Command::Reference(arguments) => reference::run(&arguments),
        Command::Advise(arguments) => advise::run(&arguments),
        Command::Settings(arguments) => settings::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
    };
    Ok(done?)
}
