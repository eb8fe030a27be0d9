//! Images: PNG, OpenEXR, textures.

pub(crate) mod compression;
mod exr;
pub(crate) mod png;
pub(crate) mod pretty;
pub(crate) mod texture;

pub use self::exr::{encode_xyz_float, encode_xyz_half, read_xyz, write_xyz_float, write_xyz_half};
pub use self::png::{Content, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16, write_rgb8};
pub use compression::{Compression, UnknownCompression};
pub use pretty::pretty_color;
pub use texture::TextureFile;
