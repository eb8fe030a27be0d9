//! PNG images: 8-bit colour, 8 bits with a palette, 8-bit and 16-bit gray.

mod decode;
mod encode;
mod lines;
#[cfg(test)]
mod tests;

#[cfg(feature = "dataset")]
pub(crate) use self::decode::MAX_PIXELS;
pub use self::decode::{
    decode_gray16, decode_palette8, decode_rgb8, read_gray16, read_numbers8, read_palette8, read_rgb8,
};
pub use self::encode::{
    Content, encode_gray8, encode_gray16, encode_levels8, encode_numbers16, encode_palette8, encode_rgb8,
    write_gray16, write_rgb8,
};
pub use self::lines::{PngLines, PngReader};
