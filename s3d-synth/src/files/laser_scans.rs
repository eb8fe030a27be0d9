//! Laser scans as PTX and E57 files.

use super::depth_pictures::jpeg;
use crate::ScanError;
use crate::building::ScanLocation;
use crate::device::{LaserScan, LaserScanner, ScanTarget};
use e57::{
    E57Writer, ImageFormat, Quaternion, Record, RecordDataType, RecordName, RecordValue,
    SphericalImageProperties, Transform, Translation,
};
use s3d_geom::Pose;
use s3d_geom::glam::{DMat3, DQuat, DVec3};
use s3d_io::Error as FileError;
use s3d_io::fs::AtomicFile;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write as _;
use std::fs::{File, rename};
use std::path::Path;

/// The guid of an E57 file. It is one for all, so that the same scan gives the same bytes.
const FILE_GUID: &str = "{53336473-796e-4468-8000-000000000057}";

impl ScanTarget<'_> {
    /// Scans from some locations and writes one PTX file: for each scan a header of ten lines, then its grid
    /// column by column, from the lowest elevation to the highest. A point is `x y z intensity r g b` in the
    /// scanner's axes, and `0 0 0 0.5 0 0 0` where nothing came back. The scan of location k has the number
    /// k. `go_on` is asked before each. The file is whole or not there.
    ///
    /// # Errors
    /// [`ScanError`] if a file cannot be written, a number is out of its range, or `go_on` returns false.
    pub fn write_ptx(
        &self,
        path: &Path,
        locations: &[ScanLocation],
        scanner: &LaserScanner,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<(), ScanError> {
        let mut file = AtomicFile::create(path)?;
        for (number, location) in (0..).zip(locations) {
            if !go_on() {
                return Err(ScanError::Cancelled);
            }
            let scan = self.laser_scan(location, scanner, number)?;
            file.put(ptx_header(&scan).as_bytes())?;

            let [columns, rows] = scan.size();
            let mut text = String::new();
            for column in 0..columns {
                text.clear();
                for row in (0..rows).rev() {
                    let Some(p) = scan.point(column, row) else {
                        text.push_str("0 0 0 0.5 0 0 0\n");
                        continue;
                    };
                    let [r, g, b] = scan.colors.at(column, row);
                    let intensity = scan.intensity.at(column, row);
                    let _ = writeln!(text, "{:.5} {:.5} {:.5} {intensity:.4} {r} {g} {b}", p.x, p.y, p.z);
                }
                file.put(text.as_bytes())?;
            }
        }
        file.commit()?;
        Ok(())
    }

    /// Scans from some locations and writes one E57 file. Each scan has its pose, its grid (`rowIndex` from
    /// the highest elevation, `columnIndex`), colours, intensities, and states of points that did not come
    /// back. If `panorama_px` is above 0, each scan has a spherical picture of that width (`images2D`), as a
    /// JPEG file. A scan's guid is the uuid of its location. The scan of location k has the number k.
    /// `go_on` is asked before each.
    ///
    /// # Errors
    /// Like [`ScanTarget::write_ptx`].
    ///
    /// # Panics
    /// If `panorama_px` is odd.
    pub fn write_e57(
        &self,
        path: &Path,
        locations: &[ScanLocation],
        scanner: &LaserScanner,
        panorama_px: u32,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<(), ScanError> {
        // The writer goes back in its file and reads it, so the file gets its name at the end.
        let mut name = path.as_os_str().to_owned();
        name.push(".part");
        let part = Path::new(&name);
        let io = |e| FileError::io(path, "write", e);
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(part);

        let written = file
            .map_err(|e| io(e).into())
            .and_then(|file| self.write_scans(path, file, locations, scanner, panorama_px, &mut go_on));
        let done = written.and_then(|()| Ok(rename(part, path).map_err(io)?));
        if done.is_err() {
            // The first error is the one to tell.
            let _ = std::fs::remove_file(part);
        }
        done
    }

    fn write_scans(
        &self,
        path: &Path,
        file: File,
        locations: &[ScanLocation],
        scanner: &LaserScanner,
        panorama_px: u32,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), ScanError> {
        let fault = |e: e57::Error| FileError::io(path, "write", std::io::Error::other(e));
        let mut writer = E57Writer::new(file, FILE_GUID).map_err(fault)?;

        for (number, location) in (0..).zip(locations) {
            if !go_on() {
                return Err(ScanError::Cancelled);
            }
            let scan = self.laser_scan(location, scanner, number)?;
            let guid = guid_of(&location.uuid);
            let mut points = writer.add_pointcloud(&guid, prototype(&scan)).map_err(fault)?;
            points.set_name(Some(location.uuid.clone()));
            points.set_transform(Some(transform(scan.origin, scan.world_from_scanner)));
            let [columns, rows] = scan.size();
            for column in 0..columns {
                for row in 0..rows {
                    points.add_point(values(&scan, column, row)).map_err(fault)?;
                }
            }
            points.finalize().map_err(fault)?;

            if panorama_px > 0 {
                let pose = Pose::level(location.position, location.yaw_rad);
                let panorama = self.panorama(&pose, panorama_px);
                let properties = SphericalImageProperties {
                    width: panorama.width(),
                    height: panorama.height(),
                    pixel_width: TAU / f64::from(panorama.width()),
                    pixel_height: PI / f64::from(panorama.height()),
                };
                // The middle of a spherical picture is along +x of its frame.
                let turn = DQuat::from_rotation_z(location.yaw_rad + FRAC_PI_2);

                let mut image = writer.add_image(&picture_guid_of(&location.uuid)).map_err(fault)?;
                image.set_name(&format!("{} panorama", location.uuid));
                image.set_pointcloud_guid(&guid);
                image.set_transform(transform(location.position, turn));
                let bytes = jpeg(path, &panorama)?;
                image
                    .add_spherical(ImageFormat::Jpeg, &mut bytes.as_slice(), properties, None)
                    .map_err(fault)?;
                image.finalize().map_err(fault)?;
            }
        }
        writer.finalize().map_err(fault)?;
        Ok(())
    }
}

/// Returns the ten lines above a scan: columns, rows, the scanner's place and axes, and the matrix scanner
/// → world for points that are rows.
fn ptx_header(scan: &LaserScan) -> String {
    let [columns, rows] = scan.size();
    let p = scan.origin;
    let place = format!("{:.6} {:.6} {:.6}", p.x, p.y, p.z);
    let turn = DMat3::from_quat(scan.world_from_scanner);
    let axes = [turn.x_axis, turn.y_axis, turn.z_axis].map(|a| format!("{:.9} {:.9} {:.9}", a.x, a.y, a.z));

    let mut text = format!("{columns}\n{rows}\n{place}\n");
    axes.iter().for_each(|axis| text.extend([axis.as_str(), "\n"]));
    axes.iter().for_each(|axis| text.extend([axis.as_str(), " 0\n"]));
    text.extend([place.as_str(), " 1\n"]);
    text
}

/// Returns the columns of a scan's points.
fn prototype(scan: &LaserScan) -> Vec<Record> {
    let [columns, rows] = scan.size();
    let number = RecordDataType::Single { min: None, max: None };
    let up_to = |max: u32| RecordDataType::Integer { min: 0, max: max.into() };
    let columns = [
        (RecordName::CartesianX, number.clone()),
        (RecordName::CartesianY, number.clone()),
        (RecordName::CartesianZ, number),
        (RecordName::CartesianInvalidState, up_to(2)),
        (RecordName::RowIndex, up_to(rows - 1)),
        (RecordName::ColumnIndex, up_to(columns - 1)),
        (RecordName::Intensity, RecordDataType::Single { min: Some(0.0), max: Some(1.0) }),
        (RecordName::ColorRed, up_to(255)),
        (RecordName::ColorGreen, up_to(255)),
        (RecordName::ColorBlue, up_to(255)),
    ];
    columns.map(|(name, data_type)| Record { name, data_type }).into()
}

/// Returns a point in the columns of [`prototype`]. State 2 means that nothing came back.
fn values(scan: &LaserScan, column: u32, row: u32) -> Vec<RecordValue> {
    let point = scan.point(column, row);
    let state = if point.is_some() { 0 } else { 2 };
    let [x, y, z] = point
        .unwrap_or(DVec3::ZERO)
        .as_vec3()
        .to_array()
        .map(RecordValue::Single);
    let [r, g, b] = scan.colors.at(column, row).map(|c| RecordValue::Integer(c.into()));
    let [state, row_index, column_index] = [state, row.into(), column.into()].map(RecordValue::Integer);
    let intensity = RecordValue::Single(scan.intensity.at(column, row));
    vec![x, y, z, state, row_index, column_index, intensity, r, g, b]
}

fn transform(place: DVec3, turn: DQuat) -> Transform {
    // The scalar part must not be below 0.
    let q = if turn.w < 0.0 { -turn } else { turn };
    Transform {
        rotation: Quaternion { w: q.w, x: q.x, y: q.y, z: q.z },
        translation: Translation { x: place.x, y: place.y, z: place.z },
    }
}

/// Returns 32 digits in the form of a guid.
fn guid_of(uuid: &str) -> String {
    let mut text: String = uuid.into();
    for at in [20, 16, 12, 8] {
        if text.is_char_boundary(at) {
            text.insert(at, '-');
        }
    }
    format!("{{{text}}}")
}

/// Returns the guid of a location's picture: the digits backwards.
fn picture_guid_of(uuid: &str) -> String {
    guid_of(&uuid.chars().rev().collect::<String>())
}
