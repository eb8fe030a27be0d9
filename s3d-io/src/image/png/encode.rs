//! Writes PNG files with the deflate of this workspace. What an image shows decides how it is compressed.

use crate::error::Result;
use crate::fs::atomic::write_bytes;
use crate::image::compression::Compression;
use png::{BitDepth, ColorType};
use s3d_deflate::png::{Filter, filter};
use s3d_deflate::{Deflater, Search};
use s3d_geom::Raster;
use std::path::Path;

/// What an 8-bit image shows, which decides how it compresses best. The pixels are the same for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Texture and noise.
    Photo,
    /// Surface normals: constant on planes, smooth elsewhere.
    Normals,
    /// Constant on patches: label indices, or a colour for each instance.
    Labels,
}

/// Encodes an image as an 8-bit RGB PNG file.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_rgb8(image: &Raster<[u8; 3]>, content: Content, compression: Compression) -> Vec<u8> {
    // A line has one byte for its filter, then the samples.
    let line = 1 + 3 * image.width() as usize;
    let photo = Search::photo(line);
    let small = Search::thorough(line, 3);
    let plans: &[(Filter, Search)] = match (content, compression) {
        (Content::Photo, Compression::Fast) => &[(Filter::Paeth, Search { nice: 16, patience: 3, ..photo })],
        (Content::Photo, Compression::Balanced) => &[(Filter::Paeth, photo)],
        // In noise, matches of a few bytes do not pay.
        (Content::Photo, Compression::Small) => &[(Filter::Paeth, small), (Filter::Paeth, photo)],
        (Content::Normals, Compression::Fast | Compression::Balanced) => {
            &[(Filter::None, Search::smooth(line))]
        }
        // Large patches repeat best without a filter, small ones as differences.
        (Content::Normals, Compression::Small) => {
            &[(Filter::Paeth, small), (Filter::None, small), (Filter::None, Search::smooth(line))]
        }
        (Content::Labels, Compression::Fast) => &[(Filter::Up, Search::patches(line))],
        (Content::Labels, Compression::Balanced) => &[(Filter::Up, Search::labels(line))],
        (Content::Labels, Compression::Small) => &[(Filter::Up, small), (Filter::Paeth, small)],
    };

    let format = Format { color: ColorType::Rgb, depth: BitDepth::Eight, pixel: 3, palette: &[] };
    encode(image.width(), image.height(), format, image.pixels().as_flattened(), plans)
}

/// Encodes an image as an 8-bit gray PNG file, tuned for images that are constant on patches, such as masks.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_gray8(image: &Raster<u8>) -> Vec<u8> {
    let search = Search::patches(1 + image.width() as usize);
    let format = Format { color: ColorType::Grayscale, depth: BitDepth::Eight, pixel: 1, palette: &[] };
    encode(image.width(), image.height(), format, image.pixels(), &[(Filter::Up, search)])
}

/// Encodes an image of shades as an 8-bit gray PNG file.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_levels8(image: &Raster<u8>, compression: Compression) -> Vec<u8> {
    let line = 1 + image.width() as usize;
    let small = Search::thorough(line, 1);
    let balanced = Search { sample: 1, ..Search::photo(line) };
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast => &[(Filter::Up, Search { nice: 16, patience: 3, ..balanced })],
        Compression::Balanced => &[(Filter::Up, balanced)],
        Compression::Small => &[(Filter::Up, small), (Filter::Paeth, small)],
    };
    let format = Format { color: ColorType::Grayscale, depth: BitDepth::Eight, pixel: 1, palette: &[] };
    encode(image.width(), image.height(), format, image.pixels(), plans)
}

/// Encodes an image of palette indices as an 8-bit PNG file with its palette.
///
/// # Panics
/// If the image has no pixel, or the palette has no colour or more than 256.
pub fn encode_palette8(image: &Raster<u8>, palette: &[[u8; 3]], compression: Compression) -> Vec<u8> {
    assert!((1..=256).contains(&palette.len()), "a palette of {} colours", palette.len());
    let line = 1 + image.width() as usize;
    let small = Search::thorough(line, 1);
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast => &[(Filter::Up, Search::patches(line))],
        Compression::Balanced => &[(Filter::Up, Search::labels(line))],
        Compression::Small => &[(Filter::Up, small), (Filter::None, small)],
    };
    let palette = palette.as_flattened();
    let format = Format { color: ColorType::Indexed, depth: BitDepth::Eight, pixel: 1, palette };
    encode(image.width(), image.height(), format, image.pixels(), plans)
}

/// Encodes an image as a 16-bit gray PNG file, tuned for smooth images such as depth.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_gray16(image: &Raster<u16>, compression: Compression) -> Vec<u8> {
    let line = 1 + 2 * image.width() as usize;
    let balanced = Search::depth(line);
    let small = Search { hash_bytes: 6, ..Search::thorough(line, 2) };
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast | Compression::Balanced => &[(Filter::Paeth, balanced)],
        Compression::Small => &[(Filter::Paeth, small), (Filter::Paeth, balanced)],
    };
    encode_16(image, plans)
}

/// Encodes an image as a 16-bit gray PNG file, tuned for images that are constant on patches, such as numbers
/// of segments.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_numbers16(image: &Raster<u16>, compression: Compression) -> Vec<u8> {
    let line = 1 + 2 * image.width() as usize;
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast | Compression::Balanced => &[(Filter::Up, Search::patches(line))],
        Compression::Small => &[(Filter::Up, Search::thorough(line, 2))],
    };
    encode_16(image, plans)
}

fn encode_16(image: &Raster<u16>, plans: &[(Filter, Search)]) -> Vec<u8> {
    let mut bytes = vec![0; 2 * image.len()];
    bytes
        .as_chunks_mut()
        .0
        .iter_mut()
        .zip(image.pixels())
        .for_each(|(pair, v)| *pair = v.to_be_bytes());
    let format = Format { color: ColorType::Grayscale, depth: BitDepth::Sixteen, pixel: 2, palette: &[] };
    encode(image.width(), image.height(), format, &bytes, plans)
}

struct Format<'a> {
    color: ColorType,
    depth: BitDepth,
    /// The number of bytes in a pixel.
    pixel: usize,
    /// The colours of the palette, three bytes each. Empty without a palette.
    palette: &'a [u8],
}

/// The lines of a band on which the plans are compared, and the distance from one band to the next.
const SAMPLE: (usize, usize) = (32, 128);
/// The largest number of lines of which all are compared.
const FEW_LINES: usize = 512;

/// Encodes the file by the plan that makes the smallest sample.
#[expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "a writer, into memory: bands are cut by their own lengths, and there is a plan"
)]
fn encode(width: u32, height: u32, format: Format<'_>, bytes: &[u8], plans: &[(Filter, Search)]) -> Vec<u8> {
    assert!(!bytes.is_empty(), "a PNG image needs pixels: {width} × {height}");
    let line = width as usize * format.pixel;

    let compress = |bytes: &[u8], (by, search): (Filter, Search)| {
        let mut out = Vec::with_capacity(bytes.len() / 4 + 1024);
        let filtered = filter(bytes, line, format.pixel, by).expect("whole lines");
        Deflater::new(search)
            .expect("searches are in range")
            .zlib(&filtered, None, &mut out);
        out
    };

    let plan = if let [plan] = plans {
        *plan
    } else {
        let of = if bytes.len() <= FEW_LINES * line {
            SAMPLE.0
        } else {
            SAMPLE.1
        };
        let bands = bytes
            .chunks(of * line)
            .map(|band| &band[..band.len().min(SAMPLE.0 * line)]);
        let sample = bands.collect::<Vec<_>>().concat();
        *plans
            .iter()
            .min_by_key(|plan| compress(&sample, **plan).len())
            .expect("there is a plan")
    };
    let compressed = compress(bytes, plan);

    let mut file = Vec::with_capacity(compressed.len() + 128);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(format.color);
    encoder.set_depth(format.depth);
    if !format.palette.is_empty() {
        encoder.set_palette(format.palette);
    }
    let written = encoder.write_header().and_then(|mut writer| {
        // The length of a chunk has 31 bits.
        compressed
            .chunks(1 << 30)
            .try_for_each(|piece| writer.write_chunk(png::chunk::IDAT, piece))?;
        writer.finish()
    });
    written.expect("memory takes any bytes");
    file
}

/// Writes an image as an 8-bit RGB PNG file, whole or not at all, and returns its size in bytes. See
/// [`encode_rgb8`].
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If the image has no pixel.
pub fn write_rgb8(
    path: &Path,
    image: &Raster<[u8; 3]>,
    content: Content,
    compression: Compression,
) -> Result<u64> {
    write_bytes(path, &encode_rgb8(image, content, compression))
}

/// Writes an image as a 16-bit gray PNG file, whole or not at all, and returns its size in bytes. See
/// [`encode_gray16`].
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If the image has no pixel.
pub fn write_gray16(path: &Path, image: &Raster<u16>, compression: Compression) -> Result<u64> {
    write_bytes(path, &encode_gray16(image, compression))
}
