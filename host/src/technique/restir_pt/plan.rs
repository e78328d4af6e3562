//! The passes of ReSTIR PT.

use super::{Changed, PtSettings};
use crate::plan::BufferId;
use crate::technique::Technique;
use crate::technique::reuse::PassParams;
use crate::technique::reuse::chain::{Chain, Passes, Queue, Reuses};
use crate::technique::reuse::planes::{Planes, Turns};
use crate::technique::sequence::{Frame, Stage, Within};
use restir_kernels::restir_pt as pt;
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::layout::{CameraParams, FEATURE_BLEND, FilmPixel};
use restir_shared::resample::mutual::{ShiftRequest, ShiftResult};
use restir_shared::resample::params::{Flags, LastFrame, ReuseParams};
use restir_shared::resample::similar::PackedSurface;
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};

impl PassParams for PtParams {
    fn settings(&self) -> u32 {
        (self.flags | Flags::OF_PASSES | Flags::TAKES_ALL).bits()
    }

    fn frame(&self) -> u32 {
        self.frame
    }
}

/// The chain of frames. Its planes are those that the settings need.
pub(super) fn chain(settings: &PtSettings, stage: &Stage) -> Chain<PtPasses> {
    let (shares, history) = (settings.shares(), settings.temporal && stage.goes_on);
    let in_space = if shares { settings.spatial } else { 0 };
    let reuses = Reuses { in_time: history, in_space, feedback: settings.feedback, shadings: 1 };
    // who finds paths of up to two segments, if it is another technique
    let direct = settings.direct.technique(&settings.integral());
    let mut planes = Planes::new(stage, direct.map(|technique| Within::new(&*technique, stage, 1)));
    let pixels = planes.pixels;
    // of each neighbour a layer: requests, and their results
    let layers = if shares { settings.neighbours as usize } else { usize::from(history) };
    let results = (layers > 0).then(|| {
        planes.add::<ShiftRequest>("requests", layers * pixels);
        planes.add::<ShiftResult>("results", layers * pixels)
    });
    let origins = planes.add_turns::<PathOrigin>("origins", history);
    let surfaces = planes.add_turns::<PackedSurface>("surfaces", history);
    // one in work, one for the last frame's or for spatial reuse, and a third where both are needed at once
    let held = history && !settings.feedback && in_space > 1;
    planes.add_records::<PackedPath>("reservoirs", 1 + usize::from(shares || history) + usize::from(held));
    let direct = planes.add::<FilmPixel>("direct", pixels);
    let returned = history.then(|| planes.add::<ShiftResult>("returned", pixels));
    if returned.is_none()
        && let Some(results) = results
    {
        planes.bind("returned", results);
    }
    let retraces = history && settings.changed == Changed::Retrace;
    let retraced = retraces.then(|| planes.add::<PackedPath>("retraced", pixels));
    let of_all = settings.params(stage);
    let passes = PtPasses { settings: settings.clone(), of_all, origins, surfaces, direct, returned, retraced };
    Chain::new(stage, settings.integral(), reuses, planes, passes)
}

/// The passes, and the planes that they name.
pub(super) struct PtPasses {
    settings: PtSettings,
    of_all: PtParams,
    origins: Turns,
    surfaces: Turns,
    direct: BufferId,
    /// Results of requests the other way, with temporal reuse.
    returned: Option<BufferId>,
    /// Paths as they are in the respective other frame, where they are traced there once more.
    retraced: Option<BufferId>,
}

impl Passes for PtPasses {
    fn initial(&self, queue: &mut Queue, now: &Frame) {
        queue.push(now, &pt::pt_trace::DESC, &self.params(now), &[("reservoirs", queue.work())]);
    }

    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let params = self.settings.with_last(self.params(now), now, last);
        let (work, mut history) = (queue.work(), queue.history());
        if !params.flags.contains(Flags::STILL)
            && let Some(returned) = self.returned
        {
            let [origins, surfaces] = [&self.origins, &self.surfaces].map(|planes| planes.before(now.index));
            queue.push(now, &reuse_reproject::DESC, &params.reuse, &[("other_surfaces", surfaces)]);
            let back = params.with_flags(Flags::BACK);
            let own = self.retraced(queue, now, &back, work);
            let planes = [("reservoirs", own), ("origins", origins), ("results", returned)];
            queue.push(now, &pt::pt_shift::DESC, &back, &planes);
            history = self.recalled(queue, now, &params, history);
            queue.push(now, &pt::pt_shift::DESC, &params, &[("reservoirs", history)]);
        }
        queue.push(now, &pt::pt_merge::DESC, &params, &[("reservoirs", history), ("merged", work)]);
    }

    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId) {
        let params = self.params(now).with_neighbours(pass);
        let (layers, paths) = (params.with_layers(), ("reservoirs", queue.work()));
        queue.push(now, &reuse_pair::DESC, &layers.reuse, &[]);
        queue.push(now, &pt::pt_shift::DESC, &layers, &[paths]);
        queue.push(now, &pt::pt_merge::DESC, &params, &[paths, ("merged", merged)]);
    }

    fn shade(&self, queue: &mut Queue, now: &Frame) {
        let direct = self.direct_light(queue, now);
        if now.adds {
            let paths = ("reservoirs", queue.work());
            queue.shade(|queue, film| {
                let planes = [paths, ("direct", direct), ("film", film)];
                queue.push(now, &pt::pt_shade::DESC, &self.params(now), &planes);
            });
        }
    }
}

impl PtPasses {
    /// The plane of the last frame's paths as they are now.
    fn recalled(&self, queue: &mut Queue, now: &Frame, params: &PtParams, last: BufferId) -> BufferId {
        if self.retraced.is_none() && !now.same_scene {
            queue.push(now, &pt::pt_recall::DESC, params, &[("reservoirs", last)]);
        }
        self.retraced(queue, now, params, last)
    }

    /// The plane of these paths with what arrives at their vertices k in the other frame, if that may be something else.
    fn retraced(&self, queue: &mut Queue, now: &Frame, params: &PtParams, paths: BufferId) -> BufferId {
        let Some(retraced) = self.retraced.filter(|_| !now.same_scene) else { return paths };
        queue.push(now, &pt::pt_retrace::DESC, params, &[("reservoirs", paths)]);
        retraced
    }

    /// The plane of what needs no path of this technique.
    fn direct_light(&self, queue: &mut Queue, now: &Frame) -> BufferId {
        let Some(picture) = queue.push_within(now) else { return self.direct };
        if now.adds {
            // of this technique's what was cut short is in it, and nothing else
            queue.push_sum(self.direct, picture);
        }
        picture
    }

    /// Of passes that see one frame.
    fn params(&self, now: &Frame) -> PtParams {
        let [scene, _] = now.scenes;
        let hybrid = self.settings.hybrid(now.features & FEATURE_BLEND != 0);
        let of_frame = self.of_all.of_frame(now.index, now.camera);
        PtParams { reuse: ReuseParams { scene, other_scene: scene, ..of_frame.reuse }, hybrid, ..of_frame }
    }
}

impl PtSettings {
    /// Of passes that see one frame, whichever it is, but for where paths are joined.
    fn params(&self, stage: &Stage) -> PtParams {
        let [width, height] = stage.size;
        let reuse = ReuseParams {
            width,
            height,
            seed: stage.seed,
            flags: self.flags().with_form(self.mis.mis()),
            neighbours: self.neighbours,
            tile: self.tile.ilog2(),
            max_plane_distance: self.max_plane_distance,
            min_normal_cos: self.min_normal_cos,
            layers: 1,
            confidence_cap: self.confidence_cap as f32,
            ..ReuseParams::default()
        };
        PtParams { reuse, max_depth: self.max_depth, ..PtParams::default() }
    }

    /// Of passes between a frame and the last one, from those of the frame.
    fn with_last(&self, mut params: PtParams, now: &Frame, camera: CameraParams) -> PtParams {
        let same_view = now.is_still() && self.still && !self.jitter;
        params.flags = params.flags.with_form(self.temporal_mis.mis());
        let last = LastFrame { camera, scene: now.scenes[1], same_view };
        let params = params.with_last(&last, !now.same_scene);
        let takes_all = !now.same_scene && self.changed != Changed::Drop;
        if takes_all { params.with_flags(Flags::TAKES_ALL) } else { params }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::film::Capacity;
    use crate::render::Render;
    use crate::settings::Value;
    use crate::technique::restir_pt::Direct;
    use crate::technique::reuse::unused;

    fn settings(change: impl Fn(&mut PtSettings)) -> PtSettings {
        let mut settings = PtSettings::default();
        change(&mut settings);
        settings
    }

    /// Bytes a pixel beside the film's: origins and surfaces of 32, paths of 64, the direct part and results that came back of 16, and of each
    /// neighbour a request of 8 and its result of 16. Counts are right, every pass fits its buffers, and every buffer is used.
    #[test]
    fn plans_hold_what_the_settings_need() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("moving").expect("built in")).expect("builds");
        let rows = [
            (settings(|s| (s.temporal, s.spatial) = (false, 0)), 1, 64 + 64 + 16),
            (settings(|s| (s.temporal, s.still, s.spatial) = (true, false, 0)), 3, 2 * 64 + 2 * 64 + 16 + 24 + 16),
            (settings(|s| s.temporal = false), 3, 64 + 2 * 64 + 16 + 4 * 24),
            (settings(|s| s.still = false), 4, 2 * 64 + 2 * 64 + 16 + 4 * 24 + 16),
            (settings(|s| (s.still, s.feedback) = (false, true)), 4, 2 * 64 + 2 * 64 + 16 + 4 * 24 + 16),
            (settings(|s| (s.still, s.feedback, s.spatial) = (false, false, 3)), 4, 2 * 64 + 3 * 64 + 16 + 4 * 24 + 16),
            (settings(|s| (s.temporal, s.neighbours) = (false, 8)), 2, 64 + 2 * 64 + 16 + 8 * 24),
            (settings(|s| s.changed = Changed::Retrace), 4, 2 * 64 + 3 * 64 + 16 + 4 * 24 + 16),
            (settings(|s| (s.temporal, s.changed) = (false, Changed::Retrace)), 3, 64 + 2 * 64 + 16 + 4 * 24),
        ];
        for (settings, frames, expected) in rows {
            for accumulate in [false, true] {
                let render = Render { count: frames, accumulate, ..Render::new([16, 12], settings.clone()) };
                let plan = render.plan(&scene);
                let capacity = Capacity {
                    size: [16, 12],
                    samples: render.repeats_in_mean(),
                    largest_block: 0,
                    progressive: false,
                };
                let words: usize = plan.buffers[3..].iter().map(|buffer| buffer.words).sum();
                let film = 16 * (capacity.planes() + 1);
                assert_eq!(4 * words / (16 * 12), expected + film, "{render:?}");
                assert!(unused(plan).is_empty(), "{render:?}");
            }
        }
    }

    /// Counts are right with another technique's passes in between, every pass fits its buffers, and every buffer is used.
    #[test]
    fn another_technique_finds_direct_light() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("cornell").expect("built in")).expect("builds");
        for direct in crate::technique::all().iter().filter_map(|technique| Direct::read(technique.about().name)) {
            for (accumulate, temporal) in [(false, true), (true, false)] {
                let settings = settings(|s| (s.direct, s.temporal, s.still) = (direct, temporal, false));
                let render = Render { count: 3, accumulate, ..Render::new([16, 12], settings) };
                assert!(unused(render.plan(&scene)).is_empty(), "{render:?}");
            }
        }
        assert!(Direct::read("unified").is_some() && Direct::read("nobody").is_none());
    }

    /// Every pass fits its buffers, so that it writes none that it reads: with all settings, over several frames.
    #[test]
    fn no_pass_writes_what_it_reads() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("moving").expect("built in")).expect("builds");
        for (spatial, bits) in (0..4).flat_map(|spatial| (0..8).map(move |bits| (spatial, bits))) {
            let settings = settings(|s| {
                (s.spatial, s.feedback, s.temporal) = (spatial, bits & 1 == 1, bits & 2 == 2);
                s.changed = if bits & 4 == 4 { Changed::Retrace } else { Changed::Drop };
            });
            let render = Render { count: 5, ..Render::new([16, 12], settings) };
            unused(render.plan(&scene));
        }
    }
}
