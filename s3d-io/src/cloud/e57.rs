//! Annotated points of E57 files: several scans, each with its pose. Source: ASTM E2807.

use crate::bounds::Bounds;
use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::columns::Columns;
use crate::cloud::table::records::{Color, color};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::error::{Error, Result};
use crate::fs::source::Source;
use e57::{E57Reader, PointCloud, RawValues, Record, RecordDataType, RecordName, RecordValue};
use s3d_geom::glam::{DQuat, DVec3, dvec3};
use std::io::BufReader;
use std::path::Path;

/// An `.e57` file.
pub(crate) struct E57Cloud<'a> {
    source: Source,
    options: &'a AnnotationOptions,
}

impl<'a> E57Cloud<'a> {
    pub(crate) fn new(source: Source, options: &'a AnnotationOptions) -> Self {
        Self { source, options }
    }

    fn error(&self, error: &e57::Error) -> Error {
        Error::format(self.source.name(), format!("cannot be read: {error}"))
    }
}

/// Where in the values of a point things are.
struct Scan<'a> {
    prototype: &'a [Record],
    columns: Columns,
    /// Range, azimuth and elevation in place of x, y and z.
    is_spherical: bool,
    /// 1: a direction only; 2: nothing.
    invalid: Option<usize>,
    colorless: Option<usize>,
    /// The smallest and the largest value of each colour.
    limits: [(f64, f64); 3],
    rotation: DQuat,
    translation: DVec3,
    /// The room that the scan is named after.
    room: Option<String>,
}

/// The attribute's name as a user writes it: without the namespace's prefix if `bare`.
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
    fn new(path: &Path, options: &AnnotationOptions, cloud: &'a PointCloud) -> Result<Self> {
        let prototype = &cloud.prototype[..];
        let find = |name: &RecordName| prototype.iter().position(|r| r.name == *name);
        let is_spherical = !cloud.has_cartesian();
        if is_spherical && !cloud.has_spherical() {
            return Err(Error::format(path, "has a scan without coordinates"));
        }
        // An attribute can be named with its prefix (`ext:label`) or without.
        let asked = [&options.class_column, &options.instance_column, &options.room_column];
        let with_prefix = asked.into_iter().flatten().any(|a| a.contains(':'));
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
        let columns = Columns::choose(path, &names, options).map_err(|e| match e {
            Error::Format { message, .. } if message.contains("no column of classes") => Error::format(
                path,
                format!(
                    "{message}. E57 itself knows no classes: export the labelled points with an attribute \
                     for them, or as LAS or PLY"
                ),
            ),
            e => e,
        })?;
        let limits = columns.color.map_or([(0.0, 255.0); 3], |channels| {
            let of_file = cloud.color_limits.as_ref();
            let stated = [
                of_file.and_then(|l| Some((l.red_min.as_ref()?, l.red_max.as_ref()?))),
                of_file.and_then(|l| Some((l.green_min.as_ref()?, l.green_max.as_ref()?))),
                of_file.and_then(|l| Some((l.blue_min.as_ref()?, l.blue_max.as_ref()?))),
            ];
            let limits = |(stated, channel): (Option<(&RecordValue, &RecordValue)>, usize)| {
                let kind = &prototype.get(channel)?.data_type;
                let stated = stated.and_then(|(a, b)| Some((a.to_f64(kind).ok()?, b.to_f64(kind).ok()?)));
                stated.or(range_of(kind)).filter(|(a, b)| b > a)
            };
            let [r, g, b] = channels;
            let [of_r, of_g, of_b] = stated;
            [(of_r, r), (of_g, g), (of_b, b)].map(|channel| limits(channel).unwrap_or((0.0, 255.0)))
        });
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
            invalid: find(if is_spherical {
                &RecordName::SphericalInvalidState
            } else {
                &RecordName::CartesianInvalidState
            }),
            colorless: find(&RecordName::IsColorInvalid),
            limits,
            rotation: rotation.normalize(),
            translation,
            room,
        })
    }

    /// A number of a point; not a number if there is none.
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

    /// Whether the point has no place.
    fn is_invalid(&self, values: &RawValues) -> bool {
        self.invalid.is_some_and(|i| self.float(values, i) != 0.0)
    }

    fn position(&self, values: &RawValues) -> DVec3 {
        let [a, b, c] = self.columns.position.map(|i| self.float(values, i));
        let local = if self.is_spherical {
            let (azimuth_sin, azimuth_cos) = (libm::sin(b), libm::cos(b));
            let (elevation_sin, elevation_cos) = (libm::sin(c), libm::cos(c));
            a * dvec3(elevation_cos * azimuth_cos, elevation_cos * azimuth_sin, elevation_sin)
        } else {
            dvec3(a, b, c)
        };
        self.rotation * local + self.translation
    }

    fn color(&self, values: &RawValues) -> [u8; 3] {
        let Some(channels) = self.columns.color else { return [0; 3] };
        if self.colorless.is_some_and(|i| self.float(values, i) != 0.0) {
            return [0; 3];
        }
        let scaled = |channel: usize, (min, max): (f64, f64)| {
            ((self.float(values, channel) - min) / (max - min)).clamp(0.0, 1.0)
        };
        let ([r, g, b], [of_r, of_g, of_b]) = (channels, self.limits);
        match color([scaled(r, of_r), scaled(g, of_g), scaled(b, of_b)], true, ColorRange::Narrow) {
            Color::Rgb(rgb) => rgb,
            Color::Wider | Color::Beyond(_) => [0; 3],
        }
    }
}

/// The values that a type can have.
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

/// What `f` gives, or a sentence if it panicked: the decoder is not ours, and a damaged file must not end the
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
        let (file, size) = self.source.open()?;
        let file = BufReader::with_capacity(1 << 18, file);
        let mut reader = guarded(path, || E57Reader::new(file))?.map_err(|e| self.error(&e))?;
        let scans = guarded(path, || reader.pointclouds())?;
        if scans.is_empty() {
            return Err(Error::format(path, "holds no scan"));
        }
        if let Some(bounds) = bounds_of(&scans) {
            reading.claims(bounds);
        }
        let (mut number, mut invalid) = (0, 0u64);
        for cloud in &scans {
            let scan = Scan::new(path, self.options, cloud)?;
            let bits: u64 = cloud.prototype.iter().map(|r| bits_of(&r.data_type)).sum();
            // A point that takes no bit would come without end.
            if u128::from(cloud.records) * u128::from(bits.max(1)) > u128::from(size) * 8 {
                let message =
                    format!("claims {} points in {size} bytes: the file is cut short", cloud.records);
                return Err(Error::format(path, message));
            }
            let mut points = guarded(path, || reader.pointcloud_raw(cloud))?.map_err(|e| self.error(&e))?;
            let c = scan.columns;
            while let Some(values) = guarded(path, || points.next())? {
                let values = values
                    .map_err(|e| Error::format(path, format!("cannot be read after point {number}: {e}")))?;
                number += 1;
                if scan.is_invalid(&values) {
                    invalid += 1;
                    continue;
                }
                let row = Row {
                    position: scan.position(&values),
                    color: scan.color(&values),
                    class: scan.value(&values, c.class),
                    instance: c.instance.map_or(Value::None, |i| scan.value(&values, i)),
                    room: match (c.room, &scan.room, self.options.room) {
                        (Some(i), _, _) => scan.value(&values, i),
                        (None, Some(name), None) => Value::Name(name),
                        _ => Value::None,
                    },
                };
                reading.push(number, &row)?;
            }
        }
        if invalid > 0 {
            let of = format!("{invalid} of {number} points are marked invalid, left out");
            reading.notes.push(format!("{}: {of}", path.display()));
        }
        Ok(true)
    }
}

/// The box of all scans at their places, if each says where its points are.
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

/// Turn, of any length, and place of a scan.
fn pose_of(scan: &PointCloud) -> (DQuat, DVec3) {
    let pose = scan.transform.clone().unwrap_or_default();
    let (q, t) = (pose.rotation, pose.translation);
    (DQuat::from_xyzw(q.x, q.y, q.z, q.w), dvec3(t.x, t.y, t.z))
}

/// The bits that a value takes.
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
