//! Encodes images and long rows of numbers as text.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use jpeg_encoder::{ColorType, Encoder, EncodingError, SamplingFactor};
use s3d_geom::Raster;
use s3d_io::image::{Content, encode_rgb8};
use std::io::Write;

/// The quality of JPEG files, 1 to 100.
const QUALITY: u8 = 85;

/// Packs the bytes of numbers into a zlib stream in Base64.
pub(crate) fn packed<T, const N: usize>(
    numbers: impl IntoIterator<Item = T>,
    bytes: fn(T) -> [u8; N],
) -> String {
    let bytes: Vec<u8> = numbers.into_iter().flat_map(bytes).collect();
    let mut stream = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to memory does not fail.
    let stream = stream
        .write_all(&bytes)
        .and_then(|()| stream.finish())
        .unwrap_or_default();
    BASE64_STANDARD.encode(stream)
}

/// Encodes an image without loss as a `data:` URL.
pub(crate) fn png_url(image: &Raster<[u8; 3]>, content: Content) -> String {
    let bytes = encode_rgb8(image, content, s3d_io::image::Compression::Fast);
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(bytes))
}

/// Encodes an image in good quality as a `data:` URL. Its colours are half as fine as its light (4:2:0),
/// which takes half the time.
///
/// The encoder of the `image` crate takes twice as long. The AVX2 instructions of this encoder save a fifth,
/// but round differently, so that the bytes would depend on the processor.
pub(crate) fn jpeg_url(image: &Raster<[u8; 3]>) -> Result<String, EncodingError> {
    let width = jpeg_side(image.width())?;
    let height = jpeg_side(image.height())?;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.encode(image.pixels().as_flattened(), width, height, ColorType::Rgb)?;
    Ok(format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(bytes)))
}

fn jpeg_side(pixels: u32) -> Result<u16, EncodingError> {
    u16::try_from(pixels).map_err(|_| EncodingError::Write(format!("{pixels} pixels are more than JPEG has")))
}
