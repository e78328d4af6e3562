//! The passes of ReSTIR PT.

use super::{Changed, PtSettings};
use crate::plan::BufferId;
use crate::technique::Technique;
use crate::technique::reuse::Specialises;
use crate::technique::reuse::chain::{Chain, Passes, Queue, Reuses, of_frame};
use crate::technique::reuse::mutual::{Mutual, with_last};
use crate::technique::reuse::planes::Planes;
use crate::technique::sequence::{Frame, Stage, Within};
use restir_kernels::restir_pt as pt;
use restir_shared::layout::{CameraParams, FEATURE_BLEND, FilmPixel};
use restir_shared::resample::params::{Flags, ReuseParams};
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};

impl Specialises for PtParams {
    fn settings(&self) -> u32 {
        (self.flags | Flags::OF_PASSES | Flags::TAKES_ALL).bits()
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
    let mutual = Mutual::new::<PackedPath, PathOrigin>(
        &mut planes,
        &reuses,
        settings.neighbours,
        [&pt::pt_shift::DESC, &pt::pt_merge::DESC],
    );
    let direct = planes.add::<FilmPixel>("direct", planes.pixels);
    let retraces = history && settings.changed == Changed::Retrace;
    let retraced = retraces.then(|| planes.add::<PackedPath>("retraced", planes.pixels));
    let of_all = settings.params(stage);
    let passes = PtPasses { settings: settings.clone(), of_all, mutual, direct, retraced };
    Chain::new(stage, settings.integral(), reuses, planes, passes)
}

/// The passes, and the planes that they name.
pub(super) struct PtPasses {
    settings: PtSettings,
    of_all: PtParams,
    mutual: Mutual,
    direct: BufferId,
    /// Paths as they are in the respective other frame, where they are traced there once more.
    retraced: Option<BufferId>,
}

impl Passes for PtPasses {
    fn initial(&self, queue: &mut Queue, now: &Frame) {
        queue.push(now, &pt::pt_trace::DESC, &self.params(now), &[("reservoirs", queue.work())]);
    }

    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let params = self.settings.with_last(self.params(now), now, last);
        self.mutual.in_time(queue, now, &params, |queue, params, paths| self.elsewhere(queue, now, params, paths));
    }

    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId) {
        self.mutual.in_space(queue, now, &self.params(now), pass, merged);
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
    /// The plane of these paths as they are in the other frame: with [`Flags::BACK`] of this frame's there, else of the last one's here.
    fn elsewhere(&self, queue: &mut Queue, now: &Frame, params: &PtParams, paths: BufferId) -> BufferId {
        if now.same_scene {
            return paths;
        }
        if let Some(retraced) = self.retraced {
            queue.push(now, &pt::pt_retrace::DESC, params, &[("reservoirs", paths)]);
            return retraced;
        }
        if !params.flags.contains(Flags::BACK) {
            queue.push(now, &pt::pt_recall::DESC, params, &[("reservoirs", paths)]);
        }
        paths
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
        let hybrid = self.settings.hybrid(now.features & FEATURE_BLEND != 0);
        PtParams { hybrid, ..of_frame(&self.of_all, now) }
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
        params.flags = params.flags.with_form(self.temporal_mis.mis());
        let params = with_last(&params, now, camera, self.still && !self.jitter);
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
    use crate::technique::Direct;
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
                    is_sum: false,
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
