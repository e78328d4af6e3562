//! What the measurements were made on.

/// Processor, cores and memory, as in `Xeon 2.1 GHz, 2 threads, 8 GiB`.
pub(crate) fn describe() -> String {
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    system.refresh_memory();
    let model = system.cpus().first().map_or("", |cpu| cpu.brand().trim());
    let model = if model.is_empty() { std::env::consts::ARCH } else { model };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let memory = system.total_memory() as f64 / f64::from(1 << 30);
    format!("{model}, {threads} hardware threads, {memory:.0} GiB, {}", std::env::consts::OS)
}
