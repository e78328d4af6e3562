//! What the paths of the last frame are, pixel by pixel, to be looked at.

use super::lineage::{Follower, ShiftPass};
use crate::exec::{Executor, Observer};
use crate::render::{self, Render, Rendered};
use crate::{Error, buffers::SceneBuffers, image::Channel, memory};
use rayon::prelude::*;
use restir_kernels::restir_pt::{pt_shade, pt_trace};
use restir_shared::shift::Cause;
use restir_shared::technique::restir_pt::{PackedPath, PtParams, Stored};
use std::{collections::BTreeMap, sync::Arc};

/// The paths of the last frame.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    /// The paths, rows from top to bottom.
    pub paths: Vec<Stored>,
    /// The index of the frame.
    pub frame: u32,
    /// What became of the shifts of others' paths to each pixel in the frame: how many ended by each of [`Cause::ALL`], of which the first
    /// means that there is a path.
    pub shifts: Vec<[u32; Cause::ALL.len()]>,
}

/// The channels of [`Layers::shifts`].
const SHIFTS: [&str; Cause::ALL.len()] =
    ["shift.done", "shift.unshiftable", "shift.joins", "shift.replay", "shift.dark", "shift.blocked", "shift.broken"];

impl Layers {
    /// As channels of an EXR file, named after the layer `path`: confidence `M`, contribution weight `W`, the `length` in segments, the index
    /// `k` of the vertex from which on it is kept (0 if it is replayed), and who traced it: the pixel `x`, `y`, and `age` frames ago.
    /// Without a path these are -1. The layer `shift` has how many shifts of others' paths to the pixel were `done` in the frame, and how many
    /// failed by which cause.
    pub fn channels(&self) -> Vec<Channel> {
        let channel =
            |name, value: &dyn Fn(&Stored) -> f32| Channel { name, values: self.paths.iter().map(value).collect() };
        let of_path = |stored: &Stored, value: u32| if stored.path.length == 0 { -1.0 } else { value as f32 };
        let paths = [
            channel("path.M", &|stored| stored.confidence),
            channel("path.W", &|stored| stored.contribution_weight),
            channel("path.length", &|stored| of_path(stored, stored.path.length)),
            channel("path.k", &|stored| of_path(stored, stored.path.reconnection)),
            channel("path.x", &|stored| of_path(stored, stored.path.key.x & 0xffff)),
            channel("path.y", &|stored| of_path(stored, stored.path.key.x >> 16)),
            channel("path.age", &|stored| of_path(stored, self.frame.wrapping_sub(stored.path.key.y))),
        ];
        let shifts = SHIFTS.into_iter().enumerate();
        let of_cause =
            |(cause, name)| Channel { name, values: self.shifts.iter().map(|counts| counts[cause] as f32).collect() };
        paths.into_iter().chain(shifts.map(of_cause)).collect()
    }

    /// The share of the paths that another pixel has as well: whose errors neighbours have in common. 0 if there are no paths.
    pub fn copied(&self) -> f64 {
        let mut holders: BTreeMap<[u32; 4], u32> = BTreeMap::new();
        for path in self.paths.iter().map(|stored| &stored.path).filter(|path| path.length > 0) {
            let who = [path.key.x, path.key.y, path.length, u32::from(path.light_sampled)];
            *holders.entry(who).or_default() += 1;
        }
        let of = |least: u32| -> u32 { holders.values().filter(|&&count| count >= least).sum() };
        f64::from(of(2)) / f64::from(of(1).max(1))
    }
}

/// As [`render::render`], with the paths of the last frame. The plan is the same; what became of its shifts is found by replaying them
/// natively, which takes the time that they take on the CPU.
///
/// # Errors
/// As of [`render::render`].
pub fn render_with_layers(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    observe: &mut Observer<'_>,
) -> Result<(Rendered, Layers), Error> {
    render::check(scene, render)?;
    // beside the plan: its planes read back, paths unpacked, channels and their encoded form
    let bytes = 2 * render.plan(scene).bytes() + 352 * u64::from(render.width) * u64::from(render.height);
    memory::check(bytes, "this render with layers", "choose a smaller size")?;
    let (mut follower, mut shifts) = (Follower::new(scene, render), Vec::new());
    let mut layers = Layers::default();
    let mut left = render.repeats_in_mean();
    let rendered = render::render(executor, scene, render, &mut |step| {
        follower.follow(step)?;
        if step.pass.kernel.name == pt_trace::DESC.name {
            shifts.clear();
        }
        shifts.extend(follower.shifts(step));
        if step.pass.kernel.name == pt_shade::DESC.name {
            left -= 1;
            if left == 0 {
                let paths = step.plane::<PackedPath>("paths")?;
                let frame = step.pass.params::<PtParams>().map_or(0, |params| params.frame);
                let shifts = counted(&shifts, paths.len());
                layers = Layers { paths: paths.iter().map(PackedPath::unpack).collect(), frame, shifts };
            }
        }
        observe(step)
    })?;
    Ok((rendered, layers))
}

/// What became of the shifts to each pixel.
fn counted(passes: &[Arc<ShiftPass>], pixels: usize) -> Vec<[u32; Cause::ALL.len()]> {
    let of_pixel = |pixel: usize| {
        let mut counts = [0; Cause::ALL.len()];
        for pass in passes.iter().filter(|pass| pass.is_to_pixels()) {
            let jobs = (pixel..pass.jobs.len()).step_by(pixels);
            jobs.filter_map(|job| pass.replay(job)).for_each(|(shifted, _)| counts[shifted.cause as usize] += 1);
        }
        counts
    };
    (0..pixels).into_par_iter().map(of_pixel).collect()
}
