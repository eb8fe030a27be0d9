//! Writes a table of all images of a data set as one Parquet file.

#![expect(clippy::indexing_slicing, reason = "a writer: its columns are its own")]

pub(crate) mod columns;
#[cfg(feature = "dataset")]
mod objects;
pub(crate) mod table;

use crate::dataset::domain::Domain;
use crate::error::Result;
use crate::fs::atomic::AtomicFile;
use columns::{Column, Named, columns, text};
#[cfg(feature = "dataset")]
pub use objects::{ObjectRow, ObjectTable};
use s3d_label::Class;
use std::io::Write;
use std::path::Path;
use table::TableWriter;

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
/// [`Error::Io`](crate::Error::Io).
pub fn write_image_index(path: &Path, classes: &[Class], rows: &[ImageRow]) -> Result<u64> {
    let mut file = AtomicFile::create(path)?;
    write_image_index_to(&mut file, path, classes, rows)?;
    file.commit()
}

/// Writes like [`write_image_index`], to any writer. Errors name the file by `name`.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_image_index_to(
    file: impl Write + Send,
    name: &Path,
    classes: &[Class],
    rows: &[ImageRow],
) -> Result<()> {
    let about =
        "A row an image. Paths are below the data set's folder; metres, radians, nats; shares of all pixels.";
    let with_photographs = rows.iter().any(|r| r.photograph.is_some());
    let of_rows = |rows: &[ImageRow]| {
        let rows: Vec<&ImageRow> = rows.iter().collect();
        columns(classes, &rows, with_photographs, paths(&rows))
    };

    let about = [("description", about.to_owned())];
    let mut table = TableWriter::begin(file, name, &of_rows(&[]), &about)?;
    for rows in rows.chunks(GROUP) {
        table.group(of_rows(rows))?;
    }
    table.finish().map(drop)
}

/// Returns the columns of the paths of files, one for each modality.
fn paths(rows: &[&ImageRow]) -> Vec<Named> {
    let of = |i: usize| rows.iter().map(|r| r.files[i].as_deref().map(text)).collect();
    let all = Domain::ALL.into_iter().enumerate();
    all.map(|(i, domain)| Named {
        name: domain.folder().to_owned(),
        required: false,
        values: Column::Text(of(i)),
    })
    .collect()
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
