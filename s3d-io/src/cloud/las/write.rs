//! Writes points as LAS 1.4.

use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use las::point::Format;
use las::{Builder, Color, Point, Transform, Vector, Version, Vlr, Writer};
use s3d_geom::PointCloud;
use s3d_geom::glam::{DVec3, Vec3};
use std::path::Path;

/// The step of coordinates, metres. It reaches 214 km.
const STEP_M: f64 = 1e-4;

/// Writes a cloud as LAS 1.4, points of format 7, with steps of 0.1 mm: positions, colours (black if it has
/// none), and labels as an extra dimension `label` of 32-bit integers, if there are any. The file appears
/// whole or not at all. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for a point that is not finite or beyond 214 km.
///
/// # Panics
/// If the cloud has colours, or there are labels, but not one a point.
pub fn write_las_points(path: &Path, cloud: &PointCloud, labels: &[i32]) -> Result<u64> {
    let n = cloud.len();
    for (what, found) in [("colours", cloud.colors.len()), ("labels", labels.len())] {
        assert!(found == 0 || found == n, "{found} {what} for {n} points");
    }
    let most_m = STEP_M * f64::from(i32::MAX);
    let is_out = |p: &Vec3| !p.as_dvec3().abs().cmple(DVec3::splat(most_m)).all();
    if let Some(at) = cloud.positions.iter().position(is_out) {
        let message = format!("point {at} lies beyond {most_m:.0} m, which LAS holds in steps of 0.1 mm");
        return Err(Error::format(path, message));
    }

    let unfit = |e: las::Error| match e {
        las::Error::Io(e) => Error::io(path, "write", e),
        e => Error::format(path, e.to_string()),
    };
    let mut point_format = Format::new(7).map_err(unfit)?;
    point_format.extra_bytes = if labels.is_empty() { 0 } else { 4 };
    let transform = Transform { scale: STEP_M, offset: 0.0 };
    let mut builder = Builder::default();
    builder.version = Version::new(1, 4);
    builder.date = None;
    builder.generating_software = "s3d".to_owned();
    builder.point_format = point_format;
    builder.transforms = Vector { x: transform, y: transform, z: transform };
    builder.vlrs = if labels.is_empty() {
        Vec::new()
    } else {
        vec![label_dimension()]
    };

    let header = builder.into_header().map_err(unfit)?;
    let mut writer = Writer::new(AtomicFile::create(path)?, header).map_err(unfit)?;
    for (i, position) in cloud.positions.iter().enumerate() {
        let [x, y, z] = position.as_dvec3().to_array();
        // 8 bits as 16, so that white is white.
        let [r, g, b] = cloud
            .colors
            .get(i)
            .copied()
            .unwrap_or_default()
            .map(|c| 257 * u16::from(c));
        let extra_bytes = labels
            .get(i)
            .map_or_else(Vec::new, |label| label.to_le_bytes().to_vec());
        let (color, gps_time) = (Some(Color::new(r, g, b)), Some(0.0));
        let point = Point { x, y, z, color, gps_time, extra_bytes, ..Point::default() };
        writer.write_point(point).map_err(unfit)?;
    }
    writer.into_inner().map_err(unfit)?.commit()
}

/// The record that describes the extra dimension of labels, 192 bytes.
fn label_dimension() -> Vlr {
    // Two bytes that mean nothing, the type (a signed integer of four bytes), options, and the name.
    let mut data = b"\0\0\x06\0label".to_vec();
    data.resize(192, 0);
    Vlr { user_id: "LASF_Spec".to_owned(), record_id: 4, description: "Extra Bytes".to_owned(), data }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_colours_and_labels_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("points.las");
        let cloud = PointCloud {
            positions: (0..300).map(|i| Vec3::new(0.01 * i as f32, -2.0, 150_000.0)).collect(),
            colors: (0..300).map(|i| [(i % 256) as u8, 0, 255]).collect(),
            ..PointCloud::default()
        };
        let labels: Vec<i32> = (0..300).map(|i| i * 1000 - 1).collect();
        let bytes = write_las_points(&path, &cloud, &labels).unwrap();
        assert_eq!(bytes, std::fs::metadata(&path).unwrap().len());

        let read = las::Reader::from_path(&path).unwrap().read_all().unwrap();
        let points: Vec<Point> = read.points().map(|point| point.unwrap()).collect();
        assert_eq!(points.len(), 300);
        for (i, point) in points.iter().enumerate() {
            let p = cloud.positions[i].as_dvec3();
            assert!((point.x - p.x).abs() <= STEP_M && point.y == -2.0 && point.z == 150_000.0);
            assert_eq!(point.color.unwrap().red, 257 * u16::from(cloud.colors[i][0]));
            assert_eq!(point.extra_bytes, labels[i].to_le_bytes());
        }

        let far = PointCloud { positions: vec![Vec3::X * 1e6], ..PointCloud::default() };
        let other = dir.path().join("far.las");
        assert!(
            write_las_points(&other, &far, &[])
                .unwrap_err()
                .to_string()
                .contains("point 0")
        );
        assert!(!other.exists());
    }
}
