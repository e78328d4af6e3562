//! What a report was made of and on: the commit and the machine.

use std::process::Command;

/// The commit of the working tree that this was built in, with `-dirty` if files differ from it, or `unknown`.
pub(crate) fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|files| !files.is_empty());
    let commit = git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    commit + if changed { "-dirty" } else { "" }
}

/// Processor, cores and memory, as in `Xeon 2.1 GHz, 2 hardware threads, 8 GiB, linux`.
pub(crate) fn machine() -> String {
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    system.refresh_memory();
    let model = system.cpus().first().map_or("", |cpu| cpu.brand().trim());
    let model = if model.is_empty() { std::env::consts::ARCH } else { model };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let memory = system.total_memory() as f64 / f64::from(1 << 30);
    format!("{model}, {threads} hardware threads, {memory:.0} GiB, {}", std::env::consts::OS)
}
