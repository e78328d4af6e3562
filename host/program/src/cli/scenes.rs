//! `restir scenes`

use restir::{Error, scene::builtin};

use super::console;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Print only the names, one a line.
    #[arg(long)]
    names: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let line = |(name, description): &(&str, &str)| match arguments.names {
        true => format!("{name}\n"),
        false => format!("{name:16} {description}\n"),
    };
    console::print(&builtin::NAMES.iter().map(line).collect::<String>())
}
