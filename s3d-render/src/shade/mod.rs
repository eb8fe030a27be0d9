//! Makes images from hits: colours, depths, normals, indices and points.

pub(crate) mod anchor;
pub(crate) mod channels;
pub(crate) mod color;
pub(crate) mod face_table;
pub(crate) mod filter;
pub(crate) mod flat_painter;
pub(crate) mod mip_maps;
pub(crate) mod patch;
pub(crate) mod pixel_color;
pub(crate) mod points;
pub(crate) mod prefetch;
pub(crate) mod spans;
pub(crate) mod texel_wrap;
pub(crate) mod view;
