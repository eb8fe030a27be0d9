//! Images of a data set as pictures to look at.

use super::sheet::{INCH, Picture};
use crate::areas::classes;
use crate::error::Result;
use crate::poster::{palette_of, unlabelled};
use crate::raster::reduce::{mean, unpack};
use s3d_dataset::DataSet;
use s3d_geom::{DEFAULT_COLOR, Raster};
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{decode_gray16, decode_rgb8, decode_xyz};
use s3d_label::{Class, LabelId, LabelTable, pretty_color};
use s3d_render::{MISSING_DEPTH, MISSING_NORMAL};

/// What an image is drawn as.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Look {
    Colors,
    Depth,
    Normals,
    Coordinates,
    Classes,
    Instances,
}

impl Look {
    /// In the order of the first figure.
    pub(super) const ALL: [Self; 6] =
        [Self::Colors, Self::Depth, Self::Normals, Self::Coordinates, Self::Classes, Self::Instances];

    pub(super) fn domain(self) -> Domain {
        match self {
            Self::Colors => Domain::Rgb,
            Self::Depth => Domain::Depth,
            Self::Normals => Domain::Normal,
            Self::Coordinates => Domain::GlobalXyz,
            Self::Classes | Self::Instances => Domain::Semantic,
        }
    }

    /// What stands below it.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Colors => "RGB",
            Self::Depth => "Depth",
            Self::Normals => "Surface normals",
            Self::Coordinates => "Global XYZ",
            Self::Classes => "Semantics: classes",
            Self::Instances => "Semantics: instances",
        }
    }
}

/// Depth is white where it is near, and this grey where it is far.
const FAR_GREY: f32 = 25.0;
/// What has no value is white, as the paper is.
const NOTHING: [u8; 3] = [255; 3];
/// The share of pixels on each side of a range that may lie outside of it.
const OUTSIDE: f64 = 0.01;

/// Reads images of a data set.
pub(super) struct Images<'a> {
    data: &'a DataSet,
    /// The most pixels of a picture for each inch.
    dpi: u32,
    table: Option<LabelTable>,
    /// The colour of each class.
    palette: Vec<[u8; 3]>,
}

impl<'a> Images<'a> {
    pub(super) fn new(data: &'a DataSet, dpi: u32) -> Result<Self> {
        let names: Vec<&str> = classes(data).iter().map(|class| class.name).collect();
        Ok(Self { data, dpi, table: data.labels()?, palette: palette_of(&names) })
    }

    /// Returns the names and colours of classes.
    pub(super) fn classes(&self) -> Vec<(&'static str, [u8; 3])> {
        let names = classes(self.data).into_iter().map(|class| class.name);
        names.zip(self.palette.iter().copied()).collect()
    }

    /// Returns an image as a picture that is drawn this wide, in points.
    ///
    /// # Errors
    /// [`Error::Dataset`](crate::Error::Dataset) if the file is missing or damaged.
    pub(super) fn picture(&self, image: &DatasetImage, look: Look, width: f32) -> Result<Picture> {
        let path = image.path(self.data.layout(), look.domain());
        let bytes = self.data.read(&path)?;
        let (pixels, missing) = match look {
            Look::Colors => (decode_rgb8(&bytes, &path)?, None),
            Look::Normals => (decode_rgb8(&bytes, &path)?, Some(MISSING_NORMAL)),
            Look::Depth => (greys(&decode_gray16(&bytes, &path)?), None),
            Look::Coordinates => (places(&decode_xyz(&bytes, &path)?), None),
            Look::Classes => (decode_rgb8(&bytes, &path)?.map(|label| self.class_color(unpack(label))), None),
            Look::Instances => (decode_rgb8(&bytes, &path)?.map(|label| self.color(unpack(label))), None),
        };
        let reduced = self.reduced(pixels, width, missing);
        let pixels = reduced.map(|pixel| if Some(pixel) == missing { NOTHING } else { pixel });
        Ok(Picture { pixels, is_photo: look == Look::Colors })
    }

    /// Returns the colours of an image as a picture that is drawn this wide, in points. Pixels of other
    /// classes than this one are pale.
    ///
    /// # Errors
    /// As [`Images::picture`].
    pub(super) fn picture_of_class(&self, image: &DatasetImage, class: usize, width: f32) -> Result<Picture> {
        let colors = self.rgb(image, Domain::Rgb)?;
        let labels = self.rgb(image, Domain::Semantic)?;
        let [w, h] = [colors.width(), colors.height()];
        if [w, h] != [labels.width(), labels.height()] {
            let path = image.path(self.data.layout(), Domain::Semantic);
            return Err(s3d_io::Error::format(&path, "has not as many pixels as the colours").into());
        }
        let seen = colors.pixels().iter().zip(labels.pixels()).map(|(color, label)| {
            let is_shown = self
                .class(unpack(*label))
                .is_some_and(|of_pixel| of_pixel.index() == class);
            if is_shown { *color } else { pale(*color) }
        });
        let pixels = self.reduced(Raster::from_vec(w, h, seen.collect()), width, None);
        Ok(Picture { pixels, is_photo: true })
    }

    /// Returns the share of an image's pixels that each class has.
    ///
    /// # Errors
    /// As [`Images::picture`].
    pub(super) fn shares_of_classes(&self, image: &DatasetImage) -> Result<Vec<f64>> {
        let labels = self.rgb(image, Domain::Semantic)?;
        let mut counts = vec![0_u32; self.palette.len()];
        for run in labels.pixels().chunk_by(|a, b| a == b) {
            let class = run.first().and_then(|label| self.class(unpack(*label)));
            if let Some(count) = class.and_then(|class| counts.get_mut(class.index())) {
                *count += run.len() as u32;
            }
        }
        let all = f64::from(labels.width()) * f64::from(labels.height());
        Ok(counts.into_iter().map(|count| f64::from(count) / all).collect())
    }

    fn rgb(&self, image: &DatasetImage, domain: Domain) -> Result<Raster<[u8; 3]>> {
        let path = image.path(self.data.layout(), domain);
        Ok(decode_rgb8(&self.data.read(&path)?, &path)?)
    }

    /// No more pixels than the figure has on this width, in points.
    fn reduced(&self, pixels: Raster<[u8; 3]>, width: f32, missing: Option<[u8; 3]>) -> Raster<[u8; 3]> {
        let most = (width * self.dpi as f32 / INCH).ceil().max(1.0) as u32;
        let [w, h] = [pixels.width(), pixels.height()];
        if w <= most {
            return pixels;
        }
        let height = (u64::from(h) * u64::from(most)).div_ceil(u64::from(w)) as u32;
        mean(&pixels, [most, height.max(1)], missing)
    }

    fn class(&self, label: u32) -> Option<Class> {
        self.table.as_ref()?.class_of(LabelId(label))
    }

    fn class_color(&self, label: u32) -> [u8; 3] {
        let color = self
            .class(label)
            .and_then(|class| self.palette.get(class.index()).copied());
        color.unwrap_or_else(unlabelled)
    }

    fn color(&self, label: u32) -> [u8; 3] {
        self.class(label).map_or_else(unlabelled, |_| pretty_color(label))
    }
}

/// Grey and light, so that what is drawn over it or beside it stands out. The paper stays white.
pub(super) fn pale([r, g, b]: [u8; 3]) -> [u8; 3] {
    if [r, g, b] == NOTHING {
        return NOTHING;
    }
    let grey = (u32::from(r) * 2 + u32::from(g) * 5 + u32::from(b)) / 8;
    [(135 + grey * 100 / 255) as u8; 3]
}

/// Depth as greys, from white to dark.
fn greys(depth: &Raster<u16>) -> Raster<[u8; 3]> {
    let known = depth
        .pixels()
        .iter()
        .filter(|v| **v != MISSING_DEPTH)
        .map(|v| f32::from(*v));
    let [near, far] = range(known.collect());
    depth.map(|v| {
        if v == MISSING_DEPTH {
            return NOTHING;
        }
        let share = ((f32::from(v) - near) / (far - near)).clamp(0.0, 1.0);
        [(255.0 + (FAR_GREY - 255.0) * share) as u8; 3]
    })
}

/// World coordinates as colours: x is red, y green, z blue, each from its least to its largest.
fn places(xyz: &Raster<[f32; 3]>) -> Raster<[u8; 3]> {
    let is_known = |place: &&[f32; 3]| **place != [0.0; 3];
    let ranges: [[f32; 2]; 3] = std::array::from_fn(|axis| {
        let known = xyz
            .pixels()
            .iter()
            .filter(is_known)
            .filter_map(|place| place.get(axis).copied());
        range(known.filter(|k| k.is_finite()).collect())
    });
    xyz.map(|place| {
        if place == [0.0; 3] {
            return NOTHING;
        }
        let mut color = DEFAULT_COLOR;
        for ((channel, k), [low, high]) in color.iter_mut().zip(place).zip(ranges) {
            *channel = (((k - low) / (high - low)).clamp(0.0, 1.0) * 255.0) as u8;
        }
        color
    })
}

/// Returns the range of most numbers.
fn range(mut numbers: Vec<f32>) -> [f32; 2] {
    numbers.sort_unstable_by(f32::total_cmp);
    let last = numbers.len().saturating_sub(1) as f64;
    let at = |share: f64| {
        numbers
            .get((share * last).round() as usize)
            .copied()
            .unwrap_or_default()
    };
    let [low, high] = [at(OUTSIDE), at(1.0 - OUTSIDE)];
    [low, high.max(low + f32::EPSILON * low.abs().max(1.0))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_white_and_far_is_dark() {
        let ramp: Vec<u16> = (0..1000).chain([MISSING_DEPTH; 200]).collect();
        let greys = greys(&Raster::from_vec(1200, 1, ramp));
        assert_eq!((greys.at(0, 0), greys.at(1100, 0)), ([255; 3], NOTHING));
        assert_eq!(greys.at(999, 0), [FAR_GREY as u8; 3]);
        assert!(greys.at(400, 0)[0] > greys.at(401 + 20, 0)[0]);
        // A flat image, and one without a value.
        assert_eq!(super::greys(&Raster::from_vec(2, 1, vec![7, 7])).at(0, 0), [255; 3]);
        assert_eq!(super::greys(&Raster::from_vec(1, 1, vec![MISSING_DEPTH])).at(0, 0), NOTHING);
    }

    #[test]
    fn coordinates_are_colours_along_their_axis() {
        let row: Vec<[f32; 3]> = (1..=1000).map(|i| [i as f32, -2.0, 3.0 - i as f32 * 0.001]).collect();
        let colors = places(&Raster::from_vec(1000, 1, row));
        let [first, last] = [colors.at(0, 0), colors.at(999, 0)];
        assert!(first[0] < 5 && last[0] > 250 && first[2] > 250 && last[2] < 5, "{first:?} {last:?}");
        assert_eq!(places(&Raster::from_vec(1, 1, vec![[0.0; 3]])).at(0, 0), NOTHING);
    }
}
