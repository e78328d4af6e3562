//! How much memory a render may take.

use std::ffi::OsStr;

use crate::Error;

const VARIABLE: &str = "RESTIR_MEMORY_LIMIT_BYTES";
/// Share of the machine's memory.
const SHARE: f64 = 0.8;

/// Where Linux says what a process may have.
const LIMITS: &str = "/proc/self/limits";

/// 80 % of the memory that this process can get, or `RESTIR_MEMORY_LIMIT_BYTES` if it is set and not empty.
///
/// # Errors
/// [`Error::Setting`] if the variable is no number.
pub(crate) fn limit() -> Result<u64, Error> {
    let value = std::env::var_os(VARIABLE).filter(|value| !value.is_empty());
    value.map_or_else(|| Ok(share_of_machine()), |value| configured(&value))
}

fn configured(value: &OsStr) -> Result<u64, Error> {
    let number = value.to_str().and_then(|text| text.parse().ok());
    number.ok_or_else(|| {
        let problem = format!("the environment variable {VARIABLE} is {value:?}, no number of bytes");
        Error::Setting(format!("{problem}; give a natural number less than 2^64, or unset it"))
    })
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
/// [`Error::Memory`]; [`Error::Setting`] for a broken variable.
pub fn check(bytes: u64, what: &str, remedy: &str) -> Result<(), Error> {
    let limit = limit()?;
    if bytes <= limit {
        return Ok(());
    }
    let [bytes, limit] = [bytes, limit].map(gib);
    let problem =
        format!("{what} would take {bytes}, more than the limit of {limit} (80 % of the memory, or {VARIABLE})");
    Err(Error::Memory(format!("{problem}; {remedy}")))
}

/// Bytes as a text: in GiB, or what is less of in smaller units.
pub(crate) fn gib(bytes: u64) -> String {
    match bytes {
        0..0x400 => format!("{bytes} bytes"),
        0x400..0x10_0000 => format!("{:.1} KiB", bytes as f64 / f64::from(1 << 10)),
        0x10_0000..0x4000_0000 => format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)),
        _ => format!("{:.2} GiB", bytes as f64 / f64::from(1 << 30)),
    }
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

    #[test]
    fn bytes_are_never_zero_of_a_large_unit() {
        let texts = [0, 1023, 1024, 3 << 19, 0x4000_0000].map(gib);
        assert_eq!(texts, ["0 bytes", "1023 bytes", "1.0 KiB", "1.5 MiB", "1.00 GiB"]);
    }

    #[test]
    fn a_limit_is_a_number() {
        assert_eq!(configured(OsStr::new("1000")).unwrap(), 1000);
        for text in ["abc", "-1", "1e9", "8GiB", " 1", "18446744073709551616"] {
            let message = configured(OsStr::new(text)).unwrap_err().to_string();
            assert!(message.contains(VARIABLE) && message.contains(text), "{message}");
        }
    }
}
