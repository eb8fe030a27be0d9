//! The place and rotation of a camera, in the convention of the published data set.
//!
//! Camera axes are Blender's: x right, y up, looking along −z. Angles are Blender's XYZ Euler angles, E(x,
//! y, z) = Rz·Ry·Rx, in radians. Source: `s3d_io::formats`, "What is written" (checked on genuine pose
//! files).

use crate::CameraError;
use glam::{DAffine3, DMat3, DQuat, DVec3, dvec3};
use std::f64::consts::FRAC_PI_2;

/// Returns the rotation Rz·Ry·Rx of three angles in radians.
pub fn rotation_from_euler(angles_rad: DVec3) -> DMat3 {
    DMat3::from_rotation_z(angles_rad.z)
        * DMat3::from_rotation_y(angles_rad.y)
        * DMat3::from_rotation_x(angles_rad.x)
}

/// Returns the three angles in radians whose [`rotation_from_euler`] is `rotation`: x and z in (−π, π], y
/// in [−π/2, π/2]. If the two outer axes coincide (y = ±π/2), z is 0.
pub fn euler_from_rotation(rotation: DMat3) -> DVec3 {
    let DMat3 { x_axis, y_axis, z_axis } = rotation;
    let cos_y = libm::hypot(x_axis.x, x_axis.y);
    let y = libm::atan2(-x_axis.z, cos_y);
    if cos_y > 1e-9 {
        dvec3(libm::atan2(y_axis.z, z_axis.z), y, libm::atan2(x_axis.y, x_axis.x))
    } else {
        dvec3(libm::atan2(-z_axis.y, y_axis.y), y, 0.0)
    }
}

/// The place and rotation of a camera.
///
/// ```
/// use s3d_geom::{Pose, euler_from_rotation, glam::{DVec3, dvec3}};
/// use std::f64::consts::FRAC_PI_2;
///
/// let north = Pose::level(dvec3(1.0, 2.0, 1.5), 0.0);
/// assert!(north.forward().abs_diff_eq(DVec3::Y, 1e-12) && north.up().abs_diff_eq(DVec3::Z, 1e-12));
/// let west_and_up = north.turned(FRAC_PI_2, 0.3);
/// assert!(west_and_up.forward().abs_diff_eq(dvec3(-0.3f64.cos(), 0.0, 0.3f64.sin()), 1e-12));
/// let (yaw_rad, pitch_rad) = north.yaw_pitch_to(&west_and_up);
/// assert!((yaw_rad - FRAC_PI_2).abs() < 1e-12 && (pitch_rad - 0.3).abs() < 1e-12);
/// // The angles that a pose file states.
/// assert!(euler_from_rotation(north.world_from_camera).abs_diff_eq(dvec3(FRAC_PI_2, 0.0, 0.0), 1e-12));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// The place of the camera, in world metres, Z-up.
    pub location: DVec3,
    /// The rotation from the camera (x right, y up, z backwards) to the world: E(final) of the pose files.
    /// Orthonormal.
    pub world_from_camera: DMat3,
}

impl Pose {
    /// Returns the pose of a scan location from its entry in a camera table: E(original) = R(q)·Rx(90°).
    /// The identity therefore looks along +Y with +Z up.
    pub fn from_scanner(location: DVec3, world_from_scanner: DQuat) -> Self {
        let turn = DMat3::from_quat(world_from_scanner.normalize());
        Self { location, world_from_camera: turn * DMat3::from_rotation_x(FRAC_PI_2) }
    }

    /// Returns the pose of a level camera (+Z up) with the heading `yaw_rad`, which is 0 along +Y and grows
    /// to the left (towards −X).
    pub fn level(location: DVec3, yaw_rad: f64) -> Self {
        Self::from_scanner(location, DQuat::from_rotation_z(yaw_rad))
    }

    /// Returns the pose of an OpenCV camera (x right, y down, z forward) from its matrix world → camera,
    /// 3 × 4, row by row. [`Pose::rt_matrix`] returns the same matrix.
    ///
    /// # Errors
    /// The errors of [`Pose::from_opengl`].
    pub fn from_rt(camera_from_world: [[f64; 4]; 3]) -> Result<Self, CameraError> {
        let [x, y, z] = camera_from_world.map(|[x, y, z, _]| dvec3(x, y, z));
        let shift = DVec3::from_array(camera_from_world.map(|[.., t]| t));
        // The rows are the axes of the camera in the world.
        let pose = Self::from_axes(DVec3::ZERO, x, -y, -z)?;
        let location = -(pose.opencv_from_world().transpose() * shift);
        if location.is_finite() {
            Ok(Self { location, ..pose })
        } else {
            Err(CameraError::NotFinite)
        }
    }

    /// Returns the pose of an OpenCV camera (x right, y down, z forward) from its matrix camera → world,
    /// 4 × 4, row by row.
    ///
    /// # Errors
    /// The errors of [`Pose::from_opengl`].
    pub fn from_opencv(world_from_camera: [[f64; 4]; 4]) -> Result<Self, CameraError> {
        let [right, down, forward, location] = columns(world_from_camera)?;
        Self::from_axes(location, right, -down, -forward)
    }

    /// Returns the pose of an OpenGL camera (x right, y up, z backwards) from its matrix camera → world,
    /// 4 × 4, row by row. Blender and nerfstudio have the same axes.
    ///
    /// Axes from rounded files, which are off by less than a thousandth, are made perpendicular. The viewing
    /// direction is kept.
    ///
    /// # Errors
    /// [`CameraError::NotFinite`]; [`CameraError::Transposed`], [`CameraError::LastRow`],
    /// [`CameraError::Scaled`], [`CameraError::Sheared`] or [`CameraError::Mirrored`] if the matrix is not a
    /// rotation with a translation.
    ///
    /// ```
    /// use s3d_geom::{CameraError, Pose, glam::DVec3};
    ///
    /// // 1.5 m above the floor, looking along +Y.
    /// let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]];
    /// let along_y = Pose::look_at(DVec3::Z * 1.5, DVec3::new(0.0, 9.0, 1.5), DVec3::Z)?;
    /// assert_eq!(Pose::from_opengl(rows)?, along_y);
    /// // A matrix read by columns has the place in its last row.
    /// let transposed = std::array::from_fn(|i| std::array::from_fn(|j| rows[j][i]));
    /// assert_eq!(Pose::from_opengl(transposed), Err(CameraError::Transposed));
    /// # Ok::<(), CameraError>(())
    /// ```
    pub fn from_opengl(world_from_camera: [[f64; 4]; 4]) -> Result<Self, CameraError> {
        let [right, up, back, location] = columns(world_from_camera)?;
        Self::from_axes(location, right, up, back)
    }

    /// Returns the pose of a camera at `eye` that looks at `target`. The top of the image is as near to `up`
    /// as possible.
    ///
    /// # Errors
    /// [`CameraError::NotFinite`]; [`CameraError::TargetAtEye`]; [`CameraError::UpAlongView`].
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Result<Self, CameraError> {
        if !(eye.is_finite() && target.is_finite() && up.is_finite()) {
            return Err(CameraError::NotFinite);
        }
        let back = (eye - target).try_normalize().ok_or(CameraError::TargetAtEye)?;
        let up = up.try_normalize().ok_or(CameraError::UpAlongView)?;
        let right = up.cross(back);
        if right.length() < 1e-9 {
            return Err(CameraError::UpAlongView);
        }
        let right = right.normalize();
        Ok(Self { location: eye, world_from_camera: DMat3::from_cols(right, back.cross(right), back) })
    }

    /// Returns the pose with these axes of the camera in the world, which may be rounded.
    fn from_axes(location: DVec3, right: DVec3, up: DVec3, back: DVec3) -> Result<Self, CameraError> {
        /// The tolerance for angles and lengths of the axes. Files hold seven decimals or fewer.
        const MOST_SKEW: f64 = 1e-3;

        if ![location, right, up, back].iter().all(|v| v.is_finite()) {
            return Err(CameraError::NotFinite);
        }

        let length = right.length();
        let skew = [
            up.length() - length,
            back.length() - length,
            right.dot(up) / length,
            up.dot(back) / length,
            back.dot(right) / length,
        ];
        if !(length > 0.0 && skew.iter().all(|s| s.abs() <= MOST_SKEW * length)) {
            return Err(CameraError::Sheared);
        }
        if right.cross(up).dot(back) <= 0.0 {
            return Err(CameraError::Mirrored);
        }
        if (length - 1.0).abs() > MOST_SKEW {
            return Err(CameraError::Scaled(length));
        }

        let back = back.normalize();
        let right = (right - back * right.dot(back)).normalize();
        Ok(Self { location, world_from_camera: DMat3::from_cols(right, back.cross(right), back) })
    }

    /// Returns the pose turned by `yaw_rad` to the left and `pitch_rad` upwards, without roll: E(final) =
    /// E(original)·Ry(yaw)·Rx(pitch).
    #[must_use]
    pub fn turned(&self, yaw_rad: f64, pitch_rad: f64) -> Self {
        let turn = DMat3::from_rotation_y(yaw_rad) * DMat3::from_rotation_x(pitch_rad);
        Self { location: self.location, world_from_camera: self.world_from_camera * turn }
    }

    /// Returns the yaw and pitch, in radians, with which [`Pose::turned`] leads from this pose to `view`. If
    /// `view` has a roll, it is ignored.
    pub fn yaw_pitch_to(&self, view: &Pose) -> (f64, f64) {
        let turn = self.world_from_camera.transpose() * view.world_from_camera;
        // The first column of Ry(yaw)·Rx(pitch) is (cos y, 0, −sin y).
        // The middle row is (0, cos p, −sin p).
        (libm::atan2(-turn.x_axis.z, turn.x_axis.x), libm::atan2(-turn.z_axis.y, turn.y_axis.y))
    }

    /// Returns the level pose (+Z up) at the same place, with the same heading ([`Pose::azimuth_rad`]).
    #[must_use]
    pub fn leveled(&self) -> Self {
        Self::level(self.location, self.azimuth_rad() - FRAC_PI_2)
    }

    /// Returns the pose after a rotation with a scale and a shift of the world.
    #[must_use]
    pub fn moved(&self, by: &DAffine3) -> Self {
        if *by == DAffine3::IDENTITY {
            return *self;
        }
        let m = by.matrix3;
        let scale = m.x_axis.length();
        let turn = DMat3::from_cols(m.x_axis / scale, m.y_axis / scale, m.z_axis / scale);
        Self {
            location: by.transform_point3(self.location),
            world_from_camera: turn * self.world_from_camera,
        }
    }

    /// Returns the direction to the right of the image, in the world; a unit vector.
    pub fn right(&self) -> DVec3 {
        self.world_from_camera.x_axis
    }

    /// Returns the direction to the top of the image, in the world; a unit vector.
    pub fn up(&self) -> DVec3 {
        self.world_from_camera.y_axis
    }

    /// Returns the viewing direction in the world; a unit vector.
    pub fn forward(&self) -> DVec3 {
        -self.world_from_camera.z_axis
    }

    /// Returns the rotation from the world to OpenCV's axes of the camera (x right, y down, z forward):
    /// D·E(final)ᵀ.
    pub fn opencv_from_world(&self) -> DMat3 {
        DMat3::from_cols(self.right(), -self.up(), self.forward()).transpose()
    }

    /// Returns `camera_rt_matrix` of the pose files, row by row: [D·E(final)ᵀ | −D·E(final)ᵀ·C],
    /// world → camera, 3 × 4.
    pub fn rt_matrix(&self) -> [[f64; 4]; 3] {
        let r = self.opencv_from_world();
        let t = -(r * self.location);
        std::array::from_fn(|i| [r.x_axis[i], r.y_axis[i], r.z_axis[i], t[i]])
    }

    /// Returns the heading of the viewing direction in the horizontal plane, in radians from +X towards +Y.
    /// If the camera looks straight up or down, the heading is the direction of the bottom or the top of its
    /// image.
    pub fn azimuth_rad(&self) -> f64 {
        let f = self.forward();
        if libm::hypot(f.x, f.y) > 1e-9 {
            libm::atan2(f.y, f.x)
        } else {
            let edge = if f.z > 0.0 { -self.up() } else { self.up() };
            libm::atan2(edge.y, edge.x)
        }
    }
}

/// Returns the columns of a 4 × 4 matrix without the last row, which must be 0 0 0 1.
fn columns(rows: [[f64; 4]; 4]) -> Result<[DVec3; 4], CameraError> {
    const LAST: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    let column = |j: usize| rows.map(|row| row[j]);
    if rows[3] != LAST {
        return Err(if column(3) == LAST {
            CameraError::Transposed
        } else {
            CameraError::LastRow
        });
    }
    Ok([0, 1, 2, 3].map(|j| dvec3(rows[0][j], rows[1][j], rows[2][j])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: DMat3, b: DMat3) -> bool {
        a.abs_diff_eq(b, 1e-12)
    }

    proptest! {
        #[test]
        fn euler_angles_come_back(x in -3.1..3.1f64, y in -1.5..1.5f64, z in -3.1..3.1f64) {
            let e = dvec3(x, y, z);
            prop_assert!(euler_from_rotation(rotation_from_euler(e)).abs_diff_eq(e, 1e-9));
        }

        #[test]
        fn yaw_and_pitch_come_back(yaw in -3.1..3.1f64, pitch in -1.5..1.5f64, q in -3.0..3.0f64) {
            let original =
                Pose::from_scanner(DVec3::ONE, DQuat::from_rotation_z(q) * DQuat::from_rotation_x(0.1));
            let (y, p) = original.yaw_pitch_to(&original.turned(yaw, pitch));
            prop_assert!((y - yaw).abs() < 1e-9 && (p - pitch).abs() < 1e-9);
        }
    }

    /// Returns the matrix camera → world, 4 × 4, with the axes multiplied by the given signs.
    fn rows(pose: &Pose, [x, y, z]: [f64; 3]) -> [[f64; 4]; 4] {
        let m = pose.world_from_camera;
        let row = |i: usize| [x * m.x_axis[i], y * m.y_axis[i], z * m.z_axis[i], pose.location[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    fn are_close(other: Pose, tolerance: f64, pose: &Pose) -> bool {
        other.location.abs_diff_eq(pose.location, tolerance)
            && other.world_from_camera.abs_diff_eq(pose.world_from_camera, tolerance)
    }

    proptest! {
        #[test]
        fn matrices_come_back(
            q in prop::array::uniform4(-1.0..1.0f64), at in prop::array::uniform3(-9.0..9.0f64),
            off in prop::array::uniform9(-2e-4..2e-4f64),
        ) {
            let Some(q) = glam::DVec4::from_array(q).try_normalize() else { return Ok(()) };
            let pose = Pose::from_scanner(DVec3::from_array(at), DQuat::from_vec4(q));

            let opengl = rows(&pose, [1.0, 1.0, 1.0]);
            prop_assert!(are_close(Pose::from_opengl(opengl).unwrap(), 1e-12, &pose));
            prop_assert!(are_close(Pose::from_opencv(rows(&pose, [1.0, -1.0, -1.0])).unwrap(), 1e-12, &pose));
            prop_assert!(are_close(Pose::from_rt(pose.rt_matrix()).unwrap(), 1e-12, &pose));
            // The axes of one convention are a rotation in the other too, so only a picture shows a mix-up.
            prop_assert!(!are_close(Pose::from_opencv(opengl).unwrap(), 0.1, &pose));

            let mut rounded = opengl;
            (0..9).for_each(|k| rounded[k / 3][k % 3] += off[k]);
            let back = Pose::from_opengl(rounded).unwrap();
            prop_assert!(are_close(back, 1e-3, &pose));
            let m = back.world_from_camera;
            prop_assert!(close(m * m.transpose(), DMat3::IDENTITY) && m.determinant() > 0.0);
        }

        #[test]
        fn cameras_look_at_their_targets(
            eye in prop::array::uniform3(-9.0..9.0f64), target in prop::array::uniform3(-9.0..9.0f64),
        ) {
            let [eye, target] = [eye, target].map(DVec3::from_array);
            let Ok(pose) = Pose::look_at(eye, target, DVec3::Z * 7.0) else { return Ok(()) };
            prop_assert!(pose.forward().abs_diff_eq((target - eye).normalize(), 1e-9));
            prop_assert!(pose.right().z.abs() < 1e-9 && pose.up().z > 0.0);
            let m = pose.world_from_camera;
            prop_assert!(m.transpose().abs_diff_eq(m.inverse(), 1e-9) && m.determinant() > 0.0);
        }
    }

    fn look_from_one(target: DVec3, up: DVec3) -> CameraError {
        Pose::look_at(DVec3::ONE, target, up).unwrap_err()
    }

    fn scale(rows: &mut [[f64; 4]; 4], by: [f64; 3]) {
        rows[..3]
            .iter_mut()
            .for_each(|row| (0..3).for_each(|k| row[k] *= by[k]));
    }

    fn transpose(rows: &mut [[f64; 4]; 4]) {
        *rows = std::array::from_fn(|i| std::array::from_fn(|j| rows[j][i]));
    }

    /// Changes a good matrix, and returns why it is refused.
    fn refused_with(change: fn(&mut [[f64; 4]; 4]), good: [[f64; 4]; 4]) -> CameraError {
        let mut rows = good;
        change(&mut rows);
        Pose::from_opengl(rows).unwrap_err()
    }

    #[test]
    fn what_is_no_rotation_is_refused_by_its_fault() {
        let pose = Pose::level(dvec3(1.0, 2.0, 3.0), 0.4).turned(0.2, 0.3);
        let good = rows(&pose, [1.0; 3]);
        assert_eq!(refused_with(transpose, good), CameraError::Transposed);
        assert_eq!(refused_with(|rows| rows[3][3] = 2.0, good), CameraError::LastRow);
        assert_eq!(refused_with(|rows| rows[1][3] = f64::NEG_INFINITY, good), CameraError::NotFinite);
        assert_eq!(refused_with(|rows| rows[1][1] += 0.1, good), CameraError::Sheared);
        assert_eq!(
            refused_with(|rows| *rows = [[0.0; 4], [0.0; 4], [0.0; 4], rows[3]], good),
            CameraError::Sheared
        );

        let mut rows = good;
        scale(&mut rows, [1.0, 1.0, -1.0]);
        assert_eq!(Pose::from_opengl(rows), Err(CameraError::Mirrored));
        scale(&mut rows, [2.0, 2.0, -2.0]);
        assert!(matches!(Pose::from_opengl(rows), Err(CameraError::Scaled(s)) if (s - 2.0).abs() < 1e-9));

        let mut rt = pose.rt_matrix();
        rt[1] = rt[1].map(|v| -v);
        assert_eq!(Pose::from_rt(rt), Err(CameraError::Mirrored));
        rt[0][3] = f64::NAN;
        rt[1] = rt[1].map(|v| -v);
        assert_eq!(Pose::from_rt(rt), Err(CameraError::NotFinite));

        assert_eq!(look_from_one(DVec3::ONE, DVec3::Z), CameraError::TargetAtEye);
        assert_eq!(look_from_one(DVec3::ZERO, DVec3::ONE), CameraError::UpAlongView);
        assert_eq!(look_from_one(DVec3::ZERO, DVec3::ZERO), CameraError::UpAlongView);
        assert_eq!(look_from_one(DVec3::ZERO, DVec3::NAN), CameraError::NotFinite);
    }

    #[test]
    fn euler_angles_of_a_locked_gimbal_give_the_same_rotation() {
        for (x, y, z) in [(0.3, FRAC_PI_2, 0.7), (1.2, -FRAC_PI_2, -0.4)] {
            let r = rotation_from_euler(dvec3(x, y, z));
            assert!(rotation_from_euler(euler_from_rotation(r)).abs_diff_eq(r, 1e-7));
        }
    }

    #[test]
    fn the_identity_looks_along_y_with_z_up() {
        let p = Pose::from_scanner(DVec3::ZERO, DQuat::IDENTITY);
        assert!(p.forward().abs_diff_eq(DVec3::Y, 1e-15));
        assert!(p.up().abs_diff_eq(DVec3::Z, 1e-15));
        assert!(p.right().abs_diff_eq(DVec3::X, 1e-15));
    }

    #[test]
    fn yaw_turns_left_and_pitch_looks_up() {
        let p = Pose::level(DVec3::ZERO, 0.0);
        assert!(p.turned(FRAC_PI_2, 0.0).forward().abs_diff_eq(-DVec3::X, 1e-12));
        assert!(p.turned(0.0, FRAC_PI_2).forward().abs_diff_eq(DVec3::Z, 1e-12));
        assert!(close(Pose::level(DVec3::ZERO, 0.4).world_from_camera, p.turned(0.4, 0.0).world_from_camera));
    }

    #[test]
    fn rt_matrix_takes_the_camera_to_the_origin_and_forward_to_z() {
        let p = Pose::from_scanner(dvec3(3.0, -2.0, 1.5), DQuat::from_rotation_z(0.7)).turned(0.3, -0.2);
        let apply = |w: DVec3| {
            let m = p.rt_matrix();
            let row = |i: usize| m[i][0] * w.x + m[i][1] * w.y + m[i][2] * w.z + m[i][3];
            dvec3(row(0), row(1), row(2))
        };
        assert!(apply(p.location).abs_diff_eq(DVec3::ZERO, 1e-12));
        assert!(apply(p.location + 2.0 * p.forward()).abs_diff_eq(dvec3(0.0, 0.0, 2.0), 1e-12));
        assert!(apply(p.location + p.up()).abs_diff_eq(dvec3(0.0, -1.0, 0.0), 1e-12));
    }

    #[test]
    fn leveling_keeps_place_and_heading() {
        let tilted = Pose::from_scanner(dvec3(1.0, 2.0, 3.0), DQuat::from_rotation_z(2.1)).turned(0.0, 0.6);
        let rolled =
            Pose { world_from_camera: tilted.world_from_camera * DMat3::from_rotation_z(0.4), ..tilted };
        for pose in [tilted, rolled] {
            let level = pose.leveled();
            assert!(level.up().abs_diff_eq(DVec3::Z, 1e-12));
            assert!((level.azimuth_rad() - pose.azimuth_rad()).abs() < 1e-12);
            assert_eq!(level.location, pose.location);
        }
        assert!(close(tilted.leveled().world_from_camera, Pose::level(DVec3::ZERO, 2.1).world_from_camera));
    }

    #[test]
    fn heading_of_a_camera_that_looks_at_the_ceiling() {
        let level = Pose::level(DVec3::ZERO, 0.5);
        let heading = level.azimuth_rad();
        for pitch in [FRAC_PI_2, -FRAC_PI_2] {
            assert!((level.turned(0.0, pitch).azimuth_rad() - heading).abs() < 1e-9);
        }
    }
}
