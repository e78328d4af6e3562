//! `shader probe`: what the size of a single kernel costs, from the compiler to the first dispatch.

use std::path::Path;
use std::time::Instant;

use super::compile::Job;
use super::flavour::Flavour;
use super::manifest::ModuleRecord;
use super::pipeline::finish_module;
use super::toolchain::Toolchain;
use super::workspace::{Workspace, scratch};
use super::{install, limits, post};
use crate::Error;

/// The kernel that the feature `size-probe` adds; it goes beyond the limits on purpose and is never shipped.
const KERNEL: &str = "size_probe";

/// What one device needed.
#[derive(Clone, Debug)]
pub struct DeviceTiming {
    /// Name of the adapter and its driver.
    pub adapter: String,
    /// Seconds to make the pipeline.
    pub pipeline_seconds: f64,
    /// Seconds from submitting the first dispatch to its end.
    pub dispatch_seconds: f64,
}

/// Makes a pipeline of an exact module with the given entry point and dispatches it once, on every adapter.
/// The error is a sentence.
pub type DeviceTimer = fn(module: &[u8], entry: &str) -> Result<Vec<DeviceTiming>, String>;

/// What the build of the probe kernel took.
#[derive(Clone, Debug)]
pub struct BuildTiming {
    /// The finished module.
    pub module: ModuleRecord,
    /// Seconds in rust-gpu for the kernel crate, all other kernels included.
    pub compile_seconds: f64,
    /// Seconds in post-pass, spirv-opt and spirv-val.
    pub finish_seconds: f64,
}

/// Builds the probe kernel, times it on devices if there is a timer, and writes the report.
pub fn run(workspace: &Workspace, timer: Option<DeviceTimer>) -> Result<(), Error> {
    let toolchain =
        Toolchain::find()?.ok_or_else(|| Error::Environment(install::consent_message(&workspace.kernels())))?;
    let (module, build) = build(workspace, &toolchain)?;
    let devices = match timer {
        Some(timer) => timer(&module, KERNEL).map_err(Error::Environment)?,
        None => Vec::new(),
    };
    let report = report(&build, &devices);
    print!("{report}");
    let path = workspace.root().join("docs").join("size-probe.md");
    write(&path, &report)
}

fn build(workspace: &Workspace, toolchain: &Toolchain) -> Result<(Vec<u8>, BuildTiming), Error> {
    let folder = scratch()?;
    let job = Job::new(workspace, toolchain, Flavour::Exact, &["size-probe"], folder.path().join("modules"));
    // Always cold, or the second run would time nothing.
    if job.target.exists() {
        std::fs::remove_dir_all(&job.target).map_err(Error::io("remove", &job.target))?;
    }
    let built = job.start()?.finish()?;
    let raw = built
        .modules
        .into_iter()
        .find_map(|(entry, bytes)| (post::kernel_name(&entry) == KERNEL).then_some(bytes))
        .ok_or_else(|| Error::Failed(format!("the feature size-probe adds no kernel named {KERNEL}")))?;
    let start = Instant::now();
    let finished = finish_module(KERNEL, &raw, Flavour::Exact)?;
    let finish_seconds = start.elapsed().as_secs_f64();
    let module = ModuleRecord::new(&finished).map_err(Error::Failed)?;
    let compile_seconds = built.kernel_seconds.unwrap_or_default();
    Ok((finished, BuildTiming { module, compile_seconds, finish_seconds }))
}

/// The report as a section of Markdown.
pub fn report(build: &BuildTiming, devices: &[DeviceTiming]) -> String {
    let mut text = format!(
        "## What the size of a kernel costs\n\n\
         Measured by `cargo xtask shader probe` on the kernel `{KERNEL}`, which is as large as kernels get; \
         the limit for shipped kernels is {} operations.\n\n\
         | step | result |\n|---|---|\n\
         | operations after spirv-opt | {} |\n\
         | bytes | {} |\n\
         | rust-gpu, the kernel crate with all other kernels | {:.1} s |\n\
         | post-pass, spirv-opt, spirv-val | {:.1} s |\n",
        limits::MAX_OPERATIONS,
        build.module.operations,
        build.module.bytes,
        build.compile_seconds,
        build.finish_seconds
    );
    for device in devices {
        text += &format!("| pipeline, {} | {:.3} s |\n", device.adapter, device.pipeline_seconds);
        text += &format!("| first dispatch, {} | {:.3} s |\n", device.adapter, device.dispatch_seconds);
    }
    if devices.is_empty() {
        text += "\nNo device was at hand, so neither pipeline creation nor a dispatch was timed.\n";
    }
    text
}

fn write(path: &Path, text: &str) -> Result<(), Error> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Error::io("create", folder))?;
    }
    std::fs::write(path, text).map_err(Error::io("write", path))
}
