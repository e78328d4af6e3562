//! Compiling a crate of kernels to SPIR-V with rust-gpu.
//!
//! spirv-builder reads its environment and ends a process on surprises, so each build runs in a child: this program
//! itself, with the hidden command `shader compile`. Two flavours then compile side by side.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};
use spirv_builder::{ModuleResult, SpirvBuilder, SpirvMetadata};

use super::flavour::Flavour;
use super::toolchain::Toolchain;
use super::workspace::Workspace;
use crate::Error;

const TARGET: &str = "spirv-unknown-vulkan1.2";

/// One build of a crate of kernels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Job {
    /// The crate.
    kernels: PathBuf,
    /// The rustup toolchain.
    channel: String,
    /// The backend library.
    backend: PathBuf,
    /// Name of the build in messages.
    name: String,
    /// The target directory. Builds with other features need another one: their outputs have the same names.
    target: PathBuf,
    /// Its features.
    features: Vec<String>,
    /// Whether a lock file decides what it depends on.
    locked: bool,
    /// Where to write the list of modules, as JSON from entry point to path.
    list: PathBuf,
}

impl Job {
    /// A build of a flavour, with further features of the kernel crate.
    pub fn new(
        workspace: &Workspace,
        toolchain: &Toolchain,
        flavour: Flavour,
        features: &[&str],
        list: PathBuf,
    ) -> Self {
        let name = features.iter().fold(flavour.to_string(), |name, feature| format!("{name}-{feature}"));
        let target = workspace.target().join("shaders").join(&name);
        let fast = (flavour == Flavour::Fast).then_some("fast");
        let features = fast.iter().chain(features).map(|&f| f.to_owned()).collect();
        let Toolchain { channel, backend } = toolchain.clone();
        Self { kernels: workspace.kernels(), channel, backend, name, target, features, locked: true, list }
    }

    /// The same build of somebody else's crate.
    #[must_use]
    pub fn of_crate(self, kernels: PathBuf) -> Self {
        let locked = kernels.ancestors().any(|folder| folder.join("Cargo.lock").is_file());
        Self { kernels, locked, ..self }
    }

    /// The part of the work that runs in the child, which gets the job as JSON.
    pub fn run(job: &str) -> Result<(), Error> {
        let job: Self = serde_json::from_str(job).map_err(|e| Error::Environment(format!("that is no job: {e}")))?;
        let mut builder = SpirvBuilder::new(job.kernels, TARGET)
            .rustc_codegen_spirv_location(job.backend)
            .shader_crate_features(job.features)
            .target_dir_path(job.target)
            .spirv_metadata(SpirvMetadata::None)
            .multimodule(true)
            // The backend's own optimiser would run before the post-pass can decorate anything.
            .extra_arg("--no-spirv-opt");
        builder.toolchain_overwrite = Some(job.channel);
        builder.build_script.defaults = false;
        let built = builder.build().map_err(|e| Error::Failed(format!("the kernels do not compile: {e}")))?;
        let ModuleResult::MultiModule(modules) = built.module else {
            return Err(Error::Failed("rust-gpu gave one module instead of one an entry point".to_owned()));
        };
        std::fs::write(&job.list, json(&modules)?).map_err(Error::io("write", &job.list))
    }

    /// Starts the child.
    pub fn start(self) -> Result<Running, Error> {
        let program = std::env::current_exe().map_err(Error::io("find", Path::new("this program")))?;
        let mut child = self
            .command(&program)?
            .spawn()
            .map_err(|e| Error::Environment(format!("cannot run {}: {e}", program.display())))?;
        let relay = child.stderr.take().map(|stderr| relay(self.name.clone(), stderr));
        Ok(Running { job: self, child, relay })
    }

    fn command(&self, program: &Path) -> Result<Command, Error> {
        let mut command = Command::new(program);
        command.args(["shader", "compile", &json(self)?]);
        // The backend recurses deeply over large functions.
        command.env("RUST_MIN_STACK", (64 << 20).to_string());
        // The lock file decides the bytes, and nothing from a user's environment may.
        command.env("RUSTGPU_CARGOFLAGS", if self.locked { "--locked" } else { "" });
        command.env_remove("RUSTGPU_CODEGEN_ARGS").env_remove("RUSTGPU_RUSTFLAGS");
        command.env("CARGO_TERM_PROGRESS_WHEN", "never");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        Ok(command)
    }

    fn modules(&self) -> Result<BTreeMap<String, Vec<u8>>, Error> {
        let text = std::fs::read_to_string(&self.list).map_err(Error::io("read", &self.list))?;
        let paths: BTreeMap<String, PathBuf> = serde_json::from_str(&text)
            .map_err(|e| Error::Failed(format!("{} is not a list of modules: {e}", self.list.display())))?;
        let read =
            |(name, path): (String, PathBuf)| Ok((name, std::fs::read(&path).map_err(Error::io("read", &path))?));
        paths.into_iter().map(read).collect()
    }
}

fn json(value: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string(value).map_err(|e| Error::Environment(format!("it cannot be written as JSON: {e}")))
}

/// A build in progress.
pub struct Running {
    job: Job,
    child: Child,
    relay: Option<JoinHandle<()>>,
}

impl Running {
    /// Waits for the modules that rust-gpu made of the crate, by entry point.
    pub fn finish(mut self) -> Result<BTreeMap<String, Vec<u8>>, Error> {
        let status = self.child.wait();
        // A relay that panicked lost messages, not the build.
        let _ = self.relay.take().map(JoinHandle::join);
        match status {
            Ok(status) if status.success() => self.job.modules(),
            _ => Err(Error::Failed(format!("the build `{}` of the kernels failed, see above", self.job.name))),
        }
    }
}

/// Prints what a build says, each line with the build's name.
fn relay(name: String, stderr: ChildStderr) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let lines = BufReader::new(stderr).lines().map_while(Result::ok);
        lines.filter(|line| !is_expected(line)).for_each(|line| eprintln!("[{name}] {line}"));
    })
}

/// The backend warns that its optimiser is off, which is on purpose; a real warning makes the count two.
fn is_expected(line: &str) -> bool {
    line.trim().is_empty()
        || line.contains("`spirv-opt` should have ran")
        || line.ends_with(" (lib) generated 1 warning") && !line.contains("`restir-shared`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_expected_warning_is_dropped() {
        assert!(is_expected("warning: `spirv-opt` should have ran (optlevel=Aggressive) but was disabled"));
        assert!(is_expected("warning: `restir-kernels` (lib) generated 1 warning"));
        assert!(!is_expected("warning: `restir-kernels` (lib) generated 2 warnings"));
        assert!(!is_expected("warning: `restir-shared` (lib) generated 1 warning"));
        assert!(is_expected("warning: `a-crate-of-yours` (lib) generated 1 warning"));
    }

    #[test]
    fn a_job_has_a_target_directory_of_its_own() {
        let toolchain = Toolchain { channel: "channel".to_owned(), backend: "backend".into() };
        let job =
            |flavour, features: &[&str]| Job::new(&Workspace::new("."), &toolchain, flavour, features, "list".into());
        let probe = job(Flavour::Fast, &["size-probe"]);
        assert_eq!(probe.features, ["fast", "size-probe"]);
        assert!(probe.target.ends_with("shaders/fast-size-probe"));
        assert!(job(Flavour::Exact, &[]).target.ends_with("shaders/exact"));
    }
}
