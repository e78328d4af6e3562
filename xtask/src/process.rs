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
