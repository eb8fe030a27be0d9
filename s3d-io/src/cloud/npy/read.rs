//! Annotated points in numpy's arrays: NPY files, and NPZ archives of one array or of several columns.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::npy::array::zipped;
use crate::cloud::npy::header::NpyHeader;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::meaning::{plain_numbers, s3dis_number};
use crate::cloud::table::records::{Field, Part, Table};
use crate::cloud::table::rows::{Reading, Tag};
use crate::cloud::table::wanted::{Wanted, columns_like, usual_names};
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use s3d_label::Class;
use std::cell::Cell;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// The columns of a plain array whose columns are not named.
const PLAIN: [&str; 8] = ["x", "y", "z", "r", "g", "b", "class", "instance"];

/// An `.npy` or `.npz` file.
pub(crate) struct NpyCloud<'a> {
    source: Source,
    is_npz: bool,
    wanted: Wanted<'a>,
    /// Whether class numbers are S3DIS's: in a plain array whose columns and classes are not named.
    s3dis_numbers: Cell<bool>,
}

impl<'a> NpyCloud<'a> {
    pub(crate) fn new(source: Source, is_npz: bool, wanted: Wanted<'a>) -> Self {
        Self { source, is_npz, wanted, s3dis_numbers: Cell::new(false) }
    }

    fn file(&self) -> Result<BufReader<Bytes>> {
        Ok(BufReader::with_capacity(1 << 18, self.source.open()?.0))
    }

    fn read_npy(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let mut source = self.file()?;
        let header = NpyHeader::read(self.source.name(), &mut source)?;
        let table = self.table(header.fields, header.stride, header.is_structured, reading)?;
        table.read(self.source.name(), source, header.rows, colors, reading)
    }

    /// The table of a single array.
    fn table(
        &self,
        mut fields: Vec<Field>,
        stride: usize,
        is_structured: bool,
        reading: &mut Reading<'_>,
    ) -> Result<Table> {
        if !is_structured {
            self.name_plain(&mut fields)?;
            if let Some(options) = self.wanted.annotations()
                && options.columns.is_empty()
                && options.classes.is_empty()
            {
                let taxonomy = &options.taxonomy;
                self.s3dis_numbers.set(taxonomy.is_s3dis());
                let path = self.source.name().display();
                let numbers = plain_numbers(taxonomy);
                reading.notes.push(format!(
                    "{path}: a plain array: its columns are taken for {}, and class numbers for {numbers}",
                    fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(" ")
                ));
            }
        }
        Table::new(self.source.name(), fields, stride, self.wanted)
    }

    /// Names the columns of a plain array.
    fn name_plain(&self, fields: &mut [Field]) -> Result<()> {
        let named = self.wanted.columns();
        let usual = match self.wanted {
            Wanted::Annotations(_) if matches!(fields.len(), 7 | 8) => PLAIN.map(str::to_owned).into(),
            Wanted::Annotations(_) => Vec::new(),
            Wanted::Measurements(_) => usual_names(fields.len()).unwrap_or_default(),
        };
        let names = match fields.len() {
            _ if named.is_empty() && !usual.is_empty() => &usual[..],
            n if n == named.len() => named,
            n => {
                let said = match named.len() {
                    0 => "they have no names: say what they are".to_owned(),
                    m => format!("{m} are named"),
                };
                return Err(Error::format(
                    self.source.name(),
                    format!(
                        "has {n} columns, and {said}, as in columns = [{}]{}",
                        columns_like(self.wanted),
                        self.wanted.place_of_columns()
                    ),
                ));
            }
        };
        for (field, name) in fields.iter_mut().zip(names) {
            field.name.clone_from(name);
        }
        Ok(())
    }

    fn read_npz(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let zipped = |e| zipped(self.source.name(), e);
        let names = self.array_names()?;
        // An archive lends one member at a time, so each array gets its own reader of the archive.
        let mut archives = Vec::new();
        for _ in &names {
            archives.push(ZipArchive::new(self.file()?).map_err(zipped)?);
        }

        let mut arrays = Vec::new();
        for (archive, name) in archives.iter_mut().zip(&names) {
            let mut member = archive.by_name(name).map_err(zipped)?;
            let path = self.source.name().join(name);
            let stem = name.trim_end_matches(".npy").to_owned();
            match NpyHeader::read(&path, &mut member) {
                Ok(header) => arrays.push((stem, header, member)),
                // Beside the arrays of points there may be arrays of any kind.
                Err(Error::Unsupported { .. }) if names.len() > 1 => {}
                Err(e) => return Err(e),
            }
        }

        if let [(_, header, member)] = &mut arrays[..] {
            let fields = std::mem::take(&mut header.fields);
            let table = self.table(fields, header.stride, header.is_structured, reading)?;
            return table.read(self.source.name(), member, header.rows, colors, reading);
        }
        read_columns(self.source.name(), arrays, self.wanted, colors, reading)
    }

    /// The names of an archive's arrays. Few archives have more than a dozen.
    fn array_names(&self) -> Result<Vec<String>> {
        let archive = ZipArchive::new(self.file()?).map_err(|e| zipped(self.source.name(), e))?;
        let names: Vec<String> = archive
            .file_names()
            .flatten()
            .filter(|n| n.ends_with(".npy"))
            .map(std::borrow::Cow::into_owned)
            .collect();
        if names.is_empty() || names.len() > 64 {
            let message =
                format!("is a ZIP archive of {} NPY arrays: points are in 1 to 64 of them", names.len());
            return Err(Error::format(self.source.name(), message));
        }
        Ok(names)
    }
}

/// Reads several arrays, each with its name and its header, as columns of one table. Shorter arrays than the
/// longest describe the cloud as a whole, and are left out.
pub(super) fn read_columns<R: Read>(
    path: &Path,
    mut arrays: Vec<(String, NpyHeader, R)>,
    wanted: Wanted<'_>,
    colors: ColorRange,
    reading: &mut Reading<'_>,
) -> Result<bool> {
    let rows = arrays.iter().map(|(_, h, _)| h.rows).max().unwrap_or(0);
    arrays.retain(|(_, h, _)| h.rows == rows && h.stride > 0);
    let mut fields = Vec::new();
    let mut parts = Vec::new();
    let mut stride = 0usize;
    for (stem, header, source) in arrays {
        let is_one = header.fields.len() == 1;
        for field in header.fields {
            let name = match field.name.as_str() {
                _ if header.is_structured => field.name,
                // An array of one column is a column.
                "[0]" if is_one => stem.clone(),
                element => format!("{stem}{element}"),
            };
            fields.push(Field { name, at: field.at.saturating_add(stride), ..field });
        }
        parts.push(Part { path: path.to_owned(), source, at: stride, stride: header.stride });
        stride = header.stride.saturating_add(stride);
    }
    let table = Table::new(path, fields, stride, wanted)?;
    table.read_parts(path, &mut parts, rows, colors, reading)
}

impl Cloud for NpyCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn class_of(&self, tag: &Tag) -> Option<Class> {
        s3dis_number(tag).filter(|_| self.s3dis_numbers.get())
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        if self.is_npz {
            self.read_npz(colors, reading)
        } else {
            self.read_npy(colors, reading)
        }
    }
}
