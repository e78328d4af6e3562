//! From source to finished modules in memory: compile, post-pass, optimise, validate.

use std::collections::BTreeMap;
use std::time::Instant;

use super::compile::{Job, Running};
use super::flavour::Flavour;
use super::toolchain::Toolchain;
use super::workspace::{Workspace, scratch};
use super::{module, post, tools};
use crate::Error;

/// Finished modules of one flavour by entry point.
pub type Modules = BTreeMap<String, Vec<u8>>;

/// Builds all kernels in both flavours, side by side.
pub fn build(workspace: &Workspace, toolchain: &Toolchain) -> Result<BTreeMap<Flavour, Modules>, Error> {
    let folder = scratch()?;
    let start = Instant::now();
    let mut running = Vec::new();
    for flavour in Flavour::ALL {
        let list = folder.path().join(flavour.name());
        running.push((flavour, Job::new(workspace, toolchain, flavour, &[], list).start()?));
    }
    // Both are awaited before either is judged, so that no build is left behind.
    let results: Vec<_> = std::thread::scope(|scope| {
        let finish = |(flavour, running): (Flavour, Running)| scope.spawn(move || finish(flavour, running));
        running
            .into_iter()
            .map(finish)
            .collect::<Vec<_>>()
            .into_iter()
            .map(|thread| thread.join())
            .collect()
    });
    let mut built = BTreeMap::new();
    for result in results {
        let (flavour, modules) =
            result.map_err(|_| Error::Failed("the post-pass panicked, see above".to_owned()))??;
        built.insert(flavour, modules);
    }
    println!(
        "built {} flavours in {:.1} s",
        built.len(),
        start.elapsed().as_secs_f64()
    );
    Ok(built)
}

fn finish(flavour: Flavour, running: Running) -> Result<(Flavour, Modules), Error> {
    let mut modules = Modules::new();
    for (entry, bytes) in running.finish()?.modules {
        let name = post::kernel_name(&entry);
        if modules
            .insert(name.to_owned(), finish_module(name, &bytes, flavour)?)
            .is_some()
        {
            return Err(Error::Failed(format!(
                "two kernels are named `{name}`: rename one of them"
            )));
        }
    }
    Ok((flavour, modules))
}

/// Post-pass, optimiser and validator for one module of rust-gpu.
pub fn finish_module(name: &str, bytes: &[u8], flavour: Flavour) -> Result<Vec<u8>, Error> {
    let at = |reason: String| Error::Failed(format!("{flavour}/{name}: {reason}"));
    let mut module = module::parse(bytes).map_err(at)?;
    post::prepare(&mut module, flavour).map_err(at)?;
    let finished = tools::optimise(&module::assemble(&module))?;
    match tools::validate(&finished)? {
        None => Ok(finished),
        Some(finding) => Err(at(finding)),
    }
}
