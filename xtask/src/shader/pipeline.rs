//! From source to finished modules in memory: compile, post-pass, canonical form, optimise, rewrite for naga (`fast`), canonical form, validate.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use super::compile::Job;
use super::flavour::{Entry, Flavour};
use super::toolchain::Toolchain;
use super::workspace::{Workspace, scratch};
use super::{canonical, inserts, loops, module, post, tools};
use crate::Error;

/// Finished modules.
pub type Modules = BTreeMap<Entry, Vec<u8>>;

/// Builds all kernels in both flavours, side by side.
pub fn build(workspace: &Workspace, toolchain: &Toolchain) -> Result<Modules, Error> {
    build_crate(workspace, toolchain, &workspace.kernels())
}

/// Builds the kernels of a crate in both flavours, side by side. It has a feature `fast`.
pub fn build_crate(workspace: &Workspace, toolchain: &Toolchain, kernels: &Path) -> Result<Modules, Error> {
    let start = Instant::now();
    // Both are awaited before either is judged, so that no build is left behind.
    let results = std::thread::scope(|scope| {
        let build = |flavour| scope.spawn(move || build_flavour(workspace, toolchain, kernels, flavour));
        Flavour::ALL.map(build).map(|thread| thread.join())
    });
    let mut built = Modules::new();
    for result in results {
        let panicked = |_| Error::Failed("the build of a flavour panicked, see above".to_owned());
        built.append(&mut result.map_err(panicked)??);
    }
    println!("built both flavours in {:.1} s", start.elapsed().as_secs_f64());
    Ok(built)
}

fn build_flavour(
    workspace: &Workspace,
    toolchain: &Toolchain,
    kernels: &Path,
    flavour: Flavour,
) -> Result<Modules, Error> {
    let folder = scratch()?;
    let job = Job::new(workspace, toolchain, flavour, &[], folder.path().join("modules")).of_crate(kernels.to_owned());
    let mut modules = Modules::new();
    for (function, bytes) in job.start()?.finish()? {
        let entry = Entry::new(flavour, post::kernel_name(&function));
        let finished = finish_module(&entry, &bytes)?;
        if modules.insert(entry.clone(), finished).is_some() {
            return Err(Error::Failed(format!("two kernels are named `{}`: rename one of them", entry.kernel)));
        }
    }
    Ok(modules)
}

/// Post-pass, optimiser and validator for one module of rust-gpu. What the optimiser does depends on the order of functions and ids,
/// so these are canonical before it, and again after it.
pub fn finish_module(entry: &Entry, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let at = |reason: String| Error::Failed(format!("{entry}: {reason}"));
    let mut module = module::parse(bytes).map_err(at)?;
    post::prepare(&mut module, entry.flavour == Flavour::Exact).map_err(at)?;
    canonical::canonicalise(&mut module);
    let optimised = tools::optimise(&module::assemble(&module))?;
    let mut module = module::parse(&optimised).map_err(at)?;
    if entry.flavour == Flavour::Fast {
        inserts::make_whole(&mut module);
        loops::hand_on_by_variables(&mut module).map_err(at)?;
    }
    canonical::canonicalise(&mut module);
    let finished = module::assemble(&module);
    tools::validate(&finished)?.map_or(Ok(finished), |finding| Err(at(finding)))
}
