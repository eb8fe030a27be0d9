//! `conventions.json`: the meaning of a data set's numbers, for programs. Source: [`crate::formats`].

use crate::dataset::domain::Domain;
use crate::error::{Error, Result};
use crate::fs::atomic::write_bytes;
use s3d_geom::NormalAxes;
use s3d_label::NULL_NAME;
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use thiserror::Error as ThisError;

/// The unit of depth images. In both units 65,535 means a missing depth, and depths beyond 65,534 units are
/// missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthUnits {
    /// 512ths of a metre, as published: up to 128 m.
    #[default]
    Per512,
    /// Millimetres: up to 65.534 m.
    Millimetres,
}

impl DepthUnits {
    /// Returns the unit's name: `512` or `mm`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Per512 => "512",
            Self::Millimetres => "mm",
        }
    }

    /// Returns how many units make a metre.
    pub const fn per_m(self) -> f64 {
        match self {
            Self::Per512 => 512.0,
            Self::Millimetres => 1000.0,
        }
    }

    /// Returns a pixel's depth in metres; `None` if it is missing.
    pub fn metres(self, value: u16) -> Option<f64> {
        (value != u16::MAX).then(|| f64::from(value) / self.per_m())
    }
}

/// The type of stored world coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum XyzType {
    /// Half floats, as published: steps of 1.6 cm at 20 m from the origin.
    #[default]
    Half,
    /// 32-bit floats.
    Float,
    /// Coordinates are not stored: they follow from depth and pose.
    None,
}

impl XyzType {
    /// Returns the type's name: `half`, `float` or `none`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::None => "none",
        }
    }
}

/// The error for a word that names no option.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
#[error("{word:?} is none of {valid}")]
pub struct UnknownWord {
    /// The word.
    pub word: String,
    /// The words that are known.
    pub valid: &'static str,
}

impl fmt::Display for Conventions {
    /// Writes the choices in one line, for messages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { depth_units, normal_axes, xyz } = self;
        let axes = normal_axes.name();
        write!(f, "depth units {depth_units}, normal axes {axes}, coordinates {xyz}")
    }
}

impl FromStr for DepthUnits {
    type Err = UnknownWord;

    fn from_str(word: &str) -> std::result::Result<Self, UnknownWord> {
        let found = [Self::Per512, Self::Millimetres].into_iter().find(|u| u.name() == word);
        found.ok_or_else(|| UnknownWord { word: word.to_owned(), valid: "512 and mm" })
    }
}

impl FromStr for XyzType {
    type Err = UnknownWord;

    fn from_str(word: &str) -> std::result::Result<Self, UnknownWord> {
        let found = [Self::Half, Self::Float, Self::None]
            .into_iter()
            .find(|t| t.name() == word);
        found.ok_or_else(|| UnknownWord { word: word.to_owned(), valid: "half, float and none" })
    }
}

impl fmt::Display for DepthUnits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl fmt::Display for XyzType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The offset that was subtracted from the coordinates of each area's scan to make world coordinates, metres,
/// by the number of the area. Areas without an offset are not in it.
pub type WorldOffsets = BTreeMap<u32, [f64; 3]>;

/// The choices among the conventions that a data set can make. The default is the published data set's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conventions {
    /// The unit of depth images.
    pub depth_units: DepthUnits,
    /// The axes of normals.
    pub normal_axes: NormalAxes,
    /// The type of world coordinates.
    pub xyz: XyzType,
}

impl Conventions {
    /// Writes `conventions.json`: these choices, the offsets of areas, and everything that is the same in
    /// every data set. Returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, path: &Path, offsets: &WorldOffsets) -> Result<u64> {
        write_bytes(path, self.to_text(offsets).as_bytes())
    }

    /// Returns the content of `conventions.json`.
    pub fn to_text(&self, offsets: &WorldOffsets) -> String {
        let mut json = self.to_json();
        if let Some(world) = json
            .get_mut("world")
            .and_then(Value::as_object_mut)
            .filter(|_| !offsets.is_empty())
        {
            world.insert("offset_m".to_owned(), json!(offsets));
            world.insert("frame_of_scan".to_owned(), json!("world + offset_m of the area, in f64"));
        }
        format!("{json:#}\n")
    }

    fn to_json(self) -> Value {
        let towards = match self.normal_axes {
            NormalAxes::Paper => "towards the camera",
            NormalAxes::OpenCv => "forward, away from the camera",
        };

        json!({
            "conventions": 1,
            "world": { "unit": "m", "up": "+Z", "handedness": "right" },
            "files": {
                "pattern": "area_{area}/{kind}/{folder}/camera_{uuid}_{roomType}_{roomNum}_frame_{frame}_\
                    domain_{suffix}.{ext}",
                "kinds": { "data": "perspective views, frame counts from 0", "pano": "panoramas, frame is \
                    \"equirectangular\"" },
                "folder_suffix_ext": Domain::ALL.map(|d| [d.folder(), d.suffix(), d.extension()]),
            },
            "meshes": {
                "up": "+Y",
                "world_from_file": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
                "semantic_obj": "a face's label is the name of its material",
            },
            "pose": {
                "schema": "assets/schema/pose.schema.json",
                "angle_unit": "rad",
                "euler": "R = Rz @ Ry @ Rx of [x, y, z]",
                "rotations": "camera to world; the camera looks along -Z, +Y is up",
                "composition": "R(final_camera_rotation) = R(rotation_from_original_to_point) @ \
                                R(camera_original_rotation)",
                "camera_rt_matrix": "3x4, world to camera, OpenCV axes: x right, y down, z forward",
                "opencv_from_camera": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
                "camera_k_matrix": "fx = fy = (W / 2) / tan(field_of_view_rads / 2), cx = W / 2, cy = H / 2",
            },
            "pixels": { "center_of_first": [0.5, 0.5], "origin": "top left" },
            "panorama": {
                "longitude": "((column + 0.5) / W - 0.5) * 2 * pi, growing to the right",
                "latitude": "(0.5 - (row + 0.5) / H) * pi",
                "center": "the pose's forward axis projected to the horizon; up is +Z, whatever the pose's \
                           tilt",
                "direction": "[cos(lat) * cos(a - lon), cos(lat) * sin(a - lon), sin(lat)], a = \
                              atan2(forward.y, forward.x)",
            },
            "rgb": { "missing": [0, 0, 0] },
            "depth": {
                "units_per_m": self.depth_units.per_m(),
                "missing": u16::MAX,
                "largest": u16::MAX - 1,
                "perspective": "z along the optical axis",
                "panorama": "distance from the camera",
            },
            "normal": {
                "axes": self.normal_axes.name(),
                "decode": "(channel - 127.5) / 127.5",
                "perspective": ["right", "down", towards],
                "panorama": ["+X", "-Z", "+Y"],
                "missing": [128, 128, 128],
            },
            "semantic": {
                "decode": "R * 65536 + G * 256 + B",
                "table": "assets/semantic_labels.json",
                "label": "class_instanceNum_roomType_roomNum_areaNum",
                "null_label": NULL_NAME,
                "unlabelled": [0, 0, 0],
                "missing": [13, 13, 13],
            },
            "semantic_pretty": { "missing": [0, 0, 0] },
            "semantic_class": {
                "decode": "the place of the class in the taxonomy, from 0; the palette has its colours",
                "legend": "assets/class_legend.csv",
                "unlabelled": 255,
                "missing": 255,
            },
            "global_xyz": {
                "type": self.xyz.name(),
                "channels": { "R": "X", "G": "Y", "B": "Z" },
                "missing": [0, 0, 0],
            },
            "depth_euclidean": {
                "units_per_m": self.depth_units.per_m(),
                "missing": u16::MAX,
                "largest": u16::MAX - 1,
                "meaning": "distance from the camera",
            },
            "reshading": { "decode": "255 * min(1, 2.5 * cos * 8 / (8 + d * d)), at least 1", "missing": 0 },
            "principal_curvature": {
                "decode": "k = (channel - 127) / 127 / 0.03, in 1/m; R is the larger, G the smaller",
                "missing": [255, 255, 255],
            },
            "edge_occlusion": { "edge": 255, "missing": 0 },
            "edge_texture": { "decode": "value / (255 * 4), limited at 255", "missing": 0 },
            "keypoints2d": { "decode": "(value / 2048) ** 2, limited at 255", "missing": 0 },
            "keypoints3d": { "decode": "(value / 255) ** 2 / 27", "missing": 0 },
            "segment_unsup2d": { "decode": "the number of the segment, from 1", "missing": 0 },
            "segment_unsup25d": { "decode": "the number of the segment, from 1", "missing": 0 },
            "mask_valid": { "seen": 255, "missing": 0 },
            "edge_instance": { "border": 255, "missing": 0 },
            "boundary_distance": { "units_per_px": 64, "missing": u16::MAX, "largest": u16::MAX - 1 },
            "semantic_refined": {
                "decode": "R * 65536 + G * 256 + B",
                "table": "assets/semantic_labels.json",
                "unlabelled": [0, 0, 0],
                "missing": [13, 13, 13],
            },
            "semantic_moved": { "moved": 255, "as_projected": 0, "missing": 0 },
            "instances": {
                "file": "area_{area}/3d/instances.npz",
                "bbox": "xmin ymin zmin xmax ymax zmax, world metres",
                "voxels": "6x6x6, index [ix, iy, iz]",
            },
            "s3dis": {
                "line": "x y z r g b, world metres",
                "alignment": "degrees in [0, 90): the direction of the walls; turn the room by minus the \
                              angle about Z",
            },
        })
    }
}

/// Reads the conventions of a data set from its `conventions.json`. The published data set has no such file;
/// its conventions are [`Conventions::default`].
///
/// # Errors
/// [`Error::Io`], also if there is no such file; [`Error::Format`] if it is something else, or names an
/// unknown convention.
pub fn read_conventions(path: &Path) -> Result<Conventions> {
    #[derive(Deserialize)]
    struct File {
        depth: Depth,
        normal: Normal,
        global_xyz: Xyz,
    }
    #[derive(Deserialize)]
    struct Depth {
        units_per_m: f64,
    }
    #[derive(Deserialize)]
    struct Normal {
        axes: String,
    }
    #[derive(Deserialize)]
    struct Xyz {
        #[serde(rename = "type")]
        kind: String,
    }

    let file: File = crate::fs::json::read_json(path)?;
    let units = [DepthUnits::Per512, DepthUnits::Millimetres];
    let per_m = file.depth.units_per_m;
    let depth_units = units.into_iter().find(|u| u.per_m() == per_m).ok_or_else(|| {
        Error::format(path, format!("depth of {per_m} units a metre is not known: 512 and 1000 are"))
    })?;

    let normal_axes = NormalAxes::from_name(&file.normal.axes).ok_or_else(|| {
        Error::format(
            path,
            format!("normals in {:?} axes are not known: paper and opencv are", file.normal.axes),
        )
    })?;

    let xyz = file
        .global_xyz
        .kind
        .parse()
        .map_err(|e: UnknownWord| Error::format(path, e.to_string()))?;
    Ok(Conventions { depth_units, normal_axes, xyz })
}

/// Reads the offset that was subtracted from the coordinates of each area's scan, from the `conventions.json`
/// at `path`. There are none if there is no such file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file is something else.
pub fn read_world_offsets(path: &Path) -> Result<WorldOffsets> {
    #[derive(Deserialize)]
    struct File {
        #[serde(default)]
        world: World,
    }
    #[derive(Default, Deserialize)]
    struct World {
        #[serde(default)]
        offset_m: WorldOffsets,
    }

    if !path.try_exists().map_err(|e| Error::io(path, "look for", e))? {
        return Ok(WorldOffsets::new());
    }
    let file: File = crate::fs::json::read_json(path)?;
    Ok(file.world.offset_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("conventions.json");
        assert!(matches!(read_conventions(&path), Err(Error::Io { .. })), "no file says nothing");
        for depth_units in [DepthUnits::Per512, DepthUnits::Millimetres] {
            for normal_axes in [NormalAxes::Paper, NormalAxes::OpenCv] {
                for xyz in [XyzType::Half, XyzType::Float, XyzType::None] {
                    let conventions = Conventions { depth_units, normal_axes, xyz };
                    for offsets in
                        [WorldOffsets::new(), [(1, [5e5, 5.4e6, 300.0]), (12, [0.0, -100.0, 0.5])].into()]
                    {
                        conventions.write(&path, &offsets).unwrap();
                        assert_eq!(read_conventions(&path).unwrap(), conventions);
                        assert_eq!(read_world_offsets(&path).unwrap(), offsets);
                        let text = std::fs::read_to_string(&path).unwrap();
                        assert_eq!(text.contains("offset_m"), !offsets.is_empty());
                    }
                    assert_eq!(xyz.to_string().parse(), Ok(xyz));
                }
                assert_eq!(NormalAxes::from_name(normal_axes.name()), Some(normal_axes));
            }
            assert_eq!(depth_units.to_string().parse(), Ok(depth_units));
        }
        assert_eq!("inch".parse::<DepthUnits>().unwrap_err().to_string(), "\"inch\" is none of 512 and mm");
        assert!("double".parse::<XyzType>().is_err() && NormalAxes::from_name("OpenCV").is_none());
    }

    #[test]
    fn each_image_says_what_sees_nothing() {
        let conventions = Conventions::default().to_json();
        for domain in Domain::ALL.into_iter().filter(|domain| domain.pixels().is_some()) {
            let missing = &conventions[domain.folder()]["missing"];
            let is_said = *missing == json!(domain.missing()) || *missing == json!(domain.missing()[0]);
            assert!(is_said, "{domain}: {missing}");
        }
    }

    #[test]
    fn depth_in_metres() {
        assert_eq!(DepthUnits::Per512.metres(1024), Some(2.0));
        assert_eq!(DepthUnits::Millimetres.metres(1024), Some(1.024));
        assert_eq!(DepthUnits::Millimetres.metres(65_535), None);
    }

    fn conventions(per_m: &str, axes: &str, kind: &str) -> String {
        format!(
            r#"{{"depth":{{"units_per_m":{per_m}}},
            "normal":{{"axes":{axes}}},"global_xyz":{{"type":{kind}}}}}"#
        )
    }

    #[test]
    fn what_is_not_known_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("conventions.json");
        for (file, part) in [
            (conventions("4000", "\"paper\"", "\"half\""), "4000 units a metre"),
            (conventions("512", "\"left\"", "\"half\""), "\"left\" axes"),
            (conventions("512", "\"paper\"", "\"double\""), "\"double\" is none of half, float and none"),
            (conventions("512", "3", "\"half\""), "invalid type"),
            ("{}".into(), "missing field"),
            ("".into(), "EOF"),
        ] {
            write_bytes(&path, file.as_bytes()).unwrap();
            let e = read_conventions(&path).unwrap_err();
            assert!(matches!(e, Error::Format { .. }) && e.to_string().contains(part), "{e}");
        }
    }
}
