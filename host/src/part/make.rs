//! A part is rendered.

use super::header::{Header, Tile, Unit, identity};
use super::tree::Tree;
use super::{Part, Portion};
use crate::checkpoint::{Watch, render_frames};
use crate::exec::{Executor, Progress, Step};
use crate::film::aligned_blocks;
use crate::plan::FramePlan;
use crate::render::{self, Images, Render};
use crate::sequence::Share;
use crate::sequence::technique::Repeats;
use crate::{Error, buffers::SceneBuffers};
use restir_shared::layout::FilmPixel;
use std::path::Path;

/// The largest block that is rendered at once, as a power of two.
const LARGEST: u32 = 31;

type Observe<'a> = dyn FnMut(Progress) -> Result<(), Error> + 'a;

/// What a part is made of while it is in work.
#[derive(Default)]
struct Sums {
    tree: Tree,
    dispatches: u64,
    counts: Vec<(String, u64)>,
}

impl Part {
    /// Renders a part of the image of `render`: [`Render::count`] is the number of samples of the whole, or of the frames of a chain; for
    /// [`Unit::Frames`] it does not matter. `observe` may end it.
    ///
    /// # Errors
    /// Those of [`Render::render`]; [`Error::Setting`] for what cannot be rendered in such parts; that of `observe`.
    pub fn render(
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        portion: &Portion,
        observe: &mut Observe<'_>,
    ) -> Result<Self, Error> {
        let (part, _) = Self::render_from(executor, scene, render, portion, None, observe)?;
        Ok(part)
    }

    /// The same of frames, which begin from the state that the file has, and leave theirs in it; see [`render_frames`]. Gives the first frame that
    /// had to be rendered.
    ///
    /// # Errors
    /// As of [`Self::render`], and those of [`render_frames`].
    pub fn render_from(
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        portion: &Portion,
        state: Option<&Path>,
        observe: &mut Observe<'_>,
    ) -> Result<(Self, u32), Error> {
        check(scene, render, portion)?;
        let Portion { unit, range, tile } = portion.clone();
        let (size, mut from) = ([render.width, render.height], range.start);
        let tile = tile.unwrap_or(Tile::whole(size));
        let of = identity(scene, render, unit, &executor.describe());
        let mut sums = Sums::default();
        match unit {
            Unit::Samples => sums.of_samples(executor, scene, render, portion, tile, observe)?,
            Unit::Chains => sums.of_chains(executor, scene, render, portion, observe)?,
            Unit::Frames => {
                let mut frames = Frames { sums: &mut sums, observe };
                from = render_frames(executor, scene, render, range.clone(), state, &mut frames)?;
            }
        }
        let Sums { tree, dispatches, counts } = sums;
        let (blocks, planes) = tree.into_blocks();
        let count = if unit == Unit::Samples { render.count } else { range.end };
        let header = Header { unit, range, count, size, tile, of, notes: Vec::new(), blocks, dispatches, counts };
        Ok((Self { header, planes }, from))
    }
}

/// Refuses what has no such parts.
fn check(scene: &SceneBuffers, render: &Render, portion: &Portion) -> Result<(), Error> {
    render.check(scene)?;
    let Portion { unit, ref range, tile } = *portion;
    let (about, name, size) = (render.technique.about(), unit.name(), [render.width, render.height]);
    let refused = |problem: String| Err(Error::Setting(problem));
    if range.is_empty() {
        return refused(format!("a part of no {name} is none; give at least one"));
    }
    if let Some(tile) = tile.filter(|_| about.repeats == Repeats::Frames) {
        return refused(format!(
            "{} has no tiles, because its pixels use samples of each other; leave out the tile {tile}, or choose the technique path",
            about.name
        ));
    }
    let repeats = if unit == Unit::Samples { Repeats::Samples } else { Repeats::Frames };
    if about.repeats != repeats {
        let parts = if about.repeats == Repeats::Samples { "samples" } else { "chains or frames" };
        return refused(format!("{} has no parts by {name}; choose {parts}", about.name));
    }
    if unit == Unit::Samples && range.end > render.count {
        let Render { count, .. } = render;
        return refused(format!(
            "the part ends with sample {}, and the image has {count}; count from 0",
            range.end - 1
        ));
    }
    if render.denoise.is_some() {
        return refused("parts cannot be denoised; denoise the image that they are merged to".to_owned());
    }
    if unit == Unit::Frames && (render.cameras.len() > 1 || scene.is_animated()) {
        return refused("frames in which something moves have no common mean; leave the camera and the scene as they are, or render each frame".to_owned());
    }
    match tile {
        Some(tile) if !tile.is_in(size) => {
            let [width, height] = size;
            refused(format!(
                "the tile {tile} is not in the image of {width} x {height} pixels; give its size, column and row"
            ))
        }
        _ => Ok(()),
    }
}

/// Progress within work whose first passes are done.
fn after(done: u64, total: u64, step: &Step<'_>) -> Progress {
    Progress { done: (done + step.progress.done).min(total), total }
}

impl Sums {
    fn of_samples(
        &mut self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        Portion { range, .. }: &Portion,
        tile: Tile,
        observe: &mut Observe<'_>,
    ) -> Result<(), Error> {
        let blocks: Vec<_> = aligned_blocks(range.start, range.end - range.start, LARGEST).collect();
        let render_of = |log2: u32| Render { count: 1 << log2, shows: render::Shows::Last, ..render.clone() };
        let share = |first| Some(([tile.width, tile.height], Share { corner: [tile.x, tile.y], first }));
        let dispatches = executor.dispatches();
        let total = blocks
            .iter()
            .map(|&(first, log2)| render_of(log2).plan_of(scene, dispatches, share(first)).pass_count)
            .sum();
        for (first, log2) in blocks {
            let (render, done) = (render_of(log2), self.dispatches);
            let plan = render.plan_of(scene, dispatches, share(first));
            self.run(executor, plan, (first, log2), &mut |step| observe(after(done, total, step)))?;
        }
        Ok(())
    }

    fn of_chains(
        &mut self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        Portion { range, .. }: &Portion,
        observe: &mut Observe<'_>,
    ) -> Result<(), Error> {
        let total = render.plan(scene).pass_count * u64::from(range.end - range.start);
        for chain in range.clone() {
            let seed = render.seed.wrapping_add(chain);
            let (render, done) = (Render { seed, shows: render::Shows::Last, ..render.clone() }, self.dispatches);
            let plan = render.plan_of(scene, executor.dispatches(), None);
            self.run(executor, plan, (chain, 0), &mut |step| observe(after(done, total, step)))?;
        }
        Ok(())
    }

    /// Runs a plan whose output is the sum of a block.
    fn run(
        &mut self,
        executor: &mut dyn Executor,
        plan: FramePlan<'_>,
        (first, log2): (u32, u32),
        observe: &mut dyn FnMut(&Step<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (passes, names) = (plan.pass_count, plan.counts);
        let outputs = executor.run_observed(plan, observe)?;
        let [words, counted] = [outputs.first(), outputs.last()].map(|words| words.map_or(&[][..], |words| words));
        self.tree.push(first, log2, bytemuck::pod_collect_to_vec(words));
        self.dispatches += passes;
        for (name, count) in render::counts(counted, names) {
            match self.counts.iter_mut().find(|(of, _)| of == name) {
                Some((_, sum)) => *sum += count,
                None => self.counts.push((name.to_owned(), count)),
            }
        }
        Ok(())
    }
}

/// Frames of a chain that go into a part.
struct Frames<'a, 'b> {
    sums: &'a mut Sums,
    observe: &'a mut Observe<'b>,
}

impl Watch for Frames<'_, '_> {
    fn progress(&mut self, progress: Progress) -> Result<(), Error> {
        self.sums.dispatches += 1;
        (self.observe)(progress)
    }

    fn frame(&mut self, frame: u32, images: &Images<'_>, step: &Step<'_>) -> Result<(), Error> {
        let pixels: Vec<FilmPixel> = images.pixels(step)?;
        self.sums.tree.push(frame, 0, pixels);
        Ok(())
    }
}
