//! `cargo xtask`: one module a subcommand, this file only dispatches.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{
    Error, albedo, aov, crossings, diffusion, documented, features, furnace, gains, mutate, num, package, parity,
    passes, profile, resampling, reuse, searchlight, session, shader, shifts, stress, unbiased, visibility, walks,
    watertight,
};

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
    /// Sweep the scalar functions and print how accurate they are.
    Num(num::Options),
    /// Compare every kernel on every adapter with the host and print the table.
    Parity(parity::Options),
    /// Tally what half spaces and slabs of media reflect and transmit, and how far from where light enters.
    Searchlight(searchlight::Options),
    /// Measure what is wrong about diffusion profiles and what they save, beside the walk, and print the report.
    Diffusion(diffusion::Options),
    /// Walk inside of white bodies, and count what does not come out again.
    Walks(walks::Options),
    /// Trace rays from the inside of a closed mesh at its edges and vertices: none may escape.
    Watertight(watertight::Options),
    /// Compare all hits of an object on adversarial segments with brute force, on host and devices, and time them.
    Crossings(crossings::Options),
    /// Test a technique for bias, tile by tile; can be interrupted and continued.
    Unbiased(unbiased::Options),
    /// Test functions at the ends of their ranges against f64, scenes and techniques of frames at theirs, and print the report.
    Stress(stress::Options),
    /// Combine reservoirs by every form of MIS on a small table, against computed expectations, and print the report.
    Resampling(resampling::Options),
    /// Shift paths from pixel to pixel and back in each scene, and print why shifts fail and whether they are undone.
    Shifts(shifts::Options),
    /// Fit what GGX reflects of light from everywhere, and print what white surfaces return.
    Albedo(albedo::Options),
    /// Draw the layers of `restir render --aov`.
    Aov(aov::Options),
    /// Print how much light white surfaces return, with and without what single scattering loses.
    Furnace(furnace::Options),
    /// Measure what each feature of a scene costs the path tracer, and print the report.
    Features(features::Options),
    /// Measure what each kernel of a frame takes and asks, and print the table.
    Passes(passes::Options),
    /// Measure where the time of a path traced render goes, and print the table.
    Profile(profile::Options),
    /// Compare averaged visibility with that of the selected sample, and print the report.
    Visibility(visibility::Options),
    /// Measure on which scenes reuse of samples pays at equal time and what limits it, and print the report.
    Reuse(reuse::Options),
    /// Measure what ReSTIR PT gains over path tracing in equal time and with equal rays, and print the report.
    Gains(gains::Options),
    /// Measure what a frame of a session costs beside its kernels, and whether its memory stays, and print the report.
    Session(session::Options),
    /// Run the program on mutated files and command lines, and see how it ends.
    Mutate(mutate::Options),
    /// Run the commands that README and docs name, and compare the pictures that they give with the committed ones.
    Documented(documented::Options),
    /// Pack the published crates, build them elsewhere without the lock file, and compare pictures of CPU and device.
    Package(package::Options),
}

fn run(task: Task) -> Result<(), Error> {
    match task {
        Task::Shader(command) => shader::run(command),
        Task::Num(options) => num::run(&options),
        Task::Parity(options) => parity::run(&options),
        Task::Diffusion(options) => diffusion::run(&options),
        Task::Walks(options) => walks::run(&options),
        Task::Searchlight(options) => searchlight::run(&options),
        Task::Watertight(options) => watertight::run(&options),
        Task::Crossings(options) => crossings::run(&options),
        Task::Unbiased(options) => unbiased::run(&options),
        Task::Stress(options) => stress::run(&options),
        Task::Resampling(options) => resampling::run(&options),
        Task::Shifts(options) => shifts::run(&options),
        Task::Albedo(options) => albedo::run(&options),
        Task::Aov(options) => aov::run(&options),
        Task::Furnace(options) => furnace::run(&options),
        Task::Features(options) => features::run(&options),
        Task::Passes(options) => passes::run(&options),
        Task::Profile(options) => profile::run(&options),
        Task::Visibility(options) => visibility::run(&options),
        Task::Reuse(options) => reuse::run(&options),
        Task::Gains(options) => gains::run(&options),
        Task::Session(options) => session::run(&options),
        Task::Mutate(options) => mutate::run(&options),
        Task::Documented(options) => documented::run(&options),
        Task::Package(options) => package::run(&options),
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
