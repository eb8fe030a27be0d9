//! The bundle of a scan location or photograph: its files in one.

use crate::error::Result;
use s3d_io::dataset::{BundleWriter, FileRecord, Layout};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A bundle that threads add files to, in any order. It is begun with its first file.
pub(crate) struct UnitBundle<'a> {
    layout: &'a Layout,
    path: PathBuf,
    writer: Mutex<Option<BundleWriter>>,
}

impl<'a> UnitBundle<'a> {
    /// Takes the uuid of a scan location or photograph.
    pub(crate) fn new(layout: &'a Layout, area: u32, uuid: &str) -> Self {
        Self { layout, path: layout.bundles_dir(area).join(uuid), writer: Mutex::default() }
    }

    fn writer(&self) -> MutexGuard<'_, Option<BundleWriter>> {
        self.writer.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a file.
    pub(crate) fn append(&self, record: FileRecord, content: &[u8]) -> Result<()> {
        let mut writer = self.writer();
        let writer = match &mut *writer {
            Some(writer) => writer,
            none => none.insert(BundleWriter::create(&self.path)?),
        };
        Ok(writer.append(record, content)?)
    }

    /// Completes the bundle. Returns its record, none if it has no file.
    pub(crate) fn finish(&self) -> Result<Vec<FileRecord>> {
        let writer = self.writer().take();
        let record = writer.map(|writer| writer.finish(self.layout.root()));
        Ok(record.transpose()?.into_iter().collect())
    }
}
