//! A folder of labels, open for work.

use super::error::{Error, Result};
use super::event::{Action, EVENT_VERSION, Event};
use super::fault::Fault;
use super::log::{Header, Log};
use super::state::State;
use s3d_geom::TriMesh;
use s3d_io::Error as FileError;
use s3d_io::cloud::{EVENTS_FILE, mesh_checksum};
use s3d_io::fs::{Checksum, create_dir};
use s3d_label::Taxonomy;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The name of the file whose lock says that a process works in the folder.
const LOCK_FILE: &str = ".lock";

/// A folder of labels such as `scan.labels`, open for work: the log of the events, and the [`State`] that
/// they add up to. It is locked until it is dropped, or the process ends.
///
/// The log, `events.jsonl`, is the truth: everything else follows from it. Its first line names the mesh, and
/// every further one is an [`Event`]. There is no checkpoint, as reading 100,000 strokes takes about as long
/// as reading their mesh.
#[derive(Debug)]
pub struct LabelFolder {
    path: PathBuf,
    log: Log,
    state: State,
    mesh: Checksum,
    taxonomy: Taxonomy,
    warnings: Vec<String>,
    _lock: Lock,
}

/// The lock of a folder, held until it is dropped or the process ends, however it ends.
#[derive(Debug)]
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing the file is not enough: a process that is being started may have it open for a moment.
        let _ = self.0.unlock();
    }
}

impl LabelFolder {
    /// Opens the labels of a mesh, or begins them: the folder is made if it does not exist. A last line that
    /// a kill cut is removed from the log; nobody was told that it was there.
    ///
    /// New classes and types of rooms must be words of `taxonomy`. Old ones in the log may be any.
    ///
    /// # Errors
    /// [`Error::InUse`], [`Error::OtherMesh`], [`Error::NoLabels`]; [`Error::File`] if the system refuses,
    /// and with the line for a log that is damaged before its end.
    pub fn open(path: &Path, mesh: &TriMesh, taxonomy: &Taxonomy) -> Result<Self> {
        create_dir(path)?;
        let log = path.join(EVENTS_FILE);
        if !log.exists() && has_other_files(path)? {
            return Err(Error::NoLabels { path: path.to_owned() });
        }
        let mut warnings = Vec::new();
        let lock = lock(path, &mut warnings)?;

        let faces = mesh.faces().len() as u32;
        let header = Header { version: EVENT_VERSION, mesh: mesh_checksum(mesh), faces };
        let opened = Log::open(&log, &header)?;
        if (opened.header.mesh, opened.header.faces) != (header.mesh, faces) {
            return Err(Error::OtherMesh { path: log, labelled: opened.header.faces, faces });
        }
        if opened.torn > 0 {
            let bytes = opened.torn;
            let shown = log.display();
            warnings.push(format!("{shown}: the last line was cut by a kill: its {bytes} bytes are removed"));
        }

        let mut state = State::of_mesh(mesh);
        for (line, event) in (2..).zip(opened.events) {
            let applied = state.apply(event);
            applied.map_err(|fault| FileError::line(&log, line, format!("does not fit: {fault}")))?;
        }
        Ok(Self {
            path: path.to_owned(),
            log: opened.log,
            state,
            mesh: header.mesh,
            taxonomy: taxonomy.clone(),
            warnings,
            _lock: lock,
        })
    }

    /// Returns the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the labels now.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns the checksum of the mesh.
    pub fn mesh(&self) -> Checksum {
        self.mesh
    }

    /// Returns the taxonomy whose words new events may use.
    pub fn taxonomy(&self) -> &Taxonomy {
        &self.taxonomy
    }

    /// Returns what was odd when the folder was opened, a sentence each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Does an action, and returns the new revision. By then, its event is on the disk.
    ///
    /// `revision` is the revision of the labels that the caller has seen: of two windows that change the same
    /// labels, the second has to look at them again. `at_ms` is the time for the log: see [`Event::at_ms`].
    ///
    /// # Errors
    /// [`Error::Stale`]; [`Error::Fault`] if the action does not fit; [`Error::Class`] and
    /// [`Error::RoomType`] for words that are not in the taxonomy; [`Error::File`] and [`Error::Broken`] if
    /// the event cannot be written. Nothing is changed then.
    pub fn add(&mut self, revision: u64, action: Action, at_ms: Option<u64>) -> Result<u64> {
        let now = self.check_revision(revision)?;
        self.check_words(&action)?;
        self.state.check(&action)?;

        let event = Event { version: EVENT_VERSION, number: now + 1, at_ms, action };
        self.log.add(&event)?;
        self.state.apply(event)?;
        Ok(now + 1)
    }

    /// Takes back the last action in effect, and returns the new revision. There is no limit.
    ///
    /// # Errors
    /// [`Fault::Nothing`] if no action is in effect, and the errors of [`LabelFolder::add`].
    pub fn undo(&mut self, revision: u64, at_ms: Option<u64>) -> Result<u64> {
        self.check_revision(revision)?;
        let why = "no action is left to be taken back";
        match self.state.next_undo() {
            Some(of) => self.add(revision, Action::Undo { of }, at_ms),
            None => Err(Fault::Nothing { why }.into()),
        }
    }

    /// Brings back what the last undo took back, and returns the new revision. Instances and rooms have their
    /// numbers again.
    ///
    /// # Errors
    /// [`Fault::Nothing`] if there is none, or something else was done since, and the errors of
    /// [`LabelFolder::add`].
    pub fn redo(&mut self, revision: u64, at_ms: Option<u64>) -> Result<u64> {
        self.check_revision(revision)?;
        let why = "no action is left to be brought back";
        match self.state.next_redo() {
            Some(of) => self.add(revision, Action::Redo { of }, at_ms),
            None => Err(Fault::Nothing { why }.into()),
        }
    }

    /// Returns the log.
    pub fn log(&self) -> &Path {
        self.log.path()
    }

    /// Returns the revision of the labels, if it is this one.
    pub(crate) fn check_revision(&self, given: u64) -> Result<u64> {
        let now = self.state.revision();
        if given == now {
            Ok(now)
        } else {
            Err(Error::Stale { given, now })
        }
    }

    fn check_words(&self, action: &Action) -> Result<()> {
        match action {
            Action::Paint { class: Some(class), .. } | Action::Class { class, .. } => {
                self.taxonomy.class(class)?;
            }
            Action::Room { is, .. } => {
                if let Some(kind) = &is.kind {
                    self.taxonomy.room_type(kind)?;
                }
            }
            Action::All { actions } => actions.iter().try_for_each(|action| self.check_words(action))?,
            _ => {}
        }
        Ok(())
    }
}

/// Returns whether a folder has files that no folder of labels has without a log.
fn has_other_files(path: &Path) -> Result<bool> {
    let entries = fs::read_dir(path).map_err(|e| FileError::io(path, "read", e))?;
    for entry in entries {
        let name = entry.map_err(|e| FileError::io(path, "read", e))?.file_name();
        if name != LOCK_FILE {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Takes the lock of a folder.
fn lock(folder: &Path, warnings: &mut Vec<String>) -> Result<Lock> {
    let path = folder.join(LOCK_FILE);
    let opened = File::options().create(true).truncate(false).write(true).open(&path);
    let file = opened.map_err(|e| FileError::io(&path, "write", e))?;
    match file.try_lock() {
        Ok(()) => Ok(Lock(file)),
        Err(TryLockError::WouldBlock) => Err(Error::InUse { path: folder.to_owned() }),
        Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => {
            let shown = path.display();
            warnings.push(format!("{shown}: no locks on this file system; label in one process at a time"));
            Ok(Lock(file))
        }
        Err(TryLockError::Error(e)) => Err(FileError::io(&path, "lock", e).into()),
    }
}
