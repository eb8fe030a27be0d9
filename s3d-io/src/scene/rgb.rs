//! The `rgb` of a `scene.toml`: what the colours of images are taken from.

use serde::de;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::path::PathBuf;

/// Pictures of the scanner as the source of colours.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureSource {
    /// What the pictures are.
    pub kind: PictureKind,
    /// The folder that they lie in.
    pub path: PathBuf,
    /// How they are put together.
    pub options: PictureOptions,
}

/// What the scanner's pictures are. Source: formats.md, "The scanner's pictures".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureKind {
    /// Six square pictures a location.
    SkyBox,
    /// Raw captures of real cameras, up to 18 a location.
    Captures,
    /// An equirectangular photograph a location.
    Panorama,
}

impl PictureKind {
    /// Its name in a scene file, and the folder that is meant where none is named.
    pub fn name(self) -> &'static str {
        match self {
            Self::SkyBox => "skybox",
            Self::Captures => "captures",
            Self::Panorama => "panorama",
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
    /// Width of a face of the cube map in pixels; what the pictures' own size asks for, if it is not said.
    pub size: Option<u32>,
    /// What a place shows that no picture shows.
    pub unseen: UnseenColor,
    /// Captures: whether the mesh is used to take the parallax between the cameras out.
    pub parallax: bool,
    /// Captures: whether their exposures are brought together.
    pub gains: bool,
    /// Panorama: how far its centre column looks to the left of the location's original camera, degrees.
    pub yaw_deg: f64,
    /// Sky box: with which side the upper and the lower picture meet.
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

/// What a place shows that no picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnseenColor {
    /// The mesh's own colour.
    Mesh,
    /// What is seen around it.
    Nearby,
}

/// With which side the lower edge of a sky box's upper picture meets, and the upper edge of its lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SkyBoxCaps {
    /// What the edges say.
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

/// What is written: the source's name alone, or a table.
#[derive(Debug)]
pub(crate) struct RgbEntry(RgbTable);

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RgbTable {
    source: Source,
    path: Option<PathBuf>,
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
}

impl<'de> Deserialize<'de> for RgbEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = RgbEntry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "\"texture\", \"skybox\", \"captures\", \"panorama\", or a table with `source` \
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
    /// The pictures, their folder as it is written; `None` for the mesh's texture. `Err` is a sentence.
    pub(crate) fn pictures(self) -> Result<Option<PictureSource>, String> {
        let RgbTable { source, path, size, unseen, parallax, gains, yaw_deg, caps } = self.0;
        let of = |is_there: bool, key: &str, kind: Source, whose: &str| {
            if is_there && source != kind {
                return Err(format!("rgb.{key} belongs to source = \"{whose}\""));
            }
            Ok(())
        };
        of(parallax.is_some(), "parallax", Source::Captures, "captures")?;
        of(gains.is_some(), "gains", Source::Captures, "captures")?;
        of(yaw_deg.is_some(), "yaw_deg", Source::Panorama, "panorama")?;
        of(caps.is_some(), "caps", Source::SkyBox, "skybox")?;
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
        Ok(Some(PictureSource { kind, path: path.unwrap_or_else(|| kind.name().into()), options }))
    }
}
