//! Memory that a call would take, and memory that is not needed any more.

use crate::error::{Result, UsageError};
use std::fs;

/// Refuses what would not fit into memory, before a system that promises more than it has ends the process.
/// `what` says what takes so many bytes: "1000000000000 points".
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage).
pub fn check_memory(what: &str, bytes: f64) -> Result<()> {
    let mut room: Vec<u8> = Vec::new();
    let fits = bytes < isize::MAX as f64 && room.try_reserve_exact(bytes as usize).is_ok();
    let free = free_bytes();
    if fits && free.is_none_or(|free| bytes <= free) {
        return Ok(());
    }
    Err(UsageError::Memory { what: what.to_owned(), bytes, free }.into())
}

/// Returns how many bytes processes may still take, as far as Linux and its control groups tell.
fn free_bytes() -> Option<f64> {
    let table = fs::read_to_string("/proc/meminfo").ok()?;
    let of = |name: &str| -> Option<f64> {
        let line = table.lines().find_map(|line| line.strip_prefix(name))?;
        let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
        Some(1024.0 * kibibytes)
    };
    let free = of("MemAvailable:")? + of("SwapFree:").unwrap_or(0.0);
    let limit = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let limit = limit.and_then(|limit| limit.trim().parse().ok());
    Some(free.min(limit.unwrap_or(f64::INFINITY)))
}

/// Gives the memory of what was dropped back to the system. The allocator of the GNU C library keeps what was
/// freed between two things that are still there, which can be gibibytes of a grid.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code)]
pub(crate) fn give_back() {
    // SAFETY: The function takes no memory that is in use, and may be called at any time from any thread.
    unsafe { libc::malloc_trim(0) };
}

/// Other allocators give memory back by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn give_back() {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_its_size() {
        check_memory("a thousand points", 19e3).unwrap();
        for bytes in [1e30, f64::INFINITY, 1e15] {
            let error = check_memory("many points", bytes).unwrap_err().to_string();
            assert!(error.starts_with("many points take "), "{error}");
        }
    }
}
