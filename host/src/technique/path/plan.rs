//! The passes of path tracing: aligned blocks of samples, each traced into a plane of the film.

use super::hybrid::Hybrid;
use super::media::{COUNTS, Media};
use super::{PathSettings, Subsurface};
use crate::Error;
use crate::exec::Dispatches;
use crate::film::{Film, aligned_blocks};
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::sequence::{Frame, Sequence, Share, Stage, Work};
use crate::technique::{PixelFilter, Technique};
use restir_kernels::path::{path, path_media, path_media_clear};
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::layout::{FEATURE_CLEAR_BORDER, FEATURE_SUBSURFACE};
use restir_shared::rng::Sampler;
use restir_shared::technique::path::media::{MediaParams, PackedWalker};
use restir_shared::technique::path::{PathFlags, PathParams};
use std::collections::VecDeque;

/// What limits a dispatch.
struct Limits {
    /// Samples over all pixels, as a power of two, where the image is not larger: keeps a dispatch below a second or two on a GPU, and on the
    /// host below some seconds.
    samples_log2: u32,
    /// Path segments of one invocation, over its samples, unless a single path has more: drivers may limit the rounds of an
    /// invocation's loops (lavapipe to 65 535), and a segment takes two traversals. The host limits none.
    segments: Option<u32>,
}

impl Limits {
    fn of(dispatches: Dispatches, max_depth: u32) -> Self {
        match dispatches {
            Dispatches::Short => Self { samples_log2: 20, segments: Some(64) },
            // of paths of up to 8 segments, and fewer of longer ones
            Dispatches::Long => {
                Self { samples_log2: 22_u32.saturating_sub(max_depth.div_ceil(8).ilog2()), segments: None }
            }
        }
    }
}

/// Samples in a block, as a power of two.
fn block_log2(settings: &PathSettings, [width, height]: [u32; 2], limits: &Limits) -> u32 {
    let fitting = || limits.samples_log2.saturating_sub((width * height).ilog2());
    let loops = limits.segments.map_or(MAX_BLOCK_LOG2, |most| (most / settings.max_depth).max(1).ilog2());
    let asked = settings.dispatch_samples.map_or_else(fitting, u32::ilog2);
    asked.min(loops).min(MAX_BLOCK_LOG2)
}

/// Number of blocks of samples from 0 on: whole ones, then one for each bit of the remainder.
fn block_count(samples: u32, largest: u32) -> u64 {
    u64::from(samples >> largest) + u64::from((samples & ((1 << largest) - 1)).count_ones())
}

/// The frames of path tracing. Samples of a mean are numbered on from frame to frame, and so are those of frames that stand alone.
pub(super) struct Paths {
    settings: PathSettings,
    size: [u32; 2],
    seed: u32,
    largest: u32,
    progressive: bool,
    share: Option<Share>,
    buffers: Vec<Buffer>,
    film: Film,
    /// Where light scatters inside of things, and is followed.
    media: Option<Media>,
    /// Where light scatters inside of things, and a profile stands for it.
    hybrid: Option<Hybrid>,
    /// The frame in work, and the number of the sample from which its mean counts.
    frame: Option<(Frame, u32)>,
    /// The blocks of the frame that are to come.
    blocks: Box<dyn Iterator<Item = (u32, u32)> + Send>,
    /// The passes after all blocks.
    last: Option<VecDeque<Result<Pass, Error>>>,
}

impl Paths {
    pub(super) fn new(settings: &PathSettings, stage: &Stage) -> Self {
        Self::of(settings, stage, false)
    }

    fn of(settings: &PathSettings, stage: &Stage, profiles_elsewhere: bool) -> Self {
        let mut buffers = stage.arenas.to_vec();
        let subsurface = settings.subsurface(stage.features);
        let scatters = subsurface != Subsurface::Off;
        let media = (subsurface == Subsurface::Walk).then(|| Media::new(&mut buffers, stage.size, settings));
        let hybrid = scatters && media.is_none();
        let hybrid = hybrid.then(|| Hybrid::new(&mut buffers, stage.size, settings, profiles_elsewhere));
        let largest_of = |dispatches| {
            if scatters { 0 } else { block_log2(settings, stage.size, &Limits::of(dispatches, settings.max_depth)) }
        };
        // longer blocks need no more planes
        let short = largest_of(Dispatches::Short);
        // blocks of a mean that goes on are smaller where a frame has fewer samples
        let film = Film::new(&mut buffers, stage.film(1, if stage.progressive { 0 } else { short }));
        Self {
            settings: settings.clone(),
            size: stage.size,
            seed: stage.seed,
            largest: largest_of(stage.dispatches),
            progressive: stage.progressive,
            share: stage.share,
            buffers,
            film,
            media,
            hybrid,
            frame: None,
            blocks: Box::new(std::iter::empty()),
            last: None,
        }
    }

    /// The same for another technique, which finds what profiles hold where paths enter bodies: the plane `entries`.
    pub(super) fn without_profiles(settings: &PathSettings, stage: &Stage) -> Self {
        Self::of(settings, stage, true)
    }

    fn flags(&self) -> PathFlags {
        let settings = &self.settings;
        let spread = match settings.filter {
            PixelFilter::Box => PathFlags::JITTER,
            PixelFilter::BlackmanHarris => PathFlags::BLACKMAN_HARRIS,
        };
        spread.only_if(settings.jitter)
            | PathFlags::ROULETTE.only_if(settings.roulette)
            | PathFlags::SOBOL.only_if(settings.sampler == Sampler::Sobol)
            | self.hybrid.as_ref().map_or(PathFlags::NONE, Hybrid::flags)
    }

    fn trace(&mut self, first: u32, log2: u32) -> Option<Result<Pass, Error>> {
        let plane = self.film.open(log2)?;
        let (frame, base) = self.frame.as_ref()?;
        let ([width, height], flags) = (self.size, self.flags());
        let params = PathParams {
            scene: frame.scenes[0],
            camera: frame.camera,
            width,
            height,
            first_sample: base.wrapping_add(first),
            block_log2: log2,
            seed: self.seed,
            max_depth: self.settings.max_depth,
            flags,
            corner: self.share.map_or(0, |share| share.corner[0] | share.corner[1] << 16),
        };
        if let Some(media) = &mut self.media {
            media.begin(params, plane);
            return self.stretch();
        }
        if let Some(hybrid) = &mut self.hybrid {
            hybrid.begin(params, plane);
            return self.turn();
        }
        let bound = [ARENAS.as_slice(), &[("film", plane)]].concat();
        Some(Pass::new(&path::DESC, &self.constants(frame), &params, &bound))
    }

    fn constants(&self, frame: &Frame) -> [(&'static str, u32); 3] {
        // without walks nothing asks what interiors scatter
        let absent = if self.media.is_some() | self.hybrid.is_some() { 0 } else { FEATURE_SUBSURFACE };
        let features = self.settings.integral().features(frame.features) & !absent;
        // one pipeline for all blocks of a render
        let block = if self.largest > 0 { u32::MAX } else { 0 };
        [("features", features), ("settings", self.flags().bits()), ("block", block)]
    }

    /// The next stretch of paths through media.
    fn stretch(&mut self) -> Option<Result<Pass, Error>> {
        let (params, film): (MediaParams, BufferId) = self.media.as_mut()?.next()?;
        let (media, (frame, _)) = (self.media.as_ref()?, self.frame.as_ref()?);
        let planes = [("walkers", media.walkers), ("tallies", media.tallies), ("film", film)];
        let bound = [ARENAS.as_slice(), &planes].concat();
        let clear = frame.features & FEATURE_CLEAR_BORDER != 0 && self.settings.lights_inside;
        let kernel = if clear { &path_media_clear::DESC } else { &path_media::DESC };
        let pass = Pass::new(kernel, &self.constants(frame), &params, &bound);
        let (word, bits) = PackedWalker::GOES_ON;
        let goes_on = |pass: Pass| pass.where_waiting("walkers", word, bits);
        Some(if params.begins != 0 { pass } else { pass.and_then(goes_on) })
    }

    /// The next turn of a sample with profiles.
    fn turn(&mut self) -> Option<Result<Pass, Error>> {
        let (kernel, params, film) = self.hybrid.as_mut()?.next()?;
        let (hybrid, (frame, _)) = (self.hybrid.as_ref()?, self.frame.as_ref()?);
        let planes = [("entries", Some(hybrid.entries)), ("exits", hybrid.exits), ("film", Some(film))];
        let known = |name: &str| kernel.bindings.iter().any(|binding| binding.name == name);
        let planes = planes.into_iter().filter(|(name, _)| known(name));
        let planes: Vec<_> = planes.filter_map(|(name, plane)| Some((name, plane?))).collect();
        let bound = [ARENAS.as_slice(), &planes].concat();
        Some(Pass::new(kernel, &self.constants(frame), &params, &bound))
    }
}

impl Sequence for Paths {
    fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    fn output(&self) -> BufferId {
        self.film.output()
    }

    fn counts(&self) -> Option<(BufferId, [&'static str; 4])> {
        self.media.as_ref().map(|media| (media.tallies, COUNTS))
    }

    fn begin(&mut self, frame: Frame) -> Work {
        if frame.clears {
            self.film.clear();
        }
        // a block is aligned within the mean that it belongs to
        let (held, samples, largest) = (self.film.samples(), frame.samples, self.largest);
        let base = match self.share {
            Some(share) => share.first,
            None if self.progressive => 0,
            None => frame.index.wrapping_mul(samples),
        };
        let blocks = if held == 0 {
            block_count(samples, largest)
        } else {
            aligned_blocks(held, samples, largest).count() as u64
        };
        self.blocks = Box::new(aligned_blocks(held, samples, largest));
        self.last = None;
        self.frame = Some((frame, base));
        let turns = self.hybrid.as_ref().map_or(1, Hybrid::dispatches);
        let turns = self.media.as_ref().map_or(turns, |media| media.stretches());
        Work { passes: blocks * u64::from(turns), blocks }
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        if let Some(pass) = self.stretch().or_else(|| self.turn()) {
            return Some(pass);
        }
        if let Some(pass) = self.film.merge_equal() {
            return Some(pass);
        }
        if let Some((first, log2)) = self.blocks.next() {
            return self.trace(first, log2);
        }
        if self.last.is_none() {
            let shows = self.frame.as_ref().is_some_and(|(frame, _)| frame.shows);
            self.last = Some(if shows { self.film.image().into() } else { VecDeque::new() });
        }
        self.last.as_mut()?.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::SceneBuffers;
    use crate::render::Render;

    #[test]
    fn blocks_cover_the_samples_in_order_and_are_counted() {
        for samples in (1..300).chain([1023, 4096, 70_001]) {
            for largest in 0..=MAX_BLOCK_LOG2 {
                let blocks: Vec<_> = aligned_blocks(0, samples, largest).collect();
                let mut next = 0;
                for &(first, log2) in &blocks {
                    assert_eq!((first, first % (1 << log2)), (next, 0), "blocks are contiguous and aligned");
                    next += 1 << log2;
                }
                assert_eq!((next, blocks.len() as u64), (samples, block_count(samples, largest)));
            }
        }
    }

    /// A dispatch on the host is as long for deep paths as for those of 8 segments, and on a GPU no longer than 64 segments or one path.
    #[test]
    fn deep_paths_have_fewer_samples_in_a_dispatch() {
        let samples = |max_depth, dispatches| {
            let settings = PathSettings { max_depth, ..PathSettings::default() };
            1 << block_log2(&settings, [256, 256], &Limits::of(dispatches, max_depth))
        };
        let rows = [(1, 64, 16), (8, 64, 8), (9, 32, 4), (16, 32, 4), (64, 8, 1), (1024, 1, 1)];
        for (max_depth, long, short) in rows {
            let found = [Dispatches::Long, Dispatches::Short].map(|dispatches| samples(max_depth, dispatches));
            assert_eq!(found, [long, short], "max_depth={max_depth}");
        }
    }

    #[test]
    fn every_pass_finds_a_plane_and_is_counted() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("cornell").expect("built in")).expect("builds");
        let counted = |render: &Render, dispatches| {
            let plan = render.plan_of(&scene, dispatches, None);
            let (planes, pass_count) = (plan.buffers.len() - ARENAS.len(), plan.pass_count);
            let passes: Vec<Pass> = plan.passes.map(|pass| pass.expect("a pass")).collect();
            let bound = passes.iter().flat_map(|pass| &pass.bindings).filter(|id| **id >= ARENAS.len());
            let used = bound.collect::<std::collections::BTreeSet<_>>().len();
            assert_eq!(passes.len() as u64, pass_count);
            (planes, used, pass_count)
        };
        for samples in (1..200).chain([1023, 1024, 1025, 4097]) {
            for largest in 0..=MAX_BLOCK_LOG2 {
                let settings = PathSettings { dispatch_samples: Some(1 << largest), ..PathSettings::default() };
                let render = Render { count: samples, ..Render::new([1, 1], settings) };
                let (planes, used, passes) = counted(&render, Dispatches::Short);
                assert_eq!(used, planes, "{samples} {largest}");
                // longer dispatches are no more, in the same planes
                let (long_planes, long_used, long_passes) = counted(&render, Dispatches::Long);
                assert_eq!(long_planes, planes, "{samples} {largest}");
                assert!(long_used <= planes && long_passes <= passes, "{samples} {largest}");
            }
        }
    }
}
