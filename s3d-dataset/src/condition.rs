//! The conditions of a useful data set.

use std::fmt;
use std::str::FromStr;

/// A condition that a useful data set fulfils.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Condition {
    /// The mesh has colours, if RGB images are made from it.
    Colour,
    /// Scan locations see the mesh in most directions.
    Coverage,
    /// Mesh and annotations lie in the same place.
    Frame,
    /// Scan locations see the front of faces.
    InsideOut,
    /// Faces get labels.
    Labels,
    /// There are not many more scan locations than the floor needs.
    Locations,
    /// Mesh and rooms have the size of buildings.
    Scale,
    /// The data set fits on the disk.
    Size,
    /// Floors and ceilings are level.
    Up,
}

impl Condition {
    /// All conditions, sorted by name.
    pub const ALL: [Self; 9] = [
        Self::Colour,
        Self::Coverage,
        Self::Frame,
        Self::InsideOut,
        Self::Labels,
        Self::Locations,
        Self::Scale,
        Self::Size,
        Self::Up,
    ];

    /// Returns the name, as `--allow` takes it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Coverage => "coverage",
            Self::Frame => "frame",
            Self::InsideOut => "inside-out",
            Self::Labels => "labels",
            Self::Locations => "locations",
            Self::Scale => "scale",
            Self::Size => "size",
            Self::Up => "up",
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Condition {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = Self::ALL.map(Self::name).join(", ");
        Self::ALL
            .into_iter()
            .find(|c| c.name() == name)
            .ok_or_else(|| format!("must be one of {names}"))
    }
}
