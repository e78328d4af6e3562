//! What an image is, whatever becomes of it: technique, settings, samples, size.

use restir::Error;
use restir::render::Render;
use restir::scene::Scene;
use restir::technique::Repeats;

use super::parse::{Size, natural, saturating};
use super::scene::DEFAULT_SIZE;
use super::technique::{Frames, PixelArguments, TechniqueArguments, configured, refuse_unused};

#[derive(clap::Args)]
pub(super) struct JobArguments {
    #[command(flatten)]
    pub(super) technique: TechniqueArguments,
    /// Samples per pixel (path tracing); the technique chooses if not given.
    #[arg(long, value_parser = saturating, allow_hyphen_values = true)]
    pub(super) spp: Option<u64>,
    /// Write the mean of all frames, instead of the last one (ReSTIR).
    #[arg(long)]
    pub(super) accumulate: bool,
    /// Longest path in segments: 1 is directly visible light, 2 adds direct light, 3 the first bounce; 8 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    max_depth: Option<u32>,
    /// Image size in pixels, as WIDTHxHEIGHT; the scene's or 512x512 if not given.
    #[arg(long, allow_hyphen_values = true)]
    size: Option<Size>,
    #[command(flatten)]
    pixel: PixelArguments,
}

impl JobArguments {
    /// The image, seen by the scene's camera.
    pub(super) fn render(&self, scene: &Scene) -> Result<Render, Error> {
        let size = self.size.map_or(Ok(scene.default_size.unwrap_or(DEFAULT_SIZE)), Size::sides)?;
        let options = &self.technique;
        let technique = configured(&options.name, &options.settings, self.max_depth, self.pixel.jitter())?;
        let given =
            [("--spp", self.spp.is_some(), Repeats::Samples), ("--accumulate", self.accumulate, Repeats::Frames)];
        refuse_unused(technique.as_ref(), &given)?;
        let count = match (self.spp, &options.frames) {
            (Some(samples), _) => u32::try_from(samples)
                .map_err(|_| Error::Setting(format!("--spp is too large; give at most {}", u32::MAX)))?,
            (None, Some(Frames::Count(count))) => *count,
            _ => technique.about().default_count,
        };
        Ok(Render { count, accumulate: self.accumulate, seed: options.seed, ..Render::new(size, technique) })
    }
}
