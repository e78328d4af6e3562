//! The command-line tools of SPIRV-Tools.

use std::path::Path;
use std::process::{Command, Output};

use super::workspace::scratch;
use crate::Error;

/// The environment that modules are made for.
const TARGET_ENV: &str = "vulkan1.2";

/// Optimises a module.
pub fn optimise(module: &[u8]) -> Result<Vec<u8>, Error> {
    let folder = scratch()?;
    let (input, output) = (folder.path().join("in.spv"), folder.path().join("out.spv"));
    std::fs::write(&input, module).map_err(Error::io("write", &input))?;
    let mut command = Command::new("spirv-opt");
    // spirv-opt takes the environment as one argument, spirv-val as two.
    command.arg(format!("--target-env={TARGET_ENV}")).arg("-O").arg(&input).arg("-o").arg(&output);
    run(&mut command)?;
    std::fs::read(&output).map_err(Error::io("read", &output))
}

/// Validates a module for Vulkan 1.2; the finding is spirv-val's own text.
pub fn validate(module: &[u8]) -> Result<Option<String>, Error> {
    let folder = scratch()?;
    let input = folder.path().join("in.spv");
    std::fs::write(&input, module).map_err(Error::io("write", &input))?;
    let output = launch(Command::new("spirv-val").args(["--target-env", TARGET_ENV]).arg(&input))?;
    Ok((!output.status.success()).then(|| format!("spirv-val: {}", message(&output))))
}

/// The assembly text of a module in a file.
pub fn disassemble(module: &Path) -> Result<String, Error> {
    run(Command::new("spirv-dis").arg("--no-color").arg(module))
}

/// The first line of `spirv-opt --version`, which some releases print to standard error.
pub fn version() -> Result<String, Error> {
    let text = message(&launch(Command::new("spirv-opt").arg("--version"))?);
    match text.lines().next() {
        Some(line) => Ok(line.trim().to_owned()),
        None => Err(Error::Environment("spirv-opt does not tell its version: install another SPIRV-Tools".to_owned())),
    }
}

/// Whether the tools are there at all.
pub fn are_installed() -> bool {
    version().is_ok()
}

/// Runs a tool to success and gives its standard output.
fn run(command: &mut Command) -> Result<String, Error> {
    let output = launch(command)?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let program = command.get_program().display();
    Err(Error::Failed(format!("{program} ended with {}: {}", output.status, message(&output))))
}

fn launch(command: &mut Command) -> Result<Output, Error> {
    command.output().map_err(|error| missing(&command.get_program().to_string_lossy(), &error))
}

fn missing(program: &str, error: &std::io::Error) -> Error {
    Error::Environment(format!(
        "cannot run {program} ({error}): install SPIRV-Tools, for example with `apt-get install spirv-tools`"
    ))
}

fn message(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8_lossy(&text).trim().to_owned()
}
