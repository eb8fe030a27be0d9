//! What an export is asked for, as plain data.

pub(crate) mod placing;
pub(crate) mod profile;
#[cfg(feature = "clap")]
pub mod words;

pub use crate::condition::Condition;
pub use profile::Profile;

use crate::error::{Result, UsageError};
use placing::Placing;
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
/// This is the one place that says an option. With the feature `clap` it is a group of arguments of a command
/// line: comments of fields are help texts. The names of fields are the names in JSON and in Python.
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
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct ExportOptions {
    /// The source of everything random. The same input and seed give the same bytes.
    #[serde(skip_serializing_if = "is_zero")]
    #[cfg_attr(feature = "clap", arg(display_order = 10, long, default_value_t = 0))]
    pub seed: u64,
    /// Place scan locations on the floor of every room instead of reading them: at least this far apart
    /// within a room, 1.5 m high, clear of walls and objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "clap", arg(display_order = 11, long, value_name = "METRES",
        value_parser = words::positive))]
    pub place_cameras: Option<f64>,
    /// Place as few scan locations as see this share of the visible surface, instead of reading them
    /// [default if there are none to read: 0.95]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "clap", arg(display_order = 12, long, value_name = "SHARE",
        value_parser = words::positive, conflicts_with = "place_cameras"))]
    pub see: Option<f64>,
    /// The number of candidate views at each scan location. The paper has 3 × 24.
    #[cfg_attr(feature = "clap", arg(display_order = 7, long, value_name = "N", default_value_t = 72,
        value_parser = clap::value_parser!(u32).range(0..=100_000)))]
    pub views: u32,
    /// Width and height of a view in pixels.
    #[cfg_attr(feature = "clap", arg(display_order = 8, long, value_name = "PX", default_value_t = 1080,
        value_parser = clap::value_parser!(u32).range(8..=16_384)))]
    pub size: u32,
    /// Width of a panorama in pixels, an even number. Its height is half of that.
    #[cfg_attr(feature = "clap", arg(display_order = 9, long, value_name = "PX", default_value_t = 4096,
        value_parser = words::even_width))]
    pub pano_width: u32,
    /// Select views among the candidates of the whole data set, of each area, or of each scan location.
    #[serde(with = "by_name")]
    #[cfg_attr(feature = "clap", arg(display_order = 13, long, value_name = "dataset|area|location",
        default_value = "dataset", value_parser = words::parsed::<Pool>))]
    pub pool: Pool,
    /// Points per m² of the point cloud.
    #[cfg_attr(feature = "clap", arg(display_order = 14, long, value_name = "N", default_value_t = 10_000.0,
        value_parser = words::positive))]
    pub points_per_m2: f64,
    /// Skip and count faults in the annotations (odd names, lines that are no points, unknown classes)
    /// instead of stopping at them.
    #[cfg_attr(feature = "clap", arg(display_order = 21, long))]
    pub lenient: bool,
    /// Give each face without a vote of an annotated point the label of the surface next to it, along the
    /// surface and not around sharp edges, if that surface is no farther than this [default: fill none, as in
    /// the published data]
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "clap", arg(display_order = 22, long, value_name = "METRES",
        value_parser = words::positive))]
    pub fill: Option<f64>,
    /// Leave annotated points out that are farther than this from every face of the mesh [default: leave
    /// none out; 1 without a number]. They enlarge the boxes of their instances and rooms; they are warned of
    /// in any case.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "clap", arg(display_order = 22, long, value_name = "METRES", num_args = 0..=1,
        require_equals = true, default_missing_value = "1", value_parser = words::positive))]
    pub trim_strays: Option<f64>,
    /// Count the classes of a candidate view on every Nth pixel of both axes; 1 counts all. With 4, the
    /// entropies of two scenes were off by at most 0.003 nats, 0.0006 on average, and the same views were
    /// kept.
    #[cfg_attr(feature = "clap", arg(display_order = 15, long, value_name = "N", default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=64)))]
    pub entropy_stride: u32,
    /// The images to write, such as rgb,depth,pose. There is also semantic_class, a PNG whose palette has a
    /// colour for each class, and objects, a JSON with amodal masks, occlusion and boxes. Trainers of many
    /// tasks find depth_euclidean, reshading, principal_curvature, edge_occlusion, edge_texture, keypoints2d,
    /// keypoints3d, segment_unsup2d, segment_unsup25d, mask_valid, edge_instance and boundary_distance.
    /// semantic_refined is semantic with borders at the edges of the picture; semantic_moved is where they
    /// differ
    /// [default: rgb, depth, normal, semantic, semantic_pretty, global_xyz, pose]
    #[serde(with = "by_names")]
    #[cfg_attr(feature = "clap", arg(display_order = 16, long, value_name = "LIST", value_delimiter = ',',
        default_values_t = Domain::PUBLISHED, hide_default_value = true,
        value_parser = words::parsed::<Domain>))]
    pub modalities: Vec<Domain>,
    /// Write every candidate view, whatever its entropy.
    #[cfg_attr(feature = "clap", arg(display_order = 17, long))]
    pub keep_all: bool,
    /// Write the images of these scan locations only. Views are still selected among all locations.
    #[cfg_attr(feature = "clap", arg(display_order = 18, long, value_name = "UUID", num_args = 1..,
        value_delimiter = ',', value_parser = words::uuid))]
    pub only: Vec<String>,
    /// Interpolate normals from the mesh's own where it has some, instead of taking the normals of faces.
    #[serde(with = "normals")]
    #[cfg_attr(feature = "clap", arg(display_order = 19, long = "smooth-normals",
        action = clap::ArgAction::SetTrue, value_parser = words::smooth_normals()))]
    pub normals: Normals,
    /// Take N samples of a pixel's colour where surfaces end or turn, so that edges have no stair-steps. All
    /// other images keep one sample.
    #[serde(skip_serializing_if = "is_one")]
    #[cfg_attr(feature = "clap", arg(display_order = 20, long, value_name = "N", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=64)))]
    pub rgb_samples: u32,
    /// Write 3d/semantic.glb for each area: the mesh with its textures, and the labels of its faces as
    /// features (EXT_mesh_features, EXT_structural_metadata), which viewers such as CesiumJS pick and colour.
    #[serde(skip_serializing_if = "is_false")]
    #[cfg_attr(feature = "clap", arg(display_order = 24, long))]
    pub semantic_glb: bool,
    /// Compression of the image files: fast, balanced (about as small as files by libpng and OpenEXR) or
    /// small (slowest). The pixels are the same.
    #[serde(with = "by_name")]
    #[cfg_attr(feature = "clap", arg(display_order = 23, long, value_name = "fast|balanced|small",
        default_value_t, value_parser = words::parsed::<Compression>))]
    pub compression: Compression,
    /// Write world coordinates as half floats (steps of 1.6 cm at 20 m from the origin), as 32-bit floats, or
    /// not at all, whatever the modalities are. `s3d xyz` can make them later, from depth and pose.
    #[serde(with = "by_name")]
    #[cfg_attr(feature = "clap", arg(display_order = 25, long, value_name = "half|float|none",
        default_value_t, value_parser = words::parsed::<XyzType>))]
    pub xyz: XyzType,
    /// Axes of normals in views: the paper's (B towards the camera) or OpenCV's (B forward, as in omnidata).
    /// Panoramas always have X, −Z, Y of the world.
    #[serde(with = "normal_axes")]
    #[cfg_attr(feature = "clap", arg(display_order = 26, long, value_name = "paper|opencv",
        default_value = "paper", value_parser = words::normal_axes))]
    pub normal_axes: NormalAxes,
    /// Write depth in 512ths of a metre (up to 128 m) or in millimetres (up to 65.534 m). Loaders of the
    /// published data divide by 512.
    #[serde(with = "by_name")]
    #[cfg_attr(feature = "clap", arg(display_order = 27, long, value_name = "512|mm", default_value_t,
        value_parser = words::parsed::<DepthUnits>))]
    pub depth_units: DepthUnits,
    /// Fill semantic_labels.json with null labels up to N entries. Loaders look up missing pixels at index
    /// 3341.
    #[serde(with = "by_name")]
    #[cfg_attr(feature = "clap", arg(display_order = 28, long, value_name = "N|off", default_value_t,
        value_parser = words::parsed::<PadLabels>))]
    pub pad_labels: PadLabels,
    /// Write the files that a point cloud loader reads to OUT/profiles/NAME as well; may be repeated.
    #[serde(with = "by_names")]
    #[cfg_attr(feature = "clap", arg(display_order = 29, long = "profile", value_delimiter = ',',
        value_parser = words::parsed::<Profile>, value_name = "pointcept|open3d-ml|mmdet3d|pointnet"))]
    pub profiles: Vec<Profile>,
    /// Go on although the data set would be of no use. The error that stops an export names its condition.
    /// Conditions decide no byte, and are not stored.
    #[serde(skip)]
    #[cfg_attr(feature = "clap", arg(display_order = 24, long, value_delimiter = ',',
        value_parser = words::parsed::<Condition>,
        value_name = "colour|coverage|frame|inside-out|labels|locations|scale|size|up"))]
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
            trim_strays: None,
            entropy_stride: 4,
            modalities: Domain::PUBLISHED.to_vec(),
            keep_all: false,
            only: Vec::new(),
            normals: Normals::Flat,
            rgb_samples: 1,
            semantic_glb: false,
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

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

fn is_one(samples: &u32) -> bool {
    *samples == 1
}

fn is_false(wanted: &bool) -> bool {
    !wanted
}

fn is_zero(seed: &u64) -> bool {
    *seed == 0
}

impl ExportOptions {
    /// Returns the names of the options that a data set stores: the fields of this struct but `allow`, in
    /// their order.
    ///
    /// ```
    /// let names = s3d_dataset::ExportOptions::names();
    /// assert!(names.starts_with(&["seed", "place_cameras"]) && !names.contains(&"allow"));
    /// ```
    pub fn names() -> &'static [&'static str] {
        field_names::of::<Self>()
    }

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
    /// [`Error::Usage`](crate::Error::Usage) if a number is out of its range or a uuid is none.
    pub fn canonical(&self) -> Result<Self> {
        let mut options = self.clone();
        options.check_ranges()?;
        options.modalities = Domain::ALL.to_vec();
        options.modalities.retain(|domain| {
            let is_left_out = self.xyz == XyzType::None && *domain == Domain::GlobalXyz;
            self.modalities.contains(domain) && !is_left_out
        });
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
            || self.trim_strays.is_some()
            || self.pad_labels.0 > 0
    }

    /// Returns the same options for scenes without labels, without anything made of labels.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::Error::Usage) if nothing else is asked for, or an option only makes sense with
    /// labels.
    pub(crate) fn without_labels(&self) -> Result<Self> {
        if let Some(profile) = self.profiles.first() {
            let value = Some(profile.name().to_owned());
            return Err(UsageError::NeedsLabels { option: "profiles", value }.into());
        }
        if self.fill.is_some() {
            return Err(UsageError::NeedsLabels { option: "fill", value: None }.into());
        }
        if self.trim_strays.is_some() {
            return Err(UsageError::NeedsLabels { option: "trim_strays", value: None }.into());
        }
        let mut options = Self { pad_labels: PadLabels(0), lenient: false, ..self.clone() };
        options.modalities.retain(|d| !d.is_semantic());
        if options.modalities.is_empty() && !self.modalities.is_empty() {
            return Err(UsageError::NothingWithoutLabels.into());
        }
        Ok(options)
    }

    fn check_ranges(&self) -> Result<()> {
        let fits = [
            ("views", self.views <= 100_000, "at most 100000"),
            ("size", (8..=16_384).contains(&self.size), "from 8 to 16384"),
            (
                "pano_width",
                (8..=32_768).contains(&self.pano_width) && self.pano_width.is_multiple_of(2),
                "an even number from 8 to 32768",
            ),
            ("points_per_m2", is_positive(self.points_per_m2), "above 0"),
            ("place_cameras", self.place_cameras.is_none_or(is_positive), "above 0"),
            (
                "see",
                self.see.is_none_or(|share| is_positive(share) && share <= 1.0),
                "above 0, and at most 1",
            ),
            ("see", self.see.is_none() || self.place_cameras.is_none(), "left out beside place_cameras"),
            ("fill", self.fill.is_none_or(is_positive), "above 0"),
            ("trim_strays", self.trim_strays.is_none_or(is_positive), "above 0"),
            ("entropy_stride", (1..=64).contains(&self.entropy_stride), "from 1 to 64"),
            ("rgb_samples", (1..=64).contains(&self.rgb_samples), "from 1 to 64"),
            ("pad_labels", self.pad_labels.0 <= 65_536, "at most 65536"),
        ];
        match fits.iter().find(|(_, fits, _)| !fits) {
            Some((option, _, range)) => {
                Err(UsageError::OutOfRange { option, range: (*range).to_owned() }.into())
            }
            None => Ok(()),
        }
    }
}

/// A uuid as the data set writes it, however it was written: 32 hexadecimal digits in lower case.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if it is none.
pub fn canonical_uuid(text: &str) -> Result<String> {
    let uuid = text.trim().replace('-', "").to_ascii_lowercase();
    if uuid.len() == 32 && uuid.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Ok(uuid);
    }
    Err(UsageError::InvalidUuid { text: text.to_owned() }.into())
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

/// The names of a struct's fields, as its derived `Deserialize` knows them.
mod field_names {
    use serde::de::value::Error;
    use serde::de::{Deserialize, Deserializer, Error as _, Visitor};
    use serde::forward_to_deserialize_any;

    /// Takes the names that a struct asks for, and gives it nothing.
    struct Asked<'a>(&'a mut &'static [&'static str]);

    pub(super) fn of<T: for<'de> Deserialize<'de>>() -> &'static [&'static str] {
        let mut names: &'static [&'static str] = &[];
        let _: Result<T, Error> = T::deserialize(Asked(&mut names));
        names
    }

    impl<'de> Deserializer<'de> for Asked<'_> {
        type Error = Error;

        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _name: &'static str,
            fields: &'static [&'static str],
            _visitor: V,
        ) -> Result<V::Value, Error> {
            *self.0 = fields;
            Err(Error::custom("only the names are wanted"))
        }

        fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Error> {
            Err(Error::custom("is no struct"))
        }

        forward_to_deserialize_any! {
            bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct
            newtype_struct seq tuple tuple_struct map enum identifier ignored_any
        }
    }
}
