//! How much memory renders of this process may take.
//!
//! ```
//! restir_host::memory::set_limit(2 << 30);
//! assert!(restir_host::memory::check(1 << 30, "this image", "choose a smaller size").is_ok());
//! let refused = restir_host::memory::check(3 << 30, "this image", "choose a smaller size").unwrap_err();
//! assert!(matches!(refused, restir_host::Error::Memory { bytes: 0xc000_0000, limit: 0x8000_0000, .. }));
//! assert!(refused.to_string().contains("3.00 GiB"));
//! ```

use std::sync::atomic::{AtomicU64, Ordering};

use crate::Error;

/// Share of the machine's memory.
const SHARE: f64 = 0.8;
/// The limit that was set; as long as none was, the largest number.
static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);

/// Where Linux says what a process may have.
const LIMITS: &str = "/proc/self/limits";

/// Sets the limit of this process: from now on, scenes, renders and sessions that would take more than so many bytes are refused.
///
/// Without it the limit is 80 % of the memory that the process can get: of the machine's, its control group's and its address space,
/// the least.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// The limit in bytes.
pub(crate) fn limit() -> u64 {
    match LIMIT.load(Ordering::Relaxed) {
        u64::MAX => share_of_machine(),
        bytes => bytes,
    }
}

fn share_of_machine() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let group = system.cgroup_limits().map_or(u64::MAX, |limits| limits.total_memory);
    let space = std::fs::read_to_string(LIMITS).map_or(u64::MAX, |limits| address_space(&limits));
    (system.total_memory().min(group).min(space) as f64 * SHARE) as u64
}

/// The limit on addresses (`ulimit -v`) in the table of [`LIMITS`]; none is the largest number.
fn address_space(limits: &str) -> u64 {
    let row = limits.lines().find_map(|line| line.strip_prefix("Max address space"));
    row.and_then(|row| row.split_whitespace().next()?.parse().ok()).unwrap_or(u64::MAX)
}

/// Refuses what takes more bytes than this process may have; `what` is named in the message, and `remedy` says what to do.
///
/// # Errors
/// [`Error::Memory`].
pub fn check(bytes: u64, what: &str, remedy: &str) -> Result<(), Error> {
    let limit = limit();
    let refused = || Error::Memory { what: what.to_owned(), bytes, limit, remedy: remedy.to_owned() };
    if bytes <= limit { Ok(()) } else { Err(refused()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_on_addresses_is_read() {
        let table = |limit: &str| {
            format!("Limit    Soft Limit    Hard Limit    Units\nMax address space    {limit}    unlimited    bytes\n")
        };
        assert_eq!(address_space(&table("8192000000")), 8_192_000_000);
        assert_eq!([address_space(&table("unlimited")), address_space("")], [u64::MAX; 2]);
    }
}
