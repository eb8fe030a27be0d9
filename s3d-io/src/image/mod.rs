//! The images of a data set: 8-bit colour and 16-bit gray PNG, OpenEXR of world coordinates.
//!
//! `encode_…` returns a file's bytes and `decode_…` takes them; `write_…` and `read_…` do the same
//! with a path. A reader refuses any kind of image that its name does not say: channels may be numbers, which
//! must not be converted. An image has at most 2³⁰ pixels.
//!
//! | kind | samples | of a data set |
//! |---|---|---|
//! | [`encode_rgb8`] | 3 × 8 bits | `rgb`, `normal`, `semantic_pretty`, `principal_curvature` |
//! | [`encode_rgb8`] | 3 × 8 bits, indices of labels | `semantic`, `semantic_refined` |
//! | [`encode_palette8`] | 8 bits and a palette | `semantic_class` |
//! | [`encode_gray16`] | 16 bits | `depth`, `depth_euclidean`, `boundary_distance` |
//! | [`encode_numbers16`] | 16 bits, numbers of patches | `segment_unsup2d`, `segment_unsup25d` |
//! | [`encode_gray8`] | 8 bits, masks | `mask_valid`, `edge_occlusion`, `edge_instance`, `semantic_moved` |
//! | [`encode_levels8`] | 8 bits, shades | `reshading`, `edge_texture`, `keypoints2d`, `keypoints3d` |
//! | [`encode_xyz_half`], [`encode_xyz_float`] | 3 × 16 or 32 bits, floats | `global_xyz` |
//! | [`encode_depth_float`] | 32 bits, floats | none: packages have it |
//! | [`encode_jpeg`] | 3 × 8 bits, with loss | none: packages have it |
//!
//! [`Compression`] chooses between time and size, and [`Content`] says what the image shows. The bytes depend
//! on nothing else, and are the same on every machine. Source: [`crate::formats`], "What is written".
//!
//! ```
//! use s3d_geom::Raster;
//! use s3d_io::image::{Compression, Content, decode_rgb8, encode_rgb8};
//!
//! let image = Raster::filled(64, 32, [200, 100, 50]);
//! let bytes = encode_rgb8(&image, Content::Photo, Compression::Balanced);
//! assert_eq!(decode_rgb8(&bytes, "photo.png".as_ref())?, image);
//! # Ok::<(), s3d_io::Error>(())
//! ```

pub(crate) mod compression;
#[cfg(feature = "exr")]
mod depth_exr;
#[cfg(feature = "exr")]
mod exr;
pub(crate) mod find;
#[cfg(feature = "texture")]
mod jpeg;
#[cfg(feature = "png")]
pub(crate) mod png;
#[cfg(feature = "texture")]
pub(crate) mod texture;

#[cfg(feature = "exr")]
pub use self::exr::{
    decode_xyz, decode_xyz_half, encode_xyz_float, encode_xyz_half, read_xyz, write_xyz_float,
    write_xyz_half, xyz_bits,
};
#[cfg(feature = "png")]
pub use self::png::{
    Content, PngLines, PngReader, decode_gray16, decode_palette8, decode_rgb8, encode_gray8, encode_gray16,
    encode_levels8, encode_numbers16, encode_palette8, encode_rgb8, read_gray16, read_numbers8,
    read_palette8, read_rgb8, write_gray16, write_rgb8,
};
pub use compression::{Compression, UnknownCompression};
#[cfg(feature = "exr")]
pub use depth_exr::encode_depth_float;
#[cfg(feature = "texture")]
pub use jpeg::encode_jpeg;
pub use s3d_label::pretty_color;
#[cfg(feature = "texture")]
pub use texture::TextureFile;
