//! Frames one after another, each in a file of its own.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::time::Instant;

use restir::advanced::checkpoint::{self, Watch, render_frames};
use restir::exec::{Description, Executor, Step};
use restir::image::read_exr_metadata;
use restir::render::{Images, Progress, Render, Rendered, Shows};
use restir::{Error, buffers::SceneBuffers, technique::Repeats};

use super::super::{console, interrupt, progress::reported, tev::Viewer};
use super::{Finished, Task, warn};

/// Parts of a frame in which progress is told.
const PARTS: u64 = 1000;

type Observe<'a> = dyn FnMut(Progress) -> Result<(), Error> + 'a;

/// A name of the frame's render, however it is shown on the way.
fn name_of(scene: &SceneBuffers, render: &Render, device: &Description) -> String {
    checkpoint::name_of(scene, &Render { shows: Shows::Last, ..render.clone() }, device)
}

/// The render that ends with a frame, which is its last one.
fn ending(render: &Render, frame: u32) -> Render {
    Render { count: frame + 1, shows: Shows::Last, ..render.clone() }
}

/// Frames of one render, some of which are written.
struct Chain<'a, 'b> {
    files: &'a mut Files<'b>,
    description: Description,
    render: &'a Render,
    /// The frames that are to be written, and the name of each.
    missing: BTreeMap<u32, String>,
    observe: &'a mut Observe<'a>,
}

impl Watch for Chain<'_, '_> {
    fn progress(&mut self, progress: Progress) -> Result<(), Error> {
        (self.observe)(progress)
    }

    fn frame(&mut self, frame: u32, images: &Images<'_>, step: &Step<'_>) -> Result<(), Error> {
        let Some(name) = self.missing.remove(&frame) else { return Ok(()) };
        let rendered = images.read(step)?;
        self.files.write(&self.description, frame, ending(self.render, frame), rendered, name)
    }
}

/// What becomes of each frame.
struct Files<'a> {
    task: &'a Task<'a>,
    viewer: &'a mut Viewer,
    /// The frames that were rendered, and of each what was written.
    done: Vec<String>,
    skipped: u32,
}

impl Task<'_> {
    /// Writes each of the frames as soon as it is done. What is interrupted leaves whole files.
    pub(super) fn numbered(
        &self,
        device: &mut dyn Executor,
        viewer: &mut Viewer,
        render: &Render,
        frames: RangeInclusive<u32>,
    ) -> Result<(), Error> {
        let start = Instant::now();
        let mut files = Files { task: self, viewer, done: Vec::new(), skipped: 0 };
        let outcome = reported("rendering", |observe| match render.technique.about().repeats {
            Repeats::Samples => files.of_samples(device, render, frames, observe),
            Repeats::Frames => files.of_frames(device, render, frames, observe),
        });
        let Files { done, skipped, .. } = files;
        if matches!(outcome, Err(Error::Interrupted)) && !done.is_empty() {
            console::note(&format!(
                "{} frames are written; the same command with --skip-existing goes on after them",
                done.len()
            ));
        }
        outcome?;
        interrupt::begin_writing();
        let (count, seconds) = (done.len(), start.elapsed().as_secs_f64());
        let there = if skipped > 0 { format!("; {skipped} were there") } else { String::new() };
        let Render { width, height, .. } = render;
        let sum = format!("rendered {count} frames of {width} x {height} pixels in {seconds:.2} s{there}\n");
        console::print(&(sum + &done.concat()))
    }
}

impl Files<'_> {
    /// Each frame is a render of its own, of the scene at that frame, with a seed of its own.
    fn of_samples(
        &mut self,
        device: &mut dyn Executor,
        render: &Render,
        frames: RangeInclusive<u32>,
        observe: &mut Observe<'_>,
    ) -> Result<(), Error> {
        let description = device.describe();
        let first = *frames.start();
        let total = u64::from(frames.end() - first + 1) * PARTS;
        for frame in frames {
            let moment = self.task.buffers.at(f64::from(frame))?;
            let cameras = vec![self.task.camera(f64::from(frame))];
            let render = Render { cameras, seed: render.seed.wrapping_add(frame), ..render.clone() };
            let name = name_of(&moment, &render, &description);
            if self.is_there(frame, &name)? {
                continue;
            }
            let images = Images::new(&moment, &render);
            let rendered = render.render_observed(&moment, device, &mut |step: &Step<'_>| {
                if self.viewer.is_due() && images.is_finished(step) {
                    self.viewer.show(&images.read(step)?.image);
                }
                let within = step.progress.done * PARTS / step.progress.total.max(1);
                observe(Progress { done: u64::from(frame - first) * PARTS + within, total })
            })?;
            self.write(&description, frame, render, rendered, name)?;
        }
        Ok(())
    }

    /// The frames of one render, which reuses in each what the ones before it have found: they are rendered too, from 0 on.
    fn of_frames(
        &mut self,
        device: &mut dyn Executor,
        render: &Render,
        frames: RangeInclusive<u32>,
        observe: &mut Observe<'_>,
    ) -> Result<(), Error> {
        let description = device.describe();
        let mut missing = BTreeMap::new();
        for frame in frames {
            let name = name_of(self.task.buffers, &ending(render, frame), &description);
            if !self.is_there(frame, &name)? {
                missing.insert(frame, name);
            }
        }
        let (Some((&first, _)), Some((&last, _))) = (missing.first_key_value(), missing.last_key_value()) else {
            return Ok(());
        };
        let state = self.task.arguments.resume.as_deref();
        let task = self.task;
        let mut chain = Chain { files: self, description, render, missing, observe };
        render_frames(device, task.buffers, render, first..last + 1, state, &mut chain).map(drop)
    }

    /// Whether the frame may be left out.
    fn is_there(&mut self, frame: u32, name: &str) -> Result<bool, Error> {
        let arguments = self.task.arguments;
        let outputs = arguments.outputs.of_frame(frame)?;
        if !arguments.skip_existing || !outputs.files().all(|file| file.exists()) {
            return Ok(false);
        }
        let metadata = read_exr_metadata(&outputs.output)?;
        let said = |key: &str| metadata.iter().find(|(name, _)| name == key).map_or("", |(_, value)| value);
        if said("render") != name || said("aov") != outputs.layer_names() {
            let problem = "it is of another render; delete it, name other files, or leave out --skip-existing";
            return Err(Error::cannot_write(&outputs.output, problem));
        }
        self.skipped += 1;
        Ok(true)
    }

    fn write(
        &mut self,
        device: &Description,
        frame: u32,
        render: Render,
        rendered: Rendered,
        name: String,
    ) -> Result<(), Error> {
        self.viewer.show(&rendered.image);
        warn(&render, &rendered);
        let outputs = self.task.arguments.outputs.of_frame(frame)?;
        let channels = self.task.layers(&render, frame, &mut |_| interrupt::check())?;
        let more = vec![("frame", frame.to_string()), ("render", name)];
        let finished = Finished { rendered, channels, render, more };
        self.task.write(&outputs, device, &finished)?;
        self.done.push(outputs.files().map(|path| format!("wrote {}\n", path.display())).collect());
        Ok(())
    }
}
