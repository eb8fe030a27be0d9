//! Errors of cameras and poses.

use glam::DVec2;
use thiserror::Error;

/// The reason why numbers are not a [`Camera`](crate::Camera) or [`Pose`](crate::Pose).
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The image has no pixels.
    #[error("an image of {width} × {height} pixels")]
    NoPixels {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A focal length is not finite or not above 0.
    #[error("focal lengths of {} and {} px: both must be finite and above 0", .0.x, .0.y)]
    FocalLength(DVec2),
    /// The principal point is not finite.
    #[error("a principal point at ({}, {}) px", .0.x, .0.y)]
    PrincipalPoint(DVec2),
    /// The angle of view of a pinhole is not between 0 and π.
    #[error("an angle of view of {0} rad: it must be between 0 and π")]
    AngleOfView(f64),
    /// K is not fx 0 cx, 0 fy cy, 0 0 1.
    #[error("K is not [fx, 0, cx], [0, fy, cy], [0, 0, 1]: cameras with skew are not supported")]
    Intrinsics,
    /// A number of the pose is infinite or NaN.
    #[error("a number of the pose is not finite")]
    NotFinite,
    /// The last column of a 4 × 4 matrix is 0 0 0 1, not the last row.
    #[error("the last row of the matrix is not 0, 0, 0, 1, but its last column is: the matrix is transposed")]
    Transposed,
    /// Neither the last row nor the last column of a 4 × 4 matrix is 0 0 0 1.
    #[error("the last row of the matrix is not 0, 0, 0, 1")]
    LastRow,
    /// The axes of the camera do not have length 1.
    #[error("the axes of the camera are {0} long instead of 1: the matrix holds a scale")]
    Scaled(f64),
    /// The axes of the camera are not perpendicular, or not equally long.
    #[error("the axes of the camera are not perpendicular and equally long: the matrix is no rotation")]
    Sheared,
    /// The axes of the camera are left-handed.
    #[error("the matrix mirrors: an axis of the camera has the wrong sign")]
    Mirrored,
    /// The camera would look at its own location.
    #[error("the target is where the camera is")]
    TargetAtEye,
    /// The up direction is zero or parallel to the viewing direction.
    #[error("the camera looks along the axis that should point up")]
    UpAlongView,
}
