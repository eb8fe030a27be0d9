//! What is told of a panic: it is a fault of this program, unless a reader caught that of a decoder.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::{self, PanicHookInfo};
use tracing::{debug, error};

/// Tells of panics in the log instead of beside it: nothing of those that become an error of the file.
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
