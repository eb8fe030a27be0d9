//! Many files of a data set in one, for images that wait to be packed: file systems of clusters slow down on
//! millions of small files.
//!
//! A bundle holds the contents one after another, then a JSON list of their [`FileRecord`]s in the same
//! order, then the length of that list (8 bytes, little-endian). Only s3d reads bundles, and removes them
//! when a package is complete.

use crate::dataset::file_list::FileRecord;
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::checksum::{Checksum, ChecksumOfParts};
use crate::fs::json::parse_json;
use crate::fs::open::open_file;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The bytes of the length of the list.
const LENGTH: u64 = 8;

/// A bundle that is being written. It takes its name only when it is complete.
#[derive(Debug)]
pub struct BundleWriter {
    file: AtomicFile,
    sum: ChecksumOfParts,
    records: Vec<FileRecord>,
}

impl BundleWriter {
    /// Begins the bundle that will be `path`. Its folder must exist.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path) -> Result<Self> {
        let file = AtomicFile::create(path)?;
        Ok(Self { file, sum: ChecksumOfParts::default(), records: Vec::new() })
    }

    /// Adds a file: its record and its content.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn append(&mut self, record: FileRecord, content: &[u8]) -> Result<()> {
        self.put(content)?;
        self.records.push(record);
        Ok(())
    }

    /// Completes the bundle. Returns its own record, in a data set in `root`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if its path does not lie below `root`.
    pub fn finish(mut self, root: &Path) -> Result<FileRecord> {
        let path = self.file.path().to_owned();
        let list = serde_json::to_vec(&self.records).map_err(|e| Error::format(&path, e.to_string()))?;
        self.put(&list)?;
        self.put(&(list.len() as u64).to_le_bytes())?;
        let (bytes, xxh3_128) = self.sum.finish();
        self.file.commit()?;
        Ok(FileRecord { bytes, xxh3_128, ..FileRecord::of_bytes(root, &path, &[])? })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.put(bytes)?;
        self.sum.add(bytes);
        Ok(())
    }
}

/// A file in a bundle.
#[derive(Clone, Debug)]
pub struct BundledFile {
    bundle: Arc<Path>,
    /// Where its content begins in the bundle.
    offset: u64,
    record: FileRecord,
}

impl BundledFile {
    /// Returns the record of the file.
    pub fn record(&self) -> &FileRecord {
        &self.record
    }

    /// Opens the content, to be read piece by piece. It is not checked.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn open(&self) -> Result<impl Read + use<>> {
        let mut file = open_file(&self.bundle)?;
        file.seek(SeekFrom::Start(self.offset))
            .map_err(|e| Error::io(&self.bundle, "read", e))?;
        Ok(file.take(self.record.bytes))
    }

    /// Returns the content.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if it is not what was written.
    pub fn read(&self) -> Result<Vec<u8>> {
        let mut content = Vec::with_capacity(self.record.bytes as usize);
        self.open()?
            .read_to_end(&mut content)
            .map_err(|e| Error::io(&self.bundle, "read", e))?;
        if Checksum::of(&content) != self.record.xxh3_128 {
            let message = format!("is damaged: {} in it is not what was written", self.record.path);
            return Err(Error::format(&self.bundle, message));
        }
        Ok(content)
    }
}

/// Returns the files in a bundle, in their order there. Their contents are not read.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no bundle, or not a whole one.
pub fn read_bundle(path: &Path) -> Result<Vec<BundledFile>> {
    let io = |e| Error::io(path, "read", e);
    let damaged = || Error::format(path, "is no whole bundle of images: remove it, and it is made again");

    // The list is at the end, before its length.
    let mut file = open_file(path)?;
    let end = file
        .metadata()
        .map_err(io)?
        .len()
        .checked_sub(LENGTH)
        .ok_or_else(damaged)?;
    let mut length = [0; LENGTH as usize];
    file.seek(SeekFrom::Start(end)).map_err(io)?;
    file.read_exact(&mut length).map_err(io)?;
    let start = end.checked_sub(u64::from_le_bytes(length)).ok_or_else(damaged)?;

    let mut list = vec![0; (end - start) as usize];
    file.seek(SeekFrom::Start(start)).map_err(io)?;
    file.read_exact(&mut list).map_err(io)?;
    let records: Vec<FileRecord> = parse_json(path, &list).map_err(|_| damaged())?;

    // The contents fill the bundle up to the list.
    let bundle: Arc<Path> = Arc::from(PathBuf::from(path));
    let mut offset = 0u64;
    let mut files = Vec::with_capacity(records.len());
    for record in records {
        let next = offset.checked_add(record.bytes).ok_or_else(damaged)?;
        files.push(BundledFile { bundle: bundle.clone(), offset, record });
        offset = next;
    }
    if offset != start {
        return Err(damaged());
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Writes a bundle of three files, one of them empty. Returns its record.
    fn write(root: &Path) -> FileRecord {
        let mut bundle = BundleWriter::create(&root.join("bundle")).unwrap();
        for (name, content) in [("b.png", "second"), ("a/x.json", ""), ("a.png", "first")] {
            let record = FileRecord::of_bytes(root, &root.join(name), content.as_bytes()).unwrap();
            bundle.append(record, content.as_bytes()).unwrap();
        }
        bundle.finish(root).unwrap()
    }

    #[test]
    fn files_come_back_and_the_bundle_is_recorded_like_any_file() {
        let dir = tempfile::tempdir().unwrap();
        let record = write(dir.path());
        record.check(dir.path()).unwrap();
        let files = read_bundle(&dir.path().join("bundle")).unwrap();
        let read: Vec<(&str, Vec<u8>)> = files
            .iter()
            .map(|f| (f.record().path.as_str(), f.read().unwrap()))
            .collect();
        assert_eq!(
            read,
            [("b.png", b"second".to_vec()), ("a/x.json", Vec::new()), ("a.png", b"first".to_vec())]
        );
    }

    #[test]
    fn a_bundle_that_is_dropped_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        drop(BundleWriter::create(&dir.path().join("bundle")).unwrap());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_cut_or_altered_bundle_is_told() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path());
        let path = dir.path().join("bundle");
        let whole = fs::read(&path).unwrap();
        for length in 0..whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            assert!(read_bundle(&path).is_err(), "{length} bytes");
        }
        let mut altered = whole;
        altered[0] ^= 1;
        fs::write(&path, altered).unwrap();
        let error = read_bundle(&path).unwrap()[0].read().unwrap_err().to_string();
        assert!(error.contains("bundle") && error.contains("b.png"), "{error}");
    }
}
