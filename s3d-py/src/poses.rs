//! Lists of cameras.

use crate::arrays;
use crate::mesh::parsed;
use crate::work::watched;
use pyo3::prelude::*;
use s3d_geom::glam::DAffine3;
use s3d_io::camera::{Distortion, Optics, PosedCamera, PosedCameras, read_posed_cameras};
use s3d_io::mesh::UpAxis;
use std::path::PathBuf;

/// Name, pose camera → world, width and height, K, and the distortion: its name and its numbers.
type PoseEntry = (String, [[f64; 4]; 4], Option<[u32; 2]>, Option<[[f64; 3]; 3]>, Option<Lens>);
type Lens = (&'static str, Vec<f64>);

/// Reads the poses of a list of cameras.
#[pyfunction]
pub(crate) fn read_poses(
    py: Python<'_>,
    path: PathBuf,
    up: &str,
    sink: Py<PyAny>,
) -> PyResult<Vec<PoseEntry>> {
    let up: UpAxis = parsed("up", up, "y, z")?;
    let world_from_file = DAffine3::from_mat3(up.rotation());
    let PosedCameras { cameras, .. } = watched(py, None, &sink, |ctx| {
        let found = read_posed_cameras(&path, &world_from_file)?;
        if found.untracked > 0 {
            ctx.warn(format_args!("{}: {} pictures have no pose", path.display(), found.untracked));
        }
        Ok(found)
    })?;
    Ok(cameras.iter().map(entry).collect())
}

fn entry(camera: &PosedCamera) -> PoseEntry {
    let pose = arrays::world_from_opencv(&camera.pose);
    let middle = camera.size.map(|size| size.map(|side| 0.5 * f64::from(side)));
    let (k, lens) = match camera.optics {
        Some(Optics::Pinhole { focal_px, center_px, distortion }) => {
            let center = center_px.map(|center| center.to_array()).or(middle);
            let k = center.map(|[cx, cy]| [[focal_px.x, 0.0, cx], [0.0, focal_px.y, cy], [0.0, 0.0, 1.0]]);
            let lens = match distortion {
                Distortion::None => None,
                Distortion::OpenCv(numbers) => Some(("opencv", numbers.to_vec())),
                Distortion::Fisheye(numbers) => Some(("fisheye", numbers.to_vec())),
            };
            (k, lens)
        }
        Some(Optics::AngleOfView { fov_rad }) => {
            let k = middle.map(|[cx, cy]| {
                let f = cx / (0.5 * fov_rad).tan();
                [[f, 0.0, cx], [0.0, f, cy], [0.0, 0.0, 1.0]]
            });
            (k, None)
        }
        Some(Optics::Equirectangular) | None => (None, None),
    };
    (camera.name.clone(), pose, camera.size, k, lens)
}
