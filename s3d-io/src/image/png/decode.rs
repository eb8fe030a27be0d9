//! Reads PNG files of one kind and no other: their samples may be numbers, which must not be converted.

use super::lines::PngReader;
use crate::error::{Error, Result};
use crate::fs::open::{open_file, read_file};
use png::{BitDepth, ColorType};
use s3d_geom::Raster;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

/// The most pixels of an image that is read: 16 times a panorama of the data set's double size.
pub(crate) const MAX_PIXELS: u64 = 1 << 30;

/// The most bytes that deflate can make of one.
pub(super) const MAX_DEFLATE: u64 = 1032;

/// The largest file in bytes that is read into memory.
const MAX_WHOLE: u64 = 1 << 28;

/// Reads an 8-bit RGB PNG file and no other kind: its channels may be numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_rgb8(path: &Path) -> Result<Raster<[u8; 3]>> {
    match open_whole(path)? {
        Opened::Whole(bytes) => decode_rgb8(&bytes, path),
        Opened::Large(file, size) => {
            let (width, height, bytes, _) = decode(file, size, path, ColorType::Rgb, BitDepth::Eight)?;
            Ok(Raster::from_vec(width, height, bytes.as_chunks().0.to_vec()))
        }
    }
}

/// Decodes like [`read_rgb8`], from the file's bytes. Errors name the file by `name`.
///
/// # Errors
/// Like [`read_rgb8`].
pub fn decode_rgb8(bytes: &[u8], name: &Path) -> Result<Raster<[u8; 3]>> {
    Ok(PngReader::default().rgb8(bytes, name)?.into_raster())
}

/// Reads an 8-bit PNG file with a palette, and no other kind. Returns the palette index of each pixel, and
/// the colours of the palette.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, encode_palette8, read_palette8};
///
/// let file = tempfile::NamedTempFile::new()?;
/// let image = Raster::from_vec(2, 1, vec![1, 0]);
/// let palette = [[0, 0, 0], [255, 128, 0]];
/// std::fs::write(file.path(), encode_palette8(&image, &palette, Compression::Balanced))?;
/// assert_eq!(read_palette8(file.path())?, (image, palette.to_vec()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Like [`read_rgb8`].
pub fn read_palette8(path: &Path) -> Result<(Raster<u8>, Vec<[u8; 3]>)> {
    decode_palette8(&read_file(path)?, path)
}

/// Decodes like [`read_palette8`], from the file's bytes. Errors name the file by `name`.
///
/// # Errors
/// Like [`read_palette8`].
pub fn decode_palette8(bytes: &[u8], name: &Path) -> Result<(Raster<u8>, Vec<[u8; 3]>)> {
    let size = bytes.len() as u64;
    let (width, height, indices, palette) =
        decode(Cursor::new(bytes), size, name, ColorType::Indexed, BitDepth::Eight)?;
    Ok((Raster::from_vec(width, height, indices), palette.as_chunks().0.to_vec()))
}

/// Reads a 16-bit gray PNG file and no other kind: its values are numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_gray16(path: &Path) -> Result<Raster<u16>> {
    match open_whole(path)? {
        Opened::Whole(bytes) => decode_gray16(&bytes, path),
        Opened::Large(file, size) => {
            let (width, height, bytes, _) =
                decode(file, size, path, ColorType::Grayscale, BitDepth::Sixteen)?;
            let values = bytes
                .as_chunks()
                .0
                .iter()
                .map(|&pair| u16::from_be_bytes(pair))
                .collect();
            Ok(Raster::from_vec(width, height, values))
        }
    }
}

/// Decodes like [`read_gray16`], from the file's bytes. Errors name the file by `name`.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, decode_gray16, encode_gray16};
///
/// let depth = Raster::filled(4, 4, 1024u16);
/// let bytes = encode_gray16(&depth, Compression::Balanced);
/// assert_eq!(decode_gray16(&bytes, "depth.png".as_ref())?, depth);
/// # Ok::<(), s3d_io::Error>(())
/// ```
///
/// # Errors
/// Like [`read_gray16`].
pub fn decode_gray16(bytes: &[u8], name: &Path) -> Result<Raster<u16>> {
    Ok(PngReader::default().gray16(bytes, name)?.into_raster())
}

/// Opens a file. Returns its size in bytes too.
fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let file = open_file(path)?;
    let size = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
    Ok((BufReader::new(file), size))
}

/// An open file.
enum Opened {
    /// The bytes of a small file.
    Whole(Vec<u8>),
    /// A large file, which is read piece by piece, and its size in bytes.
    Large(BufReader<File>, u64),
}

/// Opens a file, and reads it unless it is large.
fn open_whole(path: &Path) -> Result<Opened> {
    let (mut file, size) = open(path)?;
    if size > MAX_WHOLE {
        return Ok(Opened::Large(file, size));
    }
    let mut bytes = Vec::with_capacity(size as usize);
    file.read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
    Ok(Opened::Whole(bytes))
}

/// Reads an 8-bit gray PNG file, or the palette indices of one with a palette of up to 8 bits, and no other
/// kind. Trainers write classes so.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, encode_gray8, encode_palette8, read_numbers8};
///
/// let file = tempfile::NamedTempFile::new()?;
/// let classes = Raster::from_vec(2, 1, vec![1, 0]);
/// let bytes = encode_palette8(&classes, &[[0, 0, 0], [255, 128, 0]], Compression::Balanced);
/// for bytes in [bytes, encode_gray8(&classes)] {
///     std::fs::write(file.path(), bytes)?;
///     assert_eq!(read_numbers8(file.path())?, classes);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Like [`read_rgb8`].
pub fn read_numbers8(path: &Path) -> Result<Raster<u8>> {
    let (file, size) = open(path)?;
    let decoded = decode_one_of(file, size, path, has_numbers8, "8-bit gray or with a palette")?;
    let Decoded { width, height, bytes, depth, .. } = decoded;
    if depth == BitDepth::Eight {
        return Ok(Raster::from_vec(width, height, bytes));
    }

    // A byte holds several numbers, the first in its highest bits. Each row begins with a new byte.
    let bits = depth as usize;
    let line = (width as usize * bits).div_ceil(8);
    let numbers = bytes.chunks_exact(line.max(1)).flat_map(|row| {
        row.iter()
            .flat_map(move |byte| {
                let byte = u16::from(*byte);
                (0..8 / bits).map(move |i| (byte >> (8 - bits * (i + 1)) & ((1 << bits) - 1)) as u8)
            })
            .take(width as usize)
    });
    Ok(Raster::from_vec(width, height, numbers.collect()))
}

/// Tells whether the pixels of a PNG file are numbers of 8 bits or less: gray, or into a palette.
fn has_numbers8(color: ColorType, depth: BitDepth) -> bool {
    match color {
        ColorType::Grayscale => depth == BitDepth::Eight,
        color => color == ColorType::Indexed,
    }
}

/// Returns width, height, samples and palette of a file of `size` bytes.
pub(super) fn decode(
    file: impl BufRead + Seek,
    size: u64,
    path: &Path,
    color: ColorType,
    depth: BitDepth,
) -> Result<(u32, u32, Vec<u8>, Vec<u8>)> {
    let Decoded { width, height, bytes, palette, .. } = decode_one_of(
        file,
        size,
        path,
        |found, bits| (found, bits) == (color, depth),
        &describe(color, depth),
    )?;
    Ok((width, height, bytes, palette))
}

/// The content of a PNG file.
struct Decoded {
    width: u32,
    height: u32,
    depth: BitDepth,
    bytes: Vec<u8>,
    palette: Vec<u8>,
}

/// Reads a file of `size` bytes, if `is_one` accepts its colour type and bit depth. `wanted` describes them
/// in the error.
fn decode_one_of(
    file: impl BufRead + Seek,
    size: u64,
    path: &Path,
    is_one: impl Fn(ColorType, BitDepth) -> bool,
    wanted: &str,
) -> Result<Decoded> {
    let failed = |e| match e {
        png::DecodingError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, "read", e)
        }
        png::DecodingError::IoError(_) => Error::format(path, "the PNG file ends too early"),
        e => Error::format(path, format!("no readable PNG file: {e}")),
    };

    let mut reader = png::Decoder::new(file).read_info().map_err(failed)?;
    let info = reader.info();
    let width = info.width;
    let height = info.height;
    let palette = info.palette.as_deref().unwrap_or_default().to_vec();
    let depth = info.bit_depth;

    if !is_one(info.color_type, depth) {
        let found = describe(info.color_type, depth);
        return Err(Error::format(path, format!("the image is {found}, not {wanted}")));
    }

    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::unsupported(
            path,
            format!("{width} × {height} pixels are more than {MAX_PIXELS}"),
        ));
    }

    let line = (u64::from(width) * info.bits_per_pixel() as u64).div_ceil(8);
    let needed = line * u64::from(height);
    if needed > size.saturating_mul(MAX_DEFLATE) {
        return Err(Error::format(path, format!("claims {width} × {height} pixels in {size} bytes")));
    }

    let mut bytes = vec![0; needed as usize];
    reader.next_frame(&mut bytes).map_err(failed)?;
    Ok(Decoded { width, height, depth, bytes, palette })
}

fn describe(color: ColorType, depth: BitDepth) -> String {
    let color = match color {
        ColorType::Grayscale => "gray",
        ColorType::Rgb => "RGB",
        ColorType::Indexed => "with a palette",
        ColorType::GrayscaleAlpha => "gray with alpha",
        ColorType::Rgba => "RGB with alpha",
    };
    format!("{}-bit {color}", depth as u8)
}
