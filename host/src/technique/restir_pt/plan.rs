//! The passes of ReSTIR PT.

use super::{Changed, PtSettings};
use crate::Error;
use crate::film::{self, Film};
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::technique::Technique;
use crate::technique::sequence::{Frame, Sequence, Stage, Within, Work};
use restir_kernels::{KernelDesc, restir_pt as pt};
use restir_shared::layout::{CameraParams, FEATURE_BLEND, FilmPixel};
use restir_shared::resample::mis::Mis;
use restir_shared::shift::Start;
use restir_shared::technique::restir_pt::{
    Job, JobShifted, PT_BACK, PT_CHANGED, PT_OTHER_FRAME, PT_STILL, PT_TAKES_ALL, PackedPath, PtFacet, PtParams,
};
use std::collections::VecDeque;

/// Flags that differ from pass to pass: kernels are not specialised to them, or each would have to be compiled for every pass.
const OF_PASSES: u32 = PT_OTHER_FRAME | PT_BACK | PT_STILL | PT_CHANGED | PT_TAKES_ALL;

/// The planes of the frames; what the settings do not need is not there.
struct Planes {
    /// Of this frame and, with temporal reuse, of the last one.
    starts: Vec<BufferId>,
    /// See `starts`.
    facets: Vec<BufferId>,
    /// The one in work, one more for the last frame's paths or for spatial reuse, and a third where both are needed at once.
    paths: Vec<BufferId>,
    direct: BufferId,
    /// Of each neighbour a layer: jobs, and what became of them.
    sharing: Option<[BufferId; 2]>,
    /// What became of jobs the other way, with temporal reuse.
    returned: BufferId,
    /// Paths as they are in the respective other frame, where they are traced there once more.
    retraced: Option<BufferId>,
}

impl Planes {
    fn new(buffers: &mut Vec<Buffer>, s: &PtSettings, [width, height]: [u32; 2], keeps_history: bool) -> Self {
        let mut add = |name, layers: u32, bytes: usize| {
            let pixels = width as usize * height as usize;
            buffers.push(Buffer { name, words: pixels * layers as usize * bytes / size_of::<u32>(), contents: None });
            buffers.len() - 1
        };
        let history = 1 + usize::from(keeps_history);
        let held = s.shares() && keeps_history && !s.feedback && s.spatial > 1;
        let paths = 1 + usize::from(s.shares() || keeps_history) + usize::from(held);
        let layers = if s.shares() { s.neighbours } else { u32::from(keeps_history) };
        let jobs = (layers > 0)
            .then(|| [add("jobs", layers, size_of::<Job>()), add("shifted", layers, size_of::<JobShifted>())]);
        Self {
            starts: (0..history).map(|_| add("starts", 1, size_of::<Start>())).collect(),
            facets: (0..history).map(|_| add("facets", 1, size_of::<PtFacet>())).collect(),
            paths: (0..paths).map(|_| add("paths", 1, size_of::<PackedPath>())).collect(),
            direct: add("direct", 1, size_of::<FilmPixel>()),
            returned: if keeps_history {
                add("returned", 1, size_of::<JobShifted>())
            } else {
                jobs.map_or(0, |[_, shifted]| shifted)
            },
            sharing: jobs,
            retraced: (keeps_history && s.changed == Changed::Retrace)
                .then(|| add("retraced", 1, size_of::<PackedPath>())),
        }
    }

    /// The plane of a frame; that of the next frame is the last one's.
    fn of(planes: &[BufferId], frame: u32) -> BufferId {
        planes[frame as usize % planes.len()]
    }

    /// The arenas and what has one role in all passes of a frame, unless they say otherwise.
    fn of_frame(&self, frame: u32) -> Vec<(&'static str, BufferId)> {
        let mut roles = vec![
            ("starts", Self::of(&self.starts, frame)),
            ("facets", Self::of(&self.facets, frame)),
            ("direct", self.direct),
            ("returned", self.returned),
        ];
        roles.extend(ARENAS);
        roles.extend(self.sharing.iter().flat_map(|&[jobs, shifted]| [("jobs", jobs), ("shifted", shifted)]));
        roles
    }
}

/// The chain of frames, of which each reuses the last one.
pub(super) struct Chain {
    settings: PtSettings,
    size: [u32; 2],
    seed: u32,
    keeps_history: bool,
    buffers: Vec<Buffer>,
    planes: Planes,
    film: Film,
    /// Who finds paths of up to two segments, if it is another technique.
    direct: Option<Within>,
    /// What saw the last frame; none before the first.
    last_camera: Option<CameraParams>,
    queue: VecDeque<Result<Pass, Error>>,
}

impl Chain {
    pub(super) fn new(settings: &PtSettings, stage: &Stage) -> Self {
        let keeps_history = settings.temporal && stage.goes_on;
        let technique = settings.direct.technique(&settings.integral());
        let direct = technique.map(|technique| Within::new(&*technique, stage, 1));
        let mut buffers = Within::buffers(direct.as_ref(), stage);
        let planes = Planes::new(&mut buffers, settings, stage.size, keeps_history);
        let film = Film::new(&mut buffers, stage.film(1, 0));
        Self {
            settings: settings.clone(),
            size: stage.size,
            seed: stage.seed,
            keeps_history,
            buffers,
            planes,
            film,
            direct,
            last_camera: None,
            queue: VecDeque::new(),
        }
    }

    /// The last plane of the paths is the one that the last frame has left.
    fn reuse_in_time(&mut self, now: &Frame, last_camera: CameraParams) {
        let flags = self.settings.temporal_flags(now.is_still(Some(last_camera)), !now.same_scene);
        let still = flags & PT_STILL != 0;
        let form = if still { Mis::CONSTANT } else { self.settings.temporal_mis.mis() }.bits();
        let of_last = PtParams {
            flags,
            form,
            neighbours: 1,
            other_scene: now.scenes[1],
            other_camera: last_camera,
            ..self.params(now)
        };
        let [work, mut last] = [self.planes.paths[0], self.planes.paths[self.planes.paths.len() - 1]];
        if !still {
            let before = now.index.wrapping_add(1);
            let [starts, facets] = [&self.planes.starts, &self.planes.facets].map(|planes| Planes::of(planes, before));
            let returned = self.planes.returned;
            self.push(now, &pt::pt_reproject::DESC, of_last, &[("other_facets", facets)]);
            let back = PtParams { flags: flags | PT_BACK, ..of_last };
            let own = self.retraced(now, back, work);
            self.push(now, &pt::pt_shift::DESC, back, &[("paths", own), ("starts", starts), ("shifted", returned)]);
            last = self.recalled(now, of_last, last);
            self.push(now, &pt::pt_shift::DESC, of_last, &[("paths", last)]);
        }
        self.push(now, &pt::pt_merge::DESC, of_last, &[("paths", last), ("merged", work)]);
    }

    /// The plane of the last frame's paths as they are now.
    fn recalled(&mut self, now: &Frame, params: PtParams, last: BufferId) -> BufferId {
        if self.planes.retraced.is_none() && !now.same_scene {
            self.push(now, &pt::pt_recall::DESC, params, &[("paths", last)]);
        }
        self.retraced(now, params, last)
    }

    /// The plane of these paths with what arrives at their vertices k in the other frame, if that may be something else.
    fn retraced(&mut self, now: &Frame, params: PtParams, paths: BufferId) -> BufferId {
        let Some(retraced) = self.planes.retraced.filter(|_| !now.same_scene) else { return paths };
        self.push(now, &pt::pt_retrace::DESC, params, &[("paths", paths), ("retraced", retraced)]);
        retraced
    }

    /// The plane of what needs no path of this technique.
    fn direct_light(&mut self, now: &Frame) -> BufferId {
        let Some(within) = &mut self.direct else { return self.planes.direct };
        self.queue.extend(within.passes(now));
        if !now.adds {
            return within.picture();
        }
        let picture = within.picture();
        // of this technique's what was cut short is in it, and nothing else
        self.queue.push_back(film::add(self.size, self.planes.direct, picture));
        picture
    }

    /// The pass of spatial reuse of that number, which does not write over `held`.
    fn reuse_in_space(&mut self, now: &Frame, pass: u32, held: Option<BufferId>) {
        let paths = &self.planes.paths;
        let free = (1..paths.len()).find(|&at| Some(paths[at]) != held);
        let Some(free) = free else { return };
        let params = PtParams { neighbours: self.settings.neighbours, merge: 1 + pass, ..self.params(now) };
        let [work, merged] = [paths[0], paths[free]];
        let layers = params.with_jobs();
        self.push(now, &pt::pt_pair::DESC, layers, &[]);
        self.push(now, &pt::pt_shift::DESC, layers, &[("paths", work)]);
        self.push(now, &pt::pt_merge::DESC, params, &[("paths", work), ("merged", merged)]);
        self.planes.paths.swap(0, free);
    }

    /// All spatial passes; the plane of the paths that the next frame reuses.
    fn share(&mut self, now: &Frame) -> BufferId {
        let before = self.planes.paths[0];
        let held = (self.keeps_history && !self.settings.feedback).then_some(before);
        if self.settings.shares() {
            (0..self.settings.spatial).for_each(|pass| self.reuse_in_space(now, pass, held));
        }
        held.unwrap_or(self.planes.paths[0])
    }

    /// A pass over the planes of the frame, and others instead or beside.
    fn push(&mut self, now: &Frame, kernel: &'static KernelDesc, params: PtParams, planes: &[(&str, BufferId)]) {
        let constants =
            [("features", self.settings.integral().features(now.features)), ("settings", params.flags | OF_PASSES)];
        let mut bound = self.planes.of_frame(now.index);
        bound.retain(|(role, _)| planes.iter().all(|(other, _)| role != other));
        bound.extend(planes);
        self.queue.push_back(Pass::new(kernel, &constants, &params, &bound));
    }

    /// Of passes that see one frame.
    fn params(&self, now: &Frame) -> PtParams {
        let (s, [width, height]) = (&self.settings, self.size);
        PtParams {
            scene: now.scenes[0],
            other_scene: now.scenes[0],
            camera: now.camera,
            other_camera: now.camera,
            hybrid: s.hybrid(now.features & FEATURE_BLEND != 0),
            width,
            height,
            frame: now.index,
            seed: self.seed,
            max_depth: s.max_depth,
            flags: s.flags(),
            max_plane_distance: s.max_plane_distance,
            min_normal_cos: s.min_normal_cos,
            form: s.mis.mis().bits(),
            layers: 1,
            tile: s.tile.ilog2(),
            confidence_cap: s.confidence_cap as f32,
            ..PtParams::default()
        }
    }
}

impl Sequence for Chain {
    fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    fn output(&self) -> BufferId {
        self.film.output()
    }

    fn begin(&mut self, now: Frame) -> Work {
        self.queue.clear();
        if now.clears {
            self.film.clear();
        }
        self.push(&now, &pt::pt_trace::DESC, self.params(&now), &[("paths", self.planes.paths[0])]);
        if let Some(camera) = self.last_camera.filter(|_| self.keeps_history) {
            self.reuse_in_time(&now, camera);
        }
        let history = self.share(&now);
        let direct = self.direct_light(&now);
        let mut work = Work { passes: self.queue.len() as u64, blocks: 0 };
        if let Some(film) = now.adds.then(|| self.film.open(0)).flatten() {
            let planes = [("paths", self.planes.paths[0]), ("direct", direct), ("film", film)];
            self.push(&now, &pt::pt_shade::DESC, self.params(&now), &planes);
            self.queue.extend(std::iter::from_fn(|| self.film.merge_equal()));
            work = Work { passes: work.passes + 1, blocks: 1 };
        }
        if now.shows {
            self.queue.extend(self.film.image());
        }
        let last = self.planes.paths.len() - 1;
        let paths = &mut self.planes.paths;
        if let Some(at) = paths.iter().position(|&plane| plane == history).filter(|_| self.keeps_history) {
            paths.swap(at, last);
        }
        self.last_camera = Some(now.camera);
        work
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        self.queue.pop_front()
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
    use restir_kernels::Access;
    use std::collections::BTreeSet;

    fn settings(change: impl Fn(&mut PtSettings)) -> PtSettings {
        let mut settings = PtSettings::default();
        change(&mut settings);
        settings
    }

    /// Bytes a pixel beside the film's: starts and facets of 32, paths of 64, the direct part and jobs that came back of 16, and of each
    /// neighbour a job of 8 and what became of it of 16. Counts are right, every pass fits its buffers, and every buffer is used.
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
                let (buffers, count) = (plan.buffers.clone(), plan.pass_count);
                let passes: Vec<Pass> = plan.passes.collect::<Result<_, _>>().expect("frames are made");
                passes.iter().for_each(|pass| pass.check(&buffers).expect("fits"));
                assert_eq!(passes.len() as u64, count, "{render:?}");
                let used: BTreeSet<BufferId> = passes.into_iter().flat_map(|pass| pass.bindings).collect();
                assert_eq!(used.len(), buffers.len(), "{render:?}");
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
                let plan = render.plan(&scene);
                let (buffers, count) = (plan.buffers.clone(), plan.pass_count);
                let passes: Vec<Pass> = plan.passes.collect::<Result<_, _>>().expect("the scene stands still");
                passes.iter().for_each(|pass| pass.check(&buffers).expect("fits"));
                assert_eq!(passes.len() as u64, count, "{render:?}");
                let used: BTreeSet<BufferId> = passes.into_iter().flat_map(|pass| pass.bindings).collect();
                let unused: Vec<_> =
                    (0..buffers.len()).filter(|id| !used.contains(id)).map(|id| buffers[id].name).collect();
                assert!(unused.is_empty(), "{unused:?}");
            }
        }
        assert!(Direct::read("unified").is_some() && Direct::read("nobody").is_none());
    }

    /// No pass writes what another one has to find: with all settings, over several frames.
    #[test]
    fn no_pass_writes_what_it_reads() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("moving").expect("built in")).expect("builds");
        for (spatial, bits) in (0..4).flat_map(|spatial| (0..8).map(move |bits| (spatial, bits))) {
            let settings = settings(|s| {
                (s.spatial, s.feedback, s.temporal) = (spatial, bits & 1 == 1, bits & 2 == 2);
                s.changed = if bits & 4 == 4 { Changed::Retrace } else { Changed::Drop };
            });
            let render = Render { count: 5, ..Render::new([16, 12], settings) };
            for pass in render.plan(&scene).passes {
                let pass = pass.expect("made");
                let own = |name: &str| ["merged", "shifted", "jobs", "retraced"].contains(&name);
                let written: Vec<BufferId> = pass
                    .kernel
                    .bindings
                    .iter()
                    .zip(&pass.bindings)
                    .filter(|(b, _)| b.access == Access::Own && own(b.name))
                    .map(|(_, id)| *id)
                    .collect();
                let read = pass.kernel.bindings.iter().zip(&pass.bindings).filter(|(b, _)| b.access == Access::Read);
                assert!(read.map(|(_, id)| id).all(|id| !written.contains(id)), "{}", pass.kernel.name);
            }
        }
    }
}
