//! The options of an evaluation.

use crate::error::{Error, Result};
use crate::{Folds, Protocol};
use s3d_dataset::pack::ClassList;
use s3d_io::dataset::Frame;
use serde::{Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use thiserror::Error as ThisError;

/// The options of an evaluation. The default is the default variant of the protocol on all areas.
#[derive(Clone, Debug, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct EvalOptions {
    /// One of [`Protocol::variants`]. `None` is the first.
    #[serde(skip)]
    pub variant: Option<String>,
    /// The areas to test, and which of them together.
    #[serde(skip)]
    pub folds: Folds,
    /// Other predictions in the same form. [`Evaluation::against`](crate::Evaluation::against) has the
    /// difference of each score, with its interval: without [`bootstrap`](Self::bootstrap), 1,000 rounds.
    #[serde(skip)]
    pub against: Option<PathBuf>,
    /// The number of rounds of the [`bootstrap`](crate::bootstrap()) of rooms, or of images where there are
    /// no rooms. `None` gives no intervals.
    pub bootstrap: Option<u32>,
    /// The source of everything random.
    pub seed: u64,
    /// `depth` only: scales each predicted image to the median of its truth first.
    pub median_scale: bool,
    /// `normal`, `sem-edge`, `depth-edge`, and `depth` as Marigold: the kind of images to evaluate. `None` is
    /// the kind that the predictions are named after. The other protocols of images have one kind each.
    #[serde(serialize_with = "word")]
    pub images: Option<ImageKind>,
    /// `det` only: the classes to detect, by name. `None` means the 12 of the paper.
    pub classes: Option<Vec<String>>,
    /// `det` only: the points that the true boxes surround. `None` means [`BoxSource::Points`].
    #[serde(serialize_with = "word")]
    pub boxes: Option<BoxSource>,
    /// `panoptic` and `panoptic3d` only: the stuff classes, of which each image or room has one segment.
    /// `None` means the stuff of the taxonomy; of S3DIS's for points.
    pub stuff: Option<ClassList>,
}

fn word<S: Serializer>(option: &Option<impl fmt::Display>, serializer: S) -> Result<S::Ok, S::Error> {
    option.as_ref().map(ToString::to_string).serialize(serializer)
}

/// The points that the true boxes of `det` surround.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoxSource {
    /// The sampled points, which detectors are given (`pointcloud_boxes.json`). In S3DIS these are also the
    /// annotated points, so published results are of this kind.
    #[default]
    Points,
    /// The annotated points, from which the labels of the mesh came (`instances.json`).
    Annotations,
}

impl BoxSource {
    /// Returns the other source.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::Points => Self::Annotations,
            Self::Annotations => Self::Points,
        }
    }

    /// Says which points these are.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Points => "sampled points (pointcloud_boxes.json)",
            Self::Annotations => "annotated points (instances.json)",
        }
    }
}

impl fmt::Display for BoxSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Points => "points",
            Self::Annotations => "annotations",
        })
    }
}

/// A word that names no source of boxes.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[error("{0:?} is no source of boxes: points and annotations are")]
pub struct UnknownBoxSource(String);

impl FromStr for BoxSource {
    type Err = UnknownBoxSource;

    fn from_str(word: &str) -> Result<Self, UnknownBoxSource> {
        let found = [Self::Points, Self::Annotations]
            .into_iter()
            .find(|source| source.to_string() == word);
        found.ok_or_else(|| UnknownBoxSource(word.to_owned()))
    }
}

/// A kind of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Perspective views: normals are in the axes of the camera.
    Views,
    /// Panoramas: normals are in the axes of the world.
    Panoramas,
}

impl ImageKind {
    /// Returns the kind of an image.
    pub fn of(frame: Frame) -> Self {
        if frame == Frame::Panorama {
            Self::Panoramas
        } else {
            Self::Views
        }
    }

    /// Returns its word.
    pub(crate) fn noun(self) -> &'static str {
        match self {
            Self::Views => "views",
            Self::Panoramas => "panoramas",
        }
    }
}

impl fmt::Display for ImageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.noun())
    }
}

/// A word that names no kind of images.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[error("{0:?} is no kind of images: views and panoramas are")]
pub struct UnknownImageKind(String);

impl FromStr for ImageKind {
    type Err = UnknownImageKind;

    fn from_str(word: &str) -> Result<Self, UnknownImageKind> {
        let found = [Self::Views, Self::Panoramas]
            .into_iter()
            .find(|kind| kind.to_string() == word);
        found.ok_or_else(|| UnknownImageKind(word.to_owned()))
    }
}

impl EvalOptions {
    /// Refuses options of other protocols.
    ///
    /// # Errors
    /// [`Error::OtherProtocol`] for the first of them.
    pub(crate) fn check_of(&self, protocol: Protocol) -> Result<()> {
        const OF_IMAGES: &[Protocol] = &[
            Protocol::Normal,
            Protocol::SemPano,
            Protocol::SemView,
            Protocol::SemEdge,
            Protocol::Depth,
            Protocol::DepthEdge,
        ];
        let given: [(bool, &str, &[Protocol]); 5] = [
            (self.classes.is_some(), "classes", &[Protocol::Det]),
            (self.boxes.is_some(), "boxes", &[Protocol::Det]),
            (self.stuff.is_some(), "stuff", &[Protocol::Panoptic, Protocol::Panoptic3d]),
            (self.median_scale, "median_scale", &[Protocol::Depth]),
            (self.images.is_some(), "images", OF_IMAGES),
        ];
        for (is_given, option, owners) in given {
            if is_given && !owners.contains(&protocol) {
                return Err(Error::OtherProtocol { protocol, option, owners });
            }
        }
        Ok(())
    }

    /// Returns the variant of a protocol that these options ask for.
    ///
    /// # Errors
    /// [`Error::UnknownVariant`] if the protocol has no such variant.
    pub fn variant_of(&self, protocol: Protocol) -> Result<&'static str> {
        let variants = protocol.variants();
        let Some(word) = &self.variant else { return Ok(variants[0]) };
        let found = variants.iter().find(|name| *name == word);
        found
            .copied()
            .ok_or_else(|| Error::UnknownVariant { protocol, name: word.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_variant_is_the_default() {
        let mut options = EvalOptions::default();
        assert_eq!(options.variant_of(Protocol::Depth).unwrap(), "hohonet");
        options.variant = Some("unifuse".into());
        assert_eq!(options.variant_of(Protocol::Depth).unwrap(), "unifuse");
        let error = options.variant_of(Protocol::Det).unwrap_err().to_string();
        assert!(error.contains("mmdetection3d, open3d-ml"), "{error}");
    }

    #[test]
    fn options_of_other_protocols_are_refused() {
        let median = EvalOptions { median_scale: true, ..EvalOptions::default() };
        let classes = EvalOptions { classes: Some(vec!["wall".into()]), ..EvalOptions::default() };
        let views = EvalOptions { images: Some(ImageKind::Views), ..EvalOptions::default() };
        for (options, owner) in
            [(&median, Protocol::Depth), (&classes, Protocol::Det), (&views, Protocol::SemPano)]
        {
            assert!(options.check_of(owner).is_ok());
            let error = options.check_of(Protocol::Sem3d).unwrap_err();
            assert!(error.is_usage(), "{error}");
        }
        let message = classes.check_of(Protocol::Sem3d).unwrap_err().to_string();
        assert_eq!(message, "sem3d takes no classes: det does");
        let message = views.check_of(Protocol::Det).unwrap_err().to_string();
        assert_eq!(
            message,
            "det takes no images: normal and sem-pano and sem-view and sem-edge and depth and depth-edge do"
        );
    }

    #[test]
    fn kinds_of_images_and_sources_of_boxes_are_words() {
        assert_eq!("annotations".parse(), Ok(BoxSource::Annotations));
        let message = "boxes".parse::<BoxSource>().unwrap_err().to_string();
        assert!(message.contains("points and annotations are"), "{message}");
        assert_eq!("panoramas".parse::<ImageKind>().unwrap(), ImageKind::of(Frame::Panorama));
        assert_eq!("views".parse::<ImageKind>().unwrap(), ImageKind::of(Frame::View(3)));
        assert!(
            "both"
                .parse::<ImageKind>()
                .unwrap_err()
                .to_string()
                .contains("views and panoramas are")
        );
    }
}
