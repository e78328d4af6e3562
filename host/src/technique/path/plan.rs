//! The passes of path tracing: aligned blocks of samples, each traced into a plane of the film.

use super::PathSettings;
use crate::plan::{ARENAS, Buffer, FramePlan, Pass};
use crate::technique::{PixelFilter, Technique};
use crate::{Error, buffers::SceneBuffers, film::Film, render::Render};
use restir_kernels::path::path;
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::{PATH_BLACKMAN_HARRIS, PATH_JITTER, PATH_ROULETTE, PATH_SOBOL, PathParams};

/// Samples in one dispatch, over all pixels, where the image is not larger: keeps a dispatch below a second or two.
const DISPATCH_SAMPLES_LOG2: u32 = 20;
/// Path segments of one invocation, over its samples, unless a single path has more: drivers may limit the rounds of an
/// invocation's loops (lavapipe to 65 535), and a segment takes two traversals.
const INVOCATION_SEGMENTS: u32 = 64;

/// Samples in a block, as a power of two.
fn block_log2(settings: &PathSettings, render: &Render) -> u32 {
    let fitting = || DISPATCH_SAMPLES_LOG2.saturating_sub((render.width * render.height).ilog2());
    let loops = (INVOCATION_SEGMENTS / settings.max_depth).max(1).ilog2();
    let asked = settings.dispatch_samples.map_or_else(fitting, u32::ilog2);
    asked.min(loops).min(MAX_BLOCK_LOG2)
}

/// The samples 0..`samples` as aligned blocks (first, log2 of the size), of at most 2^`largest` samples each.
fn aligned_blocks(samples: u32, largest: u32) -> impl Iterator<Item = (u32, u32)> {
    let mut first = 0_u32;
    std::iter::from_fn(move || {
        let left = samples - first;
        (left > 0).then(|| {
            let log2 = largest.min(left.ilog2()).min(first.trailing_zeros());
            let block = (first, log2);
            first += 1 << log2;
            block
        })
    })
}

/// Number of blocks: whole ones, then one for each bit of the remainder.
fn block_count(samples: u32, largest: u32) -> u64 {
    u64::from(samples >> largest) + u64::from((samples & ((1 << largest) - 1)).count_ones())
}

pub(super) fn plan<'a>(settings: &'a PathSettings, scene: &'a SceneBuffers, render: &'a Render) -> FramePlan<'a> {
    let largest = block_log2(settings, render);
    let mut buffers = Buffer::arenas(scene).to_vec();
    let film = Film::new(&mut buffers, [render.width, render.height], render.count, largest);
    let blocks = block_count(render.count, largest);
    let outputs = vec![film.output()];
    let passes = Passes { settings, scene, render, blocks: Box::new(aligned_blocks(render.count, largest)), film };
    // merging n blocks into one takes n - 1 additions
    let pass_count = blocks + (blocks - 1) + 1;
    FramePlan { buffers, outputs, passes: Box::new(passes), pass_count, scene: Some(scene) }
}

/// Makes the passes: each block is traced into a plane of the film.
struct Passes<'a> {
    settings: &'a PathSettings,
    scene: &'a SceneBuffers,
    render: &'a Render,
    blocks: Box<dyn Iterator<Item = (u32, u32)>>,
    film: Film,
}

impl Passes<'_> {
    fn trace(&mut self, first: u32, log2: u32) -> Option<Result<Pass, Error>> {
        let plane = self.film.open(log2)?;
        let (settings, render) = (self.settings, self.render);
        let flag = |on, bit| if on { bit } else { 0 };
        let spread = match settings.filter {
            PixelFilter::Box => PATH_JITTER,
            PixelFilter::BlackmanHarris => PATH_BLACKMAN_HARRIS,
        };
        let flags = flag(settings.jitter, spread)
            | flag(settings.roulette, PATH_ROULETTE)
            | flag(settings.sampler == Sampler::Sobol, PATH_SOBOL);
        let params = PathParams {
            scene: self.scene.header,
            camera: render.camera(self.scene, 0).params(render.width, render.height),
            width: render.width,
            height: render.height,
            first_sample: first,
            block_log2: log2,
            seed: render.seed,
            max_depth: settings.max_depth,
            flags,
            reserved: 0,
        };
        let bound = [ARENAS.as_slice(), &[("film", plane)]].concat();
        let constants = [("features", settings.integral().features(self.scene)), ("settings", flags)];
        Some(Pass::new(&path::DESC, &constants, &params, &bound))
    }
}

impl Iterator for Passes<'_> {
    type Item = Result<Pass, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(pass) = self.film.merge_equal() {
            return Some(pass);
        }
        match self.blocks.next() {
            Some((first, log2)) => self.trace(first, log2),
            None => self.film.finish(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_the_samples_in_order_and_are_counted() {
        for samples in (1..300).chain([1023, 4096, 70_001]) {
            for largest in 0..=MAX_BLOCK_LOG2 {
                let blocks: Vec<_> = aligned_blocks(samples, largest).collect();
                let mut next = 0;
                for &(first, log2) in &blocks {
                    assert_eq!((first, first % (1 << log2)), (next, 0), "blocks are contiguous and aligned");
                    next += 1 << log2;
                }
                assert_eq!((next, blocks.len() as u64), (samples, block_count(samples, largest)));
            }
        }
    }

    #[test]
    fn every_pass_finds_a_plane_and_is_counted() {
        let scene = SceneBuffers::build(&crate::scene::builtin::scene("cornell").expect("built in")).expect("builds");
        for samples in (1..200).chain([1023, 1024, 1025, 4097]) {
            for largest in 0..=MAX_BLOCK_LOG2 {
                let settings = PathSettings { dispatch_samples: Some(1 << largest), ..PathSettings::default() };
                let render = Render { count: samples, ..Render::new([1, 1], settings.clone()) };
                let plan = plan(&settings, &scene, &render);
                let (planes, pass_count) = (plan.buffers.len() - ARENAS.len(), plan.pass_count);
                let passes: Vec<Pass> = plan.passes.map(|pass| pass.expect("a pass")).collect();
                let bound = passes.iter().flat_map(|pass| &pass.bindings).filter(|id| **id >= ARENAS.len());
                let used = bound.collect::<std::collections::BTreeSet<_>>().len();
                assert_eq!((passes.len() as u64, used), (pass_count, planes), "{samples} {largest}");
            }
        }
    }
}
