//! Renders an image with a technique on an executor.

use crate::exec::Executor;
use crate::film::Film;
use crate::plan::{Buffer, FramePlan, Pass};
use crate::{Error, buffers::SceneBuffers, image::Image, memory};
use restir_kernels::path::path;
use restir_shared::film::MAX_BLOCK_LOG2;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::{PATH_JITTER, PATH_ROULETTE, PathParams};
use std::ops::ControlFlow;

/// Longest side of an image in pixels.
pub const MAX_SIDE: u32 = 16_384;
/// Samples in one dispatch, over all pixels, where the image is not larger: keeps a dispatch below a second or two.
const DISPATCH_SAMPLES_LOG2: u32 = 20;
/// Path segments of one invocation, over its samples, unless a single path has more: drivers may limit the rounds of an invocation's loops (lavapipe
/// to 65 535), and a segment takes two traversals.
const INVOCATION_SEGMENTS: u32 = 64;
/// The longest paths that a render may ask for: a closed scene that absorbs nothing never ends one.
pub const MAX_DEPTH: u32 = 1024;

/// Settings of path tracing.
#[derive(Clone, Debug, PartialEq)]
pub struct PathSettings {
    /// Longest path, in segments, in 1..=[`MAX_DEPTH`]: 1 is directly visible emission, 2 adds direct light. Default 8.
    pub max_depth: u32,
    /// Spread samples over the pixel instead of sending them through its centre. Default off.
    pub jitter: bool,
    /// Russian roulette from the fourth segment on. Default off.
    pub roulette: bool,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self { max_depth: 8, jitter: false, roulette: false }
    }
}

/// What to render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Image width in pixels, in 1..=[`MAX_SIDE`].
    pub width: u32,
    /// Image height in pixels, in 1..=[`MAX_SIDE`].
    pub height: u32,
    /// Samples a pixel, not zero.
    pub samples: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Settings of the technique.
    pub path: PathSettings,
    /// Most samples of a pixel in one dispatch, rounded down to a power of two; `None` suits the image size.
    /// It does not change the image.
    pub dispatch_samples: Option<u32>,
}

/// One sample a pixel of 512 x 512 pixels.
impl Default for RenderSettings {
    fn default() -> Self {
        Self { width: 512, height: 512, samples: 1, seed: 0, path: PathSettings::default(), dispatch_samples: None }
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Dispatches that are done.
    pub done: u64,
    /// Dispatches in all.
    pub total: u64,
}

/// A rendered image.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Mean radiance.
    pub image: Image,
    /// How many dispatches it took.
    pub dispatches: u64,
    /// How many samples were dropped because they were not finite or the device cut them short.
    pub dropped_samples: u64,
}

/// Renders `scene`; `observe` is called after each dispatch and may stop the render.
///
/// # Errors
/// [`Error::Setting`] for settings out of range, [`Error::Memory`] if the buffers would take more than 80 % of the
/// memory, [`Error::Interrupted`] if `observe` breaks, and whatever the executor reports.
pub fn render(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    settings: &RenderSettings,
    observe: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Rendered, Error> {
    check(scene, settings)?;
    let plan = path_plan(scene, settings);
    let total = plan.pass_count;
    let words = executor.run(plan, &mut |step| observe(Progress { done: step.done, total }))?;
    let pixels: &[FilmPixel] = words.first().map_or(&[], |words| bytemuck::cast_slice(words));
    let image =
        Image { width: settings.width, height: settings.height, pixels: pixels.iter().map(|p| p.sum).collect() };
    let dropped_samples = pixels.iter().map(|p| p.dropped as u64).sum();
    Ok(Rendered { image, dispatches: total, dropped_samples })
}

/// Whether the settings are in range and the buffers fit: what [`render`] checks first.
///
/// # Errors
/// [`Error::Setting`] and [`Error::Memory`].
pub fn check(scene: &SceneBuffers, settings: &RenderSettings) -> Result<(), Error> {
    check_settings(settings)?;
    // beside the plan: the words read back, the image and its encoded form
    let copies = 3 * u64::from(settings.width) * u64::from(settings.height) * size_of::<FilmPixel>() as u64;
    let bytes = path_plan(scene, settings).bytes() + copies;
    memory::check(bytes, "this render", "choose a smaller size")
}

fn check_settings(settings: &RenderSettings) -> Result<(), Error> {
    let (width, height) = (settings.width, settings.height);
    let problem = if width == 0 || height == 0 {
        format!("an image of {width}x{height} pixels has no pixel; give both sides at least 1")
    } else if width > MAX_SIDE || height > MAX_SIDE {
        format!("an image of {width}x{height} pixels is too large; the longest side is {MAX_SIDE}")
    } else if settings.samples == 0 {
        "0 samples a pixel make no image; give at least 1".to_owned()
    } else if settings.path.max_depth == 0 {
        "paths of 0 segments carry no light; give a depth of at least 1".to_owned()
    } else if settings.path.max_depth > MAX_DEPTH {
        format!("paths of {} segments are too long; give a depth of at most {MAX_DEPTH}", settings.path.max_depth)
    } else if settings.dispatch_samples == Some(0) {
        "dispatches of 0 samples never end; give at least 1".to_owned()
    } else {
        return Ok(());
    };
    Err(Error::Setting(problem))
}

/// Samples in a block, as a power of two.
fn block_log2(settings: &RenderSettings) -> u32 {
    let fitting = || {
        let pixels = settings.width * settings.height;
        DISPATCH_SAMPLES_LOG2.saturating_sub(pixels.ilog2())
    };
    let loops = (INVOCATION_SEGMENTS / settings.path.max_depth).max(1).ilog2();
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

/// Buffers of a plan for path tracing.
const GEOMETRY: usize = 0;
const ATTRIBUTES: usize = 1;
const TEXELS: usize = 2;

/// The passes of a render, for settings that [`check`] accepts: what [`render`] runs.
pub fn path_plan<'a>(scene: &'a SceneBuffers, settings: &'a RenderSettings) -> FramePlan<'a> {
    let largest = block_log2(settings);
    let samples = settings.samples;
    let arena =
        |name, words: &std::sync::Arc<[u32]>| Buffer { name, words: words.len(), contents: Some(words.clone()) };
    let mut buffers = vec![
        arena("geometry", &scene.geometry),
        arena("attributes", &scene.attributes),
        arena("texels", &scene.texels),
    ];
    let film = Film::new(&mut buffers, [settings.width, settings.height], samples, largest);
    let blocks = block_count(samples, largest);
    FramePlan {
        buffers,
        outputs: vec![film.output()],
        passes: Box::new(PathPasses { scene, settings, blocks: Box::new(aligned_blocks(samples, largest)), film }),
        // merging n blocks into one takes n - 1 additions
        pass_count: blocks + (blocks - 1) + 1,
        scene: Some(scene),
    }
}

/// Makes the passes: each block is traced into a plane of the film.
struct PathPasses<'a> {
    scene: &'a SceneBuffers,
    settings: &'a RenderSettings,
    blocks: Box<dyn Iterator<Item = (u32, u32)>>,
    film: Film,
}

impl PathPasses<'_> {
    fn trace(&mut self, first: u32, log2: u32) -> Option<Result<Pass, Error>> {
        let plane = self.film.open(log2)?;
        let s = self.settings;
        let flag = |on, bit| if on { bit } else { 0 };
        let params = PathParams {
            scene: self.scene.header,
            camera: self.scene.camera.params(s.width, s.height),
            width: s.width,
            height: s.height,
            first_sample: first,
            block_log2: log2,
            seed: s.seed,
            max_depth: s.path.max_depth,
            flags: flag(s.path.jitter, PATH_JITTER) | flag(s.path.roulette, PATH_ROULETTE),
            reserved: 0,
        };
        let bound = [("geometry", GEOMETRY), ("attributes", ATTRIBUTES), ("texels", TEXELS), ("film", plane)];
        Some(Pass::new(&path::DESC, &[self.scene.features], &params, &bound, [s.width, s.height]))
    }
}

impl Iterator for PathPasses<'_> {
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
                let settings = RenderSettings {
                    width: 1,
                    height: 1,
                    samples,
                    seed: 0,
                    path: PathSettings::default(),
                    dispatch_samples: Some(1 << largest),
                };
                let plan = path_plan(&scene, &settings);
                let mut used = std::collections::BTreeSet::new();
                let mut passes = 0;
                for pass in plan.passes {
                    used.extend(pass.expect("a pass").bindings.iter().copied().filter(|id| *id > TEXELS));
                    passes += 1;
                }
                assert_eq!(
                    (passes, used.len()),
                    (plan.pass_count, plan.buffers.len() - TEXELS - 1),
                    "{samples} {largest}"
                );
            }
        }
    }
}
