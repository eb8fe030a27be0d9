//! The kinds of packages, and what each may be asked for.

use std::fmt;
use std::str::FromStr;

/// A kind of package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackageKind {
    /// [`Package::Webdataset`](super::Package::Webdataset).
    Webdataset,
    /// [`Package::Colmap`](super::Package::Colmap).
    Colmap,
    /// [`Package::Nerfstudio`](super::Package::Nerfstudio).
    Nerfstudio,
    /// [`Package::Coco`](super::Package::Coco).
    Coco,
    /// [`Package::Parquet`](super::Package::Parquet).
    Parquet,
    /// [`Package::Huggingface`](super::Package::Huggingface).
    Huggingface,
    /// [`Package::Dust3r`](super::Package::Dust3r).
    Dust3r,
    /// [`Package::Wai`](super::Package::Wai).
    Wai,
    /// [`Package::Vggt`](super::Package::Vggt).
    Vggt,
    /// [`Package::Pointcept`](super::Package::Pointcept).
    Pointcept,
    /// [`Package::SceneGraph`](super::Package::SceneGraph).
    SceneGraph,
    /// [`Package::Habitat`](super::Package::Habitat).
    Habitat,
    /// [`Package::Usd`](super::Package::Usd).
    Usd,
    /// [`Package::Concerto`](super::Package::Concerto).
    Concerto,
    /// [`Package::Objects`](super::Package::Objects).
    Objects,
    /// [`Package::SpatialQa`](super::Package::SpatialQa).
    SpatialQa,
}

/// The images that a kind of package can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Holds {
    /// Views and panoramas.
    Images,
    /// Views alone: its cameras are pinholes.
    Views,
    /// None: it has points, or meshes.
    Nothing,
}

/// What there is to say about a kind.
struct Row {
    kind: PackageKind,
    /// The word for it, which `FromStr` reads.
    name: &'static str,
    /// The name of the program or of the format, as its authors write it.
    title: &'static str,
    holds: Holds,
}

/// The kinds in the order of lists and messages.
const TABLE: &[Row] = &[
    row(PackageKind::Webdataset, "webdataset", "WebDataset", Holds::Images),
    row(PackageKind::Colmap, "colmap", "COLMAP", Holds::Views),
    row(PackageKind::Nerfstudio, "nerfstudio", "nerfstudio", Holds::Images),
    row(PackageKind::Coco, "coco", "COCO", Holds::Images),
    row(PackageKind::Parquet, "parquet", "Parquet", Holds::Images),
    row(PackageKind::Huggingface, "huggingface", "Hugging Face", Holds::Images),
    row(PackageKind::Dust3r, "dust3r", "DUSt3R", Holds::Views),
    row(PackageKind::Wai, "wai", "WAI", Holds::Views),
    row(PackageKind::Vggt, "vggt", "VGGT", Holds::Views),
    row(PackageKind::Pointcept, "pointcept", "Pointcept", Holds::Nothing),
    row(PackageKind::SceneGraph, "scene-graph", "a scene graph", Holds::Images),
    row(PackageKind::Habitat, "habitat", "habitat-sim", Holds::Nothing),
    row(PackageKind::Usd, "usd", "OpenUSD", Holds::Views),
    row(PackageKind::Concerto, "concerto", "Concerto", Holds::Views),
    row(PackageKind::Objects, "objects", "a table of objects", Holds::Images),
    row(PackageKind::SpatialQa, "spatial-qa", "spatial questions", Holds::Views),
];

const fn row(kind: PackageKind, name: &'static str, title: &'static str, holds: Holds) -> Row {
    Row { kind, name, title, holds }
}

impl PackageKind {
    /// The words of all kinds, for a help text.
    pub const WORDS: &str = "webdataset|colmap|nerfstudio|coco|parquet|huggingface|dust3r|wai|vggt|pointcept|\
                             scene-graph|habitat|usd|concerto|objects|spatial-qa";

    /// The row of the kind. Each has one: a test asks.
    fn row(self) -> &'static Row {
        TABLE.iter().find(|row| row.kind == self).unwrap_or(&TABLE[0])
    }

    /// The name, which `FromStr` reads.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The name of the program or of the format, for messages.
    pub(crate) fn title(self) -> &'static str {
        self.row().title
    }

    /// The kinds that hold images.
    pub(crate) fn with_images() -> impl Iterator<Item = Self> {
        TABLE
            .iter()
            .filter(|row| row.holds != Holds::Nothing)
            .map(|row| row.kind)
    }

    /// The images that it can hold.
    pub(crate) fn holds(self) -> Holds {
        self.row().holds
    }
}

impl fmt::Display for PackageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PackageKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let kinds: Vec<(&str, Self)> = TABLE.iter().map(|row| (row.name, row.kind)).collect();
        choice(&kinds, word)
    }
}

/// The images that a package holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackedImages {
    /// Perspective views.
    Views,
    /// Panoramas.
    Panoramas,
    /// Views and panoramas.
    #[default]
    All,
}

impl PackedImages {
    const ALL: [(&str, Self); 3] =
        [("views", Self::Views), ("panoramas", Self::Panoramas), ("all", Self::All)];
}

impl fmt::Display for PackedImages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::ALL.iter().find(|(_, images)| images == self);
        f.write_str(named.map_or("", |(name, _)| name))
    }
}

impl FromStr for PackedImages {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// The depth files of a nerfstudio package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFiles {
    /// New files: 16 bits, millimetres, 0 if missing.
    Millimetres,
    /// The files of the data set. nerfstudio must be given their unit, and missing pixels appear 128 m away.
    Original,
    /// No depth files.
    None,
}

impl DepthFiles {
    const ALL: [(&str, Self); 3] =
        [("millimetres", Self::Millimetres), ("original", Self::Original), ("none", Self::None)];
}

impl FromStr for DepthFiles {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        choice(&Self::ALL, word)
    }
}

/// The value with this name. The error lists all names.
fn choice<T: Copy>(all: &[(&str, T)], word: &str) -> Result<T, String> {
    let found = all.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    found.ok_or_else(|| format!("there are {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_row_of_its_own_and_is_in_the_help() {
        for row in TABLE {
            assert_eq!((row.kind.name(), row.name.parse()), (row.name, Ok(row.kind)));
        }
        let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
        assert_eq!(PackageKind::WORDS, names.join("|"));
        let e = "zip".parse::<PackageKind>().unwrap_err();
        assert!(e.starts_with("there are webdataset, colmap"), "{e}");
    }
}
