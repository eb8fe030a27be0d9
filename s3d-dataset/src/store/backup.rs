//! Moves in OUT. They set an earlier data set aside, bring it back, and bring the rest of a killed export to
//! a state with one meaning. [`output`](super::output) lists the states.

use crate::error::{Error, Result};
use crate::record::listing::children;
use crate::record::manifest::Head;
use crate::record::request::read_request;
use crate::store::change;
use crate::store::state::OutputState;
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// Folders in OUT for an earlier data set: while it is set aside, once it is aside, and while it is removed.
pub(super) const MOVING: &str = ".s3d-previous.part";
pub(super) const BACKUP: &str = ".s3d-previous";
pub(super) const TRASH: &str = ".s3d-trash";

/// Brings the folder of a killed export to a state with one meaning. Returns what the folder holds then.
pub(super) fn recover(layout: &Layout) -> Result<OutputState> {
    let root = layout.root();
    change::settle(layout)?;
    remove(&root.join(TRASH))?;

    let moving = Layout::new(root.join(MOVING));
    if moving.root().exists() {
        // The manifest moves last, so it is in one of the two folders.
        let mut head = Head::read(&moving.manifest())?;
        if head.is_none() {
            head = Head::read(&layout.manifest())?;
        }
        take_back(&moving, layout, head)?;
    }

    let state = OutputState::read(layout)?;
    if state.is_complete() {
        clear(layout)?;
        if root.join(BACKUP).exists() {
            discard(layout)?;
        }
        return Ok(state.without_request());
    }

    if root.join(BACKUP).exists() && !state.has_request() {
        restore(layout)?;
        return OutputState::read(layout);
    }
    Ok(state)
}

/// Removes the working files of an unfinished export, except the lock.
pub(super) fn clear(layout: &Layout) -> Result<()> {
    remove(&layout.request())?;
    remove(&layout.journal_dir())?;
    remove(&layout.failed())?;
    for path in children(&layout.work_dir())? {
        if path != layout.lock() {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Removes the earlier data set. One rename takes it away, so half of it is never mistaken for all of it.
pub(super) fn discard(layout: &Layout) -> Result<()> {
    let trash = layout.root().join(TRASH);
    rename(&layout.root().join(BACKUP), &trash)?;
    remove(&trash)
}

/// Brings the earlier data set back, in place of the one that was begun.
pub(super) fn restore(layout: &Layout) -> Result<()> {
    let aside = Layout::new(layout.root().join(BACKUP));
    let head = Head::read(&aside.manifest())?;
    let mut begun = read_request(layout)?.map(|request| request.numbers());
    // Without a request, nobody continues what was begun.
    clear(layout)?;
    if begun.is_none() {
        begun = Head::read(&layout.manifest())?.map(|head| head.area_numbers);
    }
    if let (Some(_), Some(areas)) = (&head, begun) {
        layout.entries(&areas).iter().try_for_each(|path| remove(path))?;
    }
    take_back(&aside, layout, head)
}

/// Moves the data set of a folder in OUT back into OUT, and removes the folder. The folder's content is
/// removed only if its manifest says that everything is in place.
fn take_back(from: &Layout, layout: &Layout, head: Option<Head>) -> Result<()> {
    let Some(head) = head else {
        return match fs::remove_dir(from.root()) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::unfit(
                from.root(),
                "holds an earlier data set, or a part of it, without its manifest: move it to another folder",
            )),
            _ => Ok(()),
        };
    };
    move_entries(from, layout, &head.area_numbers)?;
    remove(from.root())
}

/// Moves the existing entries of a data set from one folder to another.
pub(super) fn move_entries(from: &Layout, to: &Layout, areas: &[u32]) -> Result<()> {
    create_dir(to.root())?;
    for (source, target) in from.entries(areas).iter().zip(to.entries(areas)) {
        if is_there(source)? {
            target.parent().map_or(Ok(()), create_dir)?;
            rename(source, &target)?;
        }
    }
    // Remove the folders that are empty now.
    for folder in from.shared_dirs() {
        let _ = fs::remove_dir(folder);
    }
    Ok(())
}

/// Returns whether a file or folder of this name exists. One that cannot be looked at now is an error, not
/// missing.
fn is_there(path: &Path) -> Result<bool> {
    match fs::symlink_metadata(path) {
        Ok(_) => Ok(true),
        Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(false),
        Err(e) => Err(FileError::io(path, "look for", e).into()),
    }
}

pub(super) fn rename(from: &Path, to: &Path) -> Result<()> {
    fs::rename(from, to).map_err(|e| FileError::io(from, "move", e).into())
}

pub(super) fn remove(path: &Path) -> Result<()> {
    let gone = if path.is_dir() {
        fs::remove_dir_all(path)
    } else {
        fs::remove_file(path)
    };
    match gone {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(FileError::io(path, "remove", e).into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MANIFEST: &str = r#"{"generator":"s3d","status":"complete","area_numbers":[3]}"#;

    /// A folder with a data set, or the rest of one, in one of the folders aside.
    fn interrupted(aside: &str, manifest: Option<&str>) -> (tempfile::TempDir, Layout) {
        let dir = tempfile::tempdir().unwrap();
        let moved = Layout::new(dir.path().join(aside));
        create_dir(&moved.area_dir(3)).unwrap();
        fs::write(moved.area_dir(3).join("image.png"), "image").unwrap();
        if let Some(text) = manifest {
            fs::write(moved.manifest(), text).unwrap();
        }
        let layout = Layout::new(dir.path());
        (dir, layout)
    }

    #[test]
    fn a_data_set_aside_comes_back_or_stays_but_is_never_lost() {
        for aside in [BACKUP, MOVING] {
            let (dir, layout) = interrupted(aside, Some(MANIFEST));
            recover(&layout).unwrap();
            assert!(layout.area_dir(3).join("image.png").exists() && layout.manifest().exists());
            assert!(!dir.path().join(aside).exists());
            // A missing or damaged manifest says nothing about the files.
            for manifest in [None, Some("{\"generator\":\"s3"), Some("")] {
                let (dir, layout) = interrupted(aside, manifest);
                let message = recover(&layout).unwrap_err().to_string();
                assert!(message.contains("holds an earlier data set"), "{message}");
                assert!(dir.path().join(aside).join("area_3/image.png").exists());
            }
        }

        // A folder aside with nothing moved into it yet.
        let dir = tempfile::tempdir().unwrap();
        create_dir(&dir.path().join(MOVING)).unwrap();
        recover(&Layout::new(dir.path())).unwrap();
        assert!(!dir.path().join(MOVING).exists());
    }
}
