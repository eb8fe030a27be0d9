//! Merges the shards of an export into one data set: the files of all units are linked or copied into one
//! folder and checked, and the tables are written.

use crate::account::Account;
use crate::context::Context;
use crate::error::{Error, InputError, Result, UsageError};
use crate::export::finish::{Totals, finish};
use crate::export::run::{Run, Target};
use crate::export::shard::assignment::Assignment;
use crate::export::transfer::bring;
use crate::parallel::for_each_in_order;
use crate::record::assets;
use crate::record::journal::{Done, Finished, Unit};
use crate::record::label_list::LabelList;
use crate::record::manifest::Manifest;
use crate::record::request::Request;
use crate::record::request::{begun_by_other_version, read_request};
use crate::record::unfinished::missing_units;
use crate::stage::Stage;
use crate::store::lock::{Lock, Sharing};
use crate::store::output::Session;
use crate::summary::{Summary, UnitTally};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_label::LabelTable;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// The most units that a message names.
const MAX_NAMED: usize = 8;

/// What a shard has left in its folder.
struct Part {
    layout: Layout,
    request: Request,
    finished: Finished,
    /// The assignment for each number of shards that worked in this folder.
    assignments: Vec<Assignment>,
}

/// Makes one data set from the folders of shards, in any order. OUT may be one of them. Returns `None` if the
/// data set is there already.
///
/// # Errors
/// [`Error::Usage`] if the shards are of different calls, or OUT holds another data set; [`Error::Input`]
/// with the shards to run again if something is missing or damaged; [`Error::Temporary`] if a shard is still
/// at work.
pub fn merge(
    folders: &[PathBuf],
    output: impl Into<PathBuf>,
    overwrite: bool,
    ctx: &Context,
) -> Result<Option<Summary>> {
    let target = Target { layout: Layout::new(output.into()), overwrite, allowed: Vec::new() };
    let run = Run::new(ctx, &target);
    let layout = run.layout();
    let folders = distinct(folders)?;
    if is_done(&folders, layout)? {
        run.tell_complete();
        return Ok(None);
    }

    // All shards must be there, of one call, and complete.
    let loading = run.account.stage(Stage::Load, None);
    let (_locks, parts) = read_parts(ctx, &folders, layout)?;
    let Some(first) = parts.first() else {
        return Err(UsageError::NoShards.into());
    };
    let request = &first.request;
    refuse_mixed(&parts)?;
    refuse_other_version(first)?;

    let mut all = Finished::default();
    for done in parts.iter().flat_map(|part| part.finished.iter()) {
        all.insert(done.clone());
    }
    let missing = missing_units(request, &all);
    if !missing.is_empty() {
        return Err(told_missing(&parts, &missing, "is missing"));
    }

    let labels = label_list(&parts)?;
    loading.end();

    let state = run.look()?;
    let table = labels.table(&LabelList::path(layout))?;
    let manifest = Manifest::begin(request, &table);
    let Some(session) = run.begin(&state, request, &manifest, Sharing::Alone)? else {
        return Ok(None);
    };

    let merging = Merging { parts: &parts, all: &all, labels: &labels, table: &table, request };
    let outcome = merging.merge(&run, &session, manifest);
    let works_in_out = parts.iter().any(|part| is_same(part.layout.root(), layout.root()));
    let made = match outcome {
        // The work of the shards in OUT stays.
        Err(e) if works_in_out => return Err(e),
        outcome => session.end(ctx, outcome)?,
    };
    Ok(Some(run.finish(request, &made)))
}

/// Reads what shards left in their folders. Returns it with the locks of all folders but OUT. OUT is locked
/// only while it is read: its lock is taken again when the merge begins there.
fn read_parts(ctx: &Context, folders: &[PathBuf], layout: &Layout) -> Result<(Vec<Lock>, Vec<Part>)> {
    let (inside, apart): (Vec<&PathBuf>, Vec<&PathBuf>) =
        folders.iter().partition(|folder| is_same(folder, layout.root()));
    let locks = lock_all(ctx, &apart)?;
    let own_lock = lock_all(ctx, &inside)?;

    let parts: Result<Vec<Part>> = folders.iter().map(|folder| Part::read(ctx, folder)).collect();
    drop(own_lock);
    Ok((locks, parts?))
}

fn lock_all(ctx: &Context, folders: &[&PathBuf]) -> Result<Vec<Lock>> {
    folders
        .iter()
        .filter_map(|folder| lock(ctx, folder).transpose())
        .collect()
}

/// A merge whose shards are all there.
struct Merging<'a> {
    parts: &'a [Part],
    all: &'a Finished,
    labels: &'a LabelList,
    table: &'a LabelTable,
    request: &'a Request,
}

impl Merging<'_> {
    /// Brings the files of all units into OUT, and writes the tables.
    fn merge(&self, run: &Run<'_>, session: &Session, manifest: Manifest) -> Result<Totals> {
        let Self { parts, all, labels, table, request } = *self;
        let layout = run.layout();

        let merging = run.account.stage(Stage::Merge, None);
        // The table is needed if this OUT is merged again, or its export is continued.
        labels.write(&LabelList::path(layout))?;
        gather(layout, parts, all, session, &run.account)?;
        merging.end();

        let tables = run.account.stage(Stage::Tables, None);
        assets::write(
            layout,
            table,
            &request.options.modalities,
            manifest.labels_padded_to(),
            request.options.conventions(),
            &request.world_offsets(),
        )?;
        let made = finish(run.ctx, layout, request, manifest, &session.journal.finished(), None)?;
        tables.end();
        Ok(made)
    }
}

/// Whether the folders were merged before: OUT is one of them, and holds the data set that they make.
fn is_done(folders: &[PathBuf], layout: &Layout) -> Result<bool> {
    let (inside, apart): (Vec<&PathBuf>, Vec<&PathBuf>) =
        folders.iter().partition(|folder| is_same(folder, layout.root()));
    if inside.is_empty() || read_request(layout)?.is_some() {
        return Ok(false);
    }

    let Ok(manifest) = Manifest::read(layout) else { return Ok(false) };
    for folder in apart {
        let of = read_request(&Layout::new(folder))?;
        if !of.is_some_and(|of| manifest.differences(&of).is_empty()) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Reads the label table of the first folder that has it whole. A shard that was killed early has none, and
/// neither has an export that was begun without shards.
fn label_list(parts: &[Part]) -> Result<LabelList> {
    let found = parts
        .iter()
        .find_map(|part| LabelList::read(&LabelList::path(&part.layout)).ok());
    found.ok_or_else(|| {
        let what = "none of the folders has the label table".to_owned();
        let remedy = "run any of the shards again, and merge then".to_owned();
        InputError::Incomplete { what, remedy }.into()
    })
}

/// Returns the folders as they are on the disk, each once.
fn distinct(folders: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut distinct: Vec<PathBuf> = Vec::new();
    for folder in folders {
        if !folder.is_dir() {
            let source = std::io::Error::from(ErrorKind::NotFound);
            return Err(FileError::io(folder, "read the folder of a shard", source).into());
        }
        if !distinct.iter().any(|other| is_same(other, folder)) {
            distinct.push(folder.clone());
        }
    }
    Ok(distinct)
}

/// Whether two paths lead to the same folder.
fn is_same(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// Locks a shard's folder, so that nobody is at work in it. Returns `None` for a folder that was never
/// locked, or that cannot be written to: nobody is at work there.
fn lock(ctx: &Context, folder: &Path) -> Result<Option<Lock>> {
    let layout = Layout::new(folder);
    if !layout.lock().exists() {
        return Ok(None);
    }
    match Lock::take(ctx, &layout, Sharing::Alone) {
        Ok(lock) => Ok(Some(lock)),
        Err(Error::File(FileError::Io { source, .. }))
            if matches!(source.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem) =>
        {
            Ok(None)
        }
        Err(e) => Err(e),
    }
}

impl Part {
    fn read(ctx: &Context, folder: &Path) -> Result<Self> {
        let layout = Layout::new(folder);
        let Some(request) = read_request(&layout)? else {
            if let Some(version) = begun_by_other_version(&layout)? {
                return Err(other_version(folder, &version));
            }
            let message = if Manifest::read(&layout).is_ok() {
                "is a complete data set, and no shard of one"
            } else {
                "holds no shard of an export: give the folders that shards of an export wrote"
            };
            return Err(FileError::format(folder, message).into());
        };
        let finished = Finished::read(ctx, &layout)?;
        let assignments = Assignment::read_all(&layout)?;
        Ok(Self { layout, request, finished, assignments })
    }
}

/// Refuses shards of different calls.
fn refuse_mixed(parts: &[Part]) -> Result<()> {
    let Some((first, others)) = parts.split_first() else { return Ok(()) };
    for other in others {
        let differences = first.request.differences(&other.request);
        if !differences.is_empty() {
            return Err(UsageError::MixedShards {
                first: first.layout.root().to_owned(),
                other: other.layout.root().to_owned(),
                differences,
            }
            .into());
        }
    }
    Ok(())
}

/// Refuses shards of another version of s3d, whose tables would differ.
fn refuse_other_version(part: &Part) -> Result<()> {
    let there = &part.request.version;
    if there == env!("CARGO_PKG_VERSION") {
        return Ok(());
    }
    Err(other_version(part.layout.root(), there))
}

fn other_version(folder: &Path, there: &str) -> Error {
    UsageError::OtherVersion { folder: folder.to_owned(), there: there.to_owned() }.into()
}

/// The error for missing or damaged units, with the shards to run again.
fn told_missing(parts: &[Part], missing: &[Unit], what: &str) -> Error {
    let named: Vec<String> = missing.iter().take(MAX_NAMED).map(Unit::to_string).collect();
    let more = match missing.len() - named.len() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };

    // The shards to run again, by the number of shards that share the work.
    let mut shards: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for assignment in parts.iter().flat_map(|part| &part.assignments) {
        shards
            .entry(assignment.shards())
            .or_default()
            .extend(assignment.shards_of(missing));
    }

    let calls = shards
        .into_iter()
        .filter(|(_, numbers)| !numbers.is_empty())
        .map(|(of, numbers)| {
            let calls: Vec<String> = numbers.iter().map(|i| format!("shard {i}/{of}")).collect();
            calls.join(", ")
        });
    let calls: Vec<String> = calls.collect();
    let calls = if calls.is_empty() {
        "every shard".to_owned()
    } else {
        calls.join(", or ")
    };

    InputError::Incomplete {
        what: format!("{}{more} {what}", named.join(", ")),
        remedy: format!("run again {calls}, and merge then"),
    }
    .into()
}

/// Brings the files of all units that OUT lacks into it, and checks each there.
fn gather(
    layout: &Layout,
    parts: &[Part],
    all: &Finished,
    session: &Session,
    account: &Account<'_>,
) -> Result<()> {
    let ctx = account.ctx;
    let started = Instant::now();

    let units: Vec<Unit> = all
        .iter()
        .map(Done::unit)
        .filter(|u| !session.journal.finished().has(u))
        .collect();
    let tally: UnitTally = units.iter().filter_map(|unit| all.get(unit)).map(Done::tally).sum();
    let files: usize = units
        .iter()
        .filter_map(|unit| all.get(unit))
        .map(|done| done.files().len())
        .sum();

    let progress = ctx.progress("merging", "files", files as u64);
    let faults: Mutex<Vec<(Unit, String)>> = Mutex::new(Vec::new());

    for_each_in_order(
        ctx,
        &units,
        || (),
        |(), unit| {
            let mut fault = None;
            for part in parts {
                // OUT's own units were checked when the merge began, and this one was not whole.
                let Some(done) = part
                    .finished
                    .get(unit)
                    .filter(|_| !is_same(part.layout.root(), layout.root()))
                else {
                    continue;
                };
                match bring_unit(ctx, layout, part, done)? {
                    None => {
                        progress.add(done.files().len() as u64);
                        return session.journal.write(done.clone());
                    }
                    Some(found) => {
                        fault = fault.or(Some(format!("{}/{found}", part.layout.root().display())))
                    }
                }
            }

            let fault = fault.unwrap_or_else(|| format!("{}: {unit} is damaged", layout.root().display()));
            faults
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push((unit.clone(), fault));
            Ok(())
        },
    )?;

    let mut faults = faults.into_inner().unwrap_or_else(PoisonError::into_inner);
    faults.sort();

    match faults.first() {
        None => {
            account.units_taken(units.len() as u64, &tally, started);
            Ok(())
        }
        Some((_, first)) => {
            let units: Vec<Unit> = faults.iter().map(|(unit, _)| unit.clone()).collect();
            Err(told_missing(parts, &units, &format!("is damaged ({first})")))
        }
    }
}

/// Brings the files of a unit into OUT. Returns what is wrong with the first file that is not as it was
/// written.
fn bring_unit(ctx: &Context, layout: &Layout, part: &Part, done: &Done) -> Result<Option<String>> {
    for record in done.files() {
        ctx.check()?;
        if let Some(fault) = bring(record, part.layout.root(), layout.root())? {
            return Ok(Some(fault));
        }
    }
    Ok(None)
}
