//! The passes of ReSTIR DI.

use super::{DiSettings, Temporal, Tiles};
use crate::plan::BufferId;
use crate::technique::Technique;
use crate::technique::path::{PathSettings, Subsurface};
use crate::technique::reuse::Specialises;
use crate::technique::reuse::chain::{Chain, Passes, Queue, Reuses, of_frame};
use crate::technique::reuse::planes::{Planes, Turns};
use crate::technique::sequence::{Frame, Stage, Within};
use restir_kernels::restir_di as di;
use restir_shared::layout::{CameraParams, FilmPixel};
use restir_shared::resample::params::{LastFrame, ReuseParams};
use restir_shared::scene::GivenPlanes;
use restir_shared::technique::restir_di::{
    DiPairs, DiParams, DiPoint, PackedHit, PackedReservoir, TileParams, TileWords,
};

impl Specialises for DiParams {
    fn settings(&self) -> u32 {
        self.flags.bits()
    }
}

impl Specialises for TileParams {
    fn settings(&self) -> u32 {
        self.flags.bits()
    }
}

/// The chain of frames. Its planes are those that the settings need.
pub(super) fn chain(settings: &DiSettings, stage: &Stage) -> Chain<DiPasses> {
    let reuses = Reuses {
        in_time: settings.temporal != Temporal::Off && stage.goes_on,
        in_space: settings.spatial_passes(),
        feedback: settings.feedback,
        shadings: settings.shading_passes(),
    };
    // who finds what camera rays see directly, if more of them look for it than are shaded
    let seen = settings.sees_apart().then(|| Within::new(&seen_directly(settings), stage, settings.seen_rays));
    let mut planes = Planes::new(stage, seen);
    let pixels = planes.pixels;
    // of pixels that do not share candidates a single one, which nothing reads
    planes.add::<TileWords>("tiles", settings.tiles.map_or(1, |tiles| tiles.count as usize * tiles.size as usize));
    if settings.shaded > 0 {
        planes.add::<DiPoint>("points", pixels);
        planes.add::<DiPairs>("pairs", pixels);
    }
    let hits = planes.add_turns::<PackedHit>("hits", reuses.in_time);
    // one in work, one for spatial reuse, and one for the last frame's
    let records = 1 + usize::from(reuses.in_time) + usize::from(reuses.in_space > 0);
    planes.add_records::<PackedReservoir>("reservoirs", records);
    let direct = planes.add::<FilmPixel>("direct", pixels);
    let passes = DiPasses { settings: settings.clone(), of_all: settings.params(stage), hits, direct };
    Chain::new(stage, settings.integral(), reuses, planes, passes)
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

/// The passes, and the planes that they name.
pub(super) struct DiPasses {
    settings: DiSettings,
    of_all: DiParams,
    hits: Turns,
    direct: BufferId,
}

impl Passes for DiPasses {
    fn initial(&self, queue: &mut Queue, now: &Frame) {
        let params = self.params(now);
        if !now.primary_given && !self.knows_hits(queue) {
            queue.push(now, &di::di_primary::DESC, &params, &[]);
        }
        if self.settings.tiles.is_some() {
            queue.push(now, &di::di_tiles::DESC, &params.tile_params(), &[]);
        }
        // in a still view no history fades
        let other_view = queue.last(now).filter(|_| !self.settings.merges_as_still(now));
        let params = other_view.map_or(params, |last| params.renewed_after(last, self.settings.renewal()));
        queue.push(now, &di::di_initial::DESC, &params, &[("reservoirs", queue.work())]);
        if now.adds
            && let Some(seen) = queue.push_within(now)
        {
            queue.push_sum(seen, self.direct);
        }
    }

    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let s = &self.settings;
        let last = LastFrame { camera: last, scene: now.scenes[1], same_view: s.merges_as_still(now) };
        let with_last = self.params(now).with_last(&last);
        let neighbours = if s.temporal == Temporal::Fused { s.neighbours } else { 0 };
        let params = DiParams { reuse: ReuseParams { neighbours, ..with_last.reuse }, ..with_last };
        let hits = self.hits.before(now.index);
        let planes = [("other_hits", hits), ("others", queue.history()), ("reservoirs", queue.work())];
        queue.push(now, &di::di_combine::DESC, &params, &planes);
    }

    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId) {
        let hits = self.hits.of(now.index);
        let planes = [("other_hits", hits), ("others", queue.work()), ("reservoirs", merged)];
        queue.push(now, &di::di_combine::DESC, &self.params(now).with_neighbours(pass), &planes);
    }

    fn shade(&self, queue: &mut Queue, now: &Frame) {
        if !now.adds {
            return;
        }
        let reservoirs = ("reservoirs", queue.work());
        let shades_neighbours = self.settings.shaded > 0;
        if shades_neighbours {
            queue.push(now, &di::di_offer::DESC, &self.params(now), &[reservoirs]);
        }
        for params in self.settings.shading(&self.params(now)) {
            queue.shade(|queue, film| {
                if shades_neighbours {
                    queue.push(now, &di::di_exchange::DESC, &params, &[("film", film)]);
                    queue.push(now, &di::di_gather::DESC, &params, &[("film", film)]);
                } else {
                    queue.push(now, &di::di_shade::DESC, &params, &[reservoirs, ("film", film)]);
                }
            });
        }
    }

    fn primary(&self, frame: u32) -> Option<BufferId> {
        Some(self.hits.of(frame))
    }
}

impl DiPasses {
    /// Whether the plane of hits is still that of the same rays: its frame, and every one since, had them.
    fn knows_hits(&self, queue: &Queue) -> bool {
        !self.settings.jitter && queue.still_for as usize >= self.hits.count()
    }

    /// Of passes within the frame.
    fn params(&self, now: &Frame) -> DiParams {
        let mut params = of_frame(&self.of_all, now);
        if params.given != GivenPlanes::default() {
            params.given.half = now.index & 1;
        }
        params
    }
}

impl DiSettings {
    /// Of passes within a frame, whichever it is.
    fn params(&self, stage: &Stage) -> DiParams {
        let [width, height] = stage.size;
        let tiles = self.tiles.unwrap_or(Tiles { count: 0, size: 0 });
        let reuse = ReuseParams {
            width,
            height,
            seed: stage.seed,
            flags: self.flags(),
            neighbours: self.neighbours,
            confidence_cap: self.confidence_cap as f32,
            max_plane_distance: self.max_plane_distance,
            min_normal_cos: self.min_normal_cos,
            layers: 1,
            ..ReuseParams::default()
        };
        DiParams {
            reuse,
            candidates: self.candidates,
            gloss_fade: self.gloss_fade,
            radius: self.radius,
            near_radius: self.near_radius,
            group: self.candidates.div_ceil(self.initial_rays),
            tiles: tiles.count,
            tile_size: tiles.size,
            given: stage.given.unwrap_or_default(),
            ..DiParams::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::film::Capacity;
    use crate::plan::Pass;
    use crate::render::Render;
    use crate::scene::{AlphaMode, Camera};
    use crate::settings::Choice;
    use crate::technique::reuse::unused;
    use restir_shared::technique::restir_di::Flags;

    fn builtin(name: &str) -> SceneBuffers {
        SceneBuffers::build(&crate::scene::builtin::scene(name).expect("built in")).expect("builds")
    }

    fn passes(scene: &SceneBuffers, render: &Render) -> Vec<Pass> {
        render.plan(scene).passes.map(|pass| pass.expect("made")).collect()
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
                let capacity = Capacity { size: [3, 2], samples, largest_block: 0, progressive: false, is_sum: false };
                let film = capacity.planes() + 1;
                // points of 48 bytes a pixel and pairs of 32
                let [buffers, units] = if settings.shaded > 0 { [2, 5] } else { [0; 2] };
                assert_eq!(plan.buffers.len(), 4 + planes + buffers + film, "{render:?}");
                let words: usize = plan.buffers[4..].iter().map(|buffer| buffer.words).sum();
                let bytes_a_pixel = 4 * words / (render.width * render.height) as usize;
                assert_eq!(bytes_a_pixel, 16 * (planes + units + film), "{render:?}");
                assert!(unused(plan).is_empty(), "{render:?}");
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
                unused(render.plan(&scene));
            }
        }
    }
}
