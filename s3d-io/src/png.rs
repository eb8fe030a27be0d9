//! PNG images: 8-bit colour and 16-bit gray.

use crate::{Error, Result, write_bytes};
use png::{BitDepth, ColorType, DeflateCompression, Filter};
use s3d_geom::Raster;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Images with more pixels than this are not read: 16 times a panorama of the data set's double size.
const MAX_PIXELS: u64 = 1 << 30;

/// What an 8-bit image shows, which decides how it compresses best. The pixels come back the same whatever is said.
///
/// The settings were chosen for time first: a view of 1080² costs a few milliseconds and is at most 1.3 times as large
/// as libpng's level 6 makes it (the bench `encode` times them).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Texture and noise: Paeth's filter and a fixed Huffman code for what it leaves.
    Photo,
    /// Surface normals: constant on planes, smooth elsewhere.
    Normals,
    /// Constant in pieces: label indices, a colour per instance.
    Labels,
}

/// An image as the bytes of an 8-bit RGB PNG file.
///
/// # Panics
/// If it has no pixel.
pub fn encode_rgb8(image: &Raster<[u8; 3]>, content: Content) -> Vec<u8> {
    let (filter, compression) = match content {
        Content::Photo => (Filter::Paeth, DeflateCompression::FdeflateUltraFast),
        Content::Normals | Content::Labels => (Filter::Up, DeflateCompression::Level(2)),
    };
    let format = Format { color: ColorType::Rgb, depth: BitDepth::Eight, filter, compression };
    encode(image.width(), image.height(), format, image.pixels().as_flattened())
}

/// An image as the bytes of a 16-bit gray PNG file, set for smooth images such as depth.
///
/// # Panics
/// If it has no pixel.
pub fn encode_gray16(image: &Raster<u16>) -> Vec<u8> {
    let bytes: Vec<u8> = image.pixels().iter().flat_map(|v| v.to_be_bytes()).collect();
    let format = Format {
        color: ColorType::Grayscale,
        depth: BitDepth::Sixteen,
        filter: Filter::Paeth,
        compression: DeflateCompression::Level(3),
    };
    encode(image.width(), image.height(), format, &bytes)
}

struct Format {
    color: ColorType,
    depth: BitDepth,
    filter: Filter,
    compression: DeflateCompression,
}

fn encode(width: u32, height: u32, format: Format, bytes: &[u8]) -> Vec<u8> {
    assert!(!bytes.is_empty(), "a PNG image needs pixels: {width} × {height}");
    let mut file = Vec::with_capacity(bytes.len() / 4 + 1024);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(format.color);
    encoder.set_depth(format.depth);
    encoder.set_filter(format.filter);
    encoder.set_deflate_compression(format.compression);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(bytes)?;
        writer.finish()
    });
    written.expect("memory takes any bytes, and the size is that of the image");
    file
}

/// Writes an image as an 8-bit RGB PNG file, whole or not at all, and returns its size in bytes.
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If it has no pixel.
pub fn write_rgb8(path: &Path, image: &Raster<[u8; 3]>, content: Content) -> Result<u64> {
    write_bytes(path, &encode_rgb8(image, content))
}

/// Writes an image as a 16-bit gray PNG file, whole or not at all, and returns its size in bytes.
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If it has no pixel.
pub fn write_gray16(path: &Path, image: &Raster<u16>) -> Result<u64> {
    write_bytes(path, &encode_gray16(image))
}

/// Reads an 8-bit RGB PNG file, and nothing else: its channels may be numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_rgb8(path: &Path) -> Result<Raster<[u8; 3]>> {
    let (width, height, bytes) = decode(path, ColorType::Rgb, BitDepth::Eight)?;
    Ok(Raster::from_vec(width, height, bytes.as_chunks().0.to_vec()))
}

/// Reads a 16-bit gray PNG file, and nothing else: its values are numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_gray16(path: &Path) -> Result<Raster<u16>> {
    let (width, height, bytes) = decode(path, ColorType::Grayscale, BitDepth::Sixteen)?;
    let values = bytes.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
    Ok(Raster::from_vec(width, height, values))
}

fn decode(path: &Path, color: ColorType, depth: BitDepth) -> Result<(u32, u32, Vec<u8>)> {
    let file = File::open(path).map_err(|e| Error::io(path, "read", e))?;
    let failed = |e| match e {
        png::DecodingError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, "read", e)
        }
        png::DecodingError::IoError(_) => Error::format(path, "the PNG file ends too early"),
        e => Error::format(path, format!("no readable PNG file: {e}")),
    };
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(failed)?;
    let info = reader.info();
    let (width, height) = (info.width, info.height);
    if (info.color_type, info.bit_depth) != (color, depth) {
        let (found, wanted) = (describe(info.color_type, info.bit_depth), describe(color, depth));
        return Err(Error::format(path, format!("the image is {found}, not {wanted}")));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::unsupported(
            path,
            format!("{width} × {height} pixels are more than {MAX_PIXELS}"),
        ));
    }
    let mut bytes = vec![0; width as usize * height as usize * info.bytes_per_pixel()];
    reader.next_frame(&mut bytes).map_err(failed)?;
    Ok((width, height, bytes))
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn in_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("image.png");
        write_bytes(&path, bytes).unwrap();
        read(&path)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn pixels_come_back((w, h, data) in (1u32..40, 1u32..40).prop_flat_map(|(w, h)| {
            (Just(w), Just(h), proptest::collection::vec(any::<[u8; 3]>(), (w * h) as usize))
        })) {
            let image = Raster::from_vec(w, h, data);
            for content in [Content::Photo, Content::Normals, Content::Labels] {
                prop_assert_eq!(&in_file(&encode_rgb8(&image, content), read_rgb8).unwrap(), &image);
            }
            let gray = image.map(|[a, b, _]| u16::from_be_bytes([a, b]));
            prop_assert_eq!(in_file(&encode_gray16(&gray), read_gray16).unwrap(), gray);
        }
    }

    #[test]
    fn sixteen_bits_are_big_endian_in_the_file() {
        // The `image` crate is the other reader.
        let image = Raster::from_vec(3, 1, vec![1, 0x1234, u16::MAX]);
        let other = image::load_from_memory(&encode_gray16(&image)).unwrap();
        assert_eq!(other.as_luma16().unwrap().as_raw(), image.pixels());
        let image = Raster::from_vec(2, 1, vec![[1, 2, 3], [250, 251, 252]]);
        let other = image::load_from_memory(&encode_rgb8(&image, Content::Photo)).unwrap();
        assert_eq!(other.as_rgb8().unwrap().as_raw(), &[1, 2, 3, 250, 251, 252]);
    }

    #[test]
    fn noise_is_not_blown_up_much() {
        let mut state = 1u32;
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let image = Raster::from_vec(300, 200, (0..60_000).map(|_| [byte(), byte(), byte()]).collect());
        for content in [Content::Photo, Content::Normals, Content::Labels] {
            let bytes = encode_rgb8(&image, content);
            assert!(bytes.len() < 300 * 200 * 3 * 14 / 10, "{content:?}: {}", bytes.len());
            assert_eq!(in_file(&bytes, read_rgb8).unwrap(), image);
        }
    }

    #[test]
    fn other_kinds_are_refused_by_name() {
        let gray = encode_gray16(&Raster::filled(2, 2, 5));
        let e = in_file(&gray, read_rgb8).unwrap_err().to_string();
        assert!(e.ends_with("image.png: the image is 16-bit gray, not 8-bit RGB"), "{e}");
        let rgb = encode_rgb8(&Raster::filled(2, 2, [5; 3]), Content::Labels);
        let e = in_file(&rgb, read_gray16).unwrap_err().to_string();
        assert!(e.ends_with("the image is 8-bit RGB, not 16-bit gray"), "{e}");
    }

    #[test]
    fn broken_files_are_format_errors() {
        let whole = encode_rgb8(&Raster::filled(9, 9, [1, 2, 3]), Content::Photo);
        for cut in [0, 5, 20, 40, whole.len() - 20] {
            let e = in_file(&whole[..cut], read_rgb8).unwrap_err();
            assert!(matches!(e, Error::Format { .. }), "{cut}: {e}");
        }
        let mut damaged = whole.clone();
        damaged[50] ^= 0x55;
        assert!(matches!(in_file(&damaged, read_rgb8), Err(Error::Format { .. })));
        // A header that promises more than anybody has.
        let mut huge = whole;
        huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(in_file(&huge, read_rgb8).is_err());
        let missing = read_rgb8(Path::new("/nowhere/image.png")).unwrap_err();
        assert!(matches!(missing, Error::Io { action: "read", .. }));
    }
}
