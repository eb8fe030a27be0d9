//! Colours from pictures: cube maps, their sources, and the images that sample them.

pub(crate) mod cube_map;
pub(crate) mod cube_sources;
pub(crate) mod equirectangular;
pub(crate) mod fill;
pub(crate) mod level_panorama;
pub(crate) mod picture_color;
pub(crate) mod stitch;
pub(crate) mod undistort;
