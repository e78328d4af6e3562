//! How long a user waits for the first picture: in programs of their own, which have compiled nothing yet.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use restir_host::buffers::SceneBuffers;
use restir_host::exec::GpuExecutor;
use restir_host::scene::Scene;

use super::bench::Bench;
use super::rows::Row;
use super::subjects::MAIN;
use super::{Extent, Found, Part};
use crate::Error;

/// Caches of drivers, by the variables that turn them off: Mesa's and NVIDIA's.
const CACHES: [(&str, &str); 2] = [("MESA_SHADER_CACHE_DISABLE", "true"), ("__GL_SHADER_DISK_CACHE", "0")];

fn size(extent: Extent) -> [u32; 2] {
    if extent == Extent::Quick { [64, 48] } else { [512, 384] }
}

/// Opens the device, compares it with the host by what is rendered, and renders one sample: in seconds.
pub(super) fn seconds(adapter: Option<&str>, extent: Extent, pipelines: &Path) -> Result<f64, Error> {
    let begun = Instant::now();
    let scene = SceneBuffers::build(&Scene::load(MAIN[0].scene)?)?;
    let render = MAIN[0].render(size(extent))?;
    let builder = GpuExecutor::builder().adapter(adapter).for_render(&scene, &render);
    let mut gpu = builder.keep_pipelines_in(pipelines).open()?;
    render.render(&scene, &mut gpu)?;
    Ok(begun.elapsed().as_secs_f64())
}

pub(super) fn measure(bench: &mut Bench) -> Result<Found, Error> {
    if bench.exact().is_none() {
        let what = "Left out: the adapter cannot have the flavour exact, which is what a render begins with.";
        return Ok(Found { notes: vec![what.to_owned()], ..Found::default() });
    }
    let folder = tempfile::tempdir().map_err(Error::io("make", &std::env::temp_dir()))?;
    let [width, height] = size(bench.extent);
    let subject = format!("{}, {width} x {height}, one sample", MAIN[0].name());
    let mut found = Found::default();
    for column in ["cold, s", "with pipelines kept, s"] {
        let seconds = in_a_program(bench, folder.path())?;
        found.rows.push(Row::new(Part::First, &subject, column, seconds));
    }
    Ok(found)
}

fn in_a_program(bench: &Bench, pipelines: &Path) -> Result<f64, Error> {
    let program = std::env::current_exe().map_err(Error::io("find", Path::new("this program")))?;
    let mut command = Command::new(&program);
    command.args(["device", "--adapter", &bench.adapter()]).args(bench.extent.option());
    command.arg("--first").arg(pipelines).envs(CACHES);
    let output = command.output().map_err(Error::io("run", &program))?;
    let said = String::from_utf8_lossy(&output.stdout);
    said.trim().parse().map_err(|_| {
        let why = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        Error::Environment(format!("the first picture was not rendered: {why}"))
    })
}
