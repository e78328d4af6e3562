//! `restir devices`

use restir::Error;

use super::{console, progress::patiently};

pub(super) fn run() -> Result<(), Error> {
    let adapters = patiently("asking the adapters", adapters);
    if adapters.is_empty() {
        return console::print("no GPU adapter or driver was found; renders run on the CPU\n");
    }
    console::print(&adapters)
}

#[cfg(feature = "gpu")]
fn adapters() -> String {
    restir::exec::gpu::adapters().iter().map(describe).collect()
}

#[cfg(not(feature = "gpu"))]
fn adapters() -> String {
    "this program was built without GPU support; renders run on the CPU\n".to_owned()
}

#[cfg(feature = "gpu")]
fn describe(adapter: &restir::exec::gpu::AdapterInfo) -> String {
    format!(
        "{}\n    backend  {}\n    driver   {}\n    kind     {}\n    parity   {}\n",
        adapter.name,
        adapter.backend,
        adapter.driver,
        adapter.kind,
        parity(&adapter.name)
    )
}

#[cfg(feature = "gpu")]
fn parity(adapter: &str) -> String {
    use restir::exec::{Executor, GpuExecutor};
    match GpuExecutor::builder().adapter(adapter).shaders(super::environment::shaders()).open() {
        Ok(gpu) => gpu.describe().parity.map_or_else(String::new, |parity| format!("{parity} ({})", gpu.loading())),
        Err(error) => format!("unknown: {error}"),
    }
}
