//! The stages of an export.

use serde::Serialize;

/// A stage of an export. Meshes and points are written beside the images, by one of the threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Stage {
    /// Inputs are read and checked.
    Load,
    /// Points vote for faces.
    Label,
    /// Candidate views are drawn and scored.
    Score,
    /// Images are rendered and written.
    Render,
    /// Meshes are written.
    Meshes,
    /// Points are sampled and written.
    Points,
    /// The files of shards move into one folder.
    Merge,
    /// Files over all areas together are made.
    Tables,
}

impl Stage {
    /// Returns its name in logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::Label => "label",
            Self::Score => "score",
            Self::Render => "render",
            Self::Meshes => "meshes",
            Self::Points => "points",
            Self::Merge => "merge",
            Self::Tables => "tables",
        }
    }
}
