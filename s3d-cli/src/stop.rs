//! Ending early in good order: SIGINT and SIGTERM stop the work at the next file, and the call can be made
//! again.
//!
//! The first signal [cancels](Cancel) the call, whose work looks at that between files, chunks of points and
//! instances. Where none looks at it within [`GRACE`] — inside one call of a library, such as the parsing of
//! a large mesh — the process ends all the same, by [`watch`]: what is on the disk is whole at every moment,
//! so that this loses no more than the piece of work at hand. A second signal kills at once, with the status
//! of a process that the signal killed.

use crate::console;
use crate::failure::{Failure, TRY_AGAIN};
use s3d_dataset::{Cancel, Error};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use tracing::{error, info, warn};

/// How long the work at hand has to come to an end of its own. Schedulers kill after 30 seconds or more.
const GRACE: Duration = Duration::from_secs(5);

/// How often [`watch`] looks.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Set by the first signal.
static REQUESTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
/// The signal that asked first or last.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// Whether somebody has claimed to end the process. Locked while something is said of the end, so that the
/// last word is the last.
static ENDING: Mutex<bool> = Mutex::new(false);

/// From now on SIGINT (Ctrl-C) and SIGTERM ask for an end instead of making it. For commands whose calls can
/// be cancelled; others are better ended by the system.
pub(crate) fn install() {
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the first signal finds the flag unset, and sets it after that.
        let installed = flag::register_conditional_default(signal, Arc::clone(&REQUESTED))
            .and_then(|_| flag::register_usize(signal, Arc::clone(&SIGNAL), signal as usize))
            .and_then(|_| flag::register(signal, Arc::clone(&REQUESTED)));
        if let Err(e) = installed {
            warn!("{} will end the command at once: {e}", name(signal));
        }
    }
    if let Err(e) = thread::Builder::new().name("stop".to_owned()).spawn(watch) {
        warn!("a signal is followed at the next file, however long that takes: {e}");
    }
}

/// Whether a signal has asked for an end.
fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// What ends calls when a signal asks for it.
pub(crate) fn cancel() -> Cancel {
    Cancel::from(Arc::clone(&REQUESTED))
}

/// The signal that asked for an end.
pub(crate) fn signal_name() -> &'static str {
    name(SIGNAL.load(Ordering::Relaxed) as i32)
}

fn name(signal: i32) -> &'static str {
    low_level::signal_name(signal).unwrap_or("a signal")
}

/// Claims the right to say the last word and end the process. Who does not get it has nothing more to do.
pub(crate) fn claim_end() -> bool {
    !std::mem::replace(&mut *ENDING.lock().unwrap_or_else(PoisonError::into_inner), true)
}

/// Waits for a signal, then for [`GRACE`], and ends the process if it is still there.
fn watch() {
    while !requested() {
        thread::sleep(LOOK_EVERY);
    }
    let ending = ENDING.lock().unwrap_or_else(PoisonError::into_inner);
    if !*ending {
        info!("stopping at the next file; a second signal stops at once");
    }
    drop(ending);
    thread::sleep(GRACE);
    if claim_end() {
        console::clear();
        error!("{}", Failure::from(Error::Cancelled));
        console::finished(TRY_AGAIN);
        process::exit(i32::from(TRY_AGAIN));
    }
}
