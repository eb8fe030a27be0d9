//! What the images of the data set show. Source: [`crate::formats`], "What is written".

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// What a file shows: a modality, which the data set calls a domain. All of them are images except the pose
/// and the objects. `s3d_io::formats` defines the pixels of each.
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
    /// The distance from the camera. This one and all that follow are not in the published data set.
    DepthEuclidean,
    /// What a lamp at the camera shows of a white scene.
    Reshading,
    /// The principal curvatures of the mesh.
    PrincipalCurvature,
    /// Where a surface ends in front of another.
    EdgeOcclusion,
    /// The strength of edges of colours.
    EdgeTexture,
    /// How much a pixel's colours are a blob.
    Keypoints2d,
    /// How much a surface is a corner.
    Keypoints3d,
    /// Segments of similar colour.
    SegmentUnsup2d,
    /// Segments of surfaces.
    SegmentUnsup25d,
    /// Whether the mesh is seen.
    MaskValid,
    /// Borders between instances.
    EdgeInstance,
    /// The distance to the nearest border between instances.
    BoundaryDistance,
    /// Indices as those of `Semantic`, moved to the edges of the picture.
    SemanticRefined,
    /// Where `SemanticRefined` has another label than the mesh.
    SemanticMoved,
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
    /// PNG, 8 bits.
    Gray8,
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
    /// Whether a pixel that sees something may have the value `missing` too.
    is_ambiguous: bool,
    /// Whether the image follows from the colours of the same image.
    is_of_colors: bool,
}

impl Row {
    /// Returns the row of an image that shows no labels, and whose files are named after its folder.
    const fn image(domain: Domain, folder: &'static str, pixels: PixelKind, missing: [u16; 3]) -> Self {
        Self {
            domain,
            folder,
            suffix: folder,
            is_semantic: false,
            pixels: Some(pixels),
            missing,
            is_ambiguous: false,
            is_of_colors: false,
        }
    }

    /// Returns the row of an 8-bit gray image that is 0 where nothing is seen.
    const fn gray(domain: Domain, folder: &'static str) -> Self {
        Self::image(domain, folder, PixelKind::Gray8, [0; 3])
    }

    /// Returns the row of an image that may be 0 also where something is seen.
    const fn response(domain: Domain, folder: &'static str) -> Self {
        Self { is_ambiguous: true, ..Self::gray(domain, folder) }
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
    Row {
        is_ambiguous: true,
        ..Row::labels(Domain::SemanticClass, "semantic_class", PixelKind::Palette8, [255, 0, 0])
    },
    Row { is_ambiguous: true, ..Row::image(Domain::GlobalXyz, "global_xyz", PixelKind::Xyz, [0; 3]) },
    Row { pixels: None, ..Row::image(Domain::Pose, "pose", PixelKind::Rgb8, [0; 3]) },
    Row { pixels: None, ..Row::labels(Domain::Objects, "objects", PixelKind::Rgb8, [0; 3]) },
    Row::image(Domain::DepthEuclidean, "depth_euclidean", PixelKind::Gray16, [u16::MAX, 0, 0]),
    Row::gray(Domain::Reshading, "reshading"),
    Row::image(Domain::PrincipalCurvature, "principal_curvature", PixelKind::Rgb8, [255; 3]),
    Row::response(Domain::EdgeOcclusion, "edge_occlusion"),
    Row { is_of_colors: true, ..Row::response(Domain::EdgeTexture, "edge_texture") },
    Row { is_of_colors: true, ..Row::response(Domain::Keypoints2d, "keypoints2d") },
    Row::response(Domain::Keypoints3d, "keypoints3d"),
    Row {
        is_of_colors: true,
        ..Row::image(Domain::SegmentUnsup2d, "segment_unsup2d", PixelKind::Gray16, [0; 3])
    },
    Row::image(Domain::SegmentUnsup25d, "segment_unsup25d", PixelKind::Gray16, [0; 3]),
    Row::gray(Domain::MaskValid, "mask_valid"),
    Row { is_semantic: true, ..Row::response(Domain::EdgeInstance, "edge_instance") },
    Row::labels(Domain::BoundaryDistance, "boundary_distance", PixelKind::Gray16, [u16::MAX, 0, 0]),
    Row {
        is_of_colors: true,
        ..Row::labels(Domain::SemanticRefined, "semantic_refined", PixelKind::Rgb8, [13; 3])
    },
    Row { is_semantic: true, is_of_colors: true, ..Row::response(Domain::SemanticMoved, "semantic_moved") },
];

/// Returns the domains of the table. A variant without a row of its own does not compile.
#[expect(clippy::indexing_slicing, reason = "the compiler runs it")]
const fn domains() -> [Domain; TABLE.len()] {
    assert!(Domain::SemanticMoved as usize + 1 == TABLE.len(), "each variant has a row");
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

    /// Returns whether a pixel has the value of [`Self::missing`] only if it sees nothing, or if its value is
    /// too large to be written.
    pub fn shows_what_is_missing(self) -> bool {
        !self.row().is_ambiguous
    }

    /// Returns whether the image is made from the colours of the same image.
    pub fn is_of_colors(self) -> bool {
        self.row().is_of_colors
    }

    /// Returns the extension of the domain's files, without the dot.
    pub fn extension(self) -> &'static str {
        match self.pixels() {
            Some(PixelKind::Rgb8 | PixelKind::Gray8 | PixelKind::Gray16 | PixelKind::Palette8) => "png",
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
        let all = "there are rgb, depth, normal, semantic, semantic_pretty, semantic_class, global_xyz, \
                   pose, objects, depth_euclidean, reshading, principal_curvature, edge_occlusion, \
                   edge_texture, keypoints2d, keypoints3d, segment_unsup2d, segment_unsup25d, mask_valid, \
                   edge_instance, boundary_distance, semantic_refined and semantic_moved";
        assert_eq!(message, format!("no modality is called \"normals\"; {all}"));
    }
}
