//! How much memory a render may take.

use crate::Error;

/// Share of the machine's memory.
const SHARE: f64 = 0.8;

/// 80 % of the memory that this process can get, or `RESTIR_MEMORY_LIMIT_BYTES`.
pub(crate) fn limit() -> u64 {
    let configured = std::env::var("RESTIR_MEMORY_LIMIT_BYTES").ok().and_then(|v| v.parse().ok());
    configured.unwrap_or_else(|| {
        let mut system = sysinfo::System::new();
        system.refresh_memory();
        let group = system.cgroup_limits().map_or(u64::MAX, |limits| limits.total_memory);
        (system.total_memory().min(group) as f64 * SHARE) as u64
    })
}

/// Refuses what takes more than [`limit`] bytes; `what` is named in the message, and `remedy` says what to do.
///
/// # Errors
/// [`Error::Memory`].
pub(crate) fn check(bytes: u64, what: &str, remedy: &str) -> Result<(), Error> {
    let limit = limit();
    if bytes <= limit {
        return Ok(());
    }
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    Err(Error::Memory(format!(
        "{what} would take {:.2} GiB, more than the limit of {:.2} GiB (80 % of the memory, or \
         RESTIR_MEMORY_LIMIT_BYTES); {remedy}",
        gib(bytes),
        gib(limit)
    )))
}
