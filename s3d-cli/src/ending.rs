//! Ending early in good order: SIGINT and SIGTERM stop the work at the next file, and the call can be made
//! again.
//!
//! The first signal [cancels](s3d_dataset::Cancel) the call, which checks for that between files, chunks of
//! points and instances. If no check comes within [`GRACE`], because the work is inside one call of a library
//! such as the parsing of a large mesh, [`watch`] ends the process. No more than the piece of work at hand is
//! lost then: the files on the disk are whole at every moment. A second signal kills at once, with the status
//! of a process that the signal killed.

use crate::console;
use crate::failure::{Failure, TRY_AGAIN};
use crate::stop;
use s3d_dataset::Error;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::process;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use tracing::{error, info, warn};

/// The time that the work at hand has to end by itself. Schedulers kill after 30 seconds or more.
const GRACE: Duration = Duration::from_secs(5);

/// The time between two looks of [`watch`].
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Whether a thread has claimed to end the process. It stays locked while a message about the end is
/// written, so that nothing follows the last message.
static ENDING: Mutex<bool> = Mutex::new(false);

/// From now on SIGINT and SIGTERM ask for an end instead of killing. It is for commands whose calls can be
/// cancelled; the system ends the others.
pub(crate) fn install() {
    for signal in [SIGINT, SIGTERM] {
        if let Err(e) = stop::register(signal) {
            warn!("{} will end the command at once: {e}", stop::name(signal));
        }
    }
    if let Err(e) = thread::Builder::new().name("stop".to_owned()).spawn(watch) {
        warn!("a signal is followed at the next file, however long that takes: {e}");
    }
}

/// Claims the right to write the last message and end the process. Returns false to every caller but the
/// first; they have nothing more to do.
pub(crate) fn claim_end() -> bool {
    !std::mem::replace(&mut *ENDING.lock().unwrap_or_else(PoisonError::into_inner), true)
}

/// Waits for a signal, then for [`GRACE`], and ends the process if it still runs.
fn watch() {
    while !stop::requested() {
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
