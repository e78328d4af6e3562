//! `restir scenes`

use restir::{Error, scene::builtin};

use super::console;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Print only the names, one a line; those that hold a seed are left out.
    #[arg(long)]
    names: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let lines: String = match arguments.names {
        true => builtin::NAMES.iter().map(|(name, _)| format!("{name}\n")).collect(),
        false => {
            let all = builtin::NAMES.iter().chain(builtin::FAMILIES);
            all.map(|(name, description)| format!("{name:16} {description}\n")).collect()
        }
    };
    console::print(&lines)
}
