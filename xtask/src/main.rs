//! `cargo xtask`: one module a subcommand, this file only dispatches.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{Error, shader};

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
}

fn run(task: Task) -> Result<(), Error> {
    match task {
        Task::Shader(command) => shader::run(command, None),
    }
}

fn main() -> ExitCode {
    match run(Cli::parse().task) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            error.exit_code()
        }
    }
}
