//! Figures of papers, measured anew: plots and pictures, their data, and what became of the claims made by them.

pub(crate) mod averaging;
pub(crate) mod beside;
pub(crate) mod bitterli2020_fig1;
pub(crate) mod chains;
pub(crate) mod claim;
mod command;
pub(crate) mod cost;
pub(crate) mod kettunen2023_fig3;
pub(crate) mod kettunen2023_fig4;
pub(crate) mod landing;
pub(crate) mod picture;
mod prefixes;
pub(crate) mod scenes;
pub(crate) mod tokuyoshi_fig1;
pub(crate) mod tokuyoshi_fig2;
pub(crate) mod view;
pub(crate) mod zhang2025_candies;
pub(crate) mod zhang2025_cubes;
pub(crate) mod zhang2025_grid;
pub(crate) mod zhang2025_places;
pub(crate) mod zhang2025_profiles;
pub(crate) mod zhang2025_walk;

pub use command::{Arguments, run};

use restir::advanced::reference::{Goal, Reference};
use restir::{Error, buffers::SceneBuffers, exec::Executor, image::Image, render::Progress};

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

/// How near neighbours are in an image of the given height: as 30 of 1080 pixels, but at least 1.5 pixels, within which
/// there are eight.
fn radius(height: u32) -> f32 {
    (30.0 / 1080.0 * height as f32).max(1.5)
}

/// What a figure is made of.
pub(crate) struct Files {
    /// [`PICTURE`], if there is one.
    pub(crate) picture: Option<Image>,
    /// Tables and plots, by their names.
    pub(crate) texts: Vec<(String, String)>,
    /// In Markdown; it refers to the others.
    pub(crate) report: String,
}

/// The name of a figure's picture.
pub(crate) const PICTURE: &str = "images.png";
