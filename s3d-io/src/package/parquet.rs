//! Writes a table of all images of a data set as one Parquet file.

#![expect(clippy::indexing_slicing, reason = "a writer: its columns are its own")]

use crate::dataset::domain::Domain;
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use s3d_label::Class;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// The number of rows in a row group, of which one is in memory as columns at a time.
const GROUP: usize = 1 << 16;

/// An image, which is a row of the table. Unknown values are null in the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageRow {
    /// The number of its area.
    pub area: u32,
    /// The UUID of its scan location.
    pub camera_uuid: String,
    /// Its room, such as "office_3".
    pub room: String,
    /// The type of its room, such as "office".
    pub room_type: String,
    /// The number of its room, such as 3.
    pub room_number: u32,
    /// The number of a view; `None` for a panorama.
    pub frame_num: Option<u32>,
    /// The paths of its files below the root of the data set, in the order of [`Domain::ALL`].
    pub files: [Option<String>; Domain::ALL.len()],
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// The angle of view; π/2 for a panorama, as in its pose file.
    pub fov_rad: Option<f64>,
    /// The heading and elevation of a view, relative to the scanner's camera.
    pub yaw_pitch_rad: Option<[f64; 2]>,
    /// The position of the camera, in world metres.
    pub location: Option<[f64; 3]>,
    /// The matrix of focal lengths and principal point in pixels, row by row.
    pub k: Option<[f64; 9]>,
    /// World → camera in OpenCV's axes, 3 × 4, row by row.
    pub rt: Option<[f64; 12]>,
    /// The entropy by which a view was selected, in nats.
    pub selection_entropy: Option<f64>,
    /// The share of pixels that show a surface.
    pub coverage: Option<f64>,
    /// The content of its semantic image.
    pub semantic: Option<SemanticRow>,
    /// The least, the mean and the greatest depth in metres, over the pixels that have a depth.
    pub depth_m: Option<[f64; 3]>,
    /// The name of its photograph, if the view shows one. If no image has a photograph, the table has no
    /// such column.
    pub photograph: Option<String>,
}

/// What the pixels of a semantic image show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SemanticRow {
    /// The share of pixels of each class, at its [`Class::index`].
    pub shares: Vec<f64>,
    /// The share of pixels that show a surface without a label.
    pub unlabelled: f64,
    /// The Shannon entropy of the classes, in nats.
    pub entropy: f64,
    /// How many instances are visible.
    pub instances: u32,
}

/// The values of a column for some rows.
enum Column {
    Int(Vec<Option<i32>>),
    Float(Vec<Option<f64>>),
    Text(Vec<Option<ByteArray>>),
    List(Vec<Option<Vec<f64>>>),
}

/// Returns the columns of some rows: the name, whether it is never null, and the values.
fn columns(classes: &[Class], rows: &[ImageRow], with_photographs: bool) -> Vec<(String, bool, Column)> {
    let mut all = Vec::new();
    macro_rules! column {
        ($name:expr, $required:expr, $kind:ident, $value:expr) => {
            all.push(($name, $required, Column::$kind(rows.iter().map($value).collect())))
        };
    }

    column!("area".to_owned(), true, Int, |r| Some(int(r.area)));
    column!("camera_uuid".to_owned(), true, Text, |r| Some(text(&r.camera_uuid)));
    column!("room".to_owned(), true, Text, |r| Some(text(&r.room)));
    column!("room_type".to_owned(), true, Text, |r| Some(text(&r.room_type)));
    column!("room_number".to_owned(), true, Int, |r| Some(int(r.room_number)));
    column!("kind".to_owned(), true, Text, |r| {
        Some(text(if r.frame_num.is_some() { "view" } else { "panorama" }))
    });
    column!("frame_num".to_owned(), false, Int, |r| r.frame_num.map(int));

    for (i, domain) in Domain::ALL.into_iter().enumerate() {
        column!(domain.folder().to_owned(), false, Text, |r| r.files[i].as_deref().map(text));
    }
    for (i, name) in ["width", "height"].into_iter().enumerate() {
        column!(name.to_owned(), false, Int, |r| r.size.map(|s| int(s[i])));
    }

    column!("fov_rad".to_owned(), false, Float, |r| r.fov_rad);
    for (i, name) in ["yaw_rad", "pitch_rad"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.yaw_pitch_rad.map(|v| v[i]));
    }
    for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.location.map(|v| v[i]));
    }
    column!("k".to_owned(), false, List, |r| r.k.map(|m| m.to_vec()));
    column!("rt".to_owned(), false, List, |r| r.rt.map(|m| m.to_vec()));
    column!("selection_entropy".to_owned(), false, Float, |r| r.selection_entropy);
    column!("entropy".to_owned(), false, Float, |r| r.semantic.as_ref().map(|s| s.entropy));
    column!("coverage".to_owned(), false, Float, |r| r.coverage);

    for class in classes {
        column!(format!("share_{class}"), false, Float, |r| {
            r.semantic.as_ref().and_then(|s| s.shares.get(class.index()).copied())
        });
    }
    column!("share_unlabelled".to_owned(), false, Float, |r| r.semantic.as_ref().map(|s| s.unlabelled));
    column!("instances".to_owned(), false, Int, |r| r.semantic.as_ref().map(|s| int(s.instances)));
    for (i, name) in ["depth_min_m", "depth_mean_m", "depth_max_m"].into_iter().enumerate() {
        column!(name.to_owned(), false, Float, |r| r.depth_m.map(|v| v[i]));
    }
    if with_photographs {
        column!("photograph".to_owned(), false, Text, |r| r.photograph.as_deref().map(text));
    }
    all
}

fn text(text: &str) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}

fn int(value: u32) -> i32 {
    value as i32
}

/// Returns the schema in Parquet's notation.
fn schema(columns: &[(String, bool, Column)]) -> String {
    let mut text = String::from("message images {\n");
    for (name, required, column) in columns {
        let repetition = if *required { "required" } else { "optional" };
        let _ = match column {
            Column::Int(_) => writeln!(text, "{repetition} int32 {name};"),
            Column::Float(_) => writeln!(text, "{repetition} double {name};"),
            Column::Text(_) => writeln!(text, "{repetition} binary {name} (STRING);"),
            Column::List(_) => writeln!(
                text,
                "{repetition} group {name} (LIST) {{ repeated group list {{ required double element; }} }}"
            ),
        };
    }
    text.push('}');
    text
}

/// Writes the table of images, a row for each image in the given order, and returns the size of the file in
/// bytes.
///
/// The columns are `area`, `camera_uuid`, `room`, `room_type`, `room_number`, `kind` ("view" or "panorama")
/// and `frame_num` (null for panoramas); the path of each modality below the folder of the data set, with the
/// name of its folder (`rgb`, `depth`, `normal`, …); `width`, `height`, `fov_rad`, `yaw_rad`, `pitch_rad`,
/// `x`, `y`, `z`; `k` (9 numbers) and `rt` (12), row by row; `selection_entropy`, `entropy`, `coverage`,
/// `share_CLASS` for each of `classes`, `share_unlabelled` (all shares add up to the coverage), `instances`;
/// `depth_min_m`, `depth_mean_m`, `depth_max_m`; and `photograph`, if any image has one. See [`ImageRow`].
///
/// # Errors
/// [`Error::Io`].
pub fn write_image_index(path: &Path, classes: &[Class], rows: &[ImageRow]) -> Result<u64> {
    let mut file = AtomicFile::create(path)?;
    write_image_index_to(&mut file, path, classes, rows)?;
    file.commit()
}

/// Writes like [`write_image_index`], to any writer. Errors name the file by `name`.
///
/// # Errors
/// [`Error::Io`].
pub fn write_image_index_to(
    file: impl Write + Send,
    name: &Path,
    classes: &[Class],
    rows: &[ImageRow],
) -> Result<()> {
    let path = name;
    let failed = |e| write_error(path, e);

    let about =
        "A row an image. Paths are below the data set's folder; metres, radians, nats; shares of all pixels.";
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("s3d version ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(vec![KeyValue::new("description".to_owned(), about.to_owned())]))
        .build();

    let with_photographs = rows.iter().any(|r| r.photograph.is_some());
    let schema = parse_message_type(&schema(&columns(classes, &[], with_photographs))).map_err(failed)?;
    let mut writer =
        SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(failed)?;

    for rows in rows.chunks(GROUP) {
        let mut group = writer.next_row_group().map_err(failed)?;
        for (_, required, column) in columns(classes, rows, with_photographs) {
            let fewer = || failed(ParquetError::General("the schema has fewer columns".to_owned()));
            let mut out = group.next_column().map_err(failed)?.ok_or_else(fewer)?;
            write_column(&mut out, required, column).map_err(failed)?;
            out.close().map_err(failed)?;
        }
        group.close().map_err(failed)?;
    }
    writer.close().map_err(failed)?;
    Ok(())
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

/// Writes the values of a column, and the definition levels that tell nulls from values.
fn write_column(
    out: &mut SerializedColumnWriter<'_>,
    required: bool,
    column: Column,
) -> std::result::Result<(), ParquetError> {
    let levels = |levels: &Vec<i16>| (!required).then(|| levels.clone());

    match column {
        Column::Int(values) => {
            let (there, values) = split(values);
            out.typed::<Int32Type>()
                .write_batch(&values, levels(&there).as_deref(), None)?;
        }
        Column::Float(values) => {
            let (there, values) = split(values);
            out.typed::<DoubleType>()
                .write_batch(&values, levels(&there).as_deref(), None)?;
        }
        Column::Text(values) => {
            let (there, values) = split(values);
            out.typed::<ByteArrayType>()
                .write_batch(&values, levels(&there).as_deref(), None)?;
        }
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

            out.typed::<DoubleType>()
                .write_batch(&values, Some(&definition), Some(&repetition))?;
        }
    }
    Ok(())
}

/// Splits off the values that are not null. The level of a value is 1 and the level of a null is 0.
fn split<T>(values: Vec<Option<T>>) -> (Vec<i16>, Vec<T>) {
    let levels = values.iter().map(|v| i16::from(v.is_some())).collect();
    (levels, values.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{Field, Row};
    use std::fs::File;

    fn row(i: u32) -> ImageRow {
        ImageRow {
            area: 1 + i / 1000,
            camera_uuid: format!("{i:032x}"),
            room: "office_3".into(),
            room_type: "office".into(),
            room_number: 3,
            frame_num: Some(i),
            files: Domain::ALL.map(|d| Some(format!("area_1/data/{d}/{i}"))),
            size: Some([1080, 540]),
            fov_rad: Some(1.1),
            yaw_pitch_rad: Some([f64::from(i), -0.5]),
            location: Some([1.0, 2.0, f64::from(i)]),
            k: Some(std::array::from_fn(|k| k as f64 + f64::from(i))),
            rt: Some(std::array::from_fn(|k| -(k as f64))),
            selection_entropy: Some(0.25),
            coverage: Some(0.75),
            semantic: Some(SemanticRow {
                shares: (0..13).map(|k| f64::from(k) / 100.0).collect(),
                unlabelled: 0.125,
                entropy: 1.5,
                instances: 17,
            }),
            depth_m: Some([0.5, 2.0, 9.0]),
            photograph: Some("images/1.jpg".into()),
        }
    }

    fn bare() -> ImageRow {
        ImageRow { area: 7, camera_uuid: "a".into(), room: "WC_1".into(), ..ImageRow::default() }
    }

    fn read(path: &Path) -> (Vec<String>, Vec<Row>) {
        let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
        let names = reader
            .metadata()
            .file_metadata()
            .schema()
            .get_fields()
            .iter()
            .map(|f| f.name().to_owned())
            .collect();
        (names, reader.get_row_iter(None).unwrap().map(|r| r.unwrap()).collect())
    }

    fn field<'a>((names, rows): &'a (Vec<String>, Vec<Row>), i: usize, name: &str) -> &'a Field {
        let at = names
            .iter()
            .position(|n| n == name)
            .unwrap_or_else(|| panic!("no column {name}"));
        rows[i].get_column_iter().nth(at).unwrap().1
    }

    fn float(v: Option<f64>) -> Field {
        v.map_or(Field::Null, Field::Double)
    }

    fn text(t: &str) -> Field {
        Field::Str(t.to_owned())
    }

    #[test]
    fn rows_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("images.parquet");
        let rows = [row(5), bare(), row(2000)];
        let bytes = write_image_index(&path, &Class::S3DIS, &rows).unwrap();
        assert_eq!(bytes, std::fs::metadata(&path).unwrap().len());
        let table = read(&path);
        assert_eq!(
            (table.0.len(), table.1.len()),
            (7 + Domain::ALL.len() + 2 + 1 + 2 + 3 + 2 + 3 + 13 + 2 + 3 + 1, 3)
        );

        for (i, row) in rows.iter().enumerate() {
            assert_eq!(*field(&table, i, "area"), Field::Int(row.area as i32));
            assert_eq!(*field(&table, i, "camera_uuid"), text(&row.camera_uuid));
            let kind = if i == 1 { "panorama" } else { "view" };
            assert_eq!(*field(&table, i, "kind"), text(kind));
            assert_eq!(
                *field(&table, i, "frame_num"),
                row.frame_num.map_or(Field::Null, |n| Field::Int(n as i32))
            );
            for (file, domain) in row.files.iter().zip(Domain::ALL) {
                assert_eq!(*field(&table, i, domain.folder()), file.as_deref().map_or(Field::Null, text));
            }
            assert_eq!(*field(&table, i, "z"), float(row.location.map(|l| l[2])));
            assert_eq!(*field(&table, i, "pitch_rad"), float(row.yaw_pitch_rad.map(|v| v[1])));
            assert_eq!(*field(&table, i, "coverage"), float(row.coverage));
            let shares = row.semantic.as_ref().map(|s| s.shares.clone());
            assert_eq!(*field(&table, i, "share_chair"), float(shares.map(|s| s[Class::CHAIR.index()])));
            assert_eq!(*field(&table, i, "depth_max_m"), float(row.depth_m.map(|d| d[2])));
            let photograph = row.photograph.clone().map_or(Field::Null, Field::Str);
            assert_eq!(*field(&table, i, "photograph"), photograph);
            for (name, list) in [("k", row.k.map(|k| k.to_vec())), ("rt", row.rt.map(|m| m.to_vec()))] {
                match (field(&table, i, name), list) {
                    (Field::ListInternal(found), Some(list)) => {
                        let list: Vec<Field> = list.into_iter().map(Field::Double).collect();
                        assert_eq!(found.elements(), list);
                    }
                    (found, list) => assert_eq!((found, list), (&Field::Null, None)),
                }
            }
        }

        assert_eq!(*field(&table, 0, "height"), Field::Int(540));
        assert_eq!(*field(&table, 2, "instances"), Field::Int(17));
    }

    #[test]
    fn many_rows_are_in_several_groups_and_the_bytes_are_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let rows: Vec<ImageRow> = (0..GROUP as u32 + 10)
            .map(|i| if i % 7 == 0 { bare() } else { row(i) })
            .collect();
        let a = dir.path().join("a.parquet");
        let b = dir.path().join("b.parquet");
        write_image_index(&a, &Class::S3DIS, &rows).unwrap();
        write_image_index(&b, &Class::S3DIS, &rows).unwrap();
        assert_eq!(std::fs::read(&a).unwrap(), std::fs::read(&b).unwrap());
        let reader = SerializedFileReader::new(File::open(&a).unwrap()).unwrap();
        assert_eq!(reader.num_row_groups(), 2);
        let table = read(&a);
        assert_eq!(table.1.len(), rows.len());
        assert_eq!(*field(&table, GROUP + 8, "frame_num"), Field::Int(GROUP as i32 + 8));
    }

    #[test]
    fn no_rows_and_no_folder() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.parquet");
        write_image_index(&path, &Class::S3DIS, &[]).unwrap();
        let (names, rows) = read(&path);
        assert!(rows.is_empty() && !names.contains(&"photograph".to_owned()));
        let e = write_image_index(&dir.path().join("no/a.parquet"), &Class::S3DIS, &[]).unwrap_err();
        assert!(e.to_string().contains("a.parquet: cannot write"), "{e}");
    }
}
