//! The folder of a data set: what it holds, whether it may be written to, what happens to an earlier data set
//! in it, and how a killed export goes on.
//!
//! While an export is unfinished, `.s3d/request.json` holds the request, `.s3d/journal` the finished work,
//! and the manifest says "running". An earlier data set that is being replaced lies in `.s3d-previous` until
//! the new one is complete. Every step from one state to the next is one rename or one file, so a process
//! that comes after a kill finds one of these states:
//!
//! | `request.json` | manifest | `.s3d-previous` | |
//! |---|---|---|---|
//! | – | – | – | nothing |
//! | any | complete | any | a complete data set; the other files are removed |
//! | there | – or running | any | an unfinished export, to continue |
//! | – | – or running | there | the new one had not begun, or failed for good: the earlier comes back |
//! | – | running | – | the rest of an export by a version without a journal, which nobody continues |

use crate::account::Account;
use crate::context::Context;
use crate::error::{Activity, Error, InputError, Result, TemporaryError, UsageError, passes};
use crate::record::journal::{Done, Finished, Journal};
use crate::record::listing::remove_parts;
use crate::record::manifest::Manifest;
use crate::record::request::Request;
use crate::record::request::read_request;
use crate::store::backup::{
    BACKUP, MOVING, TRASH, clear, discard, move_entries, recover, remove, rename, restore,
};
use crate::store::lock::{Lock, Sharing};
use crate::store::state::{Holding, OutputState};
use s3d_io::dataset::{Layout, read_file_list};
use s3d_io::fs::{sync_data_set, sync_file, write_bytes, write_json};
use std::time::{Duration, Instant};

/// How an export begins.
pub(crate) enum Begin {
    /// There is something to do.
    Session(Session),
    /// The data set is there already.
    NothingToDo,
}

/// An export that holds the lock of its folder. Until [`Session::end`], it can be continued from the files on
/// disk at any moment.
pub(crate) struct Session {
    layout: Layout,
    lock: Lock,
    /// The finished units, from earlier runs too.
    pub(crate) journal: Journal,
}

/// Begins or continues an export into OUT. `state` is what OUT held before the lock was taken. `manifest` is
/// written if the export begins.
///
/// # Errors
/// [`Error::Usage`] if OUT holds a data set or an unfinished export of another request and `overwrite` is not
/// set, or if files that are not ours are in the way. [`Error::Temporary`] if another process exports into
/// OUT.
pub(crate) fn begin(
    layout: &Layout,
    state: &OutputState,
    overwrite: bool,
    request: &Request,
    manifest: &Manifest,
    account: &Account<'_>,
) -> Result<Begin> {
    let ctx = account.ctx;

    // Refusals come before any change. A complete data set needs no lock, since it may be on a read-only
    // disk.
    let leftovers = [BACKUP, MOVING, TRASH].map(|name| layout.root().join(name));
    if !leftovers.iter().any(|path| path.exists()) {
        let holding = state.compare(request);
        holding.refuse(layout, overwrite)?;
        if holding.is_complete() && !layout.work_dir().exists() && is_intact(ctx, layout, overwrite)? {
            return Ok(Begin::NothingToDo);
        }
    }

    state.refuse_links(layout, request)?;
    let lock = Lock::take(ctx, layout, Sharing::Alone)?;
    let begun =
        recover(layout).and_then(|state| begin_locked(layout, &state, overwrite, request, manifest, account));

    match begun {
        Ok(Some(finished)) => {
            let journal = Journal::begin(layout, finished)?;
            Ok(Begin::Session(Session { layout: layout.clone(), lock, journal }))
        }
        Ok(None) => {
            lock.abandon();
            Ok(Begin::NothingToDo)
        }
        Err(e) => {
            // Bring back an earlier data set if it was set aside but nothing replaced it.
            if matches!(read_request(layout), Ok(None))
                && let Err(e) = recover(layout)
            {
                ctx.warn(e);
            }
            lock.abandon();
            Err(e)
        }
    }
}

/// How often a shard tries to begin, and how long in all.
const BEGIN_EVERY: Duration = Duration::from_millis(100);
const BEGIN_WITHIN: Duration = Duration::from_secs(60);

/// Begins or continues a shard's work in OUT. Other shards of the same request may work there. Finished work
/// is not checked yet.
///
/// # Errors
/// The same as for [`begin`]. [`Error::Temporary`] if another process merges, or exports alone.
pub(crate) fn begin_shard(
    ctx: &Context,
    layout: &Layout,
    overwrite: bool,
    request: &Request,
    manifest: &Manifest,
) -> Result<Begin> {
    let started = Instant::now();
    OutputState::read(layout)?.refuse_links(layout, request)?;
    loop {
        // The first shard prepares OUT, alone for that moment.
        match Lock::take(ctx, layout, Sharing::Alone) {
            Ok(lock) => {
                let begun = begin_alone(ctx, layout, overwrite, request, manifest);
                lock.abandon();
                if !begun? {
                    return Ok(Begin::NothingToDo);
                }
            }
            Err(Error::Temporary(_)) => {}
            Err(e) => return Err(e),
        }

        match Lock::take(ctx, layout, Sharing::Shards) {
            Ok(lock) => {
                let holding = OutputState::read(layout)?.compare(request);
                if let Err(e) = holding.refuse(layout, overwrite) {
                    lock.abandon();
                    return Err(e);
                }
                if holding.is_unfinished() {
                    let journal = Journal::begin(layout, Finished::read(ctx, layout)?)?;
                    return Ok(Begin::Session(Session { layout: layout.clone(), lock, journal }));
                }
                lock.abandon();
                if started.elapsed() > BEGIN_WITHIN {
                    let path = layout.root().to_owned();
                    return Err(TemporaryError::InUse { path, by: Activity::OtherShards }.into());
                }
            }
            Err(e @ Error::Temporary(_)) if started.elapsed() > BEGIN_WITHIN => return Err(e),
            Err(Error::Temporary(_)) => {}
            Err(e) => return Err(e),
        }

        ctx.check()?;
        std::thread::sleep(BEGIN_EVERY);
    }
}

/// Prepares OUT for the work of shards. Returns whether there is something to do.
fn begin_alone(
    ctx: &Context,
    layout: &Layout,
    overwrite: bool,
    request: &Request,
    manifest: &Manifest,
) -> Result<bool> {
    let state = recover(layout)?;
    if state.compare(request).is_unfinished() {
        // Files that are being written stay: where locks work only within one machine, others may be writing
        // them.
        remove(&layout.failed())?;
        manifest.write(layout)?;
        return Ok(true);
    }
    Ok(begin_locked(layout, &state, overwrite, request, manifest, &Account::new(ctx))?.is_some())
}

/// Returns the finished units of an unfinished export, checked against their files.
fn go_on(layout: &Layout, account: &Account<'_>) -> Result<Finished> {
    let ctx = account.ctx;
    let started = Instant::now();
    let finished = Finished::read(ctx, layout)?.checked(ctx, layout)?;
    let tally = finished.iter().map(Done::tally).sum();
    account.units_taken(finished.len() as u64, &tally, started);
    ctx.info(format_args!(
        "{}: goes on where it stopped; {} units of work are done",
        layout.root().display(),
        finished.len()
    ));
    Ok(finished)
}

/// Prepares OUT for work. OUT was recovered and holds `state`. Returns the finished units, or `None` if
/// everything is done.
fn begin_locked(
    layout: &Layout,
    state: &OutputState,
    overwrite: bool,
    request: &Request,
    manifest: &Manifest,
    account: &Account<'_>,
) -> Result<Option<Finished>> {
    let ctx = account.ctx;
    let holding = state.compare(request);
    holding.refuse(layout, overwrite)?;

    // The half-written files of a killed process are of no use in any state. The folders of areas are
    // cleaned, or removed, below.
    remove_parts(layout.root(), false)?;
    remove_parts(&layout.work_dir(), true)?;
    for folder in layout.shared_dirs() {
        remove_parts(&folder, false)?;
    }

    match holding {
        Holding::Complete { .. } if holding.is_complete() && is_intact(ctx, layout, overwrite)? => {
            return Ok(None);
        }
        Holding::Unfinished { areas, differences, .. } if differences.is_empty() => {
            remove(&layout.failed())?;
            for folder in layout.entries(&areas).iter().filter(|entry| entry.is_dir()) {
                remove_parts(folder, true)?;
            }
            // The manifest may not have been written yet, or may have lost its bytes.
            manifest.write(layout)?;
            return go_on(layout, account).map(Some);
        }
        Holding::Nothing => {
            refuse_in_the_way(layout, request, &[])?;
            clear(layout)?;
        }
        Holding::Complete { .. } => {
            let areas = state.areas_of_manifest();
            refuse_in_the_way(layout, request, &areas)?;
            let moving = Layout::new(layout.root().join(MOVING));
            move_entries(layout, &moving, &areas)?;
            rename(moving.root(), &layout.root().join(BACKUP))?;
            sync_data_set(layout.root(), &[])?;
        }
        Holding::Unfinished { areas, .. } | Holding::Leftover { areas } => {
            refuse_in_the_way(layout, request, &areas)?;
            ctx.info(format_args!(
                "{}: what an earlier export left there is replaced",
                layout.root().display()
            ));
            // From here on there is nothing to continue. The lock stays in place.
            clear(layout)?;
            layout.entries(&areas).iter().try_for_each(|path| remove(path))?;
        }
    }

    write_json(&layout.request(), request)?;
    // Without its request on disk, nobody could continue the export.
    sync_file(&layout.request())?;
    manifest.write(layout)?;
    Ok(Some(Finished::default()))
}

/// Returns whether all files of a complete data set are there, checked by size or, if `exactly`, by content.
fn is_intact(ctx: &Context, layout: &Layout, exactly: bool) -> Result<bool> {
    let records = match read_file_list(&layout.file_list()) {
        Ok(records) => records,
        Err(e) if passes(&e) => return Err(e.into()),
        Err(_) if exactly => return Ok(false),
        Err(e) => return Err(InputError::Remake { what: e.to_string() }.into()),
    };

    let faults = if exactly {
        let files: Vec<_> = records.iter().collect();
        crate::record::listing::faults(ctx, layout, &files)?
            .into_iter()
            .map(|(_, fault)| fault)
            .collect()
    } else {
        records
            .iter()
            .filter(|record| record.check_size(layout.root()).is_err())
            .map(|r| r.path.clone())
            .collect::<Vec<String>>()
    };

    let Some(first) = faults.first() else { return Ok(true) };

    if exactly {
        ctx.warn(format_args!(
            "{}: {} files are not as they were written, the first: {first}; all is made again",
            layout.root().display(),
            faults.len()
        ));
        return Ok(false);
    }

    let what = format!(
        "{}: the data set was complete, but {} of its files are missing or cut, the first: {first}",
        layout.root().display(),
        faults.len()
    );
    Err(InputError::Remake { what }.into())
}

/// Refuses files in the way of the requested data set, except the files of `areas`, which are ours.
fn refuse_in_the_way(layout: &Layout, request: &Request, areas: &[u32]) -> Result<()> {
    let ours = if areas.is_empty() {
        Vec::new()
    } else {
        layout.entries(areas)
    };
    for path in layout.entries(&request.numbers()) {
        if path.exists() && !ours.contains(&path) {
            return Err(UsageError::InTheWay { path }.into());
        }
    }
    Ok(())
}

impl Session {
    /// Ends the export as `outcome` says.
    ///
    /// A complete data set takes the place of an earlier one. After a temporary failure everything stays in
    /// place, to be continued. After any other failure an earlier data set comes back; without one, the
    /// finished work stays but does not hinder another call.
    ///
    /// A shard's session ends when it is dropped: its finished work stays, whatever the outcome.
    pub(crate) fn end<T>(self, ctx: &Context, outcome: Result<T>) -> Result<T> {
        let Self { layout, lock, journal } = self;
        drop(journal);

        let ended = match &outcome {
            Ok(_) => end_complete(&layout),
            Err(e) if e.is_temporary() => Ok(()),
            Err(_) if layout.root().join(BACKUP).exists() => {
                match restore(&layout) {
                    Ok(()) => {
                        ctx.info(format_args!(
                            "{}: the earlier data set is back in place",
                            layout.root().display()
                        ));
                    }
                    Err(e) => {
                        ctx.warn(format_args!(
                            "the earlier data set is kept in {}: {e}",
                            layout.root().join(BACKUP).display()
                        ));
                    }
                }
                Ok(())
            }
            Err(_) => {
                // This may fail on a full disk. The first failure is the one to report.
                let _ = write_bytes(&layout.failed(), b"");
                Ok(())
            }
        };

        lock.abandon();
        ended.and(outcome)
    }
}

fn end_complete(layout: &Layout) -> Result<()> {
    if layout.root().join(BACKUP).exists() {
        discard(layout)?;
    }
    clear(layout)
}
