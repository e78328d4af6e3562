//! `restir reference`

use std::path::{Path, PathBuf};
use std::time::Duration;

use restir::advanced::error::explained;
use restir::advanced::output;
use restir::advanced::reference::{self, Goal, Picture, Reference};
use restir::render::Progress;
use restir::technique::{Integral, Technique, path::PathSettings};
use restir::{Error, buffers::SceneBuffers, exec::Executor, image::write_exr, scene::Scene};

use super::parse::{Size, natural, require};
use super::scene::{Additions, refuse_overwriting};
use super::technique::PixelArguments;
use super::{console, device, environment, interrupt, metadata, progress::reported};

/// The size of what is measured: small, so that references are good.
pub(super) const MEASURED_SIZE: [u32; 2] = [96, 96];

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, or a .gltf or .glb file.
    scene: PathBuf,
    /// Samples per pixel of both halves together, rounded up to a multiple of 128. Those that the cache has already
    /// count.
    #[arg(long, default_value = "16384", value_parser = natural::<u64>, allow_hyphen_values = true)]
    spp: u64,
    /// Stop after this many seconds, once the batch in work is done.
    #[arg(long, value_parser = natural::<u64>, allow_hyphen_values = true)]
    seconds: Option<u64>,
    /// Also write the reference to this EXR file.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Also write the standard error of every value to this EXR file.
    #[arg(long)]
    error: Option<PathBuf>,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    cache: Cache,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// What defines the picture, whatever the technique.
#[derive(Debug, clap::Args)]
pub struct PictureArguments {
    /// Image size in pixels, as WIDTHxHEIGHT; if not given 96x96, or for explain the scene's or 512x512.
    #[arg(long, allow_hyphen_values = true)]
    pub(super) size: Option<Size>,
    /// Longest path in segments; 8 if not given.
    #[arg(long, alias = "depth", value_parser = natural::<u32>, allow_hyphen_values = true)]
    pub(super) max_depth: Option<u32>,
    #[command(flatten)]
    pub(super) within_pixel: PixelArguments,
    #[command(flatten)]
    /// What is added to the scene.
    pub additions: Additions,
}

/// Where references are kept.
#[derive(Debug, clap::Args)]
pub struct Cache {
    /// Folder that keeps references; RESTIR_CACHE, or restir in the user's cache folder, if not given.
    #[arg(long)]
    cache: Option<PathBuf>,
}

impl PictureArguments {
    /// The size, which is the given one if none was asked for.
    pub(super) fn size(&self, default: [u32; 2]) -> Result<[u32; 2], Error> {
        self.size.map_or(Ok(default), Size::sides)
    }

    /// What is measured; `jitter` unless it was asked for.
    ///
    /// # Errors
    /// [`Error::Setting`] if the size is too large.
    pub fn measured(&self, jitter: bool) -> Result<Picture, Error> {
        let path = PathSettings::default().integral();
        let max_depth = self.max_depth.unwrap_or(path.max_depth);
        let jitter = self.within_pixel.jitter().unwrap_or(jitter);
        let integral = Integral { max_depth, jitter, ..path };
        Ok(Picture { size: self.size(MEASURED_SIZE)?, integral })
    }

    /// The scene with what is added to it, and its buffers.
    ///
    /// # Errors
    /// As of [`Scene::open`] and [`SceneBuffers::build`], and if something cannot be added.
    pub fn load(&self, name_or_path: &Path, size: [u32; 2]) -> Result<(Scene, SceneBuffers), Error> {
        let mut scene = self.additions.open(name_or_path)?;
        self.additions.complete(&mut scene, size)?;
        let buffers = self.additions.buffers(&scene)?;
        Ok((scene, buffers))
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let written = || [&arguments.output, &arguments.error].into_iter().flatten();
    written().try_for_each(|path| output::check_writable(path))?;
    refuse_overwriting(arguments.picture.additions.inputs(&arguments.scene), written())?;
    let same = arguments.output.is_some() && arguments.output == arguments.error;
    require(!same, format_args!("--output and --error name the same file; give each its own"))?;
    require(arguments.spp > 0, format_args!("0 samples a pixel make no reference; give at least 1"))?;
    let picture = arguments.picture.measured(PathSettings::default().jitter)?;
    let (scene, buffers) = arguments.picture.load(&arguments.scene, picture.size)?;
    refuse_overwriting(&scene.files, written())?;
    reference::check(&buffers, picture)?;
    let mut device = device::open(&arguments.device)?;
    let goal = Goal { samples: arguments.spp, time: arguments.seconds.map(Duration::from_secs) };
    let reference = make(device.as_mut(), &buffers, picture, &arguments.cache, goal)?;
    interrupt::begin_writing();
    let metadata = metadata::of_reference(&scene.name, picture.integral, &reference);
    for (path, image) in [(&arguments.output, reference.image()), (&arguments.error, reference.error_image())] {
        path.as_ref().map_or(Ok(()), |path| write_exr(path, &image, &metadata))?;
    }
    console::print(&describe(&scene.name, &reference))?;
    console::print(&written().map(|path| format!("wrote {}\n", path.display())).collect::<String>())
}

/// Makes or continues a reference and reports how far it is.
///
/// # Errors
/// As of [`restir::advanced::reference::make`].
pub fn make(
    executor: &mut dyn Executor,
    buffers: &SceneBuffers,
    picture: Picture,
    cache: &Cache,
    goal: Goal,
) -> Result<Reference, Error> {
    let cache = cache.cache.clone().or_else(environment::cache);
    if cache.is_none() {
        console::note("warning: there is no folder to keep the reference in; name one by --cache or RESTIR_CACHE");
    }
    let reference = reported("rendering", |observe| {
        reference::make(executor, buffers, picture, cache.as_deref(), goal, &mut |batches| {
            observe(Progress { done: batches.done, total: batches.total })
        })
    })
    .map_err(|error| match (error, &cache) {
        (Error::Interrupted, Some(cache)) => {
            console::note(&format!("what was done of the reference is kept in {}", cache.display()));
            Error::Interrupted
        }
        (Error::File { action: "write", path, source }, Some(cache)) if path.starts_with(cache) => {
            let sentence = format!("{source}; name another folder by --cache or RESTIR_CACHE");
            Error::cannot_write(&path, explained(sentence, source))
        }
        (error, _) => error,
    })?;
    if reference.dropped_samples() > 0 {
        console::note(&format!(
            "warning: {} samples of the reference were dropped, not finite or cut short by the device: it is too dark",
            reference.dropped_samples()
        ));
    }
    Ok(reference)
}

fn describe(scene: &str, reference: &Reference) -> String {
    let [width, height] = reference.size();
    let values = reference.values();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = reference.variances().iter().sum::<f64>() / count;
    let rows = [
        ("scene", scene.to_owned()),
        ("image", format!("{width} x {height} pixels")),
        ("samples", format!("{} per pixel, in two halves", reference.samples())),
        ("mean", format!("{mean:.6} +- {:.6}", reference.standard_error_of_mean())),
        ("standard error", format!("{:.3e} per value, root mean square", variance.sqrt())),
    ];
    rows.iter().map(|(name, value)| format!("{name:16} {value}\n")).collect()
}
