//! Why an evaluation failed.

use crate::options::ImageKind;
use crate::{Folds, Protocol};
use s3d_io::dataset::Domain;
use s3d_label::{Class, UnknownClass};
use std::path::PathBuf;
use thiserror::Error as ThisError;

/// The result of the calls of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why an evaluation failed.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The protocol has no variant of this name.
    #[error("{protocol} has no variant {name:?}: it has {}", protocol.variants().join(", "))]
    UnknownVariant {
        /// The protocol.
        protocol: Protocol,
        /// The name that was asked for.
        name: String,
    },
    /// [`Folds::Areas`] names an area that the data set lacks.
    #[error("the data set has no area {area}: it has {}", listed(areas))]
    UnknownArea {
        /// The area that was asked for.
        area: u32,
        /// The areas of the data set, ascending.
        areas: Vec<u32>,
    },
    /// No fold has an area of the data set.
    #[error("no fold has one of the data set's areas, {}", listed(areas))]
    NoFold {
        /// The folds that were asked for.
        folds: Folds,
        /// The areas of the data set, ascending.
        areas: Vec<u32>,
    },
    /// An option belongs to other protocols.
    #[error(
        "{protocol} takes no {option}: {} {}",
        named(owners),
        if owners.len() == 1 { "does" } else { "do" }
    )]
    OtherProtocol {
        /// The protocol.
        protocol: Protocol,
        /// The option's name in [`EvalOptions`](crate::EvalOptions).
        option: &'static str,
        /// The protocols that take it.
        owners: &'static [Protocol],
    },
    /// An option names classes that cannot be evaluated.
    #[error("{option}: {fault}")]
    Classes {
        /// The option.
        option: ClassOption,
        /// What is wrong with its classes.
        fault: ClassFault,
    },
    /// The protocol evaluates panoramas only, and views were asked for.
    #[error("{protocol} is of panoramas, not of views")]
    PanoramasOnly {
        /// The protocol.
        protocol: Protocol,
    },
    /// The protocol evaluates views only, and panoramas were asked for.
    #[error("{protocol} is of views, not of panoramas")]
    ViewsOnly {
        /// The protocol.
        protocol: Protocol,
    },
    /// The variant of `depth` evaluates panoramas only, and views were asked for.
    #[error(
        "depth as {variant} is of panoramas, not of views: depth as marigold, marigold-disparity and \
         marigold-metric is of both"
    )]
    DepthOfPanoramas {
        /// The variant.
        variant: &'static str,
    },
    /// The variant of `depth` does not scale predictions to the median of the truth.
    #[error("depth as {variant} has no scale to the median: depth as unifuse has")]
    NoMedianScale {
        /// The variant.
        variant: &'static str,
    },
    /// The data set has no labels, and the protocol needs them.
    #[error("{}: {protocol} needs labels, and the data set has none", root.display())]
    Unlabelled {
        /// The folder of the data set.
        root: PathBuf,
        /// The protocol.
        protocol: Protocol,
    },
    /// The areas that are tested have no annotated room.
    #[error("{}: no annotated room in the areas that are tested", root.display())]
    NoRooms {
        /// The folder of the data set.
        root: PathBuf,
    },
    /// The data set was made before data sets had the boxes of their sampled points.
    #[error(
        "{}: has no boxes of its sampled points (pointcloud_boxes.json), as an earlier version made it: \
         export it again, or ask for the boxes of the annotations",
        root.display()
    )]
    NoPointBoxes {
        /// The folder of the data set.
        root: PathBuf,
    },
    /// The areas that are tested have no image of the kind that is evaluated.
    #[error("the areas that are tested have no {kind} with images of {}", folders(domains))]
    NoImages {
        /// The kind of images.
        kind: ImageKind,
        /// The images that the truth is made of.
        domains: Vec<Domain>,
    },
    /// The other predictions are of other images.
    #[error(
        "{}: these predictions are of other images: both must be of views, or of panoramas",
        against.display()
    )]
    OtherImages {
        /// [`EvalOptions::against`](crate::EvalOptions::against).
        against: PathBuf,
    },
    /// A file is wrong or missing, the disk refuses, or the call was cancelled.
    #[error(transparent)]
    Dataset(#[from] s3d_dataset::Error),
}

/// An option of [`EvalOptions`](crate::EvalOptions) that names classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassOption {
    /// [`EvalOptions::classes`](crate::EvalOptions::classes).
    Classes,
    /// [`EvalOptions::stuff`](crate::EvalOptions::stuff).
    Stuff,
}

/// What is wrong with the classes of an option.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum ClassFault {
    /// A name is no class of the data set's taxonomy.
    #[error(transparent)]
    Unknown(#[from] UnknownClass),
    /// A class is named twice.
    #[error("{0} is there twice")]
    Double(Class),
    /// No class is named.
    #[error("name a class")]
    Empty,
}

impl Error {
    /// Whether the call itself cannot be, whatever the files hold: its options do not fit the protocol or the
    /// data set.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::UnknownVariant { .. }
            | Self::UnknownArea { .. }
            | Self::NoFold { .. }
            | Self::OtherProtocol { .. }
            | Self::Classes { .. }
            | Self::PanoramasOnly { .. }
            | Self::ViewsOnly { .. }
            | Self::DepthOfPanoramas { .. }
            | Self::NoMedianScale { .. } => true,
            Self::Unlabelled { .. }
            | Self::NoRooms { .. }
            | Self::NoPointBoxes { .. }
            | Self::OtherImages { .. }
            | Self::NoImages { .. }
            | Self::Dataset(_) => false,
        }
    }
}

impl From<s3d_io::Error> for Error {
    fn from(error: s3d_io::Error) -> Self {
        Self::Dataset(error.into())
    }
}

impl std::fmt::Display for ClassOption {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Classes => "classes",
            Self::Stuff => "stuff",
        })
    }
}

/// Lists numbers of areas in a sentence.
pub(crate) fn listed(areas: &[u32]) -> String {
    areas.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

/// Lists protocols in a sentence.
fn named(protocols: &[Protocol]) -> String {
    protocols
        .iter()
        .map(Protocol::to_string)
        .collect::<Vec<_>>()
        .join(" and ")
}

fn folders(domains: &[Domain]) -> String {
    domains.iter().map(|d| d.folder()).collect::<Vec<_>>().join(" and ")
}
