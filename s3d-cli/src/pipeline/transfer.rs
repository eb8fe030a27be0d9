//! Recorded files from one folder to another.

use crate::failure::Outcome;
use s3d_io::{AtomicFile, Error, FileRecord, create_dir};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::Path;

/// Gives a file of the folder `from` the same name in `to`: as a second name of the same bytes where the file systems can do
/// that, and else as a copy. Then it is read there; what is wrong with it is returned: nothing, if it is the file that was
/// recorded.
pub(crate) fn bring(record: &FileRecord, from: &Path, to: &Path) -> Outcome<Option<String>> {
    let (source, target) = (record.path_in(from), record.path_in(to));
    // Refuses a path that leads out of the folder.
    FileRecord::of_bytes(to, &target, b"")?;
    if let Some(folder) = target.parent() {
        create_dir(folder)?;
    }
    match fs::remove_file(&target) {
        Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(&target, "replace", e).into()),
        _ => {}
    }
    // Whatever keeps it from being linked, a copy says it better.
    if fs::hard_link(&source, &target).is_err() {
        let mut reader = match File::open(&source) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Some(format!("{}: {e}", record.path))),
            reader => reader.map_err(|e| Error::io(&source, "read", e))?,
        };
        let mut file = AtomicFile::create(&target)?;
        io::copy(&mut reader, &mut file).map_err(|e| Error::io(&target, "copy to", e))?;
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
        let (from, to) = (dir.path().join("from"), dir.path().join("to"));
        create_dir(&from.join("a")).unwrap();
        fs::write(from.join("a/b"), b"content").unwrap();
        let record = FileRecord::of_file(&from, &from.join("a/b")).unwrap();
        create_dir(&to.join("a")).unwrap();
        fs::write(to.join("a/b"), b"another").unwrap();
        assert_eq!(bring(&record, &from, &to).unwrap(), None);
        assert_eq!(fs::read(to.join("a/b")).unwrap(), b"content");
        fs::write(from.join("a/b"), b"contenu").unwrap();
        assert_eq!(bring(&record, &from, &to).unwrap().unwrap(), "a/b: other content");
        fs::remove_file(from.join("a/b")).unwrap();
        assert!(bring(&record, &from, &to).unwrap().unwrap().starts_with("a/b: "));
        // Between file systems it is copied.
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
}
