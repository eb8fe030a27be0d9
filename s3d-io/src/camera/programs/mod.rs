//! Lists of cameras as single programs and data sets write them, a file each.

pub(crate) mod arkit;
pub(crate) mod colmap;
#[cfg(feature = "e57")]
pub(crate) mod e57;
pub(crate) mod house;
pub(crate) mod matrices;
pub(crate) mod metashape;
pub(crate) mod nerfstudio;
pub(crate) mod polycam;
pub(crate) mod scannet;
pub(crate) mod sens;
pub(crate) mod sequence;
pub(crate) mod tum;
pub(crate) mod undistorted;
