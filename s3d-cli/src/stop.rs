//! Signals that ask for an end: SIGINT (Ctrl-C) and SIGTERM.

use s3d_dataset::Cancel;
use signal_hook::{flag, low_level};
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

/// Set by the first signal.
static REQUESTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
/// The number of the last signal.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// Makes the first signal of this kind a request for an end. A second one kills at once.
pub(crate) fn register(signal: i32) -> io::Result<()> {
    // The order matters: the first signal finds the flag unset, and sets it after that.
    flag::register_conditional_default(signal, Arc::clone(&REQUESTED))
        .and_then(|_| flag::register_usize(signal, Arc::clone(&SIGNAL), signal as usize))
        .and_then(|_| flag::register(signal, Arc::clone(&REQUESTED)))
        .map(drop)
}

/// Whether a signal has asked for an end.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Returns what cancels calls when a signal asks for an end.
pub(crate) fn cancel() -> Cancel {
    Cancel::from(Arc::clone(&REQUESTED))
}

/// The name of the signal that asked for an end.
pub(crate) fn signal_name() -> &'static str {
    name(SIGNAL.load(Ordering::Relaxed) as i32)
}

/// The name of a signal, such as "SIGINT".
pub(crate) fn name(signal: i32) -> &'static str {
    low_level::signal_name(signal).unwrap_or("a signal")
}
