//! Compares the cameras of an image in both data sets.

use super::comparison::{PoseChange, PoseChanges};
use s3d_geom::Pose;
use s3d_geom::glam::DMat3;
use s3d_io::dataset::PoseFile;

/// Cameras within these limits are the same: no pixel shows the difference.
const SAME_M: f64 = 1e-6;
const SAME_DEGREES: f64 = 1e-5;
const SAME_PX: f64 = 1e-3;

/// How two cameras differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moved {
    pub(crate) m: f64,
    pub(crate) degrees: f64,
    pub(crate) k_px: f64,
}

impl Moved {
    /// Compares angles and matrix, which both give the pose. The larger difference counts.
    pub(crate) fn between(a: &PoseFile, b: &PoseFile) -> Self {
        let pose_a = a.pose();
        let pose_b = b.pose();
        let mut m = pose_a.location.distance(pose_b.location);
        let mut degrees = angle(pose_a.world_from_camera, pose_b.world_from_camera);
        match (Pose::from_rt(a.camera_rt_matrix), Pose::from_rt(b.camera_rt_matrix)) {
            (Ok(a), Ok(b)) => {
                m = m.max(a.location.distance(b.location));
                degrees = degrees.max(angle(a.world_from_camera, b.world_from_camera));
            }
            (Err(_), Err(_)) if a.camera_rt_matrix == b.camera_rt_matrix => {}
            // One of the matrices is no rotation and translation.
            _ => degrees = 180.0,
        }
        let k = a
            .camera_k_matrix
            .as_flattened()
            .iter()
            .zip(b.camera_k_matrix.as_flattened());
        let k_px = k.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        Self { m, degrees, k_px }
    }

    /// Whether images of one size show the same.
    pub(crate) fn is_same_camera(&self) -> bool {
        self.m <= SAME_M && self.degrees <= SAME_DEGREES && self.k_px <= SAME_PX
    }
}

/// The angle between two rotations, degrees.
fn angle(a: DMat3, b: DMat3) -> f64 {
    let between = a.transpose() * b;
    // The sine and cosine, both doubled. Together they are exact for small angles too.
    let [x, y, z] = between.to_cols_array_2d();
    let sx = y[2] - z[1];
    let sy = z[0] - x[2];
    let sz = x[1] - y[0];
    let sine = (sx * sx + sy * sy + sz * sz).sqrt();
    let cosine = x[0] + y[1] + z[2] - 1.0;
    libm::atan2(sine, cosine).to_degrees()
}

impl PoseChanges {
    /// Adds a pose whose bytes differ.
    pub(crate) fn add(&mut self, (a, b): (String, String), moved: Moved, is_of_one_size: bool) {
        // K is in pixels, so it cannot be compared between images of different sizes.
        let Moved { m, degrees, k_px } = moved;
        if (Moved { k_px: if is_of_one_size { k_px } else { 0.0 }, ..moved }).is_same_camera() {
            self.same_camera += 1;
            return;
        }
        let k_px = is_of_one_size.then_some(k_px);
        self.largest_m = self.largest_m.max(m);
        self.largest_degrees = self.largest_degrees.max(degrees);
        self.largest_k_px = self.largest_k_px.max(k_px.unwrap_or(0.0));
        self.moved.push(PoseChange { a, b, m, degrees, k_px });
    }

    /// Sorts the farthest to the front. Ties keep their order.
    pub(crate) fn sort(&mut self) {
        self.moved.sort_by(|a, b| {
            b.m.total_cmp(&a.m)
                .then(b.degrees.total_cmp(&a.degrees))
                .then(b.k_px.unwrap_or(0.0).total_cmp(&a.k_px.unwrap_or(0.0)))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Camera;
    use s3d_geom::glam::{DVec3, dvec3};
    use s3d_io::dataset::Frame;

    fn file(location: DVec3, yaw_degrees: f64, fov: f64) -> PoseFile {
        let pose = Pose::level(location, yaw_degrees.to_radians());
        PoseFile::new(&Camera::perspective(pose, fov, 100, 100), &pose, "a", "office_1_1", Frame::View(0))
    }

    #[test]
    fn places_rotations_and_k_are_measured() {
        let a = file(DVec3::ZERO, 0.0, 1.0);
        assert!(Moved::between(&a, &a).is_same_camera());
        for degrees in [1e-4, 0.3, 90.0, 179.0] {
            let moved = Moved::between(&a, &file(dvec3(0.0, 0.03, 0.04), degrees, 1.0));
            assert!((moved.m - 0.05).abs() < 1e-12 && (moved.degrees - degrees).abs() < 1e-9, "{moved:?}");
            assert!(moved.k_px == 0.0 && !moved.is_same_camera());
        }

        let focal = |fov: f64| 50.0 / (fov / 2.0).tan();
        let moved = Moved::between(&a, &file(DVec3::ZERO, 0.0, 1.1));
        assert!((moved.k_px - (focal(1.0) - focal(1.1))).abs() < 1e-9, "{moved:?}");

        // Only the matrix differs.
        let mut b = a.clone();
        b.camera_rt_matrix[0][3] += 0.5;
        assert!((Moved::between(&a, &b).m - 0.5).abs() < 1e-9);
        b.camera_rt_matrix[0][0] = 7.0;
        assert_eq!(Moved::between(&a, &b).degrees, 180.0);

        let mut changes = PoseChanges::default();
        changes.add(("x".into(), "x".into()), Moved { m: 0.0, degrees: 0.0, k_px: 0.0 }, true);
        changes.add(("x".into(), "x".into()), Moved { m: 0.0, degrees: 0.0, k_px: 9.0 }, false);
        changes.add(("y".into(), "y".into()), Moved { m: 1.0, degrees: 0.0, k_px: 9.0 }, false);
        changes.add(("z".into(), "z".into()), Moved { m: 2.0, degrees: 3.0, k_px: 1.0 }, true);
        changes.sort();
        let order: Vec<&str> = changes.moved.iter().map(|moved| moved.a.as_str()).collect();
        assert_eq!((order, changes.same_camera), (vec!["z", "y"], 2));
        let largest = (changes.largest_m, changes.largest_degrees, changes.largest_k_px);
        assert_eq!(largest, (2.0, 3.0, 1.0));
    }
}
