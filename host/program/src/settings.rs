//! `restir settings`

use std::fmt::Write;

use restir::Error;
use restir::advanced::settings::Entry;
use restir::technique::{self, Technique};

use super::{console, technique::names};

/// Where the explanation of a setting begins.
const COLUMN: usize = 34;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The technique; all of them if not given.
    #[arg(value_parser = names())]
    technique: Option<String>,
}

/// Lists the settings of a technique.
pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let techniques = match &arguments.technique {
        Some(name) => vec![technique::named(name)?],
        None => technique::all(),
    };
    let texts: Vec<String> = techniques.iter().map(|technique| describe(technique.as_ref())).collect();
    console::print(&texts.join("\n"))
}

fn describe(technique: &dyn Technique) -> String {
    let about = technique.about();
    let mut text = format!("{}: {}\n", about.name, about.summary);
    for entry in technique.entries() {
        let _ = writeln!(text, "{:COLUMN$}  {} {}", pair(&entry), entry.expected, entry.doc);
    }
    let presets = technique.presets();
    if !presets.is_empty() {
        text += "presets, each with what differs from the defaults:\n";
    }
    for (name, differing) in presets {
        let pairs: Vec<String> = differing.iter().map(pair).collect();
        let _ = writeln!(text, "preset={name}: {}", pairs.join(" "));
        let mut preset = technique.boxed();
        if preset.set("preset", name).is_ok() {
            preset.biases().iter().for_each(|bias| text += &format!("    biased: {bias}\n"));
        }
    }
    text
}

fn pair(entry: &Entry) -> String {
    format!("{}={}", entry.key, entry.value)
}
