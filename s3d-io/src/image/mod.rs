//! Images: PNG, OpenEXR, textures.

pub(crate) mod compression;
#[cfg(feature = "exr")]
mod exr;
pub(crate) mod find;
#[cfg(feature = "png")]
pub(crate) mod png;
pub(crate) mod pretty;
#[cfg(feature = "texture")]
pub(crate) mod texture;

#[cfg(feature = "exr")]
pub use self::exr::{
    decode_xyz, encode_xyz_float, encode_xyz_half, read_xyz, write_xyz_float, write_xyz_half,
};
#[cfg(feature = "png")]
pub use self::png::{
    Content, decode_gray16, decode_rgb8, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16,
    write_rgb8,
};
pub use compression::{Compression, UnknownCompression};
pub use pretty::pretty_color;
#[cfg(feature = "texture")]
pub use texture::TextureFile;
