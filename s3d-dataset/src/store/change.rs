//! A change of a complete data set, made as a whole or not at all.
//!
//! The new files are written in `.s3d/change/new` under their later names, with the list of files and the
//! manifest. Then `.s3d/change/ready` is written. From there on the change can only be completed: replaced
//! files are removed, new files move into place, the manifest last. A process that is killed before leaves
//! the data set as it was. A process that is killed after leaves a change that [`pending`] reports, and the
//! next process with the lock completes it.

use crate::error::Result;
use crate::record::listing::visit_below;
use crate::record::pending_change::{Ready, folder, pending, ready_file};
use crate::store::backup::{remove, rename};
use crate::store::links::refuse_links_to;
use s3d_io::dataset::Layout;
use s3d_io::fs::{create_dir, read_json, sync_data_set, sync_file, write_json};
use std::path::{Path, PathBuf};

/// A change that is being written.
pub(crate) struct Change {
    layout: Layout,
    staged: Layout,
}

fn staged(layout: &Layout) -> Layout {
    Layout::new(folder(layout).join("new"))
}

/// Completes a ready change, and removes an unready one. Returns the call that made the completed change. The
/// caller must hold the lock.
pub(crate) fn settle(layout: &Layout) -> Result<Option<String>> {
    let call = pending(layout)?;
    if call.is_some() {
        complete(layout)?;
    }
    remove(&folder(layout))?;
    Ok(call)
}

impl Change {
    /// Begins a change of a complete data set, which will write to `folders`. The caller must hold the lock.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if one of the folders is a link, or lies below one.
    pub(crate) fn begin(layout: &Layout, folders: &[PathBuf]) -> Result<Self> {
        folders
            .iter()
            .try_for_each(|folder| refuse_links_to(layout.root(), folder))?;
        remove(&folder(layout))?;
        let staged = staged(layout);
        create_dir(staged.root())?;
        Ok(Self { layout: layout.clone(), staged })
    }

    /// Returns where new files are written.
    pub(crate) fn staged(&self) -> &Layout {
        &self.staged
    }

    /// Moves the new files into place. Nothing stays of `replaced`, folders of the data set, unless it was
    /// written anew. The list of files and the manifest must have been written.
    pub(crate) fn commit(self, call: &str, replaced: &[PathBuf]) -> Result<()> {
        let replaced = replaced
            .iter()
            .filter_map(|path| path.strip_prefix(self.layout.root()).map(Path::to_owned).ok())
            .collect();
        let ready = Ready { call: call.to_owned(), replaced };

        // A change that is called ready must be whole on the disk, or it could never be completed.
        sync_data_set(self.layout.root(), &entries(self.staged.root())?.1)?;

        let path = folder(&self.layout).join("ready");
        write_json(&path, &ready)?;
        sync_file(&path)?;
        complete(&self.layout)?;
        Ok(())
    }
}

impl Drop for Change {
    /// Removes a change that is not ready. A ready change stays.
    fn drop(&mut self) {
        if matches!(pending(&self.layout), Ok(None)) {
            let _ = remove(&folder(&self.layout));
        }
    }
}

/// Moves the rest of a ready change into place. Every step can be repeated.
fn complete(layout: &Layout) -> Result<()> {
    let staged = staged(layout);
    let root = layout.root();
    let path = ready_file(layout);
    let Ready { replaced, .. } = read_json(&path)?;

    let (folders, _) = entries(staged.root())?;
    let below = folders
        .iter()
        .filter_map(|folder| folder.strip_prefix(staged.root()).ok());
    for folder in below.chain(replaced.iter().map(PathBuf::as_path)) {
        refuse_links_to(root, &root.join(folder))?;
    }

    for folder in &replaced {
        let from = staged.root().join(folder);
        let to = root.join(folder);
        if from.exists() {
            remove(&to)?;
            to.parent().map_or(Ok(()), create_dir)?;
            rename(&from, &to)?;
        }
    }

    let (folders, files) = entries(staged.root())?;
    let place = |from: &Path| from.strip_prefix(staged.root()).map(|below| root.join(below)).ok();
    folders
        .iter()
        .filter_map(|from| place(from))
        .try_for_each(|to| create_dir(&to))?;

    // The manifest comes last, and before it the list whose checksum it holds.
    let last = [staged.file_list(), staged.manifest()];
    let first = files.iter().filter(|file| !last.contains(file));
    for from in first.chain(last.iter().filter(|file| files.contains(file))) {
        if let Some(to) = place(from) {
            rename(from, &to)?;
        }
    }

    // The change is complete from here on, though an empty folder may be left.
    remove(&path)?;
    remove(&folder(layout))
}

/// Returns the folders and the files below a folder, or none if it does not exist.
fn entries(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    let mut folders = Vec::new();
    let mut files = Vec::new();

    visit_below(folder, |path| {
        let is_folder = path.is_dir();
        let list = if is_folder { &mut folders } else { &mut files };
        list.push(path.to_owned());
        Ok(is_folder)
    })?;

    folders.sort();
    files.sort();
    Ok((folders, files))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_io::fs::write_bytes;
    use std::fs;

    const CALL: &str = "profile pointnet";

    fn put(layout: &Layout, name: &str, text: &str) {
        let path = layout.root().join(name);
        create_dir(path.parent().unwrap()).unwrap();
        write_bytes(&path, text.as_bytes()).unwrap();
    }

    fn state(layout: &Layout) -> Vec<(PathBuf, String)> {
        let mut state = Vec::new();
        for path in entries(layout.root()).unwrap().1 {
            let text = fs::read_to_string(&path).unwrap();
            state.push((path.strip_prefix(layout.root()).unwrap().to_owned(), text));
        }
        state
    }

    /// Begins a change of a data set that replaces a folder and adds a file.
    fn begun() -> (tempfile::TempDir, Layout, Change) {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        for name in
            ["profiles/pointnet/a", "profiles/pointnet/gone", "files.csv", "manifest.json", "mine.txt"]
        {
            put(&layout, name, "old");
        }
        let change = Change::begin(&layout, &[]).unwrap();
        for name in ["profiles/pointnet/a", "area_1/data/b", "area_1/c", "files.csv", "manifest.json"] {
            put(change.staged(), name, "new");
        }
        (dir, layout, change)
    }

    #[test]
    fn a_change_is_made_as_a_whole_or_not_at_all() {
        let (_dir, layout, change) = begun();
        let before = state(&layout).into_iter().filter(|(path, _)| !path.starts_with(".s3d"));
        let before: Vec<_> = before.collect();
        drop(change);
        assert_eq!((state(&layout), pending(&layout).unwrap()), (before.clone(), None));

        // Killed before it was ready.
        let (_dir, layout, change) = begun();
        std::mem::forget(change);
        assert_eq!((settle(&layout).unwrap(), state(&layout)), (None, before));
    }

    /// A kill may come between any two renames. The state after each of them leads to the same end.
    #[test]
    fn a_change_that_is_ready_is_completed_from_every_state() {
        let (_dir, layout, change) = begun();
        change.commit(CALL, &[layout.profile_dir("pointnet")]).unwrap();
        let whole = state(&layout);
        let names: Vec<&str> = whole.iter().map(|(path, _)| path.to_str().unwrap()).collect();
        let expected =
            ["area_1/c", "area_1/data/b", "files.csv", "manifest.json", "mine.txt", "profiles/pointnet/a"];
        assert_eq!(names, expected);
        assert!(
            whole
                .iter()
                .all(|(path, text)| (text == "old") == path.ends_with("mine.txt"))
        );

        type Step<'s> = &'s dyn Fn(&Path, &Path);
        let steps: [Step<'_>; 5] = [
            &|root, _| fs::remove_file(root.join("profiles/pointnet/gone")).unwrap(),
            &|root, new| {
                fs::remove_dir_all(root.join("profiles/pointnet")).unwrap();
                fs::rename(new.join("profiles/pointnet"), root.join("profiles/pointnet")).unwrap();
            },
            &|root, new| {
                fs::create_dir_all(root.join("area_1/data")).unwrap();
                fs::rename(new.join("area_1/c"), root.join("area_1/c")).unwrap();
            },
            &|root, new| fs::rename(new.join("files.csv"), root.join("files.csv")).unwrap(),
            &|root, new| fs::rename(new.join("area_1/data/b"), root.join("area_1/data/b")).unwrap(),
        ];

        for killed_after in 0..=steps.len() {
            let (_dir, layout, change) = begun();
            let ready = Ready { call: CALL.to_owned(), replaced: vec!["profiles/pointnet".into()] };
            write_json(&ready_file(&layout), &ready).unwrap();
            let new = change.staged().root().to_owned();
            drop(change);
            steps[..killed_after].iter().for_each(|step| step(layout.root(), &new));
            assert_eq!(pending(&layout).unwrap().as_deref(), Some(CALL));
            assert_eq!(settle(&layout).unwrap().as_deref(), Some(CALL), "{killed_after}");
            assert_eq!((state(&layout), pending(&layout).unwrap()), (whole.clone(), None), "{killed_after}");
        }
    }
}
