//! PNG images.

pub(crate) mod codec;

pub use codec::{Content, encode_gray16, encode_rgb8, read_gray16, read_rgb8, write_gray16, write_rgb8};
