//! Figures of papers, measured anew: plots and pictures, their data, and what became of the claims made by them.

pub(crate) mod chains;
pub(crate) mod claim;
pub(crate) mod cost;
pub(crate) mod scenes;
pub(crate) mod seed004_fig1;

use crate::bench::table::Setup;
use crate::image::Image;

/// A file of a figure.
pub(crate) struct File {
    pub(crate) name: String,
    pub(crate) contents: Contents,
}

/// What is in it.
pub(crate) enum Contents {
    Text(String),
    /// As PNG.
    Picture(Image),
}

impl File {
    pub(crate) fn text(name: impl Into<String>, text: String) -> Self {
        Self { name: name.into(), contents: Contents::Text(text) }
    }
}

/// A report's table of what it was made by and on.
pub(crate) fn origin(setup: &Setup, command: &str) -> String {
    let Setup { machine, device, commit, integral } = setup;
    format!(
        "| | |\n|---|---|\n| command | `{}` |\n| machine | {machine} |\n| device | {device} |\n| commit | {commit} |\n\
         | images | {} x {} pixels |\n",
        command.replace(['\n', '\r', '`', '|'], " "),
        integral.width,
        integral.height,
    )
}
