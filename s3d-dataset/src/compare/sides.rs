//! The two data sets while they are compared, and the files that could not be read.

use super::comparison::{ComparedSet, Side, UnreadFile};
use crate::error::{Error, Result, UsageError};
use crate::record::data_set::DataSet;
use s3d_io::dataset::{FileRecord, Layout};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Both data sets.
pub(crate) struct Sides {
    pub(crate) a: DataSet,
    pub(crate) b: DataSet,
    unread: Mutex<BTreeMap<(Side, String), String>>,
}

impl Sides {
    /// Opens both data sets.
    ///
    /// # Errors
    /// [`Error::Usage`] if one is not there; otherwise the errors of [`DataSet::open`].
    pub(crate) fn open(a: &Path, b: &Path) -> Result<Self> {
        for folder in [a, b] {
            // A manifest that is no regular file is reported by its reader.
            if std::fs::symlink_metadata(Layout::new(folder).manifest()).is_err() {
                return Err(UsageError::NoDataSet { folder: folder.to_owned() }.into());
            }
        }
        Ok(Self { a: DataSet::open(a)?, b: DataSet::open(b)?, unread: Mutex::default() })
    }

    pub(crate) fn both(&self) -> [(Side, &DataSet); 2] {
        [(Side::A, &self.a), (Side::B, &self.b)]
    }

    pub(crate) fn of(&self, side: Side) -> &DataSet {
        match side {
            Side::A => &self.a,
            Side::B => &self.b,
        }
    }

    /// The areas of both data sets, by number.
    pub(crate) fn areas(&self) -> Vec<u32> {
        let mut areas: Vec<u32> = self.a.areas().iter().chain(self.b.areas()).copied().collect();
        areas.sort_unstable();
        areas.dedup();
        areas
    }

    /// Whether both lists give these files the same bytes. False if a list lacks its file.
    pub(crate) fn are_same(&self, a: &Path, b: &Path) -> bool {
        let [a, b] = [(&self.a, a), (&self.b, b)].map(|(data, path)| data.files.record(path));
        a.is_ok_and(|a| b.is_ok_and(|b| have_same_bytes(a, b)))
    }

    /// Returns the value that was read. An unusable file is noted and gives `None`; other errors are
    /// returned.
    pub(crate) fn keep<T>(&self, side: Side, read: Result<T>) -> Result<Option<T>> {
        match read {
            Ok(value) => Ok(Some(value)),
            Err(Error::File(e)) => {
                self.add(side, self.name(side, e.path()), e.message());
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }

    /// Notes a file that could not be compared. The first message on a file is kept.
    pub(crate) fn add(&self, side: Side, path: String, message: String) {
        let mut unread = self.unread.lock().unwrap_or_else(PoisonError::into_inner);
        unread.entry((side, path)).or_insert(message);
    }

    /// The name of a file, relative to the data set's folder.
    pub(crate) fn name(&self, side: Side, path: &Path) -> String {
        self.of(side).files.name(path)
    }

    /// The files that could not be compared, by side and path.
    pub(crate) fn into_unread(self) -> Vec<UnreadFile> {
        let unread = self.unread.into_inner().unwrap_or_else(PoisonError::into_inner);
        unread
            .into_iter()
            .map(|((side, path), message)| UnreadFile { side, path, message })
            .collect()
    }
}

/// The records of a data set by path.
pub(crate) fn records(data: &DataSet) -> BTreeMap<&str, &FileRecord> {
    data.files
        .records()
        .map(|record| (record.path.as_str(), record))
        .collect()
}

pub(crate) fn have_same_bytes(a: &FileRecord, b: &FileRecord) -> bool {
    (a.bytes, a.xxh3_128) == (b.bytes, b.xxh3_128)
}

/// Describes a data set as a whole.
pub(crate) fn about(folder: &Path, data: &DataSet) -> ComparedSet {
    let (files, bytes) = data.size();
    ComparedSet {
        folder: folder.display().to_string(),
        version: data.version().to_owned(),
        seed: data.seed(),
        files,
        bytes,
        areas: data.areas().to_vec(),
        taxonomy: data.taxonomy().map(|taxonomy| taxonomy.name().to_owned()),
    }
}
