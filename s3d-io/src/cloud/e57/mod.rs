//! Annotated points of E57 files: several scans, each with its pose. Source: ASTM E2807.

#[cfg_attr(not(feature = "raw"), allow(dead_code))]
pub(crate) mod grid;

use crate::bounds::Bounds;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::columns::Columns;
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::records::{Color, color};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use e57::{E57Reader, PointCloud, RawValues, Record, RecordDataType, RecordName, RecordValue};
use grid::{attribute_index, grid_columns};
use s3d_geom::glam::{DQuat, DVec3, dvec3};
use s3d_label::Room;
use std::io::BufReader;
use std::path::Path;

/// An `.e57` file.
pub(crate) struct E57Cloud<'a> {
    source: Source,
    wanted: Wanted<'a>,
    /// The number of the only scan that is read, from 0.
    only: Option<usize>,
}

impl<'a> E57Cloud<'a> {
    pub(crate) fn new(source: Source, wanted: Wanted<'a>) -> Self {
        Self { source, wanted, only: None }
    }

    /// Returns one scan of the file, by its number from 0.
    #[cfg(feature = "raw")]
    pub(crate) fn scan(source: Source, wanted: Wanted<'a>, number: usize) -> Self {
        Self { source, wanted, only: Some(number) }
    }

    fn error(&self, error: &e57::Error) -> Error {
        Error::format(self.source.name(), format!("cannot be read: {error}"))
    }

    /// Opens the file, and returns its size too.
    fn reader(&self) -> Result<(E57Reader<BufReader<Bytes>>, u64)> {
        let (file, size) = self.source.open()?;
        let file = BufReader::with_capacity(1 << 18, file);
        let reader = guarded(self.source.name(), || E57Reader::new(file))?;
        Ok((reader.map_err(|e| self.error(&e))?, size))
    }

    /// Whether several points of a scan are at the scanner itself. A single one may be a point like others.
    fn has_several_empty(&self, cloud: &PointCloud, scan: &Scan<'_>) -> Result<bool> {
        let path = self.source.name();
        let (mut reader, _) = self.reader()?;
        let mut points = guarded(path, || reader.pointcloud_raw(cloud))?.map_err(|e| self.error(&e))?;
        let mut found = 0;
        // What cannot be read is reported when it is its turn.
        while let Some(Ok(values)) = guarded(path, || points.next())? {
            found += u32::from(!scan.is_invalid(&values) && scan.is_scanner(&values));
            if found == 2 {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// One scan of the file: what each value of its points is.
struct Scan<'a> {
    prototype: &'a [Record],
    columns: Columns,
    /// Whether the coordinates are range, azimuth and elevation in place of x, y and z.
    is_spherical: bool,
    /// The column of invalid states. 1: the point has a direction only; 2: it has nothing.
    invalid: Option<usize>,
    /// The column that marks points without a colour.
    colorless: Option<usize>,
    /// The columns of the row and the column in the scanner's grid, and their least numbers.
    grid: Option<[(usize, i64); 2]>,
    /// The smallest and the largest value of each colour.
    limits: [(f64, f64); 3],
    rotation: DQuat,
    translation: DVec3,
    /// The room, if the scan is named after one.
    room: Option<String>,
}

/// The name of an attribute as users write it, without the namespace's prefix if `bare`.
fn name_of(name: &RecordName, bare: bool) -> String {
    match name {
        RecordName::CartesianX => "x".to_owned(),
        RecordName::CartesianY => "y".to_owned(),
        RecordName::CartesianZ => "z".to_owned(),
        RecordName::ColorRed => "red".to_owned(),
        RecordName::ColorGreen => "green".to_owned(),
        RecordName::ColorBlue => "blue".to_owned(),
        RecordName::Unknown { namespace, name } if !bare && !namespace.is_empty() => {
            format!("{namespace}:{name}")
        }
        RecordName::Unknown { name, .. } => name.clone(),
        RecordName::Intensity => "intensity".to_owned(),
        RecordName::RowIndex => "rowIndex".to_owned(),
        RecordName::ColumnIndex => "columnIndex".to_owned(),
        RecordName::ReturnIndex => "returnIndex".to_owned(),
        RecordName::ReturnCount => "returnCount".to_owned(),
        RecordName::TimeStamp => "timeStamp".to_owned(),
        RecordName::SphericalRange => "sphericalRange".to_owned(),
        RecordName::SphericalAzimuth => "sphericalAzimuth".to_owned(),
        RecordName::SphericalElevation => "sphericalElevation".to_owned(),
        RecordName::CartesianInvalidState => "cartesianInvalidState".to_owned(),
        RecordName::SphericalInvalidState => "sphericalInvalidState".to_owned(),
        RecordName::IsIntensityInvalid => "isIntensityInvalid".to_owned(),
        RecordName::IsColorInvalid => "isColorInvalid".to_owned(),
        RecordName::IsTimeStampInvalid => "isTimeStampInvalid".to_owned(),
    }
}

impl<'a> Scan<'a> {
    fn new(path: &Path, wanted: Wanted<'_>, cloud: &'a PointCloud) -> Result<Self> {
        let prototype = &cloud.prototype[..];
        let is_spherical = !cloud.has_cartesian();
        if is_spherical && !cloud.has_spherical() {
            return Err(Error::format(path, "has a scan without coordinates"));
        }
        let columns = columns_of(path, wanted, prototype, is_spherical)?;
        let limits = columns
            .color
            .map_or([(0.0, 255.0); 3], |channels| color_limits(cloud, channels));

        let (rotation, translation) = pose_of(cloud);
        if !rotation.is_finite() || rotation.length() < 0.5 {
            let q = cloud.transform.clone().unwrap_or_default().rotation;
            return Err(Error::format(path, format!("has a scan whose pose has no rotation: {q:?}")));
        }

        let room = cloud
            .name
            .clone()
            .filter(|name| name.parse::<s3d_label::Room>().is_ok());

        Ok(Self {
            prototype,
            columns,
            is_spherical,
            invalid: attribute_index(
                prototype,
                if is_spherical {
                    &RecordName::SphericalInvalidState
                } else {
                    &RecordName::CartesianInvalidState
                },
            ),
            colorless: attribute_index(prototype, &RecordName::IsColorInvalid),
            grid: if wanted.annotations().is_none() {
                grid_columns(cloud)
            } else {
                None
            },
            limits,
            rotation: rotation.normalize(),
            translation,
            room,
        })
    }

    /// Value `i` of a point as a number. Returns NaN if it has none.
    fn float(&self, values: &RawValues, i: usize) -> f64 {
        let value = values.get(i).zip(self.prototype.get(i));
        value
            .and_then(|(value, record)| value.to_f64(&record.data_type).ok())
            .unwrap_or(f64::NAN)
    }

    fn value(&self, values: &RawValues, i: usize) -> Value<'static> {
        match values.get(i) {
            Some(RecordValue::Integer(n)) => Value::Whole(*n),
            _ => Value::Float(self.float(values, i)),
        }
    }

    /// Whether the point is the scanner itself. Cyclone writes it for a ray without a return.
    fn is_scanner(&self, values: &RawValues) -> bool {
        let [a, b, c] = self.columns.position.map(|i| self.float(values, i) == 0.0);
        a && (self.is_spherical || b && c)
    }

    /// Whether the point has no position.
    fn is_invalid(&self, values: &RawValues) -> bool {
        self.invalid.is_some_and(|i| self.float(values, i) != 0.0)
    }

    /// The position in the world.
    fn position(&self, values: &RawValues) -> DVec3 {
        self.rotation * self.local(self.columns.position.map(|i| self.float(values, i))) + self.translation
    }

    /// The position in the scan's own frame. An azimuth may be of any turn, as near −2π.
    fn local(&self, [a, b, c]: [f64; 3]) -> DVec3 {
        if self.is_spherical {
            let azimuth_sin = libm::sin(b);
            let azimuth_cos = libm::cos(b);
            let elevation_sin = libm::sin(c);
            let elevation_cos = libm::cos(c);
            a * dvec3(elevation_cos * azimuth_cos, elevation_cos * azimuth_sin, elevation_sin)
        } else {
            dvec3(a, b, c)
        }
    }

    /// The row of a point. `room` is the one that all points are in, if the user says so.
    fn row(&self, values: &RawValues, room: Option<Room>) -> Row<'_> {
        let columns = &self.columns;
        Row {
            position: self.position(values),
            color: self.color(values),
            class: columns.class.map_or(Value::None, |i| self.value(values, i)),
            instance: columns.instance.map_or(Value::None, |i| self.value(values, i)),
            room: match (columns.room, &self.room, room) {
                (Some(i), _, _) => self.value(values, i),
                (None, Some(name), None) => Value::Name(name),
                _ => Value::None,
            },
            measured: self.measured(values),
        }
    }

    fn measured(&self, values: &RawValues) -> Measured {
        let number = |column: Option<usize>| column.map(|i| self.float(values, i));
        let cell = self.grid.and_then(|[row, column]| {
            let index = |(i, least): (usize, i64)| match values.get(i) {
                Some(RecordValue::Integer(n)) => u32::try_from(n.checked_sub(least)?).ok(),
                _ => None,
            };
            Some([index(row)?, index(column)?])
        });
        Measured {
            intensity: number(self.columns.intensity).map_or(f32::NAN, |v| v as f32),
            time_s: number(self.columns.time).unwrap_or(f64::NAN),
            cell,
        }
    }

    fn told(&self, points: u64) -> Told {
        Told {
            points: Some(points),
            has_colors: self.columns.color.is_some(),
            // The scan states their range.
            are_bytes: true,
            has_intensity: self.columns.intensity.is_some(),
            has_times: self.columns.time.is_some(),
            has_grid: self.grid.is_some(),
        }
    }

    fn color(&self, values: &RawValues) -> [u8; 3] {
        let Some(channels) = self.columns.color else { return [0; 3] };
        if self.colorless.is_some_and(|i| self.float(values, i) != 0.0) {
            return [0; 3];
        }
        let scaled =
            |i: usize, (min, max): (f64, f64)| ((self.float(values, i) - min) / (max - min)).clamp(0.0, 1.0);
        let [r, g, b] = channels;
        let [of_r, of_g, of_b] = self.limits;
        match color([scaled(r, of_r), scaled(g, of_g), scaled(b, of_b)], true, ColorRange::Narrow) {
            Color::Rgb(rgb) => rgb,
            Color::Wider | Color::Beyond(_) => [0; 3],
        }
    }
}

/// Chooses the columns. Users name an attribute with its prefix (`ext:label`) or without.
fn columns_of(path: &Path, wanted: Wanted<'_>, prototype: &[Record], is_spherical: bool) -> Result<Columns> {
    let with_prefix = wanted.annotations().is_some_and(|options| {
        let asked = [&options.class_column, &options.instance_column, &options.room_column];
        asked.into_iter().flatten().any(|a| a.contains(':'))
    });
    let mut names: Vec<String> = prototype.iter().map(|r| name_of(&r.name, !with_prefix)).collect();
    if is_spherical {
        for (record, name) in prototype.iter().zip(&mut names) {
            let stands_for = match record.name {
                RecordName::SphericalRange => "x",
                RecordName::SphericalAzimuth => "y",
                RecordName::SphericalElevation => "z",
                _ => continue,
            };
            stands_for.clone_into(name);
        }
    }

    Columns::choose(path, &names, wanted).map_err(|e| match e {
        Error::Format { message, .. } if message.contains("no column of classes") => Error::format(
            path,
            format!(
                "{message}. E57 itself knows no classes: export the labelled points with an attribute for \
                 them, or as LAS or PLY"
            ),
        ),
        e => e,
    })
}

/// The smallest and the largest value of each colour channel: as the scan states them, else as the channel's
/// type allows, else 0 to 255.
fn color_limits(cloud: &PointCloud, channels: [usize; 3]) -> [(f64, f64); 3] {
    let limits = cloud.color_limits.as_ref();
    let [r, g, b] = channels;
    let stated = [
        (r, limits.and_then(|l| Some((l.red_min.as_ref()?, l.red_max.as_ref()?)))),
        (g, limits.and_then(|l| Some((l.green_min.as_ref()?, l.green_max.as_ref()?)))),
        (b, limits.and_then(|l| Some((l.blue_min.as_ref()?, l.blue_max.as_ref()?)))),
    ];
    stated.map(|(channel, stated)| channel_limits(cloud, channel, stated).unwrap_or((0.0, 255.0)))
}

fn channel_limits(
    cloud: &PointCloud,
    channel: usize,
    stated: Option<(&RecordValue, &RecordValue)>,
) -> Option<(f64, f64)> {
    let kind = &cloud.prototype.get(channel)?.data_type;
    let stated = stated.and_then(|(min, max)| Some((min.to_f64(kind).ok()?, max.to_f64(kind).ok()?)));
    stated.or(range_of(kind)).filter(|(min, max)| max > min)
}

/// The smallest and the largest value of a type.
fn range_of(kind: &RecordDataType) -> Option<(f64, f64)> {
    match kind {
        RecordDataType::Integer { min, max } => Some((*min as f64, *max as f64)),
        RecordDataType::ScaledInteger { min, max, scale, offset } => {
            Some((*min as f64 * scale + offset, *max as f64 * scale + offset))
        }
        RecordDataType::Single { min, max } => Some((f64::from((*min)?), f64::from((*max)?))),
        RecordDataType::Double { min, max } => Some(((*min)?, (*max)?)),
    }
}

/// Calls `f`, and returns an error if it panics: the decoder is not ours, and a damaged file must not end the
/// program.
fn guarded<T>(path: &Path, f: impl FnOnce() -> T) -> Result<T> {
    crate::guarded::guarded(f).ok_or_else(|| Error::format(path, "its points are damaged"))
}

impl Cloud for E57Cloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, _: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let (mut reader, size) = self.reader()?;
        let scans = guarded(path, || reader.pointclouds())?;
        if scans.is_empty() {
            return Err(Error::format(path, "holds no scan"));
        }

        if let Some(bounds) = bounds_of(&scans) {
            reading.claims(bounds);
        }
        let mut number = 0;
        let mut invalid = 0u64;
        let mut empty = 0u64;
        // Some programs write a scan without points in a way that cannot be read.
        let is_read =
            |(i, scan): &(usize, &PointCloud)| scan.records > 0 && self.only.is_none_or(|only| only == *i);
        let room = self.wanted.annotations().and_then(|options| options.room);
        for (i, cloud) in scans.iter().enumerate().filter(is_read) {
            let scan = Scan::new(path, self.wanted, cloud).map_err(|e| match e {
                Error::Format { message, .. } if scans.len() > 1 => {
                    Error::format(path, format!("scan {} of {}: {message}", i + 1, scans.len()))
                }
                e => e,
            })?;
            let bits: u64 = cloud.prototype.iter().map(|r| bits_of(&r.data_type)).sum();
            // Points of no bits would never end.
            if u128::from(cloud.records) * u128::from(bits.max(1)) > u128::from(size) * 8 {
                let message =
                    format!("claims {} points in {size} bytes: the file is cut short", cloud.records);
                return Err(Error::format(path, message));
            }

            let mut points = guarded(path, || reader.pointcloud_raw(cloud))?.map_err(|e| self.error(&e))?;
            let mut several_empty = None;
            reading.told = scan.told(cloud.records);
            while let Some(values) = guarded(path, || points.next())? {
                let values = values
                    .map_err(|e| Error::format(path, format!("cannot be read after point {number}: {e}")))?;
                number += 1;
                if scan.is_invalid(&values) {
                    invalid += 1;
                    continue;
                }

                if scan.is_scanner(&values) {
                    let several = match several_empty {
                        Some(several) => several,
                        None => self.has_several_empty(cloud, &scan)?,
                    };
                    several_empty = Some(several);
                    if several {
                        empty += 1;
                        continue;
                    }
                }
                reading.push(number, &scan.row(&values, room))?;
            }
        }

        if invalid > 0 {
            reading.notes.push(format!(
                "{}: {invalid} of {number} points are marked invalid, left out",
                path.display()
            ));
        }
        if empty > 0 {
            reading.notes.push(format!(
                "{}: {empty} of {number} points are at the scanner itself (0 0 0), rays without a return; \
                 left out",
                path.display()
            ));
        }
        Ok(true)
    }
}

/// The box around all scans in world coordinates. Returns `None` if one of them does not state its box.
fn bounds_of(scans: &[PointCloud]) -> Option<Bounds> {
    scans
        .iter()
        .filter(|scan| scan.records > 0)
        .try_fold(Bounds::EMPTY, |all, scan| {
            let b = scan.cartesian_bounds.as_ref()?;
            let [x, y, z] = [[b.x_min?, b.x_max?], [b.y_min?, b.y_max?], [b.z_min?, b.z_max?]];
            let (rotation, translation) = pose_of(scan);
            let corners = x
                .into_iter()
                .flat_map(|x| y.map(|y| (x, y)))
                .flat_map(|(x, y)| z.map(|z| dvec3(x, y, z)));
            Some(all.union(Bounds::of(corners.map(|p| rotation.normalize() * p + translation))))
        })
}

/// The rotation of a scan, as a quaternion of any length, and its translation.
fn pose_of(scan: &PointCloud) -> (DQuat, DVec3) {
    let pose = scan.transform.clone().unwrap_or_default();
    let q = pose.rotation;
    let t = pose.translation;
    (DQuat::from_xyzw(q.x, q.y, q.z, q.w), dvec3(t.x, t.y, t.z))
}

/// The number of bits that a value takes.
fn bits_of(kind: &RecordDataType) -> u64 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            match i128::from(*max) - i128::from(*min) {
                range @ 1.. => u64::from(range.ilog2()) + 1,
                _ => 0,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::{AnnotationOptions, Annotations};
    use e57::{E57Writer, Quaternion, Transform, Translation};
    use std::f64::consts::{FRAC_PI_2, TAU};

    const CARTESIAN: [RecordName; 3] =
        [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];

    /// Writes scans: the names of their coordinates and of another attribute.
    fn write(path: &Path, scans: &[([RecordName; 3], &str)], points: &[([f64; 3], i64)]) {
        let mut writer = E57Writer::from_file(path, "file").unwrap();
        let extension = e57::Extension::new("ext", "http://example.org/ext");
        writer.register_extension(extension).unwrap();
        for (names, attribute) in scans {
            let mut prototype: Vec<Record> = names
                .iter()
                .map(|name| Record { name: name.clone(), data_type: RecordDataType::F64 })
                .collect();
            let name = RecordName::Unknown { namespace: "ext".to_owned(), name: (*attribute).to_owned() };
            prototype.push(Record { name, data_type: RecordDataType::Integer { min: 0, max: 255 } });
            add_scan(&mut writer, prototype, points);
        }
        writer.finalize().unwrap();
    }

    /// Adds a scan at (1, 2, 3), turned by 90° about z. A point is three coordinates and another attribute.
    fn add_scan(writer: &mut E57Writer<std::fs::File>, prototype: Vec<Record>, points: &[([f64; 3], i64)]) {
        let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
        let half = libm::sqrt(0.5);
        scan.set_transform(Some(Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 1.0, y: 2.0, z: 3.0 },
        }));
        for (position, attribute) in points {
            let mut values: RawValues = position.iter().map(|v| RecordValue::Double(*v)).collect();
            values.push(RecordValue::Integer(*attribute));
            scan.add_point(values).unwrap();
        }
        scan.finalize().unwrap();
    }

    fn read(names: [RecordName; 3], points: &[([f64; 3], i64)]) -> (Vec<[f32; 3]>, Vec<String>) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("office_1.e57");
        write(&path, &[(names, "class")], points);
        let classes = [("7".to_owned(), Some(s3d_label::Class::CHAIR))].into();
        let options = AnnotationOptions { classes, ..AnnotationOptions::default() };
        let found = Annotations::open(&[path], &options).unwrap();
        let mut cloud = s3d_geom::PointCloud::default();
        found.rooms[0].instances[0].read(&mut cloud).unwrap();
        // The turn is a product of rounded numbers.
        let round = |v: f32| (v * 1e6).round() / 1e6;
        let others = found.warnings.into_iter();
        let others = others.filter(|warning| !warning.contains("no instance numbers"));
        (cloud.positions.iter().map(|p| p.to_array().map(round)).collect(), others.collect())
    }

    #[test]
    fn points_at_the_scanner_are_left_out_if_there_are_several() {
        let point = ([1.0, 0.0, 0.5], 7);
        let zero = ([0.0; 3], 7);
        let (positions, warnings) = read(CARTESIAN, &[zero, point, zero, ([0.0, 0.0, 1.0], 7)]);
        assert_eq!(positions, [[1.0, 3.0, 3.5], [1.0, 2.0, 4.0]]);
        let note = "2 of 4 points are at the scanner itself (0 0 0)";
        assert!(warnings.len() == 1 && warnings[0].contains(note), "{warnings:?}");

        let (positions, warnings) = read(CARTESIAN, &[zero, point]);
        assert_eq!(positions, [[1.0, 2.0, 3.0], [1.0, 3.0, 3.5]]);
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn the_scan_that_has_no_classes_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.e57");
        write(&path, &[(CARTESIAN, "class"), (CARTESIAN, "quality")], &[([1.0, 0.0, 0.5], 7)]);
        let message = Annotations::open(&[path], &AnnotationOptions::default())
            .unwrap_err()
            .to_string();
        let words = "a.e57: scan 2 of 2: has no column of classes; its columns are x y z quality";
        assert!(message.contains(words), "{message}");

        // A scan without points needs none.
        let path = dir.path().join("b.e57");
        let mut writer = E57Writer::from_file(&path, "file").unwrap();
        let xyz = [Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
        add_scan(&mut writer, xyz.to_vec(), &[]);
        writer.finalize().unwrap();
        let message = Annotations::open(&[path], &AnnotationOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.ends_with("b.e57: holds no point that can be used"), "{message}");
    }

    #[test]
    fn azimuths_of_any_turn_are_the_same_direction() {
        let names =
            [RecordName::SphericalRange, RecordName::SphericalAzimuth, RecordName::SphericalElevation];
        let turns = [FRAC_PI_2 - TAU, FRAC_PI_2, FRAC_PI_2 + TAU, FRAC_PI_2 - 3.0 * TAU];
        let points: Vec<([f64; 3], i64)> = turns.iter().map(|a| ([2.0, *a, 0.0], 7)).collect();
        let (positions, _) = read(names, &points);
        assert_eq!(positions, [[-1.0, 2.0, 3.0]; 4]);
    }
}
