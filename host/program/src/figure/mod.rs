//! Figures of papers, measured anew: plots and pictures, their data, and what became of the claims made by them.

pub(crate) mod averaging;
pub(crate) mod chains;
pub(crate) mod claim;
pub(crate) mod cost;
pub(crate) mod picture;
pub(crate) mod scenes;
pub(crate) mod seed002_fig1;
pub(crate) mod seed002_fig2;
pub(crate) mod seed004_fig1;

use restir::Error;
use restir::buffers::SceneBuffers;
use restir::exec::Executor;
use restir::image::Image;
use restir::reference::Picture;
use restir::reference::{Goal, Reference};
use restir::render::Progress;

use crate::bench::table::Setup;

/// Makes references and reports progress: what a figure needs of the program.
pub(crate) trait Environs {
    /// The reference of a scene.
    fn reference(&mut self, name: &str, scene: &SceneBuffers, goal: Goal) -> Result<Reference, Error>;
    /// Where chains are run, and who hears of it.
    fn run<T>(
        &mut self,
        what: &str,
        work: impl FnOnce(&mut dyn Executor, &mut dyn FnMut(Progress) -> Result<(), Error>) -> Result<T, Error>,
    ) -> Result<T, Error>;
}

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
    let Setup { machine, device, commit, picture: Picture { size: [width, height], .. } } = setup;
    format!(
        "| | |\n|---|---|\n| command | `{}` |\n| machine | {machine} |\n| device | {device} |\n| commit | {commit} |\n\
         | images | {width} x {height} pixels |\n",
        command.replace(['\n', '\r', '`', '|'], " "),
    )
}
