//! Other programs.

use std::process::Command;

use crate::Error;

/// Runs a command to success.
pub(crate) fn finish(command: &mut Command) -> Result<(), Error> {
    let line = shell(command);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Error::Failed(format!("`{line}` ended with {status}, see above"))),
        Err(error) => Err(Error::Environment(format!("cannot run `{line}`: {error}"))),
    }
}

/// A command line as one would type it.
pub(crate) fn shell(command: &Command) -> String {
    let quoted = [command.get_program()].into_iter().chain(command.get_args()).map(|word| {
        let word = word.to_string_lossy();
        if word.contains(' ') { format!("\"{word}\"") } else { word.into_owned() }
    });
    quoted.collect::<Vec<_>>().join(" ")
}

/// The profile that this program is built by, so that what it builds need not be compiled by another one too: the name of the folder that cargo
/// has put it in.
pub(crate) fn profile() -> String {
    let program = std::env::current_exe().unwrap_or_default();
    let folder = program.parent().and_then(|folder| folder.file_name()).unwrap_or_default().to_string_lossy();
    if folder == "debug" { "dev".to_owned() } else { folder.into_owned() }
}
