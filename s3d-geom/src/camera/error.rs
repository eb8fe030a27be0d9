//! Why numbers are no camera.

use glam::DVec2;
use thiserror::Error;

/// Why a [`Camera`](crate::Camera) or [`Pose`](crate::Pose) cannot be made of the numbers given.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// An image without pixels.
    #[error("an image of {width} × {height} pixels")]
    NoPixels {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// Focal lengths must be finite and above 0.
    #[error("focal lengths of {} and {} px: both must be finite and above 0", .0.x, .0.y)]
    FocalLength(DVec2),
    /// The principal point must be finite.
    #[error("a principal point at ({}, {}) px", .0.x, .0.y)]
    PrincipalPoint(DVec2),
    /// The angle of view of a pinhole is between 0 and π.
    #[error("an angle of view of {0} rad: it must be between 0 and π")]
    AngleOfView(f64),
    /// K is fx 0 cx, 0 fy cy, 0 0 1.
    #[error("K is not [fx, 0, cx], [0, fy, cy], [0, 0, 1]: cameras with skew are not supported")]
    Intrinsics,
    /// A pose with an infinity or no number.
    #[error("a number of the pose is not finite")]
    NotFinite,
    /// The last row of a 4 × 4 matrix is 0 0 0 1.
    #[error("the last row of the matrix is not 0, 0, 0, 1, but its last column is: the matrix is transposed")]
    Transposed,
    /// Likewise, of a matrix that is not transposed.
    #[error("the last row of the matrix is not 0, 0, 0, 1")]
    LastRow,
    /// The axes of a camera are 1 long.
    #[error("the axes of the camera are {0} long instead of 1: the matrix holds a scale")]
    Scaled(f64),
    /// The axes of a camera are perpendicular and equally long.
    #[error("the axes of the camera are not perpendicular and equally long: the matrix is no rotation")]
    Sheared,
    /// The axes of a camera are right-handed.
    #[error("the matrix mirrors: an axis of the camera has the wrong sign")]
    Mirrored,
    /// A camera cannot look at its own place.
    #[error("the target is where the camera is")]
    TargetAtEye,
    /// The way up must not be the viewing direction.
    #[error("the camera looks along the axis that should point up")]
    UpAlongView,
}
