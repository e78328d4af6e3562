//! The passes of ReSTIR DI.

use super::{DiSettings, Temporal, Tiles};
use crate::plan::{ARENAS, Buffer, BufferId, FramePlan, Pass};
use crate::technique::Technique;
use crate::{Error, buffers::SceneBuffers, film::Film, moments::Moments, render::Render};
use bytemuck::Pod;
use restir_kernels::{KernelDesc, restir_di as di};
use restir_shared::layout::{Extent, FEATURE_BLEND, FilmPixel};
use restir_shared::technique::restir_di::{DiPairs, DiParams, DiPoint, Flags, PackedHit, PackedReservoir, TileWords};
use std::collections::VecDeque;

/// Samples that the film holds.
pub(super) fn film_samples(settings: &DiSettings, render: &Render) -> u64 {
    u64::from(if render.accumulate { render.count } else { 1 }) * u64::from(settings.shading_passes())
}

/// The frames' passes.
pub(super) fn plan<'a>(settings: &'a DiSettings, scene: &'a SceneBuffers, render: &'a Render) -> FramePlan<'a> {
    let moments = Moments::new(scene, if keeps_history(settings, render) { 2 } else { 1 });
    let mut buffers = moments.buffers();
    let planes = Planes::new(&mut buffers, settings, render);
    let samples = film_samples(settings, render) as u32;
    let film = Film::new(&mut buffers, [render.width, render.height], samples, 0);
    let outputs = vec![film.output()];
    let passes = || Passes {
        settings,
        scene,
        render,
        moments: moments.clone(),
        planes: planes.clone(),
        film: film.clone(),
        frame: 0,
        queue: VecDeque::new(),
    };
    let pass_count = passes().count(samples);
    FramePlan { buffers, passes: Box::new(passes()), pass_count, outputs, scene: Some(scene) }
}

/// The planes of the frames; what the settings do not need is not there.
#[derive(Clone)]
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
    fn new(buffers: &mut Vec<Buffer>, s: &DiSettings, render: &Render) -> Self {
        let mut add = |name, count, bytes| {
            buffers.push(Buffer { name, words: count * bytes / size_of::<u32>(), contents: None });
            buffers.len() - 1
        };
        let candidates = s.tiles.map_or(1, |tiles| tiles.count as usize * tiles.size as usize);
        let tiles = add("tiles", candidates, size_of::<TileWords>());
        let pixels = render.width as usize * render.height as usize;
        let shading = (s.shaded > 0)
            .then(|| [add("points", pixels, size_of::<DiPoint>()), add("pairs", pixels, size_of::<DiPairs>())]);
        let history = usize::from(keeps_history(s, render));
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

fn keeps_history(settings: &DiSettings, render: &Render) -> bool {
    settings.temporal != Temporal::Off && render.count > 1
}

/// Makes the passes, a frame at a time.
struct Passes<'a> {
    settings: &'a DiSettings,
    scene: &'a SceneBuffers,
    render: &'a Render,
    moments: Moments<'a>,
    planes: Planes,
    film: Film,
    frame: u32,
    queue: VecDeque<Result<Pass, Error>>,
}

impl Passes<'_> {
    /// How many there are: merging n samples into one takes n - 1 additions, and one division. With neighbours a sample takes
    /// two passes, and a frame one before.
    fn count(mut self, samples: u32) -> u64 {
        let mut first_and_later = [0; 2];
        for passes in &mut first_and_later {
            self.reuse_hits();
            *passes = self.queue.len() as u64;
            self.queue.clear();
            self.frame += 1;
        }
        let [first, later] = first_and_later;
        // once the last camera stays, frames are alike
        let settled = self.render.count.min((self.render.cameras.len() + self.planes.hits.len()) as u32);
        let found = |frame: u32| u64::from(!self.knows_hits(frame));
        let hits = (0..settled).map(found).sum::<u64>() + u64::from(self.render.count - settled) * found(settled);
        let shaded = u64::from(samples) / u64::from(self.settings.shading_passes());
        let of_neighbours = if self.planes.shading.is_some() { u64::from(samples) + shaded } else { 0 };
        hits + first + later * u64::from(self.render.count - 1) + 2 * u64::from(samples) + of_neighbours
    }

    /// The passes of a frame up to its reservoirs.
    fn reuse(&mut self) {
        if !self.knows_hits(self.frame) {
            self.push(&di::di_primary::DESC, self.params(), &[]);
        }
        self.reuse_hits();
    }

    /// The passes that find hits in their plane.
    fn reuse_hits(&mut self) {
        if self.settings.tiles.is_some() {
            self.push_over(&di::di_tiles::DESC, &self.params().tile_params(), &[], self.settings.flags());
        }
        self.push(&di::di_initial::DESC, self.params(), &[("reservoirs", self.planes.reservoirs[0])]);
        if self.frame > 0 && keeps_history(self.settings, self.render) {
            self.reuse_in_time();
        }
        self.reuse_in_space();
    }

    fn reuse_in_time(&mut self) {
        let (settings, reservoirs) = (self.settings, &self.planes.reservoirs);
        let of_last = DiParams {
            flags: settings.temporal_flags(self.same_view(self.frame - 1)),
            other_scene: self.moments.headers()[1],
            other_camera: self.camera_params(self.frame - 1),
            other_frame: self.frame - 1,
            neighbours: if settings.temporal == Temporal::Fused { settings.neighbours } else { 0 },
            ..self.params()
        };
        let last = reservoirs[reservoirs.len() - 1];
        let last_hits = self.planes.hits(self.frame + 1);
        let planes = [("other_hits", last_hits), ("others", last), ("reservoirs", reservoirs[0])];
        self.push(&di::di_combine::DESC, of_last, &planes);
    }

    fn reuse_in_space(&mut self) {
        for pass in 0..self.settings.spatial_passes() {
            let params = DiParams { combine: 1 + pass, ..self.params() };
            // what the next frame reads is not written over
            let free_at = if pass > 0 && self.keeps_before_spatial() { 2 } else { 1 };
            let [work, free] = [self.planes.reservoirs[0], self.planes.reservoirs[free_at]];
            let planes = [("other_hits", self.planes.hits(self.frame)), ("others", work), ("reservoirs", free)];
            self.push(&di::di_combine::DESC, params, &planes);
            self.planes.reservoirs.swap(0, free_at);
        }
    }

    /// Whether the plane of hits is still that of the same rays: its frame, and every one since, had them.
    fn knows_hits(&self, frame: u32) -> bool {
        let written = frame.checked_sub(self.planes.hits.len() as u32);
        !self.settings.jitter && written.is_some_and(|at| (at..frame).all(|frame| self.same_view(frame)))
    }

    /// Whether a frame and the one after it have the same scene and the same ray in every pixel, jitter aside.
    fn same_view(&self, frame: u32) -> bool {
        let [last, camera] = [frame, frame + 1].map(|frame| self.camera_params(frame));
        // a point of a lens is another one each frame
        let is_pinhole = camera.lens_right == 0.0 && camera.lens_up == 0.0;
        // what is blended is met by the rays of some frames
        let is_still = !self.scene.is_animated() && self.scene.features & FEATURE_BLEND == 0;
        is_still && is_pinhole && last == camera
    }

    /// Whether the next frame reuses what spatial reuse began with.
    fn keeps_before_spatial(&self) -> bool {
        keeps_history(self.settings, self.render) && !self.settings.feedback && self.settings.spatial_passes() > 0
    }

    /// What the frame adds to the film.
    fn shade(&mut self) {
        let reservoirs = ("reservoirs", self.planes.reservoirs[0]);
        let shades_neighbours = self.planes.shading.is_some();
        if shades_neighbours {
            self.push(&di::di_offer::DESC, self.params(), &[reservoirs]);
        }
        for params in self.settings.shading(&self.params()) {
            let Some(film) = self.film.open(0) else { return };
            if shades_neighbours {
                self.push(&di::di_exchange::DESC, params, &[("film", film)]);
                self.push(&di::di_gather::DESC, params, &[("film", film)]);
            } else {
                self.push(&di::di_shade::DESC, params, &[reservoirs, ("film", film)]);
            }
            self.queue.extend(std::iter::from_fn(|| self.film.merge_equal()));
        }
    }

    /// A pass over the planes of the frame and some more.
    fn push(&mut self, kernel: &'static KernelDesc, params: DiParams, planes: &[(&str, BufferId)]) {
        self.push_over(kernel, &params, planes, params.flags);
    }

    fn push_over(
        &mut self,
        kernel: &'static KernelDesc,
        params: &(impl Pod + Extent),
        planes: &[(&str, BufferId)],
        flags: Flags,
    ) {
        let constants = [("features", self.settings.integral().features(self.scene)), ("settings", flags.bits())];
        let bound = [planes, &self.planes.of_frame(self.frame)].concat();
        self.queue.push_back(Pass::new(kernel, &constants, params, &bound));
    }

    fn camera_params(&self, frame: u32) -> restir_shared::layout::CameraParams {
        self.render.camera(self.scene, frame).params(self.render.width, self.render.height)
    }

    /// Of passes within the frame.
    fn params(&self) -> DiParams {
        let (render, s) = (self.render, self.settings);
        let tiles = s.tiles.unwrap_or(Tiles { count: 0, size: 0 });
        let (camera, [scene, _]) = (self.camera_params(self.frame), self.moments.headers());
        DiParams {
            scene,
            other_scene: scene,
            camera,
            other_camera: camera,
            width: render.width,
            height: render.height,
            frame: self.frame,
            other_frame: self.frame,
            seed: render.seed,
            flags: s.flags(),
            candidates: s.candidates,
            neighbours: s.neighbours,
            confidence_cap: s.confidence_cap as f32,
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
    fn end_frame(&mut self) {
        let last = self.planes.reservoirs.len() - 1;
        if keeps_history(self.settings, self.render) {
            let history = usize::from(self.keeps_before_spatial());
            self.planes.reservoirs.swap(history, last);
        }
        self.frame += 1;
    }
}

impl Iterator for Passes<'_> {
    type Item = Result<Pass, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.queue.is_empty() && self.frame < self.render.count {
            let begun = match self.moments.advance(self.frame) {
                Ok(begun) => begun,
                Err(e) => return Some(Err(e)),
            };
            self.reuse();
            if let Some(Ok(first)) = self.queue.front_mut() {
                first.frame = begun;
            }
            if self.render.accumulate || self.frame + 1 == self.render.count {
                self.shade();
            }
            self.end_frame();
        }
        self.queue.pop_front().or_else(|| self.film.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AlphaMode, Camera};
    use std::collections::BTreeSet;

    fn builtin(name: &str) -> SceneBuffers {
        SceneBuffers::build(&crate::scene::builtin::scene(name).expect("built in")).expect("builds")
    }

    fn passes(scene: &SceneBuffers, render: &Render) -> Vec<Pass> {
        render.technique.plan(scene, render).passes.map(|pass| pass.expect("made")).collect()
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
                let plan = render.technique.plan(&scene, &render);
                let film = Film::plane_count(film_samples(&settings, &render) as u32, 0) + 1;
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
            let plan = render.technique.plan(&scene, &render);
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
                tiles: on(0).then_some(Tiles { count: 1, size: 8 }),
                ..DiSettings::default()
            };
            for (spatial, frames) in (0..4).flat_map(|spatial| [1, 2, 5].map(|frames| (spatial, frames))) {
                let settings = DiSettings { spatial, ..settings.clone() };
                let render = Render { count: frames, accumulate: on(3), ..Render::new([2, 1], settings) };
                used(render.technique.plan(&scene, &render));
            }
        }
    }
}
