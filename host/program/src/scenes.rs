//! `restir scenes`

use restir::Error;
use restir::scene::{builtin, subsurface};

use super::console;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Print only the names, one a line, without the families of scenes that have a seed in their name.
    #[arg(long)]
    names: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let lines: String = match arguments.names {
        true => builtin::NAMES.iter().map(|(name, _)| format!("{name}\n")).collect(),
        false => {
            let all = builtin::NAMES.iter().chain(builtin::FAMILIES);
            let scenes = all.map(|(name, description)| format!("{name:16} {description}\n"));
            let media: Vec<&str> = subsurface::MEDIA.iter().map(|(name, ..)| *name).collect();
            scenes
                .chain([format!("media of --subsurface: {}, or a colour, as 0.9,0.5,0.2\n", media.join(", "))])
                .collect()
        }
    };
    console::print(&lines)
}
