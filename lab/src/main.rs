//! `cargo lab`: one module a subcommand, this file only dispatches.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use restir_cli::ending::Ending;
use restir_lab::{
    Error, albedo, aov, bench, crossings, denoised, device, diffusion, features, figure, furnace, gains, num, parity,
    passes, probe, profile, resampling, reuse, searchlight, session, shifts, simd, stress, unbiased, visibility, walks,
    watertight,
};
use xtask::shader;

/// Experiments, benchmarks and figures of papers.
#[derive(Parser)]
#[command(name = "cargo lab", bin_name = "cargo lab")]
struct Arguments {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    /// Measure error against run time, and write a table, plots and a report.
    ///
    /// Exits with 1 if something got worse since the table named by --against.
    Bench(Box<bench::Arguments>),
    /// Reproduce a figure of a paper: plots or pictures, their data, and a report on which of its claims hold.
    Figure(figure::Arguments),
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
    /// Measures error before and after the denoiser.
    Denoised(denoised::Options),
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
    /// Measure what each level of instructions gains on this processor, compare their bits, and print the table.
    Simd(simd::Options),
    /// Measure what a frame of a session costs beside its kernels, and whether its memory stays, and print the report.
    Session(session::Options),
    /// Measure all figures of a GPU, after its words were compared with the host's, and print the report.
    Device(device::Options),
    /// Measure what the size of a kernel costs, and write docs/size-probe.md.
    Probe,
    /// One build of the kernel crate, as of `cargo xtask`: `probe` and `features` start it as a child process.
    #[command(subcommand, hide = true)]
    Shader(shader::Command),
}

fn run(Arguments { experiment }: Arguments) -> Result<(), Ending> {
    let done: Result<(), Error> = match experiment {
        Experiment::Bench(arguments) => return bench::run(&arguments),
        Experiment::Figure(arguments) => return Ok(figure::run(&arguments)?),
        Experiment::Num(options) => num::run(&options),
        Experiment::Parity(options) => parity::run(&options),
        Experiment::Diffusion(options) => diffusion::run(&options),
        Experiment::Walks(options) => walks::run(&options),
        Experiment::Searchlight(options) => searchlight::run(&options),
        Experiment::Watertight(options) => watertight::run(&options),
        Experiment::Crossings(options) => crossings::run(&options),
        Experiment::Denoised(options) => denoised::run(&options),
        Experiment::Unbiased(options) => unbiased::run(&options),
        Experiment::Stress(options) => stress::run(&options),
        Experiment::Resampling(options) => resampling::run(&options),
        Experiment::Shifts(options) => shifts::run(&options),
        Experiment::Albedo(options) => albedo::run(&options),
        Experiment::Aov(options) => aov::run(&options),
        Experiment::Furnace(options) => furnace::run(&options),
        Experiment::Features(options) => features::run(&options),
        Experiment::Passes(options) => passes::run(&options),
        Experiment::Profile(options) => profile::run(&options),
        Experiment::Visibility(options) => visibility::run(&options),
        Experiment::Reuse(options) => reuse::run(&options),
        Experiment::Gains(options) => gains::run(&options),
        Experiment::Simd(options) => simd::run(&options),
        Experiment::Session(options) => session::run(&options),
        Experiment::Device(options) => device::run(&options),
        Experiment::Probe => probe::run(),
        Experiment::Shader(command) => shader::run(command).map_err(Error::from),
    };
    Ok(done?)
}

fn main() -> ExitCode {
    restir_cli::program::main(run)
}
