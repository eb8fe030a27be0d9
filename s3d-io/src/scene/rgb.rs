//! The entry `rgb` of a `scene.toml`: the source of the colours of images.

use s3d_geom::glam::DAffine3;
use serde::de;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::path::PathBuf;

/// Pictures of the scanner as the source of colours.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureSource {
    /// The kind of the pictures.
    pub kind: PictureKind,
    /// The folder of the pictures. [`PictureKind::E57`]: the file.
    pub path: PathBuf,
    /// [`PictureKind::E57`]: the transform from the frame of the file to the world, a rotation, a shift and a
    /// scale. It is the transform of `[cameras]` if the scan locations are of the same file.
    pub world_from_file: DAffine3,
    /// [`PictureKind::E57`]: a table of motions, `uuid,x,y,z,qx,qy,qz,qw` a line: the pictures of the
    /// location with this uuid are turned by the quaternion and then shifted, as a scan whose pose was
    /// refined is.
    pub motions: Option<PathBuf>,
    /// How the pictures become colours.
    pub options: PictureOptions,
}

/// The kind of the scanner's pictures. Source: [`crate::formats`], "The scanner's pictures".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureKind {
    /// Six square pictures for each location.
    SkyBox,
    /// Raw captures of real cameras, up to 18 for each location.
    Captures,
    /// One equirectangular photograph for each location.
    Panorama,
    /// The images of an E57 file, each with its pose.
    E57,
}

impl PictureKind {
    /// Returns the name in a scene file. It is also the default name of the folder, if the pictures are in
    /// one.
    pub fn name(self) -> &'static str {
        match self {
            Self::SkyBox => "skybox",
            Self::Captures => "captures",
            Self::Panorama => "panorama",
            Self::E57 => "e57",
        }
    }
}

impl fmt::Display for PictureKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How pictures become the colours of images.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOptions {
    /// The width of a face of the cube map in pixels. `None`: the width that suits the pictures.
    pub size: Option<u32>,
    /// The colour of places that no picture shows.
    pub unseen: UnseenColor,
    /// Captures and E57: whether the mesh is used to remove the parallax between the cameras.
    pub parallax: bool,
    /// Captures and E57: whether the exposures are matched to each other.
    pub gains: bool,
    /// Panorama: the angle from the heading of the location's original camera to the centre column, to the
    /// left, degrees.
    pub yaw_deg: f64,
    /// Sky box: the side that the upper and the lower picture meet.
    pub caps: SkyBoxCaps,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            size: None,
            unseen: UnseenColor::Mesh,
            parallax: true,
            gains: true,
            yaw_deg: 0.0,
            caps: SkyBoxCaps::Detect,
        }
    }
}

/// The colour of places that no picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnseenColor {
    /// The mesh's own colour.
    Mesh,
    /// The colours that are seen around the place.
    Nearby,
}

/// The side of a sky box that the lower edge of its upper picture meets, and the upper edge of its lower
/// picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkyBoxCaps {
    /// The side is found from the edges.
    Detect,
    /// Picture 4.
    Front,
    /// Picture 1.
    Right,
    /// Picture 2.
    Back,
    /// Picture 3.
    Left,
}

/// The entry as it is written: the name of the source alone, or a table.
#[derive(Debug)]
pub(crate) struct RgbEntry(RgbTable);

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RgbTable {
    source: Source,
    path: Option<PathBuf>,
    motions: Option<PathBuf>,
    size: Option<u32>,
    unseen: Option<UnseenColor>,
    parallax: Option<bool>,
    gains: Option<bool>,
    yaw_deg: Option<f64>,
    caps: Option<SkyBoxCaps>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Source {
    #[default]
    Texture,
    SkyBox,
    Captures,
    Panorama,
    E57,
}

impl Source {
    fn name(self) -> &'static str {
        match self {
            Self::Texture => "texture",
            Self::SkyBox => "skybox",
            Self::Captures => "captures",
            Self::Panorama => "panorama",
            Self::E57 => "e57",
        }
    }
}

impl<'de> Deserialize<'de> for RgbEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = RgbEntry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "\"texture\", \"skybox\", \"captures\", \"panorama\", \"e57\", or a table with `source` \
                     and `path`",
                )
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<RgbEntry, E> {
                let source = Source::deserialize(StrDeserializer::new(word))?;
                Ok(RgbEntry(RgbTable { source, ..RgbTable::default() }))
            }
            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<RgbEntry, A::Error> {
                RgbTable::deserialize(MapAccessDeserializer::new(map)).map(RgbEntry)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl RgbEntry {
    /// Tells whether the pictures are of an E57 file that the entry does not name.
    pub(crate) fn lacks_file(&self) -> bool {
        self.0.source == Source::E57 && self.0.path.is_none()
    }

    /// Returns the source of pictures, with the path as it is written; `None` for the mesh's texture. The
    /// error is a sentence.
    pub(crate) fn pictures(self) -> Result<Option<PictureSource>, String> {
        let RgbTable { source, path, motions, size, unseen, parallax, gains, yaw_deg, caps } = self.0;
        check_key(motions.is_some(), "motions", source, &[Source::E57])?;
        check_key(parallax.is_some(), "parallax", source, &[Source::Captures, Source::E57])?;
        check_key(gains.is_some(), "gains", source, &[Source::Captures, Source::E57])?;
        check_key(yaw_deg.is_some(), "yaw_deg", source, &[Source::Panorama])?;
        check_key(caps.is_some(), "caps", source, &[Source::SkyBox])?;
        if size.is_some_and(|size| !(32..=8192).contains(&size)) {
            return Err(format!(
                "rgb.size = {}: a face of the cube map has 32 to 8192 pixels",
                size.unwrap_or(0)
            ));
        }
        if yaw_deg.is_some_and(|yaw| !(-360.0..=360.0).contains(&yaw)) {
            return Err(format!("rgb.yaw_deg = {} is no angle from −360 to 360", yaw_deg.unwrap_or(0.0)));
        }

        let kind = match source {
            Source::Texture if path.is_some() || size.is_some() || unseen.is_some() => {
                return Err("rgb.source = \"texture\" has no path and no other key: it is the mesh's".into());
            }
            Source::Texture => return Ok(None),
            Source::SkyBox => PictureKind::SkyBox,
            Source::Captures => PictureKind::Captures,
            Source::Panorama => PictureKind::Panorama,
            Source::E57 => PictureKind::E57,
        };

        let default = PictureOptions::default();
        let options = PictureOptions {
            size,
            unseen: unseen.unwrap_or(default.unseen),
            parallax: parallax.unwrap_or(default.parallax),
            gains: gains.unwrap_or(default.gains),
            yaw_deg: yaw_deg.unwrap_or(default.yaw_deg),
            caps: caps.unwrap_or(default.caps),
        };

        let path = path.unwrap_or_else(|| kind.name().into());
        Ok(Some(PictureSource { kind, path, world_from_file: DAffine3::IDENTITY, motions, options }))
    }
}

/// Returns an error, a sentence, if the table has a key that belongs to other sources.
fn check_key(is_there: bool, key: &str, source: Source, owners: &[Source]) -> Result<(), String> {
    if !is_there || owners.contains(&source) {
        return Ok(());
    }
    let names: Vec<String> = owners.iter().map(|owner| format!("\"{}\"", owner.name())).collect();
    Err(format!("rgb.{key} belongs to source = {}", names.join(" or ")))
}
