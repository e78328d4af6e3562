//! What `shader probe` measures on devices.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use restir_host::exec::gpu::{Pipelines, adapters};
use restir_host::exec::{Executor, Flavour, GpuExecutor};
use restir_host::{Error, Shaders};
use restir_kernels::path::path;
use restir_kernels::{Case, KernelDesc};
use restir_tests::parity::{BuiltinScenes, plan};

use crate::shader::probe::DeviceTiming;

/// The probe kernel has the interface of `path`, and runs on its first case.
static PROBE: KernelDesc = KernelDesc { name: "size_probe", ..path::DESC };

/// Times pipeline and first dispatch of the probe kernel on every adapter, as [`crate::shader::probe::DeviceTimer`].
///
/// # Errors
/// A sentence, if the entry point is not the probe kernel's or an adapter does not run it.
pub fn time_on_devices(module: &[u8], entry: &str) -> Result<Vec<DeviceTiming>, String> {
    if entry != PROBE.name {
        return Err(format!("the module's entry point is {entry} instead of {}", PROBE.name));
    }
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for the module: {e}"))?;
    write_modules(folder.path(), module).map_err(|e| format!("cannot write the module: {e}"))?;
    let case = (path::DESC.cases)(&BuiltinScenes).remove(0);
    let shaders = Shaders::Folder(folder.path().to_owned());
    let time = |adapter: String| time_on(&adapter, &shaders, &case).map_err(|e| format!("{adapter}: {e}"));
    adapters().into_iter().map(|adapter| time(adapter.name)).collect()
}

/// A folder with this one module, as [`Shaders::Folder`] takes it.
fn write_modules(folder: &Path, module: &[u8]) -> std::io::Result<()> {
    let hash = blake3::hash(module).to_hex().to_string();
    let manifest = serde_json::json!({ "kernels": { PROBE.name: { "exact": { "blake3": hash } } } });
    std::fs::create_dir(folder.join("exact"))?;
    std::fs::write(folder.join("exact").join(format!("{}.spv", PROBE.name)), module)?;
    std::fs::write(folder.join("manifest.json"), manifest.to_string())
}

fn time_on(adapter: &str, shaders: &Shaders, case: &Case) -> Result<DeviceTiming, Error> {
    let mut executor = GpuExecutor::open(Some(adapter), Flavour::Exact)?.reload(Flavour::Exact, shaders.clone());
    let constants: Vec<u32> = PROBE.constants.iter().map(|c| c.default).collect();
    let device = executor.device().clone();
    let pipeline = || -> Result<f64, Error> {
        let start = Instant::now();
        Pipelines::new(&device, Flavour::Exact, shaders.clone()).get(&PROBE, &constants)?;
        Ok(start.elapsed().as_secs_f64())
    };
    let cold = pipeline()?;
    let warm = pipeline()?;
    let start = Instant::now();
    executor.run(plan(&PROBE, case), &mut |_| ControlFlow::Continue(()))?;
    // the executor makes the pipeline once more, which the driver now has in its cache
    let dispatch_seconds = (start.elapsed().as_secs_f64() - warm).max(0.0);
    Ok(DeviceTiming {
        adapter: executor.describe().adapter.unwrap_or_default(),
        pipeline_seconds: cold,
        dispatch_seconds,
    })
}
