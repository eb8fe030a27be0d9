//! The folder of a data set: whether it may be written to, and what becomes of an earlier one in it.

use super::inputs::Inputs;
use super::manifest::Head;
use crate::failure::{Failure, Outcome};
use s3d_io::{Error, Layout, create_dir};
use std::fs;
use std::path::Path;
use tracing::{info, warn};

/// Folders in OUT: an earlier data set while it is set aside, when it is, and when it goes.
const MOVING: &str = ".s3d-previous.part";
const ASIDE: &str = ".s3d-previous";
const TRASH: &str = ".s3d-trash";

/// Refuses an OUT that holds something, unless it may be overwritten, is left of an export that did not finish, or is one
/// of the `allowed` names; looks only, changes nothing.
pub(crate) fn check(layout: &Layout, overwrite: bool, allowed: &[&str]) -> Outcome<()> {
    let root = layout.root();
    if layout.root_misleads_loaders() {
        warn!(
            "{}: \"rgb\" in the folder's name misleads loaders that swap it for another modality in whole paths",
            root.display()
        );
    }
    match fs::read_dir(root) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(e) => Err(Error::io(root, "use as the output folder", e).into()),
        Ok(entries) => {
            // What an export left that did not finish is nobody's.
            let unfinished = Head::read(&layout.manifest()).filter(|head| !head.is_complete());
            let begun = unfinished.map_or(Vec::new(), |head| layout.entries(&head.area_numbers));
            for entry in entries {
                let path = entry.map_err(|e| Error::io(root, "read", e))?.path();
                let name = path.file_name().unwrap_or_default();
                let ours = begun.iter().any(|b| b.starts_with(&path));
                if !overwrite && !ours && !allowed.iter().any(|a| name == *a) {
                    return Err(Failure::Call(format!(
                        "{} already holds {}: choose another folder, or replace the data set in it with --overwrite",
                        root.display(),
                        name.display()
                    )));
                }
            }
            Ok(())
        }
    }
}

/// Refuses an OUT in which the data set would lie on its own input, or in its annotations.
pub(crate) fn check_inputs(layout: &Layout, inputs: &Inputs) -> Outcome<()> {
    let Ok(root) = fs::canonicalize(layout.root()) else { return Ok(()) };
    let entries = Layout::new(&root).entries(&inputs.numbers());
    for area in &inputs.areas {
        for path in &area.files {
            let Ok(input) = fs::canonicalize(path) else { continue };
            if entries.iter().any(|entry| input.starts_with(entry))
                || input.is_dir() && root.starts_with(&input)
            {
                return Err(Failure::Call(format!(
                    "{}: the data set would be written over its own input {}: choose another folder",
                    layout.root().display(),
                    path.display()
                )));
            }
        }
    }
    Ok(())
}

/// An earlier data set, set aside. Unless it is [discarded](Previous::discard), it comes back when this is dropped, so
/// that an export that fails loses nothing that was there.
pub(crate) struct Previous {
    /// Its folder, if there was one.
    set_aside: Option<Layout>,
}

/// Makes the folder, and sets aside what an earlier data set of ours has there. Nothing else is touched; what is in the
/// way of the new one and is not ours is an error.
pub(crate) fn prepare(layout: &Layout, areas: &[u32]) -> Outcome<Previous> {
    create_dir(layout.root())?;
    recover(layout)?;
    let head = Head::read(&layout.manifest());
    let ours = head.as_ref().map_or(Vec::new(), |head| layout.entries(&head.area_numbers));
    for path in layout.entries(areas) {
        if path.exists() && !ours.contains(&path) {
            return Err(Failure::Call(format!(
                "{} is in the way, and was not written by s3d: move it, or choose another folder",
                path.display()
            )));
        }
    }
    let Some(head) = head else { return Ok(Previous { set_aside: None }) };
    if !head.is_complete() {
        ours.iter().try_for_each(|path| remove(path))?;
        return Ok(Previous { set_aside: None });
    }
    let moving = Layout::new(layout.root().join(MOVING));
    move_entries(layout, &moving, &head.area_numbers)?;
    rename(moving.root(), &layout.root().join(ASIDE))?;
    Ok(Previous { set_aside: Some(layout.clone()) })
}

/// Brings a folder in which an export was killed back to one of two states: the earlier data set, or the new one if it
/// was complete.
fn recover(layout: &Layout) -> Outcome<()> {
    let inside = |name: &str| layout.root().join(name);
    remove(&inside(TRASH))?;
    let moving = Layout::new(inside(MOVING));
    if moving.root().exists() {
        // The manifest moves last: it is in one of the two.
        if let Some(head) = Head::read(&moving.manifest()).or_else(|| Head::read(&layout.manifest())) {
            move_entries(&moving, layout, &head.area_numbers)?;
        }
        remove(moving.root())?;
    }
    if inside(ASIDE).exists() {
        if Head::read(&layout.manifest()).is_some_and(|head| head.is_complete()) {
            return discard(layout);
        }
        restore(layout)?;
    }
    Ok(())
}

/// Removes the data set that lies aside. It goes by one rename, so that half of it is never taken for whole.
fn discard(layout: &Layout) -> Outcome<()> {
    let trash = layout.root().join(TRASH);
    rename(&layout.root().join(ASIDE), &trash)?;
    remove(&trash)
}

/// Puts the data set that lies aside back in its place, instead of what was begun there.
fn restore(layout: &Layout) -> Outcome<()> {
    if let Some(begun) = Head::read(&layout.manifest()) {
        layout.entries(&begun.area_numbers).iter().try_for_each(|path| remove(path))?;
    }
    let aside = Layout::new(layout.root().join(ASIDE));
    if let Some(head) = Head::read(&aside.manifest()) {
        move_entries(&aside, layout, &head.area_numbers)?;
    }
    remove(aside.root())
}

impl Previous {
    /// Removes the earlier data set: the new one is complete.
    pub(crate) fn discard(mut self) -> Outcome<()> {
        self.set_aside.take().map_or(Ok(()), |layout| discard(&layout))
    }
}

impl Drop for Previous {
    fn drop(&mut self) {
        if let Some(layout) = self.set_aside.take() {
            match restore(&layout) {
                Ok(()) => info!("{}: the earlier data set is back in place", layout.root().display()),
                Err(e) => {
                    warn!("the earlier data set is kept in {}: {e}", layout.root().join(ASIDE).display())
                }
            }
        }
    }
}

/// Moves a data set's entries, those that are there, from one folder to another.
fn move_entries(from: &Layout, to: &Layout, areas: &[u32]) -> Outcome<()> {
    create_dir(to.root())?;
    for (source, target) in from.entries(areas).iter().zip(to.entries(areas)) {
        if source.exists() {
            target.parent().map_or(Ok(()), create_dir)?;
            rename(source, &target)?;
        }
    }
    // The folders that hold nothing now.
    for folder in from.shared_dirs() {
        let _ = fs::remove_dir(folder);
    }
    Ok(())
}

fn rename(from: &Path, to: &Path) -> Outcome<()> {
    fs::rename(from, to).map_err(|e| Error::io(from, "move", e).into())
}

fn remove(path: &Path) -> Outcome<()> {
    let gone = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match gone {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path, "remove", e).into()),
        _ => Ok(()),
    }
}
