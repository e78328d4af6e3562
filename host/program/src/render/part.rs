//! Parts of an image, which `restir merge` puts together.

use std::ops::{Range, RangeInclusive};
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;

use restir::advanced::part::{Part, Portion, Tile, Unit};
use restir::exec::Executor;
use restir::image::Image;
use restir::render::{Progress, Render, Rendered};
use restir::{Error, buffers::SceneBuffers};

use super::super::parse::{Span, natural, require};
use super::super::technique::Frames;
use super::super::{console, interrupt, metadata, progress::reported};
use super::{Arguments, Task};

/// Parts of a frame in which progress is told.
const PARTS: u64 = 1000;

/// Which part of the image to render, if not the whole.
#[derive(clap::Args)]
pub(super) struct PartArguments {
    /// Render samples A to B of each pixel (path tracing), of those that --spp gives, counted from 0. The result is a part,
    /// -o out.part; `restir merge` makes the image of all parts, with the bits of one render.
    #[arg(long, value_name = "A..B", value_parser = samples, conflicts_with = "chains", allow_hyphen_values = true)]
    samples: Option<Span>,
    /// Render chains A to B, each a render of its own whose seed is --seed and so many more (ReSTIR). The result is a part of their mean.
    /// A part of one chain's mean is asked for by --frames A..B --accumulate.
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    chains: Option<Span>,
    /// Render the pixels of a rectangle (path tracing): its size, and the column and row of its upper left pixel. The
    /// result is a part.
    #[arg(long, visible_alias = "tiles", value_name = "WIDTHxHEIGHT+X+Y", allow_hyphen_values = true)]
    tile: Option<TileArgument>,
}

/// Samples of --samples; elsewhere an option of that name says how many there are.
fn samples(text: &str) -> Result<Span, String> {
    text.parse().map_err(|problem| format!("{problem}; how many there are says --spp"))
}

/// A tile as it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TileArgument(Tile);

impl FromStr for TileArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || "it has to be WIDTHxHEIGHT+X+Y, as in 64x64+128+0".to_owned();
        let (size, corner) = text.split_once('+').ok_or_else(form)?;
        let (width, height) = size.split_once(['x', 'X']).ok_or_else(form)?;
        let (x, y) = corner.split_once('+').ok_or_else(form)?;
        Ok(Self(Tile { x: natural(x)?, y: natural(y)?, width: natural(width)?, height: natural(height)? }))
    }
}

impl Arguments {
    /// The part that is asked for, if one is; `numbered` are the frames that become files of their own.
    pub(super) fn part(&self) -> Result<Option<Asked>, Error> {
        let PartArguments { samples, chains, tile } = &self.part;
        let frames = match &self.job.technique.frames {
            Some(Frames::Each(frames)) if self.job.accumulate && samples.is_none() && chains.is_none() => {
                Some(frames.clone())
            }
            _ => None,
        };
        let asked = match (samples, chains, frames, tile) {
            (Some(samples), ..) => Some((Unit::Samples, Some(samples.range()))),
            (_, Some(chains), ..) => Some((Unit::Chains, Some(chains.range()))),
            (.., Some(frames), _) => Some((Unit::Frames, Some(*frames.start()..frames.end() + 1))),
            (.., Some(_)) => Some((Unit::Samples, None)),
            _ => None,
        };
        let Some((unit, range)) = asked else { return Ok(None) };
        self.refuse_beside_parts(unit)?;
        Ok(Some(Asked { unit, range, tile: tile.map(|tile| tile.0) }))
    }

    /// Refuses what a whole image has.
    fn refuse_beside_parts(&self, unit: Unit) -> Result<(), Error> {
        let of_images = [
            ("--denoise", self.denoise.is_some()),
            ("--layers", self.layers),
            ("--seconds", self.stop.seconds.is_some()),
            ("--noise", self.stop.noise.is_some()),
            ("--tev", self.tev.is_some()),
            ("--skip-existing", self.skip_existing),
        ];
        let given = of_images.iter().find(|(_, given)| *given).map_or("", |(option, _)| option);
        let problem = format_args!("{given} is for whole images; leave it out of a part");
        require(given.is_empty(), problem)?;
        let problem = format_args!(
            "--resume keeps the state of a chain, of a part that --frames A..B --accumulate asks for; render smaller parts, or leave it out"
        );
        require(self.resume.is_none() || unit == Unit::Frames, problem)?;
        let counted = matches!(self.job.technique.frames, Some(Frames::Each(_)));
        let problem =
            format_args!("--chains is for chains of --frames COUNT; give their length, or leave --chains out");
        require(unit != Unit::Chains || !(counted || self.turntable.is_some()), problem)
    }
}

/// A part as it is asked for.
pub(super) struct Asked {
    pub(super) unit: Unit,
    /// All samples, if there is none.
    range: Option<Range<u32>>,
    tile: Option<Tile>,
}

impl Asked {
    /// The number of samples, if none is given, reaches to the end of the part.
    pub(super) fn least_samples(&self) -> Option<u32> {
        self.range.as_ref().filter(|_| self.unit == Unit::Samples).map(|range| range.end)
    }

    /// The part of a render.
    fn portion(&self, render: &Render) -> Portion {
        let range = self.range.clone().unwrap_or(0..render.count);
        Portion { unit: self.unit, range, tile: self.tile }
    }
}

impl Task<'_> {
    /// Renders the part of an image, or of each of some frames.
    pub(super) fn part(
        &self,
        device: &mut dyn Executor,
        render: &Render,
        asked: &Asked,
        frames: Option<RangeInclusive<u32>>,
    ) -> Result<(), Error> {
        let (start, portion) = (Instant::now(), asked.portion(render));
        let written = reported("rendering", |observe| match frames {
            None => {
                let file = &self.arguments.outputs.output;
                self.part_of(device, self.buffers, render, &portion, (file, None), observe).map(|line| vec![line])
            }
            Some(frames) => self.part_of_each(device, render, &portion, frames, observe),
        })?;
        interrupt::begin_writing();
        let Portion { unit, range, .. } = &portion;
        let (Render { width, height, .. }, seconds) = (render, start.elapsed().as_secs_f64());
        let tile = portion.tile.map_or_else(String::new, |tile| format!(", tile {tile},"));
        console::print(&format!(
            "rendered {} {}..{} of {width} x {height} pixels{tile} in {seconds:.2} s\n{}",
            unit.name(),
            range.start,
            range.end - 1,
            written.concat()
        ))
    }

    /// Frames of path tracing are renders of their own, with seeds of their own.
    fn part_of_each(
        &self,
        device: &mut dyn Executor,
        render: &Render,
        portion: &Portion,
        frames: RangeInclusive<u32>,
        observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    ) -> Result<Vec<String>, Error> {
        let total = u64::from(frames.end() - frames.start() + 1) * PARTS;
        let mut written = Vec::new();
        for (index, frame) in (0..).zip(frames) {
            let moment = self.buffers.at(f64::from(frame))?;
            let cameras = vec![self.camera(f64::from(frame))];
            let render = Render { cameras, seed: render.seed.wrapping_add(frame), ..render.clone() };
            let file = &self.arguments.outputs.of_frame(frame)?.output;
            written.push(self.part_of(device, &moment, &render, portion, (file, Some(frame)), &mut |within| {
                let within = within.done * PARTS / within.total.max(1);
                observe(Progress { done: index * PARTS + within, total })
            })?);
        }
        Ok(written)
    }

    /// Renders a part to a file; gives what to say of it.
    fn part_of(
        &self,
        device: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        portion: &Portion,
        (file, frame): (&Path, Option<u32>),
        observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    ) -> Result<String, Error> {
        let state = self.arguments.resume.as_deref();
        let (part, from) = Part::render_from(device, scene, render, portion, state, observe)?;
        if from < portion.range.start {
            let first = portion.range.start;
            console::note(&format!(
                "warning: the frames from {from} on had to be rendered, too, because they come before frame {first}; --resume FILE hands their state on"
            ));
        }
        part.with_notes(self.notes(render, device, frame)).write(file)?;
        Ok(format!("wrote {}\n", file.display()))
    }

    /// What the image will say of itself, as far as it is known.
    fn notes(&self, render: &Render, device: &dyn Executor, frame: Option<u32>) -> Vec<(String, String)> {
        let image = Image { width: 0, height: 0, pixels: Vec::new() };
        let nothing = Rendered { image, dispatches: 0, dropped_samples: 0, counts: Vec::new() };
        let more = frame.map(|frame| ("frame", frame.to_string())).into_iter().collect();
        metadata::of_render(self.scene, render, &device.describe(), &nothing, more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_parsed() {
        let tile = Tile { x: 5, y: 0, width: 64, height: 32 };
        assert_eq!("64x32+5+0".parse(), Ok(TileArgument(tile)));
        assert_eq!(tile.to_string(), "64x32+5+0");
        for text in ["", "64x32", "64x32+5", "64x32-5+0", "x+0+0", "1x1+0+0+0", "64+32x5+0", "1x-1+0+0"] {
            text.parse::<TileArgument>().unwrap_err();
        }
    }
}
