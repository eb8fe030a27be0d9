//! PNG images.

pub(crate) mod codec;

pub use codec::{
    Content, decode_gray16, decode_rgb8, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16,
    write_rgb8,
};
