//! Parquet files with the images inside.

use super::{HuggingfaceSet, features};
use crate::dataset::domain::Domain;
use crate::error::Result;
use crate::fs::atomic::AtomicFile;
use crate::package::parquet::ImageRow;
use crate::package::parquet::columns::{Column, Named, columns, text};
use crate::package::parquet::table::TableWriter;
use ::parquet::data_type::ByteArray;
use features::Kind;
use s3d_label::Class;
use std::path::Path;

/// An image with its files.
#[derive(Clone, Debug, Default)]
pub struct ImageRecord {
    /// What a table of images tells of it.
    pub row: ImageRow,
    /// The bytes of its files, one for each modality of [`HuggingfaceSet::domains`]; `None` where it has
    /// none.
    pub files: Vec<Option<Vec<u8>>>,
}

/// A Parquet file that is being written: a row an image.
pub struct ImageTable<'a> {
    classes: &'a [Class],
    domains: &'a [Domain],
    with_photographs: bool,
    table: TableWriter<AtomicFile>,
}

impl<'a> ImageTable<'a> {
    /// Begins a file of a data set.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn create(path: &Path, set: &'a HuggingfaceSet<'_>) -> Result<Self> {
        let HuggingfaceSet { classes, with_photographs, .. } = *set;
        let none = columns(classes, &[], with_photographs, modalities(&set.domains, &[]));
        let about = [("huggingface", features::metadata(set))];
        let table = TableWriter::begin(AtomicFile::create(path)?, path, &none, &about)?;
        Ok(Self { classes, domains: &set.domains, with_photographs, table })
    }

    /// Writes some rows as a row group, which readers read as a whole: some tens of megabytes are good.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn push(&mut self, records: &[ImageRecord]) -> Result<()> {
        let rows: Vec<&ImageRow> = records.iter().map(|record| &record.row).collect();
        let modalities = modalities(self.domains, records);
        self.table
            .group(columns(self.classes, &rows, self.with_photographs, modalities))
    }

    /// Completes the file. Returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io).
    pub fn finish(self) -> Result<u64> {
        self.table.finish()?.commit()
    }
}

/// Returns the columns of modalities: images, and texts where a file is text.
pub(super) fn modalities(domains: &[Domain], records: &[ImageRecord]) -> Vec<Named> {
    let with_files = |i: usize| {
        records.iter().map(move |record| {
            let file = record.files.get(i).and_then(Option::as_ref)?;
            Some((ByteArray::from(file.clone()), record))
        })
    };

    let mut all = Vec::new();
    for (i, domain) in domains.iter().enumerate() {
        let values = match features::kind_of(*domain) {
            Some(Kind::Text) => Column::Text(with_files(i).map(|file| Some(file?.0)).collect()),
            _ => Column::Image(
                with_files(i)
                    .map(|file| {
                        let (file, record) = file?;
                        let path = Domain::ALL.iter().zip(&record.row.files);
                        let path = path
                            .filter(|(of, _)| *of == domain)
                            .find_map(|(_, path)| path.as_deref());
                        Some([file, text(path.unwrap_or_default())])
                    })
                    .collect(),
            ),
        };
        all.push(Named { name: domain.folder().to_owned(), required: false, values });
    }
    all
}
