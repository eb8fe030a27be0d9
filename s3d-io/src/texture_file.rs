//! Texture images: PNG and JPEG files to 8-bit colour.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::{Error, Result};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use s3d_geom::Raster;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The longest side of a texture in pixels.
const MAX_SIDE: u32 = 65_535;
/// No PNG or JPEG holds more pixels than this in a byte: deflate shrinks at most 1,032 times, a pixel of a bit or more.
const MAX_PIXELS_PER_BYTE: u64 = 8 * 1_032;

/// The encoded image of a texture as it was found, so that an export can copy it unchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureFile {
    /// What it is, told by its content and not by its name: `"png"` or `"jpg"`.
    pub extension: &'static str,
    /// The file's bytes.
    pub bytes: Vec<u8>,
}

/// A decoded texture beside the bytes that it was decoded from.
#[derive(Clone, Debug)]
pub(crate) struct LoadedTexture {
    pub(crate) image: Raster<[u8; 3]>,
    pub(crate) file: TextureFile,
}

/// Decodes a PNG or JPEG of any kind — gray, palette, with alpha, 16 bits — to 8-bit R G B. Alpha is left out.
///
/// # Errors
/// A sentence that says what is wrong, to follow the image's name.
pub(crate) fn decode_texture(bytes: Vec<u8>) -> std::result::Result<LoadedTexture, String> {
    let (format, extension) = match image::guess_format(&bytes) {
        Ok(ImageFormat::Png) => (ImageFormat::Png, "png"),
        Ok(ImageFormat::Jpeg) => (ImageFormat::Jpeg, "jpg"),
        Ok(other) => return Err(format!("is a {} image; only PNG and JPEG are read", name_of(other))),
        Err(_) => return Err("is no PNG or JPEG image".into()),
    };
    let undecodable = |e: image::ImageError| format!("cannot be decoded: {e}");
    let (width, height) =
        ImageReader::with_format(Cursor::new(&bytes), format).into_dimensions().map_err(undecodable)?;
    let pixels = u64::from(width).saturating_mul(u64::from(height));
    if pixels == 0 || width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("is {width} × {height} pixels large; a side has 1 to {MAX_SIDE}"));
    }
    if pixels > (bytes.len() as u64).saturating_mul(MAX_PIXELS_PER_BYTE) {
        return Err(format!("claims {width} × {height} pixels in {} bytes", bytes.len()));
    }
    let mut reader = ImageReader::with_format(Cursor::new(&bytes), format);
    // The size is plausible by now; the library's own limit would refuse textures of 16,384² pixels.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(pixels.saturating_mul(16).saturating_add(64 << 20));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(undecodable)?;
    let rgb = if decoder.color_type() == ColorType::Rgb8 {
        // Most are: they are decoded to where they stay.
        let count = usize::try_from(pixels).map_err(|_| format!("has {pixels} pixels, too many"))?;
        let mut rgb = vec![[0; 3]; count];
        decoder.read_image(rgb.as_flattened_mut()).map_err(undecodable)?;
        rgb
    } else {
        let rgb = DynamicImage::from_decoder(decoder).map_err(undecodable)?.into_rgb8();
        rgb.into_raw().as_chunks().0.to_vec()
    };
    let image = Raster::from_vec(width, height, rgb);
    Ok(LoadedTexture { image, file: TextureFile { extension, bytes } })
}

fn name_of(format: ImageFormat) -> &'static str {
    format.extensions_str().first().copied().unwrap_or("different")
}

/// Reads and decodes image files, in parallel, each as [`decode_texture`] does.
pub(crate) fn read_textures(paths: &[PathBuf]) -> Vec<std::result::Result<LoadedTexture, String>> {
    paths
        .par_iter()
        // One at a time: sizes differ, and a thread that is done takes the next.
        .with_max_len(1)
        .map(|path| {
            let bytes = read_file(path).map_err(|e| match e {
                Error::Io { source, .. } => format!("cannot be read: {source}"),
                other => other.to_string(),
            })?;
            decode_texture(bytes)
        })
        .collect()
}

/// The content of a regular file. Devices and pipes are refused: reading one may never end.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>> {
    let what = fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if !what.is_file() {
        return Err(Error::format(
            path,
            if what.is_dir() { "is a folder, not a file" } else { "is no file" },
        ));
    }
    fs::read(path).map_err(|e| Error::io(path, "read", e))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};

    pub(crate) fn png_of(image: DynamicImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    /// A 2 × 1 PNG: the colours `a` and `b`.
    pub(crate) fn two_pixels(a: [u8; 3], b: [u8; 3]) -> Vec<u8> {
        png_of(ImageBuffer::from_fn(2, 1, |x, _| Rgb(if x == 0 { a } else { b })).into())
    }

    fn pixels(bytes: Vec<u8>) -> Vec<[u8; 3]> {
        decode_texture(bytes).unwrap().image.into_vec()
    }

    #[test]
    fn every_kind_of_png_becomes_rgb() {
        assert_eq!(pixels(two_pixels([1, 2, 3], [250, 0, 9])), [[1, 2, 3], [250, 0, 9]]);
        assert_eq!(pixels(png_of(ImageBuffer::from_pixel(1, 1, Luma([7u8])).into())), [[7; 3]]);
        assert_eq!(pixels(png_of(ImageBuffer::from_pixel(1, 1, LumaA([7u8, 0])).into())), [[7; 3]]);
        assert_eq!(pixels(png_of(ImageBuffer::from_pixel(1, 1, Rgba([7u8, 8, 9, 0])).into())), [[7, 8, 9]]);
        let deep = ImageBuffer::from_pixel(1, 1, Rgb([0xffffu16, 0x8080, 0x0101]));
        assert_eq!(pixels(png_of(deep.into())), [[255, 128, 1]]);
    }

    #[test]
    fn jpeg_is_told_by_its_content_and_its_bytes_are_kept() {
        let mut bytes = Vec::new();
        let image = DynamicImage::from(ImageBuffer::from_pixel(16, 16, Rgb([200u8, 100, 50])));
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Jpeg).unwrap();
        let loaded = decode_texture(bytes.clone()).unwrap();
        assert_eq!(loaded.file, TextureFile { extension: "jpg", bytes });
        let close = |p: &[u8; 3]| p.iter().zip([200, 100, 50]).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 3);
        assert!(loaded.image.pixels().iter().all(close));
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert!(decode_texture(b"v 0 0 0".to_vec()).unwrap_err().contains("no PNG or JPEG"));
        assert!(decode_texture(b"GIF89a\x01\0\x01\0".to_vec()).unwrap_err().contains("gif"));
        let mut cut = two_pixels([1; 3], [2; 3]);
        cut.truncate(cut.len() - 20);
        assert!(decode_texture(cut).unwrap_err().contains("cannot be decoded"));
        // A header that claims 60,000 × 60,000 pixels (with its checksum), and nothing behind it.
        let mut claim = two_pixels([1; 3], [2; 3]);
        claim[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
        let crc = crc32(&claim[12..29]);
        claim[29..33].copy_from_slice(&crc.to_be_bytes());
        assert!(decode_texture(claim).unwrap_err().contains("claims 60000 × 60000"));
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
        })
    }

    #[test]
    fn a_folder_is_no_file() {
        let dir = tempfile::tempdir().unwrap();
        assert!(read_file(dir.path()).unwrap_err().to_string().contains("is a folder"));
        assert!(read_file(&dir.path().join("gone")).unwrap_err().to_string().contains("cannot read"));
    }

    #[test]
    #[expect(clippy::print_stderr, reason = "a skipped test says so")]
    fn the_png_suite_decodes_or_is_refused() {
        let suite = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/hard-inputs/pngsuite/png");
        let Ok(entries) = fs::read_dir(&suite) else {
            eprintln!("skipped: {} is not there", suite.display());
            return;
        };
        let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
        paths.sort();
        for (path, texture) in paths.iter().zip(read_textures(&paths)) {
            // Names of the suite that start with x are broken on purpose.
            let broken = path.file_name().unwrap().to_str().unwrap().starts_with('x');
            assert_eq!(texture.is_err(), broken, "{}: {:?}", path.display(), texture.map(|_| ()));
        }
    }
}
