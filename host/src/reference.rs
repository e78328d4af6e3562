//! Reference images whose own noise is known.
//!
//! A reference has two halves that share no random number. Each is the mean, in `f64`, of batches of
//! [`BATCH_SAMPLES`] samples a pixel; a batch is a render with a seed of its own. With halves a and b of m and n
//! samples the reference is r = (m a + n b) / (m + n), and (a - b)² m n / (m + n)² is an unbiased estimate of the
//! variance of each of its values. It has one degree of freedom: useless for a single pixel, precise in a mean over
//! the image.
//!
//! In a cache each half is an EXR file that says what it is of, and more batches can be added to it. A reference that
//! was continued agrees with one that was made at once to the rounding of `f32`. Devices that give the CPU's bits share
//! their references; any other has its own, and so has each version of the kernels.
//!
//! ```
//! use restir_host::reference::{BATCH_SAMPLES, Goal, Picture, make};
//! use restir_host::technique::{Technique, path::PathSettings};
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let picture = Picture { size: [16, 16], integral: PathSettings { max_depth: 3, ..PathSettings::default() }.integral() };
//! let goal = Goal { samples: 4 * u64::from(BATCH_SAMPLES), time: None };
//! let reference = make(&mut CpuExecutor::new()?, &scene, picture, None, goal, &mut |_| Ok(()))?;
//!
//! // two batches in each half; the mean radiance is known to less than one part in a hundred
//! assert_eq!(reference.samples(), 256);
//! let values = reference.values();
//! let mean = values.iter().sum::<f64>() / values.len() as f64;
//! assert!(reference.standard_error_of_mean() < 0.01 * mean);
//! # Ok::<(), Error>(())
//! ```

use crate::settings::Choice;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use restir_shared::technique::path::PathParams;

use crate::checkpoint::hash_code;
use crate::exec::Executor;
use crate::image::{Image, read_exr, read_exr_metadata, write_exr};
use crate::output;
use crate::render::{Progress, Render, Rendered};
use crate::{Error, buffers::SceneBuffers, technique::Integral, technique::path::PathSettings};

/// Samples a pixel in a batch.
#[doc(hidden)]
pub const BATCH_SAMPLES: u32 = 64;
/// Changes with what the cache means; a reference of another version is made anew.
const FORMAT: &str = "2";
/// Seeds from here on are those of references; others should stay below.
pub const FIRST_SEED: u32 = 1 << 31;
/// The files of the halves.
const HALVES: [&str; 2] = ["half0.exr", "half1.exr"];
/// How long a killed program may have worked for nothing.
const SAVE_EVERY: Duration = Duration::from_secs(30);

/// What a reference is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What the pixels converge to.
    pub integral: Integral,
}

/// How good a reference has to be, and how long that may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Samples a pixel over both halves; rounded up to whole batches of both.
    pub samples: u64,
    /// No batch begins after this time, except for the first of each half.
    pub time: Option<Duration>,
}

/// One half of a reference.
#[derive(Clone, Debug, Default, PartialEq)]
struct Half {
    /// Mean of the batches: three values a pixel.
    mean: Vec<f64>,
    batches: u32,
    dropped: u64,
}

/// A reference image.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    size: [u32; 2],
    halves: [Half; 2],
}

impl Half {
    fn add(&mut self, batch: &Rendered) {
        let values = batch.image.pixels.as_flattened();
        self.mean.resize(values.len(), 0.0);
        self.batches += 1;
        let share = 1.0 / f64::from(self.batches);
        self.mean.iter_mut().zip(values).for_each(|(mean, &value)| *mean += (f64::from(value) - *mean) * share);
        self.dropped += batch.dropped_samples;
    }
}

impl Reference {
    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples a pixel over both halves.
    pub fn samples(&self) -> u64 {
        self.halves.iter().map(|half| u64::from(half.batches) * u64::from(BATCH_SAMPLES)).sum()
    }

    /// Samples that were dropped because they were not finite: each makes the reference too dark.
    pub fn dropped_samples(&self) -> u64 {
        self.halves.iter().map(|half| half.dropped).sum()
    }

    /// The reference: three values a pixel, rows from top to bottom.
    pub fn values(&self) -> Vec<f64> {
        let [a, b] = self.shares();
        self.pairs().map(|(x, y)| a * x + b * y).collect()
    }

    /// Estimated variance of each of [`Self::values`].
    #[doc(hidden)]
    pub fn variances(&self) -> Vec<f64> {
        let [a, b] = self.shares();
        self.pairs().map(|(x, y)| (x - y) * (x - y) * a * b).collect()
    }

    /// The standard error of the mean over all values. The channels of a pixel are dependent, pixels are not.
    #[doc(hidden)]
    pub fn standard_error_of_mean(&self) -> f64 {
        let [a, b] = self.shares();
        let differences: Vec<f64> = self.pairs().map(|(x, y)| x - y).collect();
        let squares: f64 = differences.chunks_exact(3).map(|pixel| pixel.iter().sum::<f64>().powi(2)).sum();
        (squares * a * b).sqrt() / differences.len().max(1) as f64
    }

    /// The reference as an image.
    pub fn image(&self) -> Image {
        self.to_image(&self.values())
    }

    /// The estimated standard error of every value as an image.
    pub fn error_image(&self) -> Image {
        self.to_image(&self.variances().iter().map(|variance| variance.sqrt()).collect::<Vec<_>>())
    }

    fn to_image(&self, values: &[f64]) -> Image {
        let pixels = values.as_chunks::<3>().0.iter().map(|pixel| pixel.map(|value| value as f32)).collect();
        Image { width: self.size[0], height: self.size[1], pixels }
    }

    /// As it is in a cache, so that a reference is the same before and after.
    fn rounded(mut self) -> Self {
        let means = self.halves.iter_mut().flat_map(|half| &mut half.mean);
        means.for_each(|value| *value = f64::from(*value as f32));
        self
    }

    /// The part of all samples that each half has.
    fn shares(&self) -> [f64; 2] {
        let [a, b] = self.halves.each_ref().map(|half| f64::from(half.batches));
        [a / (a + b), b / (a + b)]
    }

    fn pairs(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.halves[0].mean.iter().copied().zip(self.halves[1].mean.iter().copied())
    }
}

/// Whether the picture is in range and its buffers fit: what [`make`] checks first.
///
/// # Errors
/// As of [`Render::check`].
pub fn check(scene: &SceneBuffers, picture: Picture) -> Result<(), Error> {
    batch_of(picture).check(scene)
}

/// Makes the reference of a scene by path tracing, or continues the one in the folder `cache`. `observe` hears how many batches
/// of both halves are done.
///
/// # Errors
/// As of [`Render::render`]; that of `observe`, after what is done was saved; [`Error::File`] if the cache cannot be written.
/// What cannot be read from it is made anew.
pub fn make(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    picture: Picture,
    cache: Option<&Path>,
    goal: Goal,
    observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
) -> Result<Reference, Error> {
    let batch = batch_of(picture);
    batch.check(scene)?;
    let origin = executor.describe().origin();
    let store = cache.map(|cache| Store::new(cache, scene, &batch, &origin)).transpose()?;
    let save = |reference: &Reference| store.as_ref().map_or(Ok(()), |store| store.save(reference));
    // a half that is missing, damaged or of something else is empty
    let halves = [0, 1].map(|half| store.as_ref().and_then(|store| store.read(half)).unwrap_or_default());
    let mut reference = Reference { size: picture.size, halves };
    let start = Instant::now();
    let total = 2 * goal.samples.max(1).div_ceil(2 * u64::from(BATCH_SAMPLES));
    let mut saved = Instant::now();
    let mut changed = false;
    let outcome = loop {
        let [a, b] = reference.halves.each_ref().map(|half| u64::from(half.batches));
        let late = a > 0 && a == b && goal.time.is_some_and(|time| start.elapsed() >= time);
        if (a + b >= total && a > 0 && b > 0) || late {
            break Ok(());
        }
        let index = usize::from(b < a);
        let half = &mut reference.halves[index];
        let batch = Render { seed: FIRST_SEED + 2 * half.batches + index as u32, ..batch.clone() };
        match batch.render_observed(scene, executor, &mut |_| observe(Progress { done: a + b, total })) {
            Ok(rendered) => half.add(&rendered),
            Err(error) => break Err(error),
        }
        changed = true;
        if saved.elapsed() > SAVE_EVERY {
            save(&reference)?;
            (saved, changed) = (Instant::now(), false);
        }
    };
    if changed {
        save(&reference)?;
    }
    outcome.map(|()| reference.rounded())
}

/// A batch with the seed 0.
fn batch_of(Picture { size, integral }: Picture) -> Render {
    Render { count: BATCH_SAMPLES, ..Render::new(size, PathSettings::of(integral)) }
}

/// Names the integral and the origin of its bits: the arenas, the parameters of the pass that traces and the code, in 16
/// hexadecimal digits.
fn digest(scene: &SceneBuffers, batch: &Render, origin: &str) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut plan = batch.plan(scene);
    for words in plan.buffers.iter().filter_map(|buffer| buffer.contents.as_ref()) {
        hasher.update(&(words.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(words));
    }
    let pass = plan.passes.next().and_then(Result::ok);
    if let Some((params, constants)) = pass.and_then(|pass| Some((pass.params::<PathParams>()?, pass.constants))) {
        hasher.update(bytemuck::cast_slice(&constants));
        // how samples are split over dispatches does not matter
        hasher.update(bytemuck::bytes_of(&PathParams { first_sample: 0, block_log2: 0, seed: 0, ..params }));
    }
    hasher.update(FORMAT.as_bytes());
    hasher.update(origin.as_bytes());
    hash_code(&mut hasher);
    hasher.finalize().to_hex().as_str().chars().take(16).collect()
}

/// The files of a reference in a cache.
struct Store {
    folder: PathBuf,
    digest: String,
    size: [u32; 2],
    metadata: Vec<(String, String)>,
}

impl Store {
    fn new(cache: &Path, scene: &SceneBuffers, batch: &Render, origin: &str) -> Result<Self, Error> {
        let digest = digest(scene, batch, origin);
        let Integral { max_depth, jitter, filter, multiscatter } = batch.technique.integral();
        let folder = cache.join(&digest);
        output::check_writable_in(&folder, HALVES)?;
        let pairs = [
            ("format", FORMAT.to_owned()),
            ("digest", digest.clone()),
            ("technique", batch.technique.about().name.to_owned()),
            ("bits", origin.to_owned()),
            ("max_depth", max_depth.to_string()),
            ("jitter", jitter.to_string()),
            ("filter", filter.name().to_owned()),
            ("multiscatter", multiscatter.to_string()),
            ("batch_samples", BATCH_SAMPLES.to_string()),
        ];
        let metadata = pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        Ok(Self { folder, digest, size: [batch.width, batch.height], metadata })
    }

    fn path(&self, half: usize) -> PathBuf {
        self.folder.join(HALVES[half])
    }

    fn read(&self, half: usize) -> Option<Half> {
        let path = self.path(half);
        let metadata = read_exr_metadata(&path).ok()?;
        let value = |key: &str| metadata.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str());
        let same = value("format") == Some(FORMAT)
            && value("digest") == Some(&self.digest)
            && value("batch_samples") == Some(&BATCH_SAMPLES.to_string());
        let (batches, dropped) = (value("batches")?.parse().ok()?, value("dropped_samples")?.parse().ok()?);
        let image = read_exr(&path).ok()?;
        let values = image.pixels.as_flattened();
        let sound = same
            && batches > 0
            && [image.width, image.height] == self.size
            && values.iter().all(|x| x.is_finite())
            && value("checksum") == Some(&checksum(half, batches, dropped, values));
        sound.then(|| Half { mean: values.iter().map(|&value| f64::from(value)).collect(), batches, dropped })
    }

    fn save(&self, reference: &Reference) -> Result<(), Error> {
        let _making = output::making();
        output::make_folder(&self.folder)?;
        (0..2).filter(|&half| reference.halves[half].batches > 0).try_for_each(|half| {
            let Half { mean, batches, dropped } = &reference.halves[half];
            let mut metadata = self.metadata.clone();
            let numbers = [("half", half as u64), ("batches", u64::from(*batches)), ("dropped_samples", *dropped)];
            metadata.extend(numbers.map(|(key, value)| (key.to_owned(), value.to_string())));
            let image = reference.to_image(mean);
            let checksum = checksum(half, *batches, *dropped, image.pixels.as_flattened());
            metadata.push(("checksum".to_owned(), checksum));
            write_exr(&self.path(half), &image, &metadata)
        })
    }
}

/// The hash of all that a half holds, so that a file whose bits have changed is not believed.
fn checksum(half: usize, batches: u32, dropped: u64, values: &[f32]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("{half} {batches} {dropped}").as_bytes());
    hasher.update(bytemuck::cast_slice(values));
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::CpuExecutor;
    use crate::exec::{Description, Flavour, Parity};
    use crate::scene::Scene;
    use crate::technique::PixelFilter;

    const SIZE: u32 = 6;

    const INTEGRAL: Integral = Integral { max_depth: 3, jitter: false, filter: PixelFilter::Box, multiscatter: true };

    fn reference(cache: Option<&Path>, samples: u64, integral: Integral) -> Reference {
        made(cache, Goal { samples, time: None }, integral, &mut |_| Ok(())).unwrap()
    }

    fn made(
        cache: Option<&Path>,
        goal: Goal,
        integral: Integral,
        observe: &mut dyn FnMut(Progress) -> Result<(), Error>,
    ) -> Result<Reference, Error> {
        let scene = SceneBuffers::build(&Scene::load("furnace")?)?;
        make(&mut CpuExecutor::with_threads(1)?, &scene, Picture { size: [SIZE; 2], integral }, cache, goal, observe)
    }

    #[test]
    fn the_stated_errors_are_those_of_the_known_radiance() {
        let reference = reference(None, 4096, INTEGRAL);
        assert_eq!(reference.samples(), 4096);
        let exact = 2.0 * (1.0 - 0.5_f64.powi(3));
        let values = reference.values();
        let count = values.len() as f64;
        let actual = values.iter().map(|x| (x - exact).powi(2)).sum::<f64>() / count;
        let stated = reference.variances().iter().sum::<f64>() / count;
        // 36 independent pixels: each mean square has a relative standard error of sqrt(2/36), their ratio of a third
        assert!(actual / stated > 0.3 && actual / stated < 3.0, "{actual} {stated}");
        let error = (values.iter().sum::<f64>() / count - exact).abs();
        assert!(error < 4.0 * reference.standard_error_of_mean(), "{error}");
        // all channels of the furnace are equal, so the mean has the error of a third of its values
        let expected = (stated / f64::from(SIZE * SIZE)).sqrt();
        assert!((reference.standard_error_of_mean() / expected - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_cached_reference_is_continued_and_others_are_not_taken_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Some(folder.path());
        let first = reference(cache, 256, INTEGRAL);
        let same = reference(cache, 100, INTEGRAL);
        assert_eq!((same.samples(), &same.image()), (256, &first.image()), "nothing was missing");
        let more = reference(cache, 512, INTEGRAL);
        let whole = reference(None, 512, INTEGRAL);
        assert_eq!((more.samples(), whole.samples()), (512, 512));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(more.values().iter().zip(whole.values()).all(|(&a, b)| close(a, b)), "it is the same estimate");
        let deeper = Integral { max_depth: 4, ..INTEGRAL };
        let spread = Integral { jitter: true, ..INTEGRAL };
        let filtered = Integral { filter: PixelFilter::BlackmanHarris, ..spread };
        for other in [deeper, spread, filtered] {
            assert_eq!(reference(cache, 128, other).samples(), 128);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn devices_with_other_bits_have_references_of_their_own() {
        let cpu = Description { executor: "cpu", adapter: None, flavour: Flavour::Exact, parity: None };
        let gpu = Description { adapter: Some("a GPU".to_owned()), parity: Some(Parity::Exact), ..cpu.clone() };
        let fast = Description { flavour: Flavour::Fast, ..gpu.clone() };
        let off = Description { parity: Some(Parity::Approximate { max_ulp: 1 }), ..gpu.clone() };
        assert_eq!(cpu.origin(), gpu.origin());
        assert!(fast.origin() != gpu.origin() && off.origin() != gpu.origin() && fast.origin() != off.origin());
    }

    #[test]
    fn a_damaged_cache_is_made_anew() {
        let folder = tempfile::tempdir().unwrap();
        let whole = reference(Some(folder.path()), 128, INTEGRAL);
        let entry = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap();
        let file = entry.path().join("half1.exr");
        let bytes = std::fs::read(&file).unwrap();
        std::fs::write(&file, b"damaged").unwrap();
        assert_eq!(reference(Some(folder.path()), 128, INTEGRAL).image(), whole.image());
        for at in (0..bytes.len()).step_by(37) {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            std::fs::write(&file, &flipped).unwrap();
            let again = reference(Some(folder.path()), 128, INTEGRAL);
            assert_eq!((again.image(), again.samples()), (whole.image(), 128), "a bit of byte {at}");
        }
    }

    #[test]
    fn an_interrupted_reference_keeps_its_batches() {
        let folder = tempfile::tempdir().unwrap();
        let goal = Goal { samples: 1024, time: None };
        let at_once = made(Some(folder.path()), goal, INTEGRAL, &mut |_| Err(Error::Interrupted));
        assert!(matches!(at_once, Err(Error::Interrupted)));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "an empty folder is left");
        let stop = &mut |progress: Progress| if progress.done < 4 { Ok(()) } else { Err(Error::Interrupted) };
        let outcome = made(Some(folder.path()), goal, INTEGRAL, stop);
        assert!(matches!(outcome, Err(Error::Interrupted)));
        assert_eq!(reference(Some(folder.path()), 1, INTEGRAL).samples(), 4 * u64::from(BATCH_SAMPLES));
    }

    #[test]
    fn without_time_each_half_has_one_batch() {
        let goal = Goal { samples: 1 << 40, time: Some(Duration::ZERO) };
        assert_eq!(made(None, goal, INTEGRAL, &mut |_| Ok(())).unwrap().samples(), 2 * u64::from(BATCH_SAMPLES));
    }
}
