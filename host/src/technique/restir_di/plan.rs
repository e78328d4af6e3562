//! The passes of ReSTIR DI.

use super::{DiSettings, Temporal, Tiles};
use crate::Error;
use crate::film::{self, Film};
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::technique::Technique;
use crate::technique::path::{PathSettings, Subsurface};
use crate::technique::sequence::{Frame, Sequence, Stage, Within, Work};
use bytemuck::Pod;
use restir_kernels::{KernelDesc, restir_di as di};
use restir_shared::layout::{CameraParams, Extent, FilmPixel};
use restir_shared::technique::restir_di::{DiPairs, DiParams, DiPoint, Flags, PackedHit, PackedReservoir, TileWords};
use std::collections::VecDeque;

/// The planes of the frames; what the settings do not need is not there.
struct Planes {
    /// Of this frame and, with temporal reuse, of the last one.
    hits: Vec<BufferId>,
    /// The one in work, one more for spatial reuse, one more for the last frame's.
    reservoirs: Vec<BufferId>,
    direct: BufferId,
    /// Candidates that pixels share; of pixels that do not a single one, which nothing reads.
    tiles: BufferId,
    /// Points and pairs of shading with neighbours, if there are any.
    shading: Option<[BufferId; 2]>,
}

impl Planes {
    fn new(buffers: &mut Vec<Buffer>, s: &DiSettings, [width, height]: [u32; 2], keeps_history: bool) -> Self {
        let mut add = |name, count, bytes| {
            buffers.push(Buffer { name, words: count * bytes / size_of::<u32>(), contents: None });
            buffers.len() - 1
        };
        let candidates = s.tiles.map_or(1, |tiles| tiles.count as usize * tiles.size as usize);
        let tiles = add("tiles", candidates, size_of::<TileWords>());
        let pixels = width as usize * height as usize;
        let shading = (s.shaded > 0)
            .then(|| [add("points", pixels, size_of::<DiPoint>()), add("pairs", pixels, size_of::<DiPairs>())]);
        let history = usize::from(keeps_history);
        let spatial = usize::from(s.spatial_passes() > 0);
        Self {
            hits: (0..1 + history).map(|_| add("hits", pixels, size_of::<PackedHit>())).collect(),
            reservoirs: (0..1 + history + spatial)
                .map(|_| add("reservoirs", pixels, size_of::<PackedReservoir>()))
                .collect(),
            direct: add("direct", pixels, size_of::<FilmPixel>()),
            tiles,
            shading,
        }
    }

    /// The plane of a frame's hits; that of the next frame is the last one's.
    fn hits(&self, frame: u32) -> BufferId {
        self.hits[frame as usize % self.hits.len()]
    }

    /// The arenas and what has one role in all passes of a frame.
    fn of_frame(&self, frame: u32) -> Vec<(&'static str, BufferId)> {
        let mut roles = vec![("hits", self.hits(frame)), ("direct", self.direct), ("tiles", self.tiles)];
        roles.extend(ARENAS);
        roles.extend(self.shading.iter().flat_map(|&[points, pairs]| [("points", points), ("pairs", pairs)]));
        roles
    }
}

/// The chain of frames, of which each reuses the last one.
pub(super) struct Chain {
    settings: DiSettings,
    size: [u32; 2],
    seed: u32,
    keeps_history: bool,
    buffers: Vec<Buffer>,
    planes: Planes,
    film: Film,
    /// Who finds what camera rays see directly, if more of them look for it than are shaded.
    seen: Option<Within>,
    /// The frame in work; none before the first.
    now: Option<Frame>,
    /// How many frames up to this one had the scene and the rays of the one before.
    still_for: u32,
    queue: VecDeque<Result<Pass, Error>>,
}

impl Chain {
    pub(super) fn new(settings: &DiSettings, stage: &Stage) -> Self {
        let keeps_history = settings.temporal != Temporal::Off && stage.goes_on;
        let seen = settings.sees_apart().then(|| Within::new(&seen_directly(settings), stage, settings.seen_rays));
        let mut buffers = Within::buffers(seen.as_ref(), stage);
        let planes = Planes::new(&mut buffers, settings, stage.size, keeps_history);
        let film = Film::new(&mut buffers, stage.film(settings.shading_passes(), 0));
        Self {
            settings: settings.clone(),
            size: stage.size,
            seed: stage.seed,
            keeps_history,
            buffers,
            planes,
            film,
            seen,
            now: None,
            still_for: 0,
            queue: VecDeque::new(),
        }
    }

    /// The passes between primary hits and shading.
    fn reuse(&mut self, now: &Frame, last_camera: Option<CameraParams>) {
        if self.settings.tiles.is_some() {
            self.push_over(now, &di::di_tiles::DESC, &self.params(now).tile_params(), &[], self.settings.flags());
        }
        let last_camera = last_camera.filter(|_| self.keeps_history);
        let params = self.params(now);
        // in a still view no history fades
        let other_view = last_camera.filter(|_| !self.flags_in_time().contains(Flags::STILL));
        let renewal = self.settings.renewal();
        let params = other_view.map_or(params, |camera| params.renewed_after(camera, renewal));
        self.push(now, &di::di_initial::DESC, params, &[("reservoirs", self.planes.reservoirs[0])]);
        self.see(now);
        if let Some(camera) = last_camera {
            self.reuse_in_time(now, camera);
        }
        self.reuse_in_space(now);
    }

    /// Adds what is seen directly to what needs no resampling.
    fn see(&mut self, now: &Frame) {
        let Some(within) = self.seen.as_mut().filter(|_| now.adds) else { return };
        self.queue.extend(within.passes(now));
        self.queue.push_back(film::add(self.size, within.picture(), self.planes.direct));
    }

    /// The flags of the combine with the last frame.
    fn flags_in_time(&self) -> Flags {
        self.settings.temporal_flags(self.still_for > 0)
    }

    fn reuse_in_time(&mut self, now: &Frame, last_camera: CameraParams) {
        let (settings, reservoirs) = (&self.settings, &self.planes.reservoirs);
        let of_last = DiParams {
            flags: self.flags_in_time(),
            other_scene: now.scenes[1],
            other_camera: last_camera,
            other_frame: now.index.wrapping_sub(1),
            neighbours: if settings.temporal == Temporal::Fused { settings.neighbours } else { 0 },
            ..self.params(now)
        };
        let last = reservoirs[reservoirs.len() - 1];
        let last_hits = self.planes.hits(now.index + 1);
        let planes = [("other_hits", last_hits), ("others", last), ("reservoirs", reservoirs[0])];
        self.push(now, &di::di_combine::DESC, of_last, &planes);
    }

    fn reuse_in_space(&mut self, now: &Frame) {
        for pass in 0..self.settings.spatial_passes() {
            let params = DiParams { combine: 1 + pass, ..self.params(now) };
            // what the next frame reads is not written over
            let free_at = if pass > 0 && self.keeps_before_spatial() { 2 } else { 1 };
            let [work, free] = [self.planes.reservoirs[0], self.planes.reservoirs[free_at]];
            let planes = [("other_hits", self.planes.hits(now.index)), ("others", work), ("reservoirs", free)];
            self.push(now, &di::di_combine::DESC, params, &planes);
            self.planes.reservoirs.swap(0, free_at);
        }
    }

    /// Whether the plane of hits is still that of the same rays: its frame, and every one since, had them.
    fn knows_hits(&self) -> bool {
        !self.settings.jitter && self.still_for as usize >= self.planes.hits.len()
    }

    /// Whether the next frame reuses what spatial reuse began with.
    fn keeps_before_spatial(&self) -> bool {
        self.keeps_history && !self.settings.feedback && self.settings.spatial_passes() > 0
    }

    /// What the frame adds to the film; how many passes that takes beside the film's own.
    fn shade(&mut self, now: &Frame) -> u64 {
        let before = self.queue.len();
        let mut of_film = 0;
        let reservoirs = ("reservoirs", self.planes.reservoirs[0]);
        let shades_neighbours = self.planes.shading.is_some();
        if shades_neighbours {
            self.push(now, &di::di_offer::DESC, self.params(now), &[reservoirs]);
        }
        for params in self.settings.shading(&self.params(now)) {
            let Some(film) = self.film.open(0) else { break };
            if shades_neighbours {
                self.push(now, &di::di_exchange::DESC, params, &[("film", film)]);
                self.push(now, &di::di_gather::DESC, params, &[("film", film)]);
            } else {
                self.push(now, &di::di_shade::DESC, params, &[reservoirs, ("film", film)]);
            }
            let shaded = self.queue.len();
            self.queue.extend(std::iter::from_fn(|| self.film.merge_equal()));
            of_film += self.queue.len() - shaded;
        }
        (self.queue.len() - before - of_film) as u64
    }

    /// A pass over the planes of the frame and some more.
    fn push(&mut self, now: &Frame, kernel: &'static KernelDesc, params: DiParams, planes: &[(&str, BufferId)]) {
        self.push_over(now, kernel, &params, planes, params.flags);
    }

    fn push_over(
        &mut self,
        now: &Frame,
        kernel: &'static KernelDesc,
        params: &(impl Pod + Extent),
        planes: &[(&str, BufferId)],
        flags: Flags,
    ) {
        let constants = [("features", self.settings.integral().features(now.features)), ("settings", flags.bits())];
        let bound = [planes, &self.planes.of_frame(now.index)].concat();
        self.queue.push_back(Pass::new(kernel, &constants, params, &bound));
    }

    /// Of passes within the frame.
    fn params(&self, now: &Frame) -> DiParams {
        let (s, [width, height], [scene, _]) = (&self.settings, self.size, now.scenes);
        let tiles = s.tiles.unwrap_or(Tiles { count: 0, size: 0 });
        DiParams {
            scene,
            other_scene: scene,
            camera: now.camera,
            other_camera: now.camera,
            width,
            height,
            frame: now.index,
            other_frame: now.index,
            seed: self.seed,
            flags: s.flags(),
            candidates: s.candidates,
            neighbours: s.neighbours,
            confidence_cap: s.confidence_cap as f32,
            gloss_fade: s.gloss_fade,
            radius: s.radius,
            near_radius: s.near_radius,
            max_plane_distance: s.max_plane_distance,
            min_normal_cos: s.min_normal_cos,
            group: s.candidates.div_ceil(s.initial_rays),
            tiles: tiles.count,
            tile_size: tiles.size,
            ..DiParams::default()
        }
    }

    /// The last plane of the reservoirs is the one that the next frame finds its history in.
    fn keep(&mut self) {
        let last = self.planes.reservoirs.len() - 1;
        if self.keeps_history {
            let history = usize::from(self.keeps_before_spatial());
            self.planes.reservoirs.swap(history, last);
        }
    }
}

/// Path tracing of what camera rays see directly.
fn seen_directly(settings: &DiSettings) -> PathSettings {
    PathSettings {
        max_depth: 1,
        sampler: settings.sampler,
        subsurface: Subsurface::Off,
        ..PathSettings::of(settings.integral())
    }
}

impl Sequence for Chain {
    fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    fn output(&self) -> BufferId {
        self.film.output()
    }

    fn primary(&self, frame: u32) -> Option<BufferId> {
        Some(self.planes.hits(frame))
    }

    fn begin(&mut self, now: Frame) -> Work {
        let last_camera = self.now.take().map(|last| last.camera);
        self.still_for = if now.is_still(last_camera) { self.still_for.saturating_add(1) } else { 0 };
        self.queue.clear();
        if now.clears {
            self.film.clear();
        }
        if !now.primary_given && !self.knows_hits() {
            self.push(&now, &di::di_primary::DESC, self.params(&now), &[]);
        }
        self.reuse(&now, last_camera);
        let mut work = Work { passes: self.queue.len() as u64, blocks: 0 };
        if now.adds {
            work.passes += self.shade(&now);
            work.blocks = u64::from(self.settings.shading_passes());
        }
        if now.shows {
            self.queue.extend(self.film.image());
        }
        self.keep();
        self.now = Some(now);
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
    use crate::plan::FramePlan;
    use crate::render::Render;
    use crate::scene::{AlphaMode, Camera};
    use std::collections::BTreeSet;

    fn builtin(name: &str) -> SceneBuffers {
        SceneBuffers::build(&crate::scene::builtin::scene(name).expect("built in")).expect("builds")
    }

    fn passes(scene: &SceneBuffers, render: &Render) -> Vec<Pass> {
        render.plan(scene).passes.map(|pass| pass.expect("made")).collect()
    }

    /// The buffers that some pass uses. Counts are right, and every pass fits its buffers.
    fn used(plan: FramePlan<'_>) -> BTreeSet<BufferId> {
        let passes: Vec<Pass> = plan.passes.collect::<Result<_, _>>().expect("the scene stands still");
        passes.iter().for_each(|pass| pass.check(&plan.buffers).expect("fits"));
        assert_eq!(passes.len() as u64, plan.pass_count);
        passes.into_iter().flat_map(|pass| pass.bindings).collect()
    }

    /// Counts are right, every pass fits its buffers, and every buffer is used.
    #[test]
    fn plans_hold_what_the_settings_need() {
        let scene = builtin("cornell");
        let plain = DiSettings { temporal: Temporal::Off, spatial: 0, ..DiSettings::default() };
        let rows = [
            (plain.clone(), 3, 1 + 1 + 1),
            (DiSettings { spatial: 2, ..plain.clone() }, 3, 1 + 2 + 1),
            (DiSettings { spatial: 3, feedback: false, ..plain.clone() }, 3, 1 + 2 + 1),
            (DiSettings { temporal: Temporal::On, ..plain.clone() }, 3, 2 + 2 + 1),
            (DiSettings { temporal: Temporal::On, spatial: 3, feedback: false, ..plain.clone() }, 1, 1 + 2 + 1),
            (DiSettings { temporal: Temporal::On, spatial: 3, feedback: false, ..plain.clone() }, 4, 2 + 3 + 1),
            (DiSettings { temporal: Temporal::On, ..plain.clone() }, 1, 1 + 1 + 1),
            (DiSettings { temporal: Temporal::Fused, ..plain }, 5, 2 + 2 + 1),
            (DiSettings::default(), 4, 2 + 3 + 1),
            (DiSettings { shaded: 20, ..DiSettings::default() }, 3, 2 + 3 + 1),
            (DiSettings { shaded: 0, ..DiSettings::default() }, 3, 2 + 3 + 1),
        ];
        for (settings, frames, planes) in rows {
            for accumulate in [false, true] {
                let render = Render { count: frames, accumulate, ..Render::new([3, 2], settings.clone()) };
                let plan = render.plan(&scene);
                let samples = render.repeats_in_mean() * settings.shading_passes();
                let capacity = Capacity { size: [3, 2], samples, largest_block: 0, progressive: false };
                let film = capacity.planes() + 1;
                // points of 48 bytes a pixel and pairs of 32
                let [buffers, units] = if settings.shaded > 0 { [2, 5] } else { [0; 2] };
                assert_eq!(plan.buffers.len(), 4 + planes + buffers + film, "{render:?}");
                let words: usize = plan.buffers[4..].iter().map(|buffer| buffer.words).sum();
                let bytes_a_pixel = 4 * words / (render.width * render.height) as usize;
                assert_eq!(bytes_a_pixel, 16 * (planes + units + film), "{render:?}");
                let buffers = plan.buffers.len();
                assert_eq!(used(plan).len(), buffers, "{render:?}");
            }
        }
    }

    #[test]
    fn tiles_are_there_if_they_are_asked_for() {
        let scene = builtin("cornell");
        let words = |settings: DiSettings| {
            let render = Render::new([4, 3], settings);
            let plan = render.plan(&scene);
            plan.buffers.iter().find(|buffer| buffer.name == "tiles").map(|buffer| buffer.words)
        };
        assert_eq!(words(DiSettings::default()), Some(16));
        let tiles = Some(Tiles { count: 3, size: 50 });
        assert_eq!(words(DiSettings { tiles, ..DiSettings::default() }), Some(3 * 50 * 16));
    }

    /// Hits are found again where rays or scene may be others.
    #[test]
    fn hits_of_a_still_view_are_known() {
        let scene = builtin("cornell");
        let primary = |scene: &SceneBuffers, settings, cameras: &[Camera]| {
            let render = Render { count: 6, cameras: cameras.to_vec(), ..Render::new([4, 3], settings) };
            passes(scene, &render).iter().filter(|pass| pass.kernel.name == di::di_primary::DESC.name).count()
        };
        let default = DiSettings::default;
        assert_eq!(primary(&scene, default(), &[]), 2);
        assert_eq!(primary(&scene, DiSettings { temporal: Temporal::Off, ..default() }, &[]), 1);
        assert_eq!(primary(&scene, DiSettings { jitter: true, ..default() }, &[]), 6);
        assert_eq!(primary(&builtin("moving"), default(), &[]), 6);
        let lens = Camera { lens_radius: 0.1, ..scene.camera };
        assert_eq!(primary(&scene, default(), &[lens]), 6);
        let moved = |by: f64| Camera { position: scene.camera.position * by, ..scene.camera };
        // frames 0 to 3 see another view than the one before, and 4 fills the other plane
        assert_eq!(primary(&scene, default(), &[1.0, 1.01, 1.0, 1.02].map(moved)), 5);
    }

    /// Merging without tests needs the same ray in every pixel.
    #[test]
    fn only_a_still_view_is_merged_as_such() {
        let still_passes = |scene: &SceneBuffers, render: &Render| -> Vec<bool> {
            let combines =
                passes(scene, render).into_iter().filter(|pass| pass.kernel.name == di::di_combine::DESC.name);
            let flags = combines.map(|pass| pass.params::<DiParams>().expect("of this technique").flags);
            flags.filter(|flags| flags.contains(Flags::OTHER_FRAME)).map(|flags| flags.contains(Flags::STILL)).collect()
        };
        let scene = builtin("cornell");
        let of = |settings| Render { count: 3, ..Render::new([4, 3], settings) };
        let default = DiSettings::default;
        assert_eq!(still_passes(&scene, &of(default())), [true; 2]);
        for settings in [
            DiSettings { jitter: true, ..default() },
            DiSettings { temporal: Temporal::Fused, ..default() },
            DiSettings { still: false, ..default() },
        ] {
            assert_eq!(still_passes(&scene, &of(settings.clone())), [false; 2], "{settings:?}");
        }
        let lens = Camera { lens_radius: 0.1, ..scene.camera };
        let moved = Camera { position: scene.camera.position * 1.01, ..scene.camera };
        assert_eq!(still_passes(&scene, &Render { cameras: vec![lens], ..of(default()) }), [false; 2]);
        let stops = Render { cameras: vec![scene.camera, moved], ..of(default()) };
        assert_eq!(still_passes(&scene, &stops), [false, true]);
        assert_eq!(still_passes(&builtin("moving"), &of(default())), [false; 2]);
        let with = |mode| {
            let mut source = crate::scene::builtin::scene("cornell").expect("built in");
            (source.materials[0].alpha, source.materials[0].alpha_mode) = (0.5, mode);
            SceneBuffers::build(&source).expect("builds")
        };
        // rays of some frames pass what is blended, a mask is the same in all
        assert_eq!(still_passes(&with(AlphaMode::Blend), &of(default())), [false; 2]);
        assert_eq!(still_passes(&with(AlphaMode::Mask { cutoff: 0.7 }), &of(default())), [true; 2]);
    }

    /// All combinations of what decides on passes and planes.
    #[test]
    fn no_combination_of_settings_is_without_a_plan() {
        let scene = builtin("cornell");
        for bits in 0..3 * 32_u32 {
            let on = |bit: u32| bits >> bit & 1 == 1;
            let settings = DiSettings {
                temporal: Temporal::ALL[(bits / 32) as usize],
                feedback: on(1),
                shaded: if on(4) { 20 } else { 0 },
                jitter: on(5),
                seen_rays: if on(2) { 5 } else { 1 },
                tiles: on(0).then_some(Tiles { count: 1, size: 8 }),
                ..DiSettings::default()
            };
            for (spatial, frames) in (0..4).flat_map(|spatial| [1, 2, 5].map(|frames| (spatial, frames))) {
                let settings = DiSettings { spatial, ..settings.clone() };
                let render = Render { count: frames, accumulate: on(3), ..Render::new([2, 1], settings) };
                used(render.plan(&scene));
            }
        }
    }
}
