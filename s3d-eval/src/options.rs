//! How an evaluation is done.

use crate::{Folds, Protocol};
use s3d_dataset::{ClassList, Error, Result};
use s3d_io::dataset::Frame;
use std::fmt;
use std::str::FromStr;

/// How an evaluation is done. Its `Default` is the protocol's own way on all areas.
#[derive(Clone, Debug, PartialEq, Default)]
#[non_exhaustive]
pub struct EvalOptions {
    /// One of [`Protocol::variants`]; `None`: the first.
    pub variant: Option<String>,
    /// Which areas are tested, and which of them together.
    pub folds: Folds,
    /// How many times rooms (or images, where there are no rooms) are drawn again with replacement for the
    /// 95 % intervals of scores; `None`: no intervals.
    pub bootstrap: Option<u32>,
    /// Everything random comes from it.
    pub seed: u64,
    /// `depth`: predictions are scaled to the median of the truth first, image by image.
    pub median_scale: bool,
    /// `normal`: which images are evaluated; `None`: those that the predictions are named after. The other
    /// protocols of images have one kind each.
    pub images: Option<ImageKind>,
    /// `det`: the classes to detect, by name; `None`: the paper's 12.
    pub classes: Option<Vec<String>>,
    /// `panoptic`: the classes of which all of an image is one segment; `None`: those that the taxonomy calls
    /// stuff.
    pub stuff: Option<ClassList>,
}

/// A kind of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Perspective views: normals are in the camera's axes.
    Views,
    /// Panoramas: normals are in the world's axes.
    Panoramas,
}

impl ImageKind {
    /// Which kind an image is of.
    pub fn of(frame: Frame) -> Self {
        if frame == Frame::Panorama {
            Self::Panoramas
        } else {
            Self::Views
        }
    }
}

impl fmt::Display for ImageKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Views => "views",
            Self::Panoramas => "panoramas",
        })
    }
}

impl FromStr for ImageKind {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        let found = [Self::Views, Self::Panoramas]
            .into_iter()
            .find(|kind| kind.to_string() == word);
        found.ok_or_else(|| Error::Usage(format!("{word:?} is no kind of images: views and panoramas are")))
    }
}

impl EvalOptions {
    /// The variant that is asked for.
    ///
    /// # Errors
    /// [`Error::Usage`] if the protocol has none of this name.
    pub fn variant_of(&self, protocol: Protocol) -> Result<&'static str> {
        let variants = protocol.variants();
        let Some(word) = &self.variant else { return Ok(variants[0]) };
        let found = variants.iter().find(|name| *name == word);
        found.copied().ok_or_else(|| {
            Error::Usage(format!("{protocol} has no variant {word:?}: it has {}", variants.join(", ")))
        })
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
    fn kinds_of_images_are_words() {
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
