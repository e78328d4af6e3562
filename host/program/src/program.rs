//! How a program begins, reads its command line, and ends.
//!
//! Results go to standard output; warnings, progress and errors to standard error. It exits with 0 when it did what
//! was asked, with 1 when a comparison that was asked for did not pass, with 2 when it could not do what was asked, and
//! with 130 when it was interrupted; all but 0 come with one line `error: ...`.

use std::process::ExitCode;

use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::ending::{EXIT_BAD_INPUT, Ending};
use super::{console, device, environment, interrupt};

/// Runs a program with the arguments of the process.
pub fn main<A: Parser>(run: impl FnOnce(A) -> Result<(), Ending>) -> ExitCode {
    silence_mesa();
    survive_file_limit();
    if let Err(error) = interrupt::install() {
        return ended(Err(error.into()));
    }
    let arguments = match A::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return not_run::<A>(&error),
    };
    let checked = environment::limit_memory().and_then(|()| device::check_environment());
    ended(checked.map_err(Ending::from).and_then(|()| run(arguments)))
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
fn not_run<A: Parser>(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return ended(console::print(&error.render().to_string()).map_err(Ending::from));
    }
    interrupt::begin_ending();
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let command = A::command();
        let name = command.get_bin_name().unwrap_or(command.get_name());
        console::note(&format!("error: no command was given; {name} --help lists them"));
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
