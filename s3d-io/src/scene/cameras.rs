//! The table `[cameras]` of a `scene.toml`.

use crate::mesh::file::UpAxis;
use s3d_geom::glam::{DAffine3, DMat3, DMat4, DVec3};
use serde::Deserialize;
use std::path::PathBuf;

/// The source of an area's scan locations.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraSource {
    /// They are read from a list by [`read_scan_locations`](crate::camera::read_scan_locations).
    Listed {
        /// The file or folder.
        path: PathBuf,
        /// The transform from the list's frame to the world (metres, Z-up): a rotation, a shift and a scale.
        world_from_file: DAffine3,
    },
    /// They are to be placed on the floor.
    Placed {
        /// The smallest distance between two locations of a room, metres. Above 0, finite.
        distance_m: f64,
    },
}

/// The table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CamerasTable {
    path: Option<PathBuf>,
    place: Option<f64>,
    up: Option<UpAxis>,
    transform: Option<[[f64; 4]; 4]>,
}

impl CamerasTable {
    /// Returns the source that the table describes. The error is a sentence.
    pub(crate) fn source(self) -> std::result::Result<CameraSource, String> {
        match (self.path, self.place) {
            (Some(_), Some(_)) => Err("path and place exclude each other".into()),
            (None, None) => Err("needs a path, or place = METRES to put scan locations on the floor".into()),
            (None, Some(_)) if self.up.is_some() || self.transform.is_some() => {
                Err("up and transform go with a path".into())
            }
            (None, Some(distance_m)) if distance_m > 0.0 && distance_m.is_finite() => {
                Ok(CameraSource::Placed { distance_m })
            }
            (None, Some(distance_m)) => Err(format!("place = {distance_m} is no distance in metres")),
            (Some(path), None) => {
                let up = self.up.unwrap_or(UpAxis::Z);
                let given = self.transform.map_or(Ok(DAffine3::IDENTITY), similarity)?;
                Ok(CameraSource::Listed { path, world_from_file: given * DAffine3::from_mat3(up.rotation()) })
            }
        }
    }
}

/// Returns the transform that has these rows. It may turn, shift and scale, nothing else. The error is a
/// sentence.
pub(crate) fn similarity(rows: [[f64; 4]; 4]) -> std::result::Result<DAffine3, String> {
    const FORM: &str = "transform is no rotation with a scale and a shift: its rows are [x, y, z, shift], \
                        the last [0, 0, 0, 1]";

    let columns = DMat4::from_cols_array_2d(&rows).transpose();
    let m = DMat3::from_mat4(columns);
    let scale = libm::cbrt(m.determinant());
    let is_finite = rows.iter().flatten().all(|v| v.is_finite());
    let is_similar = (m.transpose() * m)
        .abs_diff_eq(DMat3::from_diagonal(DVec3::splat(scale * scale)), 1e-4 * scale * scale);

    if !is_finite || rows[3] != [0.0, 0.0, 0.0, 1.0] || scale <= 0.0 || !is_similar {
        return Err(FORM.into());
    }
    Ok(DAffine3 { matrix3: m, translation: columns.w_axis.truncate() })
}
