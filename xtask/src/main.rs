//! `cargo xtask`: one module a subcommand, this file only dispatches.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{Error, device, documented, mutate, package, planted, shader, surface};

/// Tools of the project.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build, check and inspect the SPIR-V modules.
    #[command(subcommand)]
    Shader(shader::Command),
    /// Run the program on mutated files and command lines, and see how it ends.
    Mutate(mutate::Options),
    /// Run the commands that README and docs name, and compare the pictures that they give with the committed ones.
    Documented(documented::Options),
    /// Pack the published crates, build them elsewhere without the lock file, and compare pictures of CPU and device.
    Package(package::Options),
    /// Plant faults in the library, one at a time, and see whether the tests see them.
    Planted(planted::Options),
    /// Count the public items of the libraries.
    Surface(surface::Options),
    /// Measure all figures of a GPU, after its words were compared with the host's: `cargo lab device`.
    Device(device::Options),
}

fn run(task: Task) -> Result<ExitCode, Error> {
    let done = match task {
        Task::Shader(command) => shader::run(command),
        Task::Mutate(options) => mutate::run(&options),
        Task::Documented(options) => documented::run(&options),
        Task::Package(options) => package::run(&options),
        Task::Planted(options) => planted::run(&options),
        Task::Surface(options) => surface::run(&options),
        Task::Device(options) => return device::run(&options),
    };
    done.map(|()| ExitCode::SUCCESS)
}

fn main() -> ExitCode {
    match run(Cli::parse().task) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{error}");
            error.exit_code()
        }
    }
}
