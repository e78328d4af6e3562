//! Registers and local memory of kernels, as the GPU's own driver tells them.

use xtask::shader::cost;

use super::Found;
use super::bench::Bench;
use crate::Error;

pub(super) fn measure(bench: &mut Bench) -> Result<Found, Error> {
    let traces = |kernel: &&str| ["path", "di_", "pt_", "ray_"].iter().any(|start| kernel.starts_with(start));
    let names: Vec<&str> = restir_kernels::all().iter().map(|kernel| kernel.name).filter(traces).collect();
    let missing =
        || "Left out: no driver here tells what kernels take (VK_KHR_pipeline_executable_properties).".to_owned();
    Ok(match cost::of_gpu(&names)? {
        Some(table) => {
            let other = (!table.contains(&bench.adapter())).then(|| "This table is of another adapter.".to_owned());
            Found { table, notes: other.into_iter().collect(), ..Found::default() }
        }
        None => Found { notes: vec![missing()], ..Found::default() },
    })
}
