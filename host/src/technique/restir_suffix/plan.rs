//! The passes of suffix ReSTIR.

use super::SuffixSettings;
use crate::Error;
use crate::compact::{Sorting, sort};
use crate::plan::BufferId;
use crate::technique::Technique;
use crate::technique::reuse::Specialises;
use crate::technique::reuse::chain::{Chain, Passes, Queue, Reuses, of_frame};
use crate::technique::reuse::mutual::{Layers, Mutual, with_last};
use crate::technique::reuse::planes::{Planes, Turns};
use crate::technique::sequence::{Frame, Stage, Within};
use restir_kernels::restir_pt as pt;
use restir_kernels::restir_suffix as suffix;
use restir_shared::layout::{CameraParams, FEATURE_BLEND};
use restir_shared::resample::mis::Mis;
use restir_shared::resample::mutual::ShiftResult;
use restir_shared::resample::params::{Flags, ReuseParams};
use restir_shared::shift::PathOrigin;
use restir_shared::technique::restir_pt::{PackedPath, PtParams};
use restir_shared::technique::restir_suffix::{Asks, Nearest, PrefixPoint, SuffixParams, Throughput};

impl Specialises for SuffixParams {
    fn settings(&self) -> u32 {
        self.path.settings()
    }
}

/// The chain of frames. Its planes are those that the settings need.
pub(super) fn chain(settings: &SuffixSettings, stage: &Stage) -> Chain<SuffixPasses> {
    let history = settings.temporal && stage.goes_on;
    let reuses = Reuses { in_time: history, in_space: settings.spatial, feedback: settings.feedback, shadings: 1 };
    // who finds paths of up to two segments, if it is another technique
    let direct = settings.direct.technique(&settings.integral());
    let mut planes = Planes::new(stage, direct.map(|technique| Within::new(&*technique, stage, 1)));
    let [borrowed, crossings] = [Asks::BORROWED, Asks::CROSSED].map(|asks| asks.layers(settings.borrowed) as usize);
    let layers = Layers { requests: crossings.max(borrowed), results: borrowed };
    let kernels = [&pt::pt_shift::DESC, &pt::pt_merge::DESC];
    let mutual = Mutual::with_layers::<PackedPath, PathOrigin>(&mut planes, &reuses, layers, kernels);
    let pixels = planes.pixels;
    // what pixels see is of no use any more when integration prefixes are traced
    let ends = planes.add::<PathOrigin>("ends", pixels);
    planes.bind("seen", ends);
    planes.add::<Throughput>("throughputs", pixels);
    planes.add::<Nearest>("nearest", pixels);
    let canonical = planes.add::<PackedPath>("canonical", pixels);
    let crossed = (crossings > 0).then(|| planes.add::<ShiftResult>("crossed", crossings * pixels));
    if let Some(results) = mutual.results().filter(|_| crossed.is_none()) {
        planes.bind("crossed", results);
    }
    planes.add::<PrefixPoint>("points", pixels);
    let words = planes.add::<u32>("words", pixels);
    let grid = sorted(&mut planes, words);
    let mut of_all = settings.params(stage);
    of_all.buckets = grid.as_ref().map_or(0, |grid| grid.buckets);
    let passes = SuffixPasses {
        settings: settings.clone(),
        of_all,
        origins: mutual.origins(),
        mutual,
        ends,
        canonical,
        crossed,
        grid,
    };
    Chain::new(stage, settings.integral(), reuses, planes, passes)
}

/// The sort of all pixels by these words, whose results have roles.
fn sorted(planes: &mut Planes, words: BufferId) -> Result<Sorting, Error> {
    let items = u32::try_from(planes.pixels).unwrap_or(u32::MAX);
    let grid = planes.with_buffers(|buffers| sort(buffers, words, items, Sorting::digits_for(items)))?;
    planes.bind("order", grid.order);
    planes.bind("starts", grid.starts);
    Ok(grid)
}

/// The passes, and the planes that they name.
pub(super) struct SuffixPasses {
    settings: SuffixSettings,
    of_all: SuffixParams,
    mutual: Mutual,
    /// The ends of supporting prefixes.
    origins: Turns,
    /// The ends of integration prefixes; before there are any, what pixels see.
    ends: BufferId,
    /// The suffixes of these.
    canonical: BufferId,
    /// What borrowed suffixes are to the other lenders, if there are any.
    crossed: Option<BufferId>,
    /// The sort of supporting prefixes by their buckets.
    grid: Result<Sorting, Error>,
}

impl Passes for SuffixPasses {
    fn initial(&self, queue: &mut Queue, now: &Frame) {
        let params = self.params(now);
        queue.push(now, &suffix::suffix_support::DESC, &params, &[]);
        if let Some(last) = queue.last(now) {
            self.keep(queue, now, last);
        }
        queue.push(now, &suffix::suffix_trace::DESC, &params.path, &[("reservoirs", queue.work())]);
        queue.push(now, &suffix::suffix_point::DESC, &params, &[]);
        match &self.grid {
            Ok(grid) => queue.push_all(&grid.passes),
            Err(error) => queue.fail(error),
        }
    }

    fn reuse_in_time(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let mut params = with_last(&self.params(now).path, now, last, false);
        let mut history = queue.history();
        if now.same_scene {
            // suffixes of one vertex: both pixels find the same
            params.flags = params.flags.with_form(Mis::CONSTANT) | Flags::KEPT;
        } else {
            history = self.mutual.exchange(queue, now, &params, |queue, params, paths| {
                if !params.flags.contains(Flags::BACK) {
                    queue.push(now, &pt::pt_recall::DESC, params, &[("reservoirs", paths)]);
                }
                paths
            });
        }
        self.mutual.merge_in_time(queue, now, &params, history);
    }

    fn reuse_in_space(&self, queue: &mut Queue, now: &Frame, pass: u32, merged: BufferId) {
        let mut params = self.params(now);
        params.path = params.path.with_neighbours(pass);
        queue.push(now, &suffix::suffix_pair::DESC, &params, &[]);
        self.mutual.share(queue, now, &params.path, merged);
    }

    fn shade(&self, queue: &mut Queue, now: &Frame) {
        let direct = queue.push_within(now);
        if now.adds {
            let suffixes = queue.work();
            queue.shade(|queue, film| {
                for prefix in 0..self.settings.prefixes {
                    let params = SuffixParams { prefix, ..self.params(now) };
                    self.integrate(queue, now, &params, suffixes, film);
                }
                if let Some(direct) = direct {
                    queue.push_sum(direct, film);
                }
            });
        }
    }
}

impl SuffixPasses {
    /// Puts supporting prefixes of the last frame in the place of new ones.
    fn keep(&self, queue: &mut Queue, now: &Frame, last: CameraParams) {
        let mut params = self.params(now);
        params.path = with_last(&params.path, now, last, !self.settings.jitter);
        if !params.flags.contains(Flags::STILL) {
            self.mutual.reproject(queue, now, &params.path, &[("origins", self.ends)]);
        }
        let before = ("other_origins", self.origins.before(now.index));
        queue.push(now, &suffix::suffix_keep::DESC, &params, &[before]);
    }

    /// Adds what one integration prefix of each pixel finds, and what is borrowed at its end, to the picture.
    fn integrate(&self, queue: &mut Queue, now: &Frame, params: &SuffixParams, suffixes: BufferId, film: BufferId) {
        let (film, lent) = (("film", film), ("reservoirs", suffixes));
        queue.push(now, &suffix::suffix_prefix::DESC, params, &[film]);
        queue.push(now, &suffix::suffix_find::DESC, params, &[]);
        self.ask(queue, now, params, Asks::BORROWED);
        self.shift(queue, now, params, &params.path, Asks::BORROWED, &[lent, ("origins", self.ends)]);
        if let Some(crossed) = self.crossed {
            self.ask(queue, now, params, Asks::CROSSED);
            self.shift(queue, now, params, &params.path, Asks::CROSSED, &[lent, ("results", crossed)]);
        }
        queue.push(now, &suffix::suffix_gather::DESC, params, &[lent, film]);
        if params.prefix.is_multiple_of(self.settings.canonical) {
            let (of_canonical, canonical) = (params.canonical(), ("reservoirs", self.canonical));
            queue.push(now, &suffix::suffix_trace::DESC, &of_canonical, &[canonical, ("origins", self.ends)]);
            self.ask(queue, now, params, Asks::CANONICAL);
            self.shift(queue, now, params, &of_canonical, Asks::CANONICAL, &[canonical]);
            queue.push(now, &suffix::suffix_canonical::DESC, params, &[lent, film]);
        }
    }

    /// Asks for the shifts of one kind.
    fn ask(&self, queue: &mut Queue, now: &Frame, params: &SuffixParams, asks: Asks) {
        let mut params = SuffixParams { asks, ..*params };
        params.layers = asks.layers(params.borrowed);
        queue.push(now, &suffix::suffix_ask::DESC, &params, &[]);
    }

    /// Makes the shifts that were asked for.
    fn shift(
        &self,
        queue: &mut Queue,
        now: &Frame,
        params: &SuffixParams,
        of: &PtParams,
        asks: Asks,
        planes: &[(&'static str, BufferId)],
    ) {
        let mut shifts = *of;
        shifts.layers = asks.layers(params.borrowed);
        queue.push(now, &pt::pt_shift::DESC, &shifts, planes);
    }

    /// Of passes that see one frame.
    fn params(&self, now: &Frame) -> SuffixParams {
        let hybrid = self.settings.hybrid(now.features & FEATURE_BLEND != 0);
        let path = PtParams { hybrid, ..of_frame(&self.of_all.path, now) };
        SuffixParams { path, ..self.of_all }
    }
}

impl SuffixSettings {
    /// Of passes that see one frame, whichever it is, but for where suffixes are joined, and for the grid.
    fn params(&self, stage: &Stage) -> SuffixParams {
        let [width, height] = stage.size;
        let reuse = ReuseParams {
            width,
            height,
            seed: stage.seed,
            flags: self.flags().with_form(Mis::PAIRWISE),
            neighbours: 1,
            max_plane_distance: self.max_plane_distance,
            min_normal_cos: self.min_normal_cos,
            layers: 1,
            confidence_cap: self.confidence_cap as f32,
            ..ReuseParams::default()
        };
        SuffixParams {
            path: PtParams { reuse, max_depth: self.max_depth, ..PtParams::default() },
            ends: self.end_rule(),
            prefixes: self.prefixes,
            borrowed: self.borrowed,
            radius: self.radius,
            kept_for: self.kept_for as f32,
            canonical_share: 1.0 / self.prefixes.div_ceil(self.canonical) as f32,
            ..SuffixParams::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::plan::Buffer;
    use crate::render::Render;
    use crate::settings::Value;
    use crate::technique::Direct;
    use crate::technique::reuse::unused;
    use restir_shared::technique::restir_suffix::MAX_BORROWED;

    fn scene() -> SceneBuffers {
        SceneBuffers::build(&crate::scene::builtin::scene("moving").expect("built in")).expect("builds")
    }

    fn settings(change: impl Fn(&mut SuffixSettings)) -> SuffixSettings {
        let mut settings = SuffixSettings::default();
        change(&mut settings);
        settings
    }

    /// Counts are right, every pass fits its buffers, so that it writes none that it reads, and every buffer is used: with all settings that
    /// decide on passes and planes.
    #[test]
    fn no_combination_of_settings_is_without_a_plan() {
        let scene = scene();
        for (spatial, borrowed, bits) in (0..3)
            .flat_map(|spatial| (1..=MAX_BORROWED).flat_map(move |k| (0..8_u32).map(move |bits| (spatial, k, bits))))
        {
            let on = |bit: u32| bits >> bit & 1 == 1;
            let canonical = if on(2) { 1 } else { 4 };
            let settings = SuffixSettings {
                spatial,
                borrowed,
                temporal: on(0),
                feedback: on(1),
                canonical,
                prefixes: 2,
                ..SuffixSettings::default()
            };
            for (count, accumulate) in [(1, false), (4, false), (4, true)] {
                let render = Render { count, accumulate, ..Render::new([8, 6], settings.clone()) };
                assert!(unused(render.plan(&scene)).is_empty(), "{render:?}");
            }
        }
    }

    /// The picture of the technique that finds direct light is read, whichever that is.
    #[test]
    fn another_technique_finds_direct_light() {
        for direct in crate::technique::all().iter().filter_map(|technique| Direct::read(technique.about().name)) {
            for (accumulate, temporal) in [(false, true), (true, false)] {
                let settings = settings(|s| (s.direct, s.temporal) = (direct, temporal));
                let render = Render { count: 3, accumulate, ..Render::new([16, 12], settings) };
                assert!(unused(render.plan(&scene())).is_empty(), "{render:?}");
            }
        }
    }

    /// Bytes a pixel beside the film's, as docs/restir-suffix.md has them, at a size at which the grid's cells do not count.
    #[test]
    fn planes_are_as_large_as_is_said() {
        let scene = scene();
        let rows = [
            (settings(|_| ()), STATED[0]),
            (settings(|s| s.borrowed = 1), STATED[1]),
            (settings(|s| s.borrowed = 4), STATED[2]),
            (settings(|s| (s.temporal, s.spatial) = (false, 0)), STATED[3]),
        ];
        const STATED: [usize; 4] = [537, 481, 809, 393];
        for (settings, stated) in rows {
            let render = Render { count: 4, ..Render::new([512, 512], settings) };
            let of_film = |buffer: &&Buffer| !["film", "mean"].contains(&buffer.name);
            let plan = render.plan(&scene);
            let words: usize = plan.buffers[3..].iter().filter(of_film).map(|buffer| buffer.words).sum();
            assert_eq!((4 * words).div_ceil(512 * 512), stated, "{render:?}");
        }
    }
}
