//! What the images of the data set show. Source: [`crate::formats`], "What is written".

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// What a file shows: a modality, which the data set calls a domain. All of them are images except the pose
/// and the objects.
/// `TABLE` below says what there is to say about each; CONTRIBUTING.md lists what else a new one needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Domain {
    /// Colour.
    Rgb,
    /// Depth, 512 units a metre.
    Depth,
    /// Surface normals.
    Normal,
    /// Indices into `semantic_labels.json`.
    Semantic,
    /// A colour for each instance, to look at.
    SemanticPretty,
    /// The places of classes in the taxonomy, as an image with a palette. It is not in the published data
    /// set.
    SemanticClass,
    /// World coordinates.
    GlobalXyz,
    /// The camera.
    Pose,
    /// The instances in the image: their amodal masks, what hides them, their boxes. It is not in the
    /// published data set.
    Objects,
}

/// The error for a word that names no domain.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("no modality is called {word:?}; there are {}", names())]
pub struct UnknownDomain {
    /// The word.
    pub word: String,
}

/// The kind of pixels that the files of a domain have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PixelKind {
    /// PNG, 3 × 8 bits.
    Rgb8,
    /// PNG, 16 bits.
    Gray16,
    /// PNG, 8 bits and a palette.
    Palette8,
    /// OpenEXR, 3 × 16 or 32 bits, floats.
    Xyz,
}

/// What there is to say about a domain. Methods of [`Domain`] with the names of these fields describe them.
struct Row {
    domain: Domain,
    folder: &'static str,
    suffix: &'static str,
    is_semantic: bool,
    pixels: Option<PixelKind>,
    missing: [u16; 3],
}

impl Row {
    /// Returns the row of an image that shows no labels, and whose files are named after its folder.
    const fn image(domain: Domain, folder: &'static str, pixels: PixelKind, missing: [u16; 3]) -> Self {
        Self { domain, folder, suffix: folder, is_semantic: false, pixels: Some(pixels), missing }
    }

    /// Returns the row of an image that shows labels.
    const fn labels(domain: Domain, folder: &'static str, pixels: PixelKind, missing: [u16; 3]) -> Self {
        Self { is_semantic: true, ..Self::image(domain, folder, pixels, missing) }
    }
}

/// The domains in the order of their variants, which is the order of [`Domain::ALL`].
const TABLE: &[Row] = &[
    Row::image(Domain::Rgb, "rgb", PixelKind::Rgb8, [0; 3]),
    Row::image(Domain::Depth, "depth", PixelKind::Gray16, [u16::MAX, 0, 0]),
    Row { suffix: "normals", ..Row::image(Domain::Normal, "normal", PixelKind::Rgb8, [128; 3]) },
    Row::labels(Domain::Semantic, "semantic", PixelKind::Rgb8, [13; 3]),
    Row::labels(Domain::SemanticPretty, "semantic_pretty", PixelKind::Rgb8, [0; 3]),
    Row::labels(Domain::SemanticClass, "semantic_class", PixelKind::Palette8, [255, 0, 0]),
    Row::image(Domain::GlobalXyz, "global_xyz", PixelKind::Xyz, [0; 3]),
    Row { pixels: None, ..Row::image(Domain::Pose, "pose", PixelKind::Rgb8, [0; 3]) },
    Row { pixels: None, ..Row::labels(Domain::Objects, "objects", PixelKind::Rgb8, [0; 3]) },
];

/// Returns the domains of the table. A variant without a row of its own does not compile.
#[expect(clippy::indexing_slicing, reason = "the compiler runs it")]
const fn domains() -> [Domain; TABLE.len()] {
    assert!(Domain::Objects as usize + 1 == TABLE.len(), "each variant has a row");
    let mut all = [Domain::Pose; TABLE.len()];
    let mut i = 0;
    while i < TABLE.len() {
        assert!(TABLE[i].domain as usize == i, "rows have the order of the variants");
        all[i] = TABLE[i].domain;
        i += 1;
    }
    all
}

impl Domain {
    /// All domains in the order of [`crate::formats`], which is the order of options, of manifests and of the
    /// columns of tables.
    pub const ALL: [Self; TABLE.len()] = domains();

    /// The domains of the published data set in the same order. They are written by default.
    pub const PUBLISHED: [Self; 7] = [
        Self::Rgb,
        Self::Depth,
        Self::Normal,
        Self::Semantic,
        Self::SemanticPretty,
        Self::GlobalXyz,
        Self::Pose,
    ];

    #[expect(clippy::indexing_slicing, reason = "each variant has a row: see `domains`")]
    const fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// Returns whether the domain shows labels.
    pub fn is_semantic(self) -> bool {
        self.row().is_semantic
    }

    /// Returns the name of the domain's folder, "normal". Users name the domain by it too.
    pub fn folder(self) -> &'static str {
        self.row().folder
    }

    /// Returns the last word in the names of the domain's files: "normals". For all other domains it is the
    /// folder's name.
    pub fn suffix(self) -> &'static str {
        self.row().suffix
    }

    /// Returns the kind of the domain's pixels. `None` for the pose and the objects, which are not
    /// images.
    pub fn pixels(self) -> Option<PixelKind> {
        self.row().pixels
    }

    /// Returns the pixel of the domain's files where nothing is seen. A gray value or a place in a palette is
    /// the first of the three.
    pub fn missing(self) -> [u16; 3] {
        self.row().missing
    }

    /// Returns the extension of the domain's files, without the dot.
    pub fn extension(self) -> &'static str {
        match self.pixels() {
            Some(PixelKind::Rgb8 | PixelKind::Gray16 | PixelKind::Palette8) => "png",
            Some(PixelKind::Xyz) => "exr",
            None => "json",
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.folder())
    }
}

impl FromStr for Domain {
    type Err = UnknownDomain;

    /// Finds the domain by the name of its folder.
    fn from_str(word: &str) -> Result<Self, UnknownDomain> {
        let found = Self::ALL.into_iter().find(|d| d.folder() == word);
        found.ok_or_else(|| UnknownDomain { word: word.to_owned() })
    }
}

/// Returns the names of all domains, as a sentence lists them.
fn names() -> String {
    let [others @ .., last] = Domain::ALL.map(Domain::folder);
    format!("{} and {last}", others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_the_names_of_folders() {
        for domain in Domain::ALL {
            assert_eq!(domain.to_string().parse(), Ok(domain));
        }
        let message = "normals".parse::<Domain>().unwrap_err().to_string();
        let all = "there are rgb, depth, normal, semantic, semantic_pretty, semantic_class, global_xyz, pose and objects";
        assert_eq!(message, format!("no modality is called \"normals\"; {all}"));
    }
}
