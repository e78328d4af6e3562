//! The passes of ReSTIR PT.

use super::PtSettings;
use crate::Error;
use crate::film::Film;
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::technique::Technique;
use crate::technique::sequence::{Frame, Sequence, Stage, Work};
use restir_kernels::{KernelDesc, restir_pt as pt};
use restir_shared::layout::{FEATURE_BLEND, FilmPixel};
use restir_shared::shift::Start;
use restir_shared::technique::restir_pt::{Job, JobShifted, PAIRS, PackedPath, PtFacet, PtParams, pair_offsets};
use std::collections::VecDeque;

/// The planes of the frames; what the settings do not need is not there.
struct Planes {
    starts: BufferId,
    facets: BufferId,
    /// The one in work, one more for spatial reuse.
    paths: Vec<BufferId>,
    direct: BufferId,
    /// Of each neighbour a layer, if there are any.
    sharing: Option<[BufferId; 2]>,
}

impl Planes {
    fn new(buffers: &mut Vec<Buffer>, s: &PtSettings, [width, height]: [u32; 2]) -> Self {
        let mut add = |name, layers: u32, bytes: usize| {
            let pixels = width as usize * height as usize;
            buffers.push(Buffer { name, words: pixels * layers as usize * bytes / size_of::<u32>(), contents: None });
            buffers.len() - 1
        };
        let shares = s.neighbours > 0 && s.spatial > 0;
        Self {
            starts: add("starts", 1, size_of::<Start>()),
            facets: add("facets", 1, size_of::<PtFacet>()),
            paths: (0..1 + u32::from(shares)).map(|_| add("paths", 1, size_of::<PackedPath>())).collect(),
            direct: add("direct", 1, size_of::<FilmPixel>()),
            sharing: shares.then(|| {
                [add("jobs", s.neighbours, size_of::<Job>()), add("shifted", s.neighbours, size_of::<JobShifted>())]
            }),
        }
    }

    /// The arenas and what has one role in all passes of a frame.
    fn roles(&self) -> Vec<(&'static str, BufferId)> {
        let mut roles = vec![("starts", self.starts), ("facets", self.facets), ("direct", self.direct)];
        roles.extend(ARENAS);
        roles.extend(self.sharing.iter().flat_map(|&[jobs, shifted]| [("jobs", jobs), ("shifted", shifted)]));
        roles
    }
}

/// The frames.
pub(super) struct Chain {
    settings: PtSettings,
    size: [u32; 2],
    seed: u32,
    buffers: Vec<Buffer>,
    planes: Planes,
    film: Film,
    queue: VecDeque<Result<Pass, Error>>,
}

impl Chain {
    pub(super) fn new(settings: &PtSettings, stage: &Stage) -> Self {
        let mut buffers = stage.arenas.to_vec();
        let planes = Planes::new(&mut buffers, settings, stage.size);
        let film = Film::new(&mut buffers, stage.film(1, 0));
        let (size, seed, queue) = (stage.size, stage.seed, VecDeque::new());
        Self { settings: settings.clone(), size, seed, buffers, planes, film, queue }
    }

    fn reuse_in_space(&mut self, now: &Frame, merge: u32) {
        let Some(params) = self.sharing(now, merge) else { return };
        let [work, free] = [self.planes.paths[0], self.planes.paths[1]];
        let layers = PtParams { layers: params.neighbours, ..params };
        self.push(now, &pt::pt_pair::DESC, layers, &[]);
        self.push(now, &pt::pt_shift::DESC, layers, &[("paths", work)]);
        self.push(now, &pt::pt_merge::DESC, params, &[("paths", work), ("merged", free)]);
        self.planes.paths.swap(0, 1);
    }

    /// Parameters of a pass of spatial reuse, if there are any neighbours to share with.
    fn sharing(&self, now: &Frame, merge: u32) -> Option<PtParams> {
        let mut pairs = [0; PAIRS];
        let asked = &mut pairs[..self.settings.neighbours as usize / 2];
        let count = pair_offsets(self.seed, now.index, merge, self.settings.radius, asked);
        let neighbours = 2 * count as u32;
        (count > 0).then(|| PtParams { neighbours, pairs, merge, ..self.params(now) })
    }

    /// A pass over the planes of the frame and some more.
    fn push(&mut self, now: &Frame, kernel: &'static KernelDesc, params: PtParams, planes: &[(&str, BufferId)]) {
        let constants = [("features", self.settings.integral().features(now.features)), ("settings", params.flags)];
        let bound = [planes, &self.planes.roles()].concat();
        self.queue.push_back(Pass::new(kernel, &constants, &params, &bound));
    }

    /// Of passes that see one frame.
    fn params(&self, now: &Frame) -> PtParams {
        let (s, [width, height]) = (&self.settings, self.size);
        PtParams {
            scene: now.scenes[0],
            camera: now.camera,
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
        if self.planes.sharing.is_some() {
            (0..self.settings.spatial).for_each(|merge| self.reuse_in_space(&now, merge));
        }
        let mut work = Work { passes: self.queue.len() as u64, blocks: 0 };
        if let Some(film) = now.adds.then(|| self.film.open(0)).flatten() {
            let planes = [("paths", self.planes.paths[0]), ("film", film)];
            self.push(&now, &pt::pt_shade::DESC, self.params(&now), &planes);
            self.queue.extend(std::iter::from_fn(|| self.film.merge_equal()));
            work = Work { passes: work.passes + 1, blocks: 1 };
        }
        if now.shows {
            self.queue.extend(self.film.image());
        }
        work
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        self.queue.pop_front()
    }
}
