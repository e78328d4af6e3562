//! From source to finished modules in memory: compile, post-pass, optimise, validate.

use std::collections::BTreeMap;
use std::time::Instant;

use super::compile::Job;
use super::flavour::Flavour;
use super::toolchain::Toolchain;
use super::workspace::{Workspace, scratch};
use super::{module, post, tools};
use crate::Error;

/// Finished modules of one flavour by kernel.
pub type Modules = BTreeMap<String, Vec<u8>>;

/// Builds all kernels in both flavours, side by side.
pub fn build(workspace: &Workspace, toolchain: &Toolchain) -> Result<BTreeMap<Flavour, Modules>, Error> {
    let start = Instant::now();
    // Both are awaited before either is judged, so that no build is left behind.
    let results = std::thread::scope(|scope| {
        let build = |flavour| scope.spawn(move || build_flavour(workspace, toolchain, flavour));
        Flavour::ALL.map(build).map(|thread| thread.join())
    });
    let mut built = BTreeMap::new();
    for (flavour, result) in Flavour::ALL.into_iter().zip(results) {
        let panicked = |_| Error::Failed(format!("the build of the flavour {flavour} panicked, see above"));
        built.insert(flavour, result.map_err(panicked)??);
    }
    println!("built both flavours in {:.1} s", start.elapsed().as_secs_f64());
    Ok(built)
}

fn build_flavour(workspace: &Workspace, toolchain: &Toolchain, flavour: Flavour) -> Result<Modules, Error> {
    let folder = scratch()?;
    let job = Job::new(workspace, toolchain, flavour, &[], folder.path().join("modules"));
    let mut modules = Modules::new();
    for (entry, bytes) in job.start()?.finish()? {
        let name = post::kernel_name(&entry);
        let finished = finish_module(name, &bytes, flavour)?;
        if modules.insert(name.to_owned(), finished).is_some() {
            return Err(Error::Failed(format!("two kernels are named `{name}`: rename one of them")));
        }
    }
    Ok(modules)
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
