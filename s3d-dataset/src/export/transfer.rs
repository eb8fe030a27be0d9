//! Brings recorded files from one folder to another.

use crate::error::Result;
use s3d_io::Error as FileError;
use s3d_io::dataset::FileRecord;
use s3d_io::fs::{AtomicFile, create_dir, open_file};
use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Brings a file of the folder `from` to the same name in `to`: as a hard link where the file systems can do
/// that, and otherwise as a copy. Then reads it there. Returns what is wrong with it; `None` if it is the
/// file that was recorded.
pub(crate) fn bring(record: &FileRecord, from: &Path, to: &Path) -> Result<Option<String>> {
    let source = record.path_in(from);
    let target = record.path_in(to);

    // Refuses a path that leads out of the folder.
    FileRecord::of_bytes(to, &target, b"")?;
    if let Some(folder) = target.parent() {
        create_dir(folder)?;
    }

    // A hard link to a symbolic link would be a symbolic link too, to a file that somebody else may remove.
    // If hard linking fails for another reason, such as a name that is taken, a copy reports the reason
    // better. The copy takes its place only when it is whole, so that nothing is lost if the two are one
    // file, as through two paths to one folder.
    let is_link = fs::symlink_metadata(&source).is_ok_and(|found| found.is_symlink());
    if is_link || fs::hard_link(&source, &target).is_err() {
        let mut reader = match record.check_size(from).and_then(|()| open_file(&source)) {
            Err(FileError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                return Ok(Some(format!("{}: {source}", record.path)));
            }
            Err(e @ FileError::Format { .. }) => return Ok(Some(e.to_string())),
            reader => reader?,
        };
        let mut file = AtomicFile::create(&target)?;
        io::copy(&mut reader, &mut file).map_err(|e| FileError::io(&target, "copy to", e))?;
        file.commit()?;
    }

    Ok(record.fault(to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_comes_whole_in_place_of_another_or_its_fault_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let from = dir.path().join("from");
        let to = dir.path().join("to");
        create_dir(&from.join("a")).unwrap();
        fs::write(from.join("a/b"), b"content").unwrap();
        let record = FileRecord::of_file(&from, &from.join("a/b")).unwrap();
        create_dir(&to.join("a")).unwrap();

        fs::write(to.join("a/b"), b"another").unwrap();
        assert_eq!(bring(&record, &from, &to).unwrap(), None);
        assert_eq!(fs::read(to.join("a/b")).unwrap(), b"content");

        fs::write(from.join("a/b"), b"contenu").unwrap();
        assert!(
            bring(&record, &from, &to)
                .unwrap()
                .unwrap()
                .contains("a/b: is damaged: other content")
        );

        fs::remove_file(from.join("a/b")).unwrap();
        assert!(bring(&record, &from, &to).unwrap().unwrap().starts_with("a/b: "));

        // Files are copied between file systems.
        fs::write(from.join("a/b"), b"content").unwrap();
        if let Ok(memory) = tempfile::tempdir_in("/dev/shm") {
            let elsewhere = memory.path().join("to");
            assert_eq!(bring(&record, &from, &elsewhere).unwrap(), None);
            assert_eq!(fs::read(elsewhere.join("a/b")).unwrap(), b"content");
        }

        for path in ["../c", "/c", "a/../../c"] {
            let outside = FileRecord { path: path.into(), ..record.clone() };
            assert!(bring(&outside, &from, &to).is_err(), "{path}");
        }
    }

    /// A folder that is mounted at two places has two paths that look like two folders.
    #[cfg(unix)]
    #[test]
    fn one_folder_by_two_paths_keeps_its_files_and_links_become_files() {
        let dir = tempfile::tempdir().unwrap();
        let from = dir.path().join("from");
        let two = dir.path().join("two");
        create_dir(&from).unwrap();
        std::os::unix::fs::symlink(&from, &two).unwrap();
        fs::write(from.join("b"), b"content").unwrap();
        let record = FileRecord::of_file(&from, &from.join("b")).unwrap();
        assert_eq!(bring(&record, &from, &two).unwrap(), None);
        assert_eq!(fs::read(from.join("b")).unwrap(), b"content");

        let linked = dir.path().join("linked");
        let to = dir.path().join("to");
        create_dir(&linked).unwrap();
        std::os::unix::fs::symlink(from.join("b"), linked.join("b")).unwrap();
        assert_eq!(bring(&record, &linked, &to).unwrap(), None);
        fs::remove_dir_all(&from).unwrap();
        assert_eq!(fs::read(to.join("b")).unwrap(), b"content");
    }
}
