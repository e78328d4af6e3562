//! `cargo lab probe`: what the size of a kernel costs on a device: its pipeline, and its first dispatch, to which some drivers
//! put compilation off.

use std::collections::BTreeMap;
use std::sync::mpsc;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::gpu::{Pipelines, adapters};
use restir_host::exec::{Executor, Flavour, GpuExecutor};
use restir_host::plan::{FramePlan, Pass};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_host::technique;
use restir_host::{Shaders, spirv};
use restir_kernels::path::path;
use restir_kernels::{Case, KernelDesc};
use restir_tests::{cases, parity};

use xtask::shader::compile::Job;
use xtask::shader::flavour::Entry;
use xtask::shader::manifest::{Manifest, hash};
use xtask::shader::module::{operations, parse};
use xtask::shader::pipeline::finish_module;
use xtask::shader::publish::write;
use xtask::shader::toolchain::Toolchain;
use xtask::shader::workspace::{MANIFEST, Workspace, scratch};
use xtask::shader::{install, limits, post};

use crate::Error;
use crate::report::publish;

/// A kernel that the feature `size-probe` adds; it goes beyond the limits on purpose and is never shipped. Its interface is
/// that of `path`, and it runs on a case of `path`.
static PROBE: KernelDesc = KernelDesc { name: "size_probe", ..path::DESC };
/// `SpecId` of its number of segments, and the numbers that are measured: some 20, 24 and 28 thousand operations.
const SEGMENTS_ID: u32 = 1;
const SEGMENTS: [u32; 3] = [5, 6, 7];
/// A scene on which kernels are large.
const SCENE: &str = "cornell";
/// Each time is the least of so many.
const ROUNDS: usize = 3;

/// Seconds of the processor for a kernel's pipeline and for its first dispatch.
type Seconds = [f64; 2];

/// A probe, in a folder that [`Shaders::Folder`] takes.
struct Probe {
    folder: tempfile::TempDir,
    label: String,
    operations: usize,
    case: Case,
}

/// Builds the probe kernel, times it and shipped kernels on all adapters, and writes the report.
///
/// # Errors
/// [`Error::Environment`] without the shader toolchain or SPIRV-Tools.
pub fn run() -> Result<(), Error> {
    let workspace = &Workspace::current();
    let toolchain =
        Toolchain::find()?.ok_or_else(|| Error::Environment(install::consent_message(&workspace.kernels())))?;
    let raw = build(workspace, &toolchain)?;
    let of_segments = |&segments: &u32| {
        let label = format!("`{}`, {segments} segments", PROBE.name);
        finish(&raw, label, &[(SEGMENTS_ID, segments)], case())
    };
    let probes = SEGMENTS.iter().map(of_segments).collect::<Result<Vec<_>, _>>()?;
    let manifest = Manifest::read(&workspace.spirv())?;
    publish("size-probe", &report(&probes, &manifest)?, true)
}

/// The modules of the kernels that the feature adds, by name, as rust-gpu gives them.
type Raw = BTreeMap<String, Vec<u8>>;

/// The probe kernels, of which one has all its segments.
fn build(workspace: &Workspace, toolchain: &Toolchain) -> Result<Raw, Error> {
    let folder = scratch()?;
    let job = Job::new(workspace, toolchain, Flavour::Exact, &["size-probe"], folder.path().join("modules"));
    let modules = job.start()?.finish()?;
    Ok(modules.into_iter().map(|(entry, bytes)| (post::kernel_name(&entry).to_owned(), bytes)).collect())
}

/// The probe that `case` is of, with some constants frozen.
fn finish(raw: &Raw, label: String, frozen: &[(u32, u32)], case: Case) -> Result<Probe, Error> {
    let name = case.kernel.name;
    let found = raw.get(name);
    let raw = found.ok_or_else(|| Error::Failed(format!("the feature size-probe adds no kernel named {name}")))?;
    let words = spirv::freeze(&bytemuck::pod_collect_to_vec(raw), frozen);
    let entry = Entry::new(Flavour::Exact, name);
    let words = words.ok_or_else(|| Error::Failed(format!("the module of {name} is no SPIR-V")))?;
    let module = finish_module(&entry, bytemuck::cast_slice(&words))?;
    let operations = operations(&parse(&module).map_err(Error::Failed)?).count();
    let folder = scratch()?;
    let manifest = serde_json::json!({ "kernels": { name: { "exact": { "blake3": hash(&module) } } } });
    write(&folder.path().join(entry.path()), &module)?;
    write(&folder.path().join(MANIFEST), manifest.to_string().as_bytes())?;
    Ok(Probe { folder, label, operations, case })
}

fn report(probes: &[Probe], manifest: &Manifest) -> Result<String, restir_host::Error> {
    let mut text = format!(
        "# What the size of a kernel costs\n\nMade by `MESA_SHADER_CACHE_DISABLE=true cargo lab probe`. A kernel \
         may have {} operations. `size_probe` has a number of segments of a path, each with a traversal, a surface and a \
         GGX lobe of its own. The others are those of every technique with its default settings. Seconds of the \
         processor for the pipeline and for the first dispatch, each the least of {ROUNDS}: of a kernel for all scenes, and of one whose \
         constants are frozen to `{SCENE}`.\n",
        limits::MAX_OPERATIONS
    );
    let scene = SceneBuffers::build(&Scene::load(SCENE)?)?;
    let render = |technique| Render { count: 2, ..Render::new([16, 16], technique) };
    let renders: Vec<Render> = technique::all().into_iter().map(render).collect();
    for adapter in adapters() {
        text += &format!(
            "\n{} ({}, {})\n\n| kernel | operations | pipeline | first dispatch | frozen: pipeline | first dispatch |\n\
             |---|---:|---:|---:|---:|---:|\n",
            adapter.name, adapter.backend, adapter.driver
        );
        let row = |name: &str, operations: usize, [all, frozen]: [Seconds; 2]| {
            let seconds = all.iter().chain(&frozen).map(|s| format!("{s:.2}")).collect::<Vec<_>>().join(" | ");
            format!("| {name} | {operations} | {seconds} |\n")
        };
        for Probe { folder, label, operations, case } in probes {
            let shaders = Shaders::Folder(folder.path().to_owned());
            let times = both(&adapter.name, &shaders, &|| parity::plan(case))?;
            text += &row(label, *operations, times[case.kernel.name]);
        }
        for render in &renders {
            let plan = || render.plan(&scene);
            for (name, times) in both(&adapter.name, &Shaders::Embedded, &plan)? {
                text += &row(&format!("`{name}`"), manifest.kernels[name].exact.operations, times);
            }
        }
    }
    Ok(text)
}

/// A parity case of `path` that is frozen to [`SCENE`], for the probe.
fn case() -> Case {
    let suits = |case: &&Case| case.kernel.name == path::DESC.name && case.name.ends_with(&format!("{SCENE}, frozen"));
    let case = cases::all().iter().find(suits).expect("a unit test looks for it").clone();
    Case { kernel: &PROBE, ..case }
}

/// The times of a plan's kernels by name: for all scenes, and frozen as the plan has them.
fn both<'a>(
    adapter: &str,
    shaders: &Shaders,
    plan: &dyn Fn() -> FramePlan<'a>,
) -> Result<BTreeMap<&'static str, [Seconds; 2]>, restir_host::Error> {
    let mut times = BTreeMap::new();
    for _ in 0..ROUNDS {
        for (index, plan) in [general(plan()), plan()].into_iter().enumerate() {
            for (name, [pipeline, dispatch]) in first_run(adapter, shaders, plan)? {
                let least = &mut times.entry(name).or_insert([[f64::INFINITY; 2]; 2])[index];
                *least = [least[0].min(pipeline), least[1].min(dispatch)];
            }
        }
    }
    Ok(times)
}

/// The plan with kernels for all scenes.
fn general(plan: FramePlan<'_>) -> FramePlan<'_> {
    let general = |pass: Pass| Pass { constants: pass.kernel.constants.iter().map(|c| c.default).collect(), ..pass };
    FramePlan { passes: Box::new(plan.passes.map(move |pass| pass.map(general))), ..plan }
}

/// The times of a plan's kernels on a device that is opened for it, so that the driver has not seen them. The executor makes
/// all pipelines before the first dispatch, and each is made once more to be timed alone.
fn first_run(
    adapter: &str,
    shaders: &Shaders,
    plan: FramePlan<'_>,
) -> Result<BTreeMap<&'static str, Seconds>, restir_host::Error> {
    let executor = GpuExecutor::builder().adapter(adapter).open()?.reload(Flavour::Exact, shaders.clone());
    let mut pipelines = Pipelines::new(executor.device(), Flavour::Exact, shaders.clone());
    let (sender, made) = mpsc::channel();
    let mut executor = executor.observe_pipelines(move |_, _| {
        // who would receive it lives longer
        let _ = sender.send(processor_seconds());
    });
    let mut times = BTreeMap::new();
    let mut before = 0.0;
    executor.run_observed(plan, &mut |step| {
        let dispatch = processor_seconds() - made.try_iter().last().unwrap_or(before);
        let start = processor_seconds();
        times.entry(step.pass.kernel.name).or_insert_with(|| {
            let pipeline = pipelines.get(step.pass.kernel, &step.pass.constants);
            pipeline.map(|_| [processor_seconds() - start, dispatch])
        });
        before = processor_seconds();
        Ok(())
    })?;
    times.into_iter().map(|(name, seconds)| Ok((name, seconds?))).collect()
}

/// Seconds of the processor that this process has used, which are the same however many others use it. Linux counts them in
/// hundredths, in fields 14 and 15 of a line whose second field may contain anything, in parentheses.
fn processor_seconds() -> f64 {
    let line = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = line.rsplit(')').next().into_iter().flat_map(str::split_whitespace);
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_case_to_probe() {
        assert_eq!(case().constants.len(), PROBE.constants.len());
    }
}
