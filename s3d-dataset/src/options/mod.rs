//! What an export is asked for, as plain data.

pub(crate) mod condition;
pub(crate) mod placing;
pub(crate) mod profile;

use crate::error::{Error, Result};
use condition::Condition;
use placing::Placing;
use profile::Profile;
use s3d_geom::NormalAxes;
use s3d_io::dataset::{Conventions, DepthUnits, Domain, PADDED_LABELS, XyzType};
use s3d_io::image::Compression;
use s3d_render::Normals;
use s3d_sample::Pool;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What decides the bytes of a data set besides its input. The defaults are the paper's where it names a
/// number. The manifest stores them, with the seed and the distance of placed locations elsewhere in it.
///
/// ```
/// use s3d_dataset::ExportOptions;
///
/// let options = ExportOptions { views: 24, size: 540, ..ExportOptions::default() };
/// assert_eq!((options.pano_width, options.points_per_m2), (4096, 10_000.0));
/// let text = serde_json::to_string(&options)?;
/// assert_eq!(serde_json::from_str::<ExportOptions>(&text)?, options);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExportOptions {
    /// Everything random comes from it: the same input and seed give the same bytes.
    #[serde(skip_serializing_if = "is_zero")]
    pub seed: u64,
    /// Put scan locations on the floor of every room, no two of a room nearer than this, metres, instead of
    /// reading some. Without labels: no two nearer than this at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place_cameras: Option<f64>,
    /// Put as few scan locations as see this share of the surface that can be seen from anywhere, above 0 to
    /// 1, instead of reading some. Where there are none to be read, and nothing is said, it is 0.95.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub see: Option<f64>,
    /// Candidate views a scan location, 100,000 at most; the paper's are 3 × 24.
    pub views: u32,
    /// Width and height of a view in pixels, 8 to 16,384.
    pub size: u32,
    /// Width of a panorama in pixels, even, 8 to 32,768; it is half as high.
    pub pano_width: u32,
    /// Among which candidates views are selected.
    #[serde(with = "by_name")]
    pub pool: Pool,
    /// Density of the point cloud.
    pub points_per_m2: f64,
    /// Skip and count what is not as it should be in the annotations instead of stopping at it.
    pub lenient: bool,
    /// Give faces without a vote the label of the labelled surface next to them, if that is no farther than
    /// this, metres; see [`s3d_label::fill_labels`]. Nothing is filled where it is not there, as published.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fill: Option<f64>,
    /// The classes of a candidate view are counted on every which pixel of both axes, 1 to 64.
    pub entropy_stride: u32,
    /// Which images are written.
    #[serde(with = "by_names")]
    pub modalities: Vec<Domain>,
    /// Write every candidate view, whatever its entropy.
    pub keep_all: bool,
    /// Write the images of these scan locations only, by uuid; of all if empty. The selection stays that of
    /// all locations.
    pub only: Vec<String>,
    /// The faces' normals, or those interpolated from the mesh's own where it has some.
    #[serde(with = "normals")]
    pub normals: Normals,
    /// How many places of a pixel tell how much of each face its colour shows, where surfaces end or turn; 1
    /// to 64. 1 is its centre alone, as in every other modality, and leaves stair-steps. Colours of pictures
    /// stay.
    #[serde(skip_serializing_if = "is_one")]
    pub rgb_samples: u32,
    /// How much time the images' files may take. The pixels are the same.
    #[serde(with = "by_name")]
    pub compression: Compression,
    /// How world coordinates are stored.
    #[serde(with = "by_name")]
    pub xyz: XyzType,
    /// Axes of normals in views.
    #[serde(with = "normal_axes")]
    pub normal_axes: NormalAxes,
    /// Units of depth.
    #[serde(with = "by_name")]
    pub depth_units: DepthUnits,
    /// How many entries `semantic_labels.json` is filled up to.
    #[serde(with = "by_name")]
    pub pad_labels: PadLabels,
    /// What is written besides for loaders of point clouds.
    #[serde(with = "by_names")]
    pub profiles: Vec<Profile>,
    /// Conditions of usefulness that the data set need not meet. They decide none of its bytes, and are not
    /// stored.
    #[serde(skip)]
    pub allow: Vec<Condition>,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            place_cameras: None,
            see: None,
            views: 72,
            size: 1080,
            pano_width: 4096,
            pool: Pool::Dataset,
            points_per_m2: 10_000.0,
            lenient: false,
            fill: None,
            entropy_stride: 4,
            modalities: Domain::PUBLISHED.to_vec(),
            keep_all: false,
            only: Vec::new(),
            normals: Normals::Flat,
            rgb_samples: 1,
            compression: Compression::default(),
            xyz: XyzType::default(),
            normal_axes: NormalAxes::default(),
            depth_units: DepthUnits::default(),
            pad_labels: PadLabels::default(),
            profiles: Vec::new(),
            allow: Vec::new(),
        }
    }
}

fn is_one(samples: &u32) -> bool {
    *samples == 1
}

fn is_zero(seed: &u64) -> bool {
    *seed == 0
}

impl ExportOptions {
    /// How scan locations are to be placed, if they are.
    pub(crate) fn placing(&self) -> Option<Placing> {
        self.place_cameras.map(Placing::Apart).or(self.see.map(Placing::Seeing))
    }

    /// What `conventions.json` tells of them.
    pub fn conventions(&self) -> Conventions {
        Conventions { depth_units: self.depth_units, normal_axes: self.normal_axes, xyz: self.xyz }
    }

    /// The same options in their one form, however they were written: modalities once each and in their own
    /// order, without world coordinates where none are stored; uuids in lower case without hyphens, sorted;
    /// profiles likewise.
    ///
    /// # Errors
    /// [`Error::Usage`] if a number is out of its range or a uuid is none.
    pub fn canonical(&self) -> Result<Self> {
        let mut options = self.clone();
        options.check_ranges()?;
        let left_out = |d: &Domain| self.xyz == XyzType::None && *d == Domain::GlobalXyz;
        let asked = |d: &Domain| self.modalities.contains(d) && !left_out(d);
        options.modalities = Domain::ALL.into_iter().filter(asked).collect();
        options.profiles.sort();
        options.profiles.dedup();
        options.only = self
            .only
            .iter()
            .map(|text| canonical_uuid(text))
            .collect::<Result<_>>()?;
        options.only.sort();
        options.only.dedup();
        Ok(options)
    }

    /// Whether something is asked for that is made of labels.
    pub(crate) fn need_labels(&self) -> bool {
        self.modalities.iter().any(|d| d.is_semantic())
            || !self.profiles.is_empty()
            || self.fill.is_some()
            || self.pad_labels.0 > 0
    }

    /// The same for scenes without labels: what is made of them is left out.
    ///
    /// # Errors
    /// [`Error::Usage`] if nothing else is asked for, and for what only makes sense with labels.
    pub(crate) fn without_labels(&self) -> Result<Self> {
        if let Some(profile) = self.profiles.first() {
            return Err(Error::Usage(format!("--profile {profile} needs labels, and the scene has none")));
        }
        if self.fill.is_some() {
            return Err(Error::Usage("--fill needs labels, and the scene has none".to_owned()));
        }
        let mut options = Self { pad_labels: PadLabels(0), lenient: false, ..self.clone() };
        options.modalities.retain(|d| !d.is_semantic());
        if options.modalities.is_empty() && !self.modalities.is_empty() {
            return Err(Error::Usage(
                "--modalities: only images of labels, and the scene has none".to_owned(),
            ));
        }
        Ok(options)
    }

    fn check_ranges(&self) -> Result<()> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let fits = [
            ("views", self.views <= 100_000, "at most 100000"),
            ("size", (8..=16_384).contains(&self.size), "from 8 to 16384"),
            (
                "pano_width",
                (8..=32_768).contains(&self.pano_width) && self.pano_width.is_multiple_of(2),
                "an even number from 8 to 32768",
            ),
            ("points_per_m2", positive(self.points_per_m2), "above 0"),
            ("place_cameras", self.place_cameras.is_none_or(positive), "above 0"),
            ("see", self.see.is_none_or(|share| positive(share) && share <= 1.0), "above 0, and at most 1"),
            ("see", self.see.is_none() || self.place_cameras.is_none(), "left out beside place_cameras"),
            ("fill", self.fill.is_none_or(positive), "above 0"),
            ("entropy_stride", (1..=64).contains(&self.entropy_stride), "from 1 to 64"),
            ("rgb_samples", (1..=64).contains(&self.rgb_samples), "from 1 to 64"),
            ("pad_labels", self.pad_labels.0 <= 65_536, "at most 65536"),
        ];
        match fits.iter().find(|(_, fits, _)| !fits) {
            Some((name, _, range)) => Err(Error::Usage(format!("{name}: must be {range}"))),
            None => Ok(()),
        }
    }
}

/// A uuid as the data set writes it, however it was written: 32 hexadecimal digits in lower case.
///
/// # Errors
/// [`Error::Usage`] if it is none.
pub fn canonical_uuid(text: &str) -> Result<String> {
    let uuid = text.trim().replace('-', "").to_ascii_lowercase();
    if uuid.len() == 32 && uuid.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Ok(uuid);
    }
    Err(Error::Usage(format!("{text:?} is no uuid of 32 hexadecimal digits")))
}

/// How many entries the label table is filled up to with null labels; 0 for none. Loaders of the published
/// data look missing pixels up at index 3341.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PadLabels(pub usize);

impl Default for PadLabels {
    fn default() -> Self {
        Self(PADDED_LABELS)
    }
}

impl fmt::Display for PadLabels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == 0 {
            f.write_str("off")
        } else {
            write!(f, "{}", self.0)
        }
    }
}

impl FromStr for PadLabels {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        if word == "off" {
            return Ok(Self(0));
        }
        match word.parse() {
            Ok(n @ 1..=65_536) => Ok(Self(n)),
            _ => Err("must be off, or a number of entries from 1 to 65536".to_owned()),
        }
    }
}

/// Values that are stored as the words of the command line.
pub(crate) mod by_name {
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::fmt::Display;
    use std::str::FromStr;

    pub(crate) fn serialize<T: Display, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(value)
    }

    pub(crate) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// Lists of them.
mod by_names {
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::fmt::Display;
    use std::str::FromStr;

    pub(super) fn serialize<T: Display, S: Serializer>(
        values: &[T],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(T::to_string))
    }

    pub(super) fn deserialize<'de, T: FromStr<Err: Display>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<T>, D::Error> {
        let words = Vec::<String>::deserialize(deserializer)?;
        words
            .iter()
            .map(|word| word.parse().map_err(D::Error::custom))
            .collect()
    }
}

mod normals {
    use s3d_render::Normals;
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &Normals, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match value {
            Normals::Smooth => "smooth",
            Normals::Flat => "flat",
        })
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Normals, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "smooth" => Ok(Normals::Smooth),
            "flat" => Ok(Normals::Flat),
            word => Err(D::Error::custom(format!("{word:?} is neither flat nor smooth"))),
        }
    }
}

mod normal_axes {
    use s3d_geom::NormalAxes;
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(value: &NormalAxes, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(value.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NormalAxes, D::Error> {
        let word = String::deserialize(deserializer)?;
        NormalAxes::from_name(&word)
            .ok_or_else(|| D::Error::custom(format!("{word:?} is neither paper nor opencv")))
    }
}
