//! Parts of an image, which are rendered apart and merged: the bits of one render, however it is split.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, GpuExecutor};
use restir_host::image::Image;
use restir_host::part::{Part, PartFile, Portion, Tile, Unit, merge, noise};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_host::technique::{Technique, configure, named};
use restir_tests::device;
use restir_tests::random::SplitMix;
use restir_tests::suite::{Trial, ensure};
use std::ops::Range;
use tempfile::TempDir;

/// Scene, settings of path tracing: all kernels that it has.
const SUBJECTS: [(&str, &[&str]); 6] = [
    ("cornell", &[]),
    ("cornell", &["filter=blackman-harris", "roulette=on"]),
    ("toys", &["jitter=off", "sampler=independent"]),
    ("foliage", &[]),
    ("candles", &["longest_walk=64"]),
    ("cube", &["subsurface=hybrid"]),
];
/// Splits of each of the subjects.
const SPLITS: u64 = 18;
const TECHNIQUES: [&str; 4] = ["restir-di", "restir-pt", "restir-suffix", "restir-sss"];
/// Splits of each of the techniques by chains, and as many by frames.
const SPLITS_OF_CHAINS: u64 = 12;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("noise of parts is the standard error of their mean", the_noise_is_the_standard_error),
        Trial::test("a file of which a byte differs or lacks is refused", damaged_files_are_refused).first(),
        Trial::test("parts of another version, device or nonsense are refused", foreign_parts_are_refused).first(),
    ];
    trials.extend(device::trials(|adapter| {
        let of_samples = SUBJECTS.map(|(scene, settings)| {
            let name = format!("{} in tiles and samples", [&[scene], settings].concat().join(" "));
            adapter.trial(&name, move |executor| splits_of_samples(executor, scene, settings))
        });
        let of_frames = TECHNIQUES.map(|technique| {
            adapter.trial(&format!("{technique} in chains and frames"), move |executor| {
                splits_of_frames(executor, technique)
            })
        });
        of_samples.into_iter().chain(of_frames).collect()
    }));
    trials
}

/// Whatever renders a part: the CPU, or the adapter.
struct Either<'a> {
    cpu: CpuExecutor,
    gpu: &'a mut GpuExecutor,
}

impl Either<'_> {
    fn any(&mut self, random: &mut SplitMix) -> &mut dyn Executor {
        if random.below(2) == 0 { &mut self.cpu } else { &mut *self.gpu }
    }
}

/// Parts in files of a folder of their own.
struct Files {
    folder: TempDir,
    files: Vec<PartFile>,
}

impl Files {
    fn new() -> Result<Self, Failed> {
        Ok(Self { folder: tempfile::tempdir()?, files: Vec::new() })
    }

    fn add(&mut self, part: &Part) -> Result<(), Failed> {
        let path = self.folder.path().join(format!("{}.part", self.files.len()));
        part.write(&path)?;
        self.files.push(PartFile::open(&path)?);
        Ok(())
    }

    /// What becomes of them in another order.
    fn merged(mut self, random: &mut SplitMix) -> Result<Image, Failed> {
        for last in (1..self.files.len()).rev() {
            self.files.swap(last, random.below(last + 1));
        }
        Ok(merge(&self.files)?.image)
    }
}

fn technique(name: &str, settings: &[&str]) -> Result<Box<dyn Technique>, Failed> {
    let mut technique = named(name)?;
    configure(technique.as_mut(), settings)?;
    Ok(technique)
}

/// Cuts a tile or a range in two, again and again.
fn split(random: &mut SplitMix, tile: Tile, range: Range<u32>, cuts: u32, parts: &mut Vec<Portion>) {
    let Tile { x, y, width, height } = tile;
    let sizes = [width, height, range.end - range.start];
    let axis = random.below(3);
    if cuts == 0 || sizes[axis] < 2 {
        parts.push(Portion { unit: Unit::Samples, range, tile: Some(tile) });
        return;
    }
    let at = 1 + random.below(sizes[axis] as usize - 1) as u32;
    let (tiles, middle) = match axis {
        0 => ([Tile { width: at, ..tile }, Tile { x: x + at, width: width - at, ..tile }], None),
        1 => ([Tile { height: at, ..tile }, Tile { y: y + at, height: height - at, ..tile }], None),
        _ => ([tile; 2], Some(range.start + at)),
    };
    let ranges = middle.map_or([range.clone(), range.clone()], |middle| [range.start..middle, middle..range.end]);
    for (tile, range) in tiles.into_iter().zip(ranges) {
        split(random, tile, range, cuts - 1, parts);
    }
}

fn splits_of_samples(gpu: &mut GpuExecutor, scene: &str, settings: &[&str]) -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load(scene)?)?;
    let mut either = Either { cpu: CpuExecutor::inline(), gpu };
    let mut random = SplitMix::new(53);
    for seed in 0..SPLITS {
        let size = [1 + random.below(30), 1 + random.below(20)].map(|side| side as u32);
        let count = 1 + random.below(40) as u32;
        let render = Render { count, seed: seed as u32, ..Render::new(size, technique("path", settings)?) };
        let (mut portions, mut files) = (Vec::new(), Files::new()?);
        let whole = Tile { x: 0, y: 0, width: size[0], height: size[1] };
        split(&mut random, whole, 0..count, 2, &mut portions);
        for portion in &portions {
            files.add(&Part::render(either.any(&mut random), &scene, &render, portion, &mut |_| Ok(()))?)?;
        }
        let expected = render.render(&scene, &mut either.cpu)?.image;
        ensure(files.merged(&mut random)? == expected, || format!("{count} samples of {size:?} in {portions:?}"))?;
    }
    Ok(())
}

/// Cuts a range into some.
fn ranges(random: &mut SplitMix, count: u32) -> Vec<Range<u32>> {
    let mut cuts: Vec<u32> = (0..3).map(|_| random.below(count as usize) as u32).chain([0, count]).collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts.windows(2).map(|ends| ends[0]..ends[1]).collect()
}

fn splits_of_frames(gpu: &mut GpuExecutor, name: &str) -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let mut either = Either { cpu: CpuExecutor::inline(), gpu };
    let mut random = SplitMix::new(71);
    for seed in 0..SPLITS_OF_CHAINS as u32 {
        let count = 2 + random.below(8) as u32;
        let render =
            Render { seed: 100 * seed, count, accumulate: true, ..Render::new([17, 11], technique(name, &[])?) };
        let by_frames = by_frames(&mut either, &mut random, &scene, &render)?;
        ensure(by_frames == render.render(&scene, &mut either.cpu)?.image, || format!("{name}, {count} frames"))?;
        let chains = Render { count: 2, accumulate: seed % 2 == 0, ..render };
        let (mut apart, mut whole) = (Files::new()?, Files::new()?);
        for range in ranges(&mut random, count) {
            let portion = Portion { unit: Unit::Chains, range, tile: None };
            apart.add(&Part::render(either.any(&mut random), &scene, &chains, &portion, &mut |_| Ok(()))?)?;
        }
        let all = Portion { unit: Unit::Chains, range: 0..count, tile: None };
        whole.add(&Part::render(&mut either.cpu, &scene, &chains, &all, &mut |_| Ok(()))?)?;
        ensure(apart.merged(&mut random)? == whole.merged(&mut random)?, || format!("{name}, {count} chains"))?;
    }
    Ok(())
}

/// A chain whose state goes from part to part; every third part finds none, and begins at frame 0.
fn by_frames(
    either: &mut Either<'_>,
    random: &mut SplitMix,
    scene: &SceneBuffers,
    render: &Render,
) -> Result<Image, Failed> {
    let mut files = Files::new()?;
    let path = files.folder.path().join("state");
    let mut left = 0;
    for (index, range) in ranges(random, render.count).into_iter().enumerate() {
        let state = (index % 3 != 2).then_some(path.as_path());
        let expected = if state.is_some() { std::mem::replace(&mut left, range.end) } else { 0 };
        let portion = Portion { unit: Unit::Frames, range, tile: None };
        let executor = either.any(random);
        let (part, from) = Part::render_from(executor, scene, render, &portion, state, &mut |_| Ok(()))?;
        ensure(from == expected, || format!("from {from} instead of {expected}"))?;
        files.add(&part)?;
    }
    files.merged(random)
}

/// The mean of 16 chains, in parts of two, is said to be as noisy as such means are: 24 of them differ from their mean by that. Over 1536
/// values the variance is known to about 1 / sqrt(23 * 1536 / 10), which is 1.7 %, and the noise to half of that; a tenth is twelve
/// standard errors. Parts that counted chains as if each part had one would miss by 1.41.
fn the_noise_is_the_standard_error() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let cpu = &mut CpuExecutor::inline();
    let render = Render { count: 2, accumulate: true, ..Render::new([32, 16], technique("restir-di", &[])?) };
    let (mut said, mut images) = (0.0, Vec::new());
    for group in 0..24 {
        let (render, mut files) = (Render { seed: 16 * group, ..render.clone() }, Files::new()?);
        for first in (0..16).step_by(2) {
            let portion = Portion { unit: Unit::Chains, range: first..first + 2, tile: None };
            files.add(&Part::render(cpu, &scene, &render, &portion, &mut |_| Ok(()))?)?;
        }
        said += noise(&files.files)?.relative.powi(2) / 24.0;
        images.push(merge(&files.files)?.image);
    }
    let values = |image: &Image| image.pixels.as_flattened().iter().map(|&value| f64::from(value)).collect::<Vec<_>>();
    let images: Vec<Vec<f64>> = images.iter().map(values).collect();
    let (mut variance, mut sum) = (0.0, 0.0);
    for value in 0..images[0].len() {
        let mean = images.iter().map(|image| image[value]).sum::<f64>() / 24.0;
        variance += images.iter().map(|image| (image[value] - mean).powi(2)).sum::<f64>() / 23.0;
        sum += mean;
    }
    let count = images[0].len() as f64;
    let actual = (variance / count).sqrt() / (sum / count);
    let ratio = said.sqrt() / actual;
    ensure((ratio - 1.0).abs() < 0.1, || format!("{ratio}"))?;
    Ok(())
}

/// Cut short at every length and with a bit turned in every byte, of a part of one pixel; nothing is a panic.
fn damaged_files_are_refused() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let render = Render { count: 3, ..Render::new([1, 1], technique("path", &[])?) };
    let portion = Portion { unit: Unit::Samples, range: 1..3, tile: None };
    let part = Part::render(&mut CpuExecutor::inline(), &scene, &render, &portion, &mut |_| Ok(()))?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.part");
    part.write(&path)?;
    let bytes = std::fs::read(&path)?;
    let is_refused = |bytes: &[u8]| -> Result<bool, Failed> {
        std::fs::write(&path, bytes)?;
        let refused = PartFile::open(&path).err().map(|error| error.to_string());
        Ok(refused.is_some_and(|error| error.contains("part of an image; ")))
    };
    for at in 0..bytes.len() {
        ensure(is_refused(&bytes[..at])?, || format!("{at} bytes"))?;
        let mut turned = bytes.clone();
        turned[at] ^= 1 << (at % 8);
        ensure(is_refused(&turned)?, || format!("byte {at}"))?;
    }
    ensure(is_refused(&[&bytes[..], b"x"].concat())?, || "a byte more".to_owned())?;
    ensure(!is_refused(&bytes)?, || "the whole file is refused".to_owned())?;
    Ok(())
}

/// Whole files, whose hash is right, of which the header says something else.
fn foreign_parts_are_refused() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let render = Render { count: 2, ..Render::new([2, 1], technique("path", &[])?) };
    let mut files = Files::new()?;
    for range in [0..1, 1..2] {
        let portion = Portion { unit: Unit::Samples, range, tile: None };
        files.add(&Part::render(&mut CpuExecutor::inline(), &scene, &render, &portion, &mut |_| Ok(()))?)?;
    }
    let path = files.files[1].path().to_owned();
    let whole = std::fs::read(&path)?;
    let (begin, planes) = (22, 2 * 16 + blake3::OUT_LEN);
    let header = String::from_utf8(whole[begin..whole.len() - planes].to_vec())?;
    let changed = |from: &str, to: &str| -> Result<String, Failed> {
        ensure(header.contains(from), || format!("the header has no {from}"))?;
        let header = header.replacen(from, to, 1);
        let sums = &whole[whole.len() - planes..][..32];
        let mut bytes = [&whole[..begin - 8], &(header.len() as u64).to_le_bytes(), header.as_bytes(), sums].concat();
        let hash = blake3::hash(&bytes);
        bytes.extend(hash.as_bytes());
        std::fs::write(&path, bytes)?;
        let merged = PartFile::open(&path).and_then(|part| merge(&[files.files[0].clone(), part]));
        Ok(merged.err().map_or_else(|| "merged".to_owned(), |error| error.to_string()))
    };
    let version = header.split("\"version\",\"").nth(1).ok_or("a version")?[..8].to_owned();
    for (from, to, problem) in [
        (version.as_str(), "00000000", "it is of another version than"),
        ("\"device\",\"exact\"", "\"device\",\"fast\"", "it is of device=fast, and"),
        ("\"size\":[2,1]", "\"size\":[4000000000,4000000000]", "no whole part"),
        ("\"size\":[2,1]", "\"size\":[1,1]", "no whole part"),
        ("\"width\":2", "\"width\":4294967295", "no whole part"),
        ("\"blocks\":[[1,0]]", "\"blocks\":[[1,40]]", "no whole part"),
        ("\"blocks\":[[1,0]]", "\"blocks\":[]", "no whole part"),
        ("\"end\":2", "\"end\":1", "no whole part"),
        ("\"start\":1", "\"start\":0", "no whole part"),
    ] {
        let said = changed(from, to)?;
        ensure(said.contains(problem), || format!("{to}: {said}"))?;
    }
    let same = changed("\"unit\"", "\"unit\"")?;
    ensure(same == "merged", || format!("the part as it was: {same}"))
}
