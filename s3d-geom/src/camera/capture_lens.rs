//! The lens of a scanner's picture, straight or spherical.

use super::{Lens, SphericalLens};

/// The lens of a scanner's picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaptureLens {
    /// A camera's lens. A pinhole is one without distortion.
    Straight(Lens),
    /// The projection of a spherical picture.
    Spherical(SphericalLens),
}

impl CaptureLens {
    /// Returns the width and height of the picture in pixels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Straight(lens) => [lens.width(), lens.height()],
            Self::Spherical(lens) => [lens.width(), lens.height()],
        }
    }
}

impl From<Lens> for CaptureLens {
    fn from(lens: Lens) -> Self {
        Self::Straight(lens)
    }
}

impl From<SphericalLens> for CaptureLens {
    fn from(lens: SphericalLens) -> Self {
        Self::Spherical(lens)
    }
}
