//! How a raw scan is fused, as plain data.

#[cfg(feature = "clap")]
use crate::options::words;
use s3d_io::mesh::UpAxis;
use s3d_io::scene::FuseSource;
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;
use std::path::PathBuf;

/// How a raw scan is fused. With the feature `clap` it is a group of arguments of a command line.
///
/// ```
/// use s3d_dataset::fuse::FuseOptions;
///
/// let options = FuseOptions { cell_m: 0.02, ..FuseOptions::default() };
/// assert_eq!(options.max_error_m, 0.003);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct FuseOptions {
    /// The edge of a cell of the grid, metres. Things thinner than two cells may be lost.
    #[cfg_attr(feature = "clap", arg(long = "cell", value_name = "METRES", default_value_t = 0.01,
        value_parser = words::positive))]
    pub cell_m: f64,
    /// How far the simplified surface may lie from the fused one, metres; 0 keeps all faces.
    #[cfg_attr(feature = "clap", arg(long = "max-error", value_name = "METRES", default_value_t = 0.003,
        value_parser = words::not_negative))]
    pub max_error_m: f64,
    /// Stop simplifying at this number of faces [default: as few as the error allows]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub faces: Option<u32>,
    /// Leave out measurements that are farther than this, metres [default: 5 for depth pictures, 60 for laser
    /// scans]
    #[cfg_attr(feature = "clap", arg(long = "range", value_name = "METRES", value_parser = words::positive))]
    pub range_m: Option<f64>,
    /// Close holes in floors and walls that are at most this wide, along their plane; in a PLY their faces
    /// have 1 in the column `closed`.
    #[cfg_attr(feature = "clap", arg(long = "close", value_name = "METRES", value_parser = words::positive))]
    pub close_m: Option<f64>,
    /// Move laser scans onto each other before they are fused, and say how far each moved.
    #[cfg_attr(feature = "clap", arg(long))]
    pub refine_poses: bool,
    /// Take each Nth depth picture.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value = "1"))]
    pub every: NonZeroU32,
    /// The axis of the scan's world that points up [default: z, or what its form defines]
    #[cfg_attr(feature = "clap", arg(long, value_name = "y|z", value_parser = words::parsed::<UpAxis>))]
    #[serde(skip_serializing_if = "Option::is_none", with = "axis")]
    pub up: Option<UpAxis>,
    /// How many metres a step of the numbers in depth pictures is, such as 0.001 [default: as the program
    /// that wrote them has it]
    #[cfg_attr(feature = "clap", arg(long = "depth-unit", value_name = "METRES",
        value_parser = words::positive))]
    pub depth_unit_m: Option<f64>,
    /// Focal lengths and principal point of the depth camera in pixels, for pictures whose files do not tell
    /// them: fx,fy,cx,cy
    #[cfg_attr(
        feature = "clap",
        arg(long, value_name = "FX,FY,CX,CY", value_delimiter = ',', allow_negative_numbers = true)
    )]
    pub intrinsics: Vec<f64>,
    /// Where the scanner stood, for points whose file does not tell it: x,y,z in metres
    #[cfg_attr(
        feature = "clap",
        arg(long = "origin", value_name = "X,Y,Z", value_delimiter = ',', allow_negative_numbers = true)
    )]
    pub origin_m: Vec<f64>,
    /// The path of a mobile scanner, for points with times: lines of t x y z, or a CSV that names them
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub trajectory: Option<PathBuf>,
    /// The memory that the grid may take, GiB. A larger scan is fused in tiles, to the same mesh.
    #[cfg_attr(feature = "clap", arg(long = "memory", value_name = "GIB", default_value_t = 4.0,
        value_parser = words::positive))]
    pub memory_gib: f64,
}

impl Default for FuseOptions {
    fn default() -> Self {
        Self {
            cell_m: 0.01,
            max_error_m: 0.003,
            faces: None,
            range_m: None,
            close_m: None,
            refine_poses: false,
            every: NonZeroU32::MIN,
            up: None,
            depth_unit_m: None,
            intrinsics: Vec::new(),
            origin_m: Vec::new(),
            trajectory: None,
            memory_gib: 4.0,
        }
    }
}

impl FuseOptions {
    /// The options that a scene file says, and the defaults for the rest.
    pub(super) fn of_scene(source: &FuseSource) -> Self {
        let usual = Self::default();
        Self {
            cell_m: source.cell_m.unwrap_or(usual.cell_m),
            max_error_m: source.max_error_m.unwrap_or(usual.max_error_m),
            range_m: source.range_m,
            close_m: source.close_m,
            up: source.up,
            ..usual
        }
    }
}

/// An axis by its name.
mod axis {
    use s3d_io::mesh::UpAxis;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(axis: &Option<UpAxis>, to: S) -> Result<S::Ok, S::Error> {
        match axis {
            Some(axis) => to.serialize_str(axis.name()),
            None => to.serialize_none(),
        }
    }

    pub(super) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Option<UpAxis>, D::Error> {
        let name = Option::<String>::deserialize(from)?;
        name.map(|name| name.parse().map_err(D::Error::custom)).transpose()
    }
}
