//! Writes columns as a Parquet file, some rows at a time.

use super::columns::{Column, Named};
use crate::error::{Error, Result};
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::ColumnPath;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::result::Result as StdResult;
use std::sync::Arc;

/// The parts of an image's column.
const PARTS: [&str; 2] = ["bytes", "path"];

/// A Parquet file that is being written.
pub(crate) struct TableWriter<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    /// The name of the file in errors.
    path: PathBuf,
}

impl<W: Write + Send> TableWriter<W> {
    /// Begins the file. `columns` have no rows. `about` are names and texts of the file's metadata.
    pub(crate) fn begin(file: W, path: &Path, columns: &[Named], about: &[(&str, String)]) -> Result<Self> {
        let about = about
            .iter()
            .map(|(name, text)| KeyValue::new((*name).to_owned(), text.clone()));
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(concat!("s3d version ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_key_value_metadata(Some(about.collect()));

        // The files of images are compressed already, and no two are the same.
        for column in columns
            .iter()
            .filter(|column| matches!(column.values, Column::Image(_)))
        {
            let leaf = ColumnPath::new(vec![column.name.clone(), PARTS[0].to_owned()]);
            properties = properties
                .set_column_compression(leaf.clone(), Compression::UNCOMPRESSED)
                .set_column_dictionary_enabled(leaf.clone(), false)
                .set_column_statistics_enabled(leaf, EnabledStatistics::None);
        }

        let failed = |e| write_error(path, e);
        let schema = parse_message_type(&schema(columns)).map_err(failed)?;
        let writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()));
        Ok(Self { writer: writer.map_err(failed)?, path: path.to_owned() })
    }

    /// Writes some rows as a row group.
    pub(crate) fn group(&mut self, columns: Vec<Named>) -> Result<()> {
        self.try_group(columns).map_err(|e| write_error(&self.path, e))
    }

    fn try_group(&mut self, columns: Vec<Named>) -> StdResult<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for Named { required, values, .. } in columns {
            write_column(&mut group, required, values)?;
        }
        group.close()?;
        Ok(())
    }

    /// Completes the file, and returns what was written to.
    pub(crate) fn finish(self) -> Result<W> {
        self.writer.into_inner().map_err(|e| write_error(&self.path, e))
    }
}

/// Returns the schema in Parquet's notation.
fn schema(columns: &[Named]) -> String {
    let mut text = String::from("message images {\n");
    for Named { name, required, values } in columns {
        let repetition = if *required { "required" } else { "optional" };
        let _ = match values {
            Column::Int(_) => writeln!(text, "{repetition} int32 {name};"),
            Column::Float(_) => writeln!(text, "{repetition} double {name};"),
            Column::Text(_) => writeln!(text, "{repetition} binary {name} (STRING);"),
            Column::List(_) => writeln!(
                text,
                "{repetition} group {name} (LIST) {{ repeated group list {{ required double element; }} }}"
            ),
            Column::Image(_) => writeln!(
                text,
                "{repetition} group {name} {{ optional binary {}; optional binary {} (STRING); }}",
                PARTS[0], PARTS[1]
            ),
        };
    }
    text.push('}');
    text
}

fn write_error(path: &Path, e: ParquetError) -> Error {
    let e = match e {
        ParquetError::External(e) => match e.downcast::<std::io::Error>() {
            Ok(e) => *e,
            Err(e) => std::io::Error::other(e),
        },
        e => std::io::Error::other(e),
    };
    Error::io(path, "write", e)
}

/// Writes a column: its values, the definition levels that tell nulls from values, and the repetition levels
/// that begin lists.
fn write_column<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    required: bool,
    column: Column,
) -> StdResult<(), ParquetError> {
    macro_rules! leaf {
        ($kind:ty, $values:expr, $definition:expr, $repetition:expr) => {{
            let fewer = || ParquetError::General("the schema has fewer columns".to_owned());
            let mut out = group.next_column()?.ok_or_else(fewer)?;
            out.typed::<$kind>().write_batch($values, $definition, $repetition)?;
            out.close()?;
        }};
    }
    macro_rules! plain {
        ($kind:ty, $values:expr) => {{
            let (there, values) = split($values);
            leaf!($kind, &values, (!required).then_some(&*there), None)
        }};
    }

    match column {
        Column::Int(values) => plain!(Int32Type, values),
        Column::Float(values) => plain!(DoubleType, values),
        Column::Text(values) => plain!(ByteArrayType, values),
        Column::List(lists) => {
            // The definition level is 0 for null, 1 for an empty list and 2 for an element. The repetition
            // level 0 begins a list.
            let mut definition = Vec::new();
            let mut repetition = Vec::new();
            let mut values = Vec::new();

            for list in lists {
                let list_definition = i16::from(list.is_some());
                let list = list.unwrap_or_default();
                definition.extend(if list.is_empty() {
                    vec![list_definition]
                } else {
                    vec![2; list.len()]
                });
                repetition.extend((0..list.len().max(1)).map(|i| i16::from(i > 0)));
                values.extend(list);
            }
            leaf!(DoubleType, &values, Some(&definition), Some(&repetition));
        }
        Column::Image(images) => {
            // The definition level is 0 for null, and 2 for a part: each image has both.
            let there: Vec<i16> = images.iter().map(|image| 2 * i16::from(image.is_some())).collect();
            let (files, names): (Vec<ByteArray>, Vec<ByteArray>) =
                images.into_iter().flatten().map(|[file, name]| (file, name)).unzip();
            leaf!(ByteArrayType, &files, Some(&there), None);
            leaf!(ByteArrayType, &names, Some(&there), None);
        }
    }
    Ok(())
}

/// Splits off the values that are not null. The level of a value is 1 and the level of a null is 0.
fn split<T>(values: Vec<Option<T>>) -> (Vec<i16>, Vec<T>) {
    let levels = values.iter().map(|v| i16::from(v.is_some())).collect();
    (levels, values.into_iter().flatten().collect())
}
