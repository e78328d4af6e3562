//! The passes of ReSTIR SSS.

use super::{Shading, Shift, SssSettings};
use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};
use crate::technique::Technique;
use crate::technique::path::PathSettings;
use crate::technique::reuse::Specialises;
use crate::technique::reuse::chain::{Chain, Passes, Queue, Reuses, of_frame};
use crate::technique::reuse::mutual::{Mutual, with_last};
use crate::technique::reuse::planes::Planes;
use crate::technique::sequence::{Frame, Sequence, Stage, Within, Work};
use restir_kernels::restir_sss as sss;
use restir_shared::layout::{CameraParams, FEATURE_SUBSURFACE};
use restir_shared::resample::params::{Flags, ReuseParams};
use restir_shared::technique::restir_sss::{PackedSubsurface, SssOrigin, SssParams};

impl Specialises for SssParams {
    fn settings(&self) -> u32 {
        (self.flags | Flags::OF_PASSES).bits() | self.profile.bits()
    }
}

/// The frames. A scene without bodies has those of path tracing alone.
pub(super) fn sequence(settings: &SssSettings, stage: &Stage) -> Box<dyn Sequence> {
    let path = settings.path();
    if stage.features & FEATURE_SUBSURFACE == 0 {
        let alone = PathSettings { dispatch_samples: Some(1), ..path };
        return Box::new(OneSample { path: alone.sequence(stage), progressive: stage.progressive, held: 0 });
    }
    let mut planes = Planes::new(stage, Some(Within::by(|stage| path.without_profiles(stage), stage, 1)));
    let reuses = Reuses {
        in_time: settings.temporal && stage.goes_on,
        in_space: if settings.shares() { settings.spatial } else { 0 },
        feedback: settings.feedback,
        shadings: 1,
    };
    planes.bind_within("entries");
    let kernels = [&sss::sss_shift::DESC, &sss::sss_merge::DESC];
    let mutual = Mutual::new::<PackedSubsurface, SssOrigin>(&mut planes, &reuses, settings.neighbours, kernels);
    // records that send what all samples send together are no history
    let is_apart = settings.shading == Shading::All && settings.feedback && reuses.in_space > 0;
    let together = is_apart.then(|| planes.add::<PackedSubsurface>("together", planes.pixels));
    let passes = SssPasses { settings: settings.clone(), of_all: settings.params(stage), mutual, together };
    Box::new(Chain::new(stage, settings.integral(), reuses, planes, passes))
}

/// Frames of one sample each, which has the frame's number.
struct OneSample {
    path: Box<dyn Sequence>,
    /// The film goes on after the mean is made.
    progressive: bool,
    /// Samples that the film holds.
    held: u32,
}

impl Sequence for OneSample {
    fn buffers(&self) -> &[Buffer] {
        self.path.buffers()
    }

    fn output(&self) -> BufferId {
        self.path.output()
    }

    fn begin(&mut self, now: Frame) -> Work {
        self.held = if now.clears { 0 } else { self.held };
        // the film's samples are numbered from the first one on
        let (index, samples) = (now.index.wrapping_sub(self.held), u32::from(now.adds));
        self.held = if now.shows && !self.progressive { 0 } else { self.held + samples };
        self.path.begin(Frame { index, samples, ..now })
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        self.path.next_pass()
    }
}

/// The passes.
pub(super) struct SssPasses {
    settings: SssSettings,
    of_all: SssParams,
    mutual: Mutual,
    /// What pixels are shaded by, where that is not the history.
    together: Option<BufferId>,
}

impl Passes for SssPasses {
    fn initial(&self, queue: &mut Queue, now: &Frame) {
        queue.push_within(now);
        queue.push(now, &sss::sss_initial::DESC, &self.params(now), &[("reservoirs", queue.work())]);
    }

    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let mut params = self.params(now);
        params.flags = params.flags.with_form(self.settings.temporal_mis.mis());
        // where a path enters is drawn anew each frame: no view stands still
        let params = with_last(&params, now, last, false);
        self.mutual.in_time(queue, now, &params, |queue, params, samples| self.elsewhere(queue, now, params, samples));
    }

    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId) {
        let (mut params, records) = (self.params(now), queue.work());
        let is_last = pass + 1 == self.settings.spatial;
        let is_other = is_last && self.settings.shift == Shift::Sequential;
        if is_other {
            params = params.with_flags(Flags::DELAYED);
            queue.push(now, &sss::sss_index::DESC, &params, &[("reservoirs", records)]);
        }
        let sums = if is_last && self.sums() && self.together.is_none() { Flags::SUMS } else { Flags::default() };
        self.mutual.in_space(queue, now, &params.with_flags(sums), pass, merged);
        if let Some(together) = self.together.filter(|_| is_last && now.adds) {
            self.mutual.sum(queue, now, &params, pass, together);
        }
        // the next frame reconnects what it reuses
        let history = if self.settings.feedback { merged } else { records };
        if is_other && (self.settings.feedback || pass == 0) {
            queue.push(now, &sss::sss_index::DESC, &self.params(now), &[("reservoirs", history)]);
        }
    }

    fn shade(&self, queue: &mut Queue, now: &Frame) {
        let Some(direct) = queue.within().filter(|_| now.adds) else { return };
        queue.shade(|queue, film| {
            let reservoirs = self.together.unwrap_or(queue.work());
            let planes = [("reservoirs", reservoirs), ("direct", direct), ("film", film)];
            queue.push(now, &sss::sss_shade::DESC, &self.params(now), &planes);
        });
    }
}

impl SssPasses {
    /// Whether pixels are shaded by all samples of the last merge.
    fn sums(&self) -> bool {
        self.settings.shading == Shading::All
    }

    /// The plane of these samples as they are in the other frame: of the last one's here. Those of this frame are taken there by their shift.
    fn elsewhere(&self, queue: &mut Queue, now: &Frame, params: &SssParams, samples: BufferId) -> BufferId {
        if !now.same_scene && !params.flags.contains(Flags::BACK) {
            queue.push(now, &sss::sss_recall::DESC, params, &[("reservoirs", samples)]);
        }
        samples
    }

    /// Of passes that see one frame.
    fn params(&self, now: &Frame) -> SssParams {
        of_frame(&self.of_all, now)
    }
}

impl SssSettings {
    /// Of passes that see one frame, whichever it is.
    fn params(&self, stage: &Stage) -> SssParams {
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
        let Self { lambert_below, reconnected_beyond, segments, max_depth, .. } = *self;
        SssParams { reuse, profile: self.profile_flags(), lambert_below, reconnected_beyond, segments, max_depth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::render::Render;
    use crate::settings::Choice;
    use crate::technique::restir_sss::Traced;
    use crate::technique::reuse::unused;

    fn builtin(name: &str) -> SceneBuffers {
        SceneBuffers::build(&crate::scene::builtin::scene(name).expect("built in")).expect("builds")
    }

    /// Counts are right, every pass fits its buffers, so that it writes none that it reads, and every buffer is used: with all settings that
    /// decide on passes and planes.
    #[test]
    fn no_combination_of_settings_is_without_a_plan() {
        let scene = builtin("slab");
        for (shift, spatial, bits) in Shift::ALL
            .iter()
            .flat_map(|shift| (0..4).flat_map(move |spatial| (0..16_u32).map(move |bits| (*shift, spatial, bits))))
        {
            let on = |bit: u32| bits >> bit & 1 == 1;
            let settings = SssSettings {
                shift,
                spatial,
                temporal: on(0),
                feedback: on(1),
                shading: if on(2) { Shading::All } else { Shading::Selected },
                traced: if on(3) { Traced::Single } else { Traced::Nothing },
                ..SssSettings::default()
            };
            for (count, accumulate) in [(1, false), (4, false), (4, true)] {
                let render = Render { count, accumulate, ..Render::new([8, 6], settings.clone()) };
                assert!(unused(render.plan(&scene)).is_empty(), "{render:?}");
            }
        }
    }

    /// Where nothing scatters light inside there are the buffers and passes of path tracing alone.
    #[test]
    fn a_scene_without_bodies_costs_nothing() {
        let render = Render { count: 5, ..Render::new([8, 6], SssSettings::default()) };
        let scene = builtin("cornell");
        let plan = render.plan(&scene);
        assert!(plan.buffers.iter().all(|buffer| !["reservoirs", "entries", "origins"].contains(&buffer.name)));
        let kernels: Vec<_> = plan.passes.map(|pass| pass.expect("made").kernel.name).collect();
        assert!(kernels.iter().all(|name| ["path", "film_add", "film_resolve"].contains(name)), "{kernels:?}");
    }
}
