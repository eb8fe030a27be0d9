//! The loaders that profiles are for.

use std::fmt;
use std::str::FromStr;

/// A loader that a data set can be written for besides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Profile {
    /// mmdetection3d's S3DIS converter.
    Mmdet3d,
    /// Open3D-ML's S3DIS class.
    Open3dMl,
    /// Pointcept's S3DIS preprocessing.
    Pointcept,
    /// PointNet's collected arrays, as its many descendants read them.
    PointNet,
}

impl Profile {
    /// All of them, by name.
    pub const ALL: [Self; 4] = [Self::Mmdet3d, Self::Open3dMl, Self::Pointcept, Self::PointNet];

    /// The name of the profile and of its folder.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mmdet3d => "mmdet3d",
            Self::Open3dMl => "open3d-ml",
            Self::Pointcept => "pointcept",
            Self::PointNet => "pointnet",
        }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Profile {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|p| p.name() == word);
        found.ok_or_else(|| format!("{word:?} is none of pointcept, open3d-ml, mmdet3d and pointnet"))
    }
}
