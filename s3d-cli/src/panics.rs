//! The report of a panic: a fault of this program, unless a decoder panicked and a reader caught it.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::{self, PanicHookInfo};
use tracing::{debug, error};

/// Reports panics in the log instead of beside it. A panic that becomes an error of the file is only a
/// detail.
pub(crate) fn install() {
    panic::set_hook(Box::new(tell));
}

fn tell(panic: &PanicHookInfo<'_>) {
    let message = panic.payload_as_str().unwrap_or("no message");
    let place = panic
        .location()
        .map_or_else(String::new, |l| format!(" at {}:{}", l.file(), l.line()));
    if s3d_io::panic_is_caught() {
        debug!("a decoder gave up: {message}{place}");
        return;
    }
    error!("panicked, which is a fault of s3d, not of its input: {message}{place}; please report it");
    let backtrace = Backtrace::capture();
    if backtrace.status() == BacktraceStatus::Captured {
        error!("{backtrace}");
    }
}
