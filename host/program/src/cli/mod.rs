//! The program `restir`: renders scenes, compares images, measures techniques, lists devices and scenes.
//!
//! Results go to standard output; warnings, progress and errors to standard error. It exits with 0 when it did what
//! was asked, with 1 when a comparison that was asked for did not pass, with 2 when it could not do what was asked, and
//! with 130 when it was interrupted; all but 0 come with one line `error: ...`.

use std::fmt;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Parser, Subcommand};
use restir::Error;

mod advise;
mod bench;
mod compare;
mod console;
mod device;
mod devices;
mod ending;
mod environment;
mod explain;
mod export;
mod figure;
mod info;
mod interrupt;
mod metadata;
mod progress;
mod reference;
mod render;
mod scene;
mod scenes;
mod settings;
mod technique;
mod tev;

use ending::{EXIT_BAD_INPUT, Ending};

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
    Render(render::Arguments),
    /// Write a scene as a .glb file, for other renderers.
    ///
    /// An environment is written as an EXR file beside it. The camera that a render would choose is written if the scene
    /// has none.
    Export(export::Arguments),
    /// List the built-in scenes.
    Scenes(scenes::Arguments),
    /// List the GPU adapters, and whether their results have the same bits as the CPU's.
    Devices,
    /// Describe a scene, or an image and how it was made.
    Info(info::Arguments),
    /// Compare an image with a reference.
    ///
    /// Exits with 0 whenever the images could be compared, also if they differ.
    Compare(compare::Arguments),
    /// Make or continue the reference image of a scene, with its standard error, in a cache.
    Reference(reference::Arguments),
    /// Measure error against run time, and write a table, plots and a report.
    ///
    /// Exits with 1 if something got worse since the table named by --against.
    Bench(bench::Arguments),
    /// Find the technique and the settings with the least error for their time on a scene, by trying them.
    Advise(advise::Arguments),
    /// Reproduce a figure of a paper: plots or pictures, their data, and a report on which of its claims hold.
    Figure(figure::Arguments),
    /// List the settings of a technique with their defaults, and its presets.
    Settings(settings::Arguments),
    /// Explain one pixel: its path, where its reservoir's sample came from, or what each pass wrote.
    Explain(explain::Arguments),
}

/// Runs the program with the arguments of the process.
pub(crate) fn main() -> ExitCode {
    silence_mesa();
    survive_file_limit();
    if let Err(error) = interrupt::install() {
        return ended(Err(error.into()));
    }
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return not_run(&error),
    };
    let checked = environment::limit_memory().and_then(|()| device::check_environment());
    ended(checked.map_err(Ending::from).and_then(|()| run(arguments.command)))
}

/// Says what went wrong.
fn ended(outcome: Result<(), Ending>) -> ExitCode {
    interrupt::begin_ending();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(ending) => {
            console::note(&format!("error: {ending}"));
            ExitCode::from(ending.exit_code())
        }
    }
}

/// Shows the help or the version if they were asked for, else what is wrong with the arguments.
fn not_run(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return ended(console::print(&error.render().to_string()).map_err(Ending::from));
    }
    interrupt::begin_ending();
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        console::note("error: no command was given; restir --help lists them");
    } else {
        console::note(&one_line(&error.to_string(), known_elsewhere(error)));
    }
    ExitCode::from(EXIT_BAD_INPUT)
}

/// What other renderers call an option, and its name here.
const ELSEWHERE: [(&str, &str); 19] = [
    ("--samples", "--spp"),
    ("--sample-count", "--spp"),
    ("--width", "--size WIDTHxHEIGHT"),
    ("--height", "--size WIDTHxHEIGHT"),
    ("--resolution", "--size WIDTHxHEIGHT"),
    ("--res", "--size WIDTHxHEIGHT"),
    ("--bounces", "--max-depth, which counts segments: one more than bounces"),
    ("--fov", "--camera EYE:TARGET:FOV"),
    ("--ev", "--exposure"),
    ("--tone-map", "--tonemap"),
    ("--envmap", "--env"),
    ("--gpu", "--device gpu"),
    ("--cpu", "--device cpu"),
    ("--integrator", "--technique"),
    ("--display-server", "--tev"),
    ("--aovs", "--aov"),
    ("--time-limit", "--seconds"),
    ("--timeout", "--seconds"),
    ("--animation", "--frames A..B"),
];

/// The name of an option that was asked for by another one.
fn known_elsewhere(error: &clap::Error) -> Option<&'static str> {
    let Some(ContextValue::String(asked)) = error.get(ContextKind::InvalidArg) else { return None };
    ELSEWHERE.iter().find(|(name, _)| name == asked).map(|(_, here)| *here)
}

/// The message of clap without its usage and without the hint at a form that nobody wants, in one line.
fn one_line(message: &str, known: Option<&str>) -> String {
    let parts: Vec<&str> = message
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.contains("as a value, use '-- "))
        .filter(|line| known.is_none() || !line.starts_with("tip:"))
        .collect();
    let hint = known.map_or_else(String::new, |known| format!("; here it is {known}"));
    format!("{}{hint}; see --help", parts.join(" ").replace(" tip: ", "; "))
}

/// Mesa's Vulkan layer that chooses the default device writes `error: ...` where there is no display; the program
/// makes its own choice.
fn silence_mesa() {
    const DISABLE: &str = "NODEVICE_SELECT";
    if std::env::var_os(DISABLE).is_none() {
        // SAFETY: the process has no other thread yet.
        unsafe { std::env::set_var(DISABLE, "1") };
    }
}

/// A file larger than the process may write (`ulimit -f`) is an error of the write then, as a full disk is, and not the end of the program,
/// which would leave a temporary file.
fn survive_file_limit() {
    #[cfg(unix)]
    // SAFETY: to ignore a signal has no handler that could do wrong.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

fn run(command: Command) -> Result<(), Ending> {
    let done = match command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Scenes(arguments) => scenes::run(&arguments),
        Command::Devices => devices::run(),
        Command::Info(arguments) => info::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Reference(arguments) => reference::run(&arguments),
        Command::Bench(arguments) => return bench::run(&arguments),
        Command::Advise(arguments) => advise::run(&arguments),
        Command::Figure(arguments) => figure::run(&arguments),
        Command::Settings(arguments) => settings::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
    };
    Ok(done?)
}

/// Refuses what was asked for unless it `holds`.
fn require(holds: bool, problem: fmt::Arguments<'_>) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Setting(problem.to_string())) }
}
