//! The device's words beside the host's, in small images: before anything is measured.

use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, GpuExecutor, Parity};
use restir_host::render::Render;
use restir_host::scene::Scene;
use restir_kernels::Case;
use restir_tests::parity;
use restir_tests::traversal::{Kind, case, frozen, rays};

use super::bench::Bench;
use super::subjects::MAIN;
use crate::Error;

/// Width and height of the images whose rays are compared.
const SIZE: [u32; 2] = [64, 48];
/// Scenes whose rays are compared.
const TRACED: [&str; 2] = ["cornell", "foliage"];

/// A sentence on what was compared.
pub(super) fn compare(bench: &mut Bench) -> Result<String, Error> {
    let Some(gpu) = bench.exact() else {
        return Ok(
            "The adapter cannot have the flavour exact, whose words would be the host's: there was nothing to compare."
                .to_owned(),
        );
    };
    for subject in MAIN {
        let scene = SceneBuffers::build(&Scene::load(subject.scene)?)?;
        // of two frames the second one reuses the first
        let frames = Render { count: 2, ..subject.render(SIZE)? };
        if let Parity::Approximate { max_ulp } = gpu.check_for(&scene, &frames)? {
            return Err(differs(&format!("{} by {max_ulp} units in the last place", subject.name())));
        }
    }
    let mut words = 0;
    for name in TRACED {
        let scene = SceneBuffers::build(&Scene::load(name)?)?;
        for kind in Kind::ALL {
            let case = case(name, &scene, SIZE, kind, &rays(&scene, SIZE, kind));
            words += same_hits(gpu, &frozen(case, &scene))?;
        }
    }
    let names: Vec<String> = MAIN.iter().map(|subject| subject.name()).collect();
    Ok(format!(
        "Two small frames each of {}, and {words} words of hits of rays, were compared with the host's first: none differs.",
        names.join(", ")
    ))
}

/// Compares the hits of rays: how many words there are.
pub(super) fn same_hits(gpu: &mut GpuExecutor, case: &Case) -> Result<usize, Error> {
    let outcome = parity::compare_with(&mut CpuExecutor::new()?, gpu, case)?;
    if outcome.is_exact() { Ok(outcome.words) } else { Err(differs(&format!("rays ({}): {outcome}", case.name))) }
}

fn differs(what: &str) -> Error {
    Error::Failed(format!(
        "the device gives other words than the host, {what}; nothing was measured, `cargo lab parity` says which kernels differ"
    ))
}
