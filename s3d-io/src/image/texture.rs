//! Decodes texture images to 8-bit colour: PNG and JPEG, which an export copies unchanged, and WebP, BMP, TGA
//! and TIFF, which it writes as PNG.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use crate::fs::open::read_file;
use crate::guarded::guarded;
use crate::image::jpeg::{fault, without_fill};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The longest side of a texture in pixels.
const MAX_SIDE: u32 = 65_535;
/// The most pixels of a texture: 32,768 × 16,384. That is twice as much as graphics cards take, and 1.6 GB
/// once it is decoded. A file of half a megabyte can claim seven times as many.
const MAX_PIXELS: u64 = 1 << 29;
/// The most pixels of all textures of a file together: 2,048 textures of 2,048 × 2,048, 26 GB of them.
const MAX_PIXELS_TOGETHER: u64 = 1 << 33;
/// The most pixels that a byte of a PNG or JPEG can hold: deflate shrinks at most 1,032 times, and a pixel
/// has at least one bit.
const MAX_PIXELS_PER_BYTE: u64 = 8 * 1_032;

/// The encoded image of a texture as its file has it, so that an export can copy it unchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextureFile {
    /// The format, `"png"` or `"jpg"`, told by the content and not by the name.
    pub extension: &'static str,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
}

/// A decoded texture, with the bytes from which it was decoded.
#[derive(Clone, Debug)]
pub(crate) struct LoadedTexture {
    pub(crate) image: Raster<[u8; 3]>,
    /// `None` for a format that an export does not copy.
    pub(crate) file: Option<TextureFile>,
}

/// Why an image is not decoded: a sentence that follows its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum TextureFault {
    /// It is damaged, or no image. The mesh can be drawn without it.
    Unreadable(String),
    /// It is too large for the memory, alone or together with the other images of the mesh.
    TooLarge(String),
}

impl std::fmt::Display for TextureFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Unreadable(message) | Self::TooLarge(message)) = self;
        f.write_str(message)
    }
}

/// Decodes an image of any kind (gray, palette, with alpha, 16 bits) to 8-bit RGB. Alpha is dropped.
pub(crate) fn decode_texture(bytes: Vec<u8>) -> std::result::Result<LoadedTexture, TextureFault> {
    let (format, extension, size) = size_of_texture(&bytes)?;
    // The decoders belong to other crates, and some panic on damaged images.
    let is_jpeg = format == ImageFormat::Jpeg;
    let encoded = if is_jpeg { without_fill(&bytes) } else { &bytes };
    let image = guarded(|| decode(encoded, format, size))
        .unwrap_or_else(|| Err("its content is damaged".into()))
        .map_err(|e| TextureFault::Unreadable(format!("cannot be decoded: {e}")))?;
    if is_jpeg && let Some(what) = fault(encoded, image.height()) {
        return Err(TextureFault::Unreadable(what));
    }
    let file = extension.map(|extension| TextureFile { extension, bytes });
    Ok(LoadedTexture { image, file })
}

fn decode(
    bytes: &[u8],
    format: ImageFormat,
    [width, height]: [u32; 2],
) -> std::result::Result<Raster<[u8; 3]>, String> {
    let pixels = u64::from(width).saturating_mul(u64::from(height));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The size was checked. The library's own limit would refuse textures of 16,384² pixels.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(pixels.saturating_mul(16).saturating_add(64 << 20));
    reader.limits(limits);

    let decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let rgb = if decoder.color_type() == ColorType::Rgb8 {
        // Most images are of this kind, and are decoded without a copy.
        let count = usize::try_from(pixels).map_err(|_| format!("has {pixels} pixels, too many"))?;
        let mut rgb = vec![[0; 3]; count];
        decoder.read_image(rgb.as_flattened_mut()).map_err(|e| e.to_string())?;
        rgb
    } else {
        let image = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
        image.into_rgb8().into_raw().as_chunks().0.to_vec()
    };
    Ok(Raster::from_vec(width, height, rgb))
}

/// The format of a texture, the extension of its file if an export copies it, and its width and height.
type Header = (ImageFormat, Option<&'static str>, [u32; 2]);

/// Returns the width and height of a texture in pixels, from its first bytes. The file can hold an image of
/// this size.
#[cfg(feature = "e57")]
pub(crate) fn texture_size(bytes: &[u8]) -> std::result::Result<[u32; 2], TextureFault> {
    size_of_texture(bytes).map(|header| header.2)
}

/// Reads the first bytes of a texture. The file can hold an image of the size that they tell.
fn size_of_texture(bytes: &[u8]) -> std::result::Result<Header, TextureFault> {
    let guessed = image::guess_format(bytes).ok();
    let (format, extension) = match guessed.or(is_tga(bytes).then_some(ImageFormat::Tga)) {
        Some(ImageFormat::Png) => (ImageFormat::Png, Some("png")),
        Some(ImageFormat::Jpeg) => (ImageFormat::Jpeg, Some("jpg")),
        #[cfg(feature = "textures")]
        Some(format @ (ImageFormat::WebP | ImageFormat::Bmp | ImageFormat::Tga | ImageFormat::Tiff)) => {
            (format, None)
        }
        Some(other) => {
            let message = format!("is a {} image; {READ} are read", name_of(other));
            return Err(TextureFault::Unreadable(message));
        }
        None if bytes.starts_with(b"\xABKTX") => {
            let message = format!("is a KTX2 image, of the memory of a graphics card; {READ} are read");
            return Err(TextureFault::Unreadable(message));
        }
        None => return Err(TextureFault::Unreadable(format!("is no image; {READ} are read"))),
    };

    let size = guarded(|| ImageReader::with_format(Cursor::new(bytes), format).into_dimensions());
    let (width, height) = match size {
        Some(Ok(size)) => size,
        Some(Err(e)) => return Err(TextureFault::Unreadable(format!("cannot be decoded: {e}"))),
        None => return Err(TextureFault::Unreadable("cannot be decoded: its header is damaged".into())),
    };

    let pixels = u64::from(width).saturating_mul(u64::from(height));
    if pixels == 0 || width > MAX_SIDE || height > MAX_SIDE {
        let message = format!("is {width} × {height} pixels large; a side has 1 to {MAX_SIDE}");
        return Err(TextureFault::Unreadable(message));
    }
    if pixels > MAX_PIXELS {
        return Err(TextureFault::TooLarge(format!(
            "is {width} × {height} pixels large, and a texture has {MAX_PIXELS} at most (32,768 × 16,384): \
             scale it down, or cut it in parts"
        )));
    }
    if pixels > (bytes.len() as u64).saturating_mul(MAX_PIXELS_PER_BYTE) {
        let message = format!("claims {width} × {height} pixels in {} bytes", bytes.len());
        return Err(TextureFault::Unreadable(message));
    }
    Ok((format, extension, [width, height]))
}

/// The formats, for messages.
const READ: &str = if cfg!(feature = "textures") {
    "PNG, JPEG, WebP, BMP, TGA and TIFF"
} else {
    "PNG and JPEG"
};

/// Returns whether the first bytes are the header of a TGA image, which has no name of its own: a map of
/// colours or none, one of six types, its depth in bits, a width and a height.
fn is_tga(bytes: &[u8]) -> bool {
    let Some(&[_, map, kind, _, _, _, _, map_bits, _, _, _, _, w0, w1, h0, h1, bits, _]) =
        bytes.first_chunk()
    else {
        return false;
    };
    let has_map = map == 1 && matches!(map_bits, 15 | 16 | 24 | 32) && matches!(kind, 1 | 9);
    let has_colors = map == 0 && matches!(kind, 2 | 3 | 10 | 11);
    (has_map || has_colors)
        && matches!(bits, 8 | 15 | 16 | 24 | 32)
        && [w0, w1] != [0; 2]
        && [h0, h1] != [0; 2]
}

fn name_of(format: ImageFormat) -> &'static str {
    format.extensions_str().first().copied().unwrap_or("different")
}

/// Reads and decodes image files in parallel. A fault that the mesh can be drawn with stands in the place of
/// its image.
///
/// # Errors
/// [`Error::Unsupported`] if an image is too large, or all images together are.
pub(crate) fn read_textures(paths: &[PathBuf]) -> Result<Vec<std::result::Result<LoadedTexture, String>>> {
    // A thread takes one file at a time, since sizes differ. The bytes stay in memory with the images, so all
    // files are read before the first image is decoded.
    let files: Vec<_> = paths
        .par_iter()
        .with_max_len(1)
        .map(|path| encoded_texture(path))
        .collect();

    let mut together = Together::default();
    for (path, file) in paths.iter().zip(&files) {
        let size = match file {
            Ok((Ok([width, height]), _)) => together.add(*width, *height),
            Ok((Err(TextureFault::TooLarge(message)), _)) => Err(message.clone()),
            Ok((Err(TextureFault::Unreadable(_)), _)) | Err(_) => Ok(()),
        };
        size.map_err(|message| Error::unsupported(path, message))?;
    }

    let textures = files.into_par_iter().with_max_len(1).map(|file| {
        let (_, bytes) = file?;
        decode_texture(bytes).map_err(|fault| fault.to_string())
    });
    Ok(textures.collect())
}

/// The size of an image, or its fault, and the bytes of its file.
type EncodedTexture = (std::result::Result<[u32; 2], TextureFault>, Vec<u8>);

/// Reads an image file, and the size in its header. The error is a sentence that follows its name.
fn encoded_texture(path: &Path) -> std::result::Result<EncodedTexture, String> {
    match read_file(path) {
        Ok(bytes) => Ok((size_of_texture(&bytes).map(|(_, _, size)| size), bytes)),
        Err(Error::Io { source, .. }) => Err(format!("cannot be read: {source}")),
        Err(other) => Err(other.to_string()),
    }
}

/// How many textures a file has, and how many pixels.
#[derive(Default)]
pub(crate) struct Together {
    pixels: u64,
    textures: usize,
}

impl Together {
    /// Counts a texture, before memory is reserved for it. The error is a sentence that follows its name.
    pub(crate) fn add(&mut self, width: u32, height: u32) -> std::result::Result<(), String> {
        self.pixels = self
            .pixels
            .saturating_add(u64::from(width).saturating_mul(u64::from(height)));
        self.textures = self.textures.saturating_add(1);
        if self.pixels <= MAX_PIXELS_TOGETHER {
            return Ok(());
        }
        Err(format!(
            "is texture {} of the file, and the textures up to it have {} pixels together, more than \
             {MAX_PIXELS_TOGETHER}: scale them down, or cut the scene in parts",
            self.textures, self.pixels
        ))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};
    use std::fs;

    pub(crate) fn png_of(image: DynamicImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    }

    /// Encodes a 2 × 1 PNG of the colours `a` and `b`.
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
        assert_eq!(loaded.file, Some(TextureFile { extension: "jpg", bytes }));
        assert!(
            loaded
                .image
                .pixels()
                .iter()
                .all(|p| p.iter().zip([200, 100, 50]).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 3))
        );
    }

    #[cfg(feature = "textures")]
    #[test]
    fn textures_of_modellers_are_decoded_and_not_copied() {
        let colors = [[200, 100, 50], [1, 2, 3]];
        let image: DynamicImage =
            ImageBuffer::from_fn(2, 1, |x, _| Rgb(if x == 0 { colors[0] } else { colors[1] })).into();
        for format in [ImageFormat::WebP, ImageFormat::Bmp, ImageFormat::Tga, ImageFormat::Tiff] {
            let mut bytes = Vec::new();
            image.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
            let loaded = decode_texture(bytes).unwrap_or_else(|e| panic!("{format:?}: {e}"));
            assert_eq!((loaded.image.into_vec(), loaded.file), (colors.to_vec(), None), "{format:?}");
        }
        assert!(fault_of(b"\xABKTX 20\xBB\r\n".to_vec()).contains("is a KTX2 image"));
    }

    fn fault_of(bytes: Vec<u8>) -> String {
        decode_texture(bytes).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert!(fault_of(b"v 0 0 0".to_vec()).contains("is no image; PNG"));
        assert!(fault_of(b"GIF89a\x01\0\x01\0".to_vec()).contains("gif"));
        let mut cut = two_pixels([1; 3], [2; 3]);
        cut.truncate(cut.len() - 20);
        assert!(fault_of(cut).contains("cannot be decoded"));
        assert!(fault_of(claim(20_000)).contains("claims 20000 × 20000"));
    }

    /// Makes a header that claims this number of pixels on each side (with its checksum), and next to no
    /// content.
    fn claim(side: u32) -> Vec<u8> {
        let mut claim = two_pixels([1; 3], [2; 3]);
        claim[16..20].copy_from_slice(&side.to_be_bytes());
        claim[20..24].copy_from_slice(&side.to_be_bytes());
        let crc = crc32(&claim[12..29]);
        claim[29..33].copy_from_slice(&crc.to_be_bytes());
        claim
    }

    #[test]
    fn textures_that_are_too_large_are_errors_whatever_is_behind_their_header() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("wall.png");
        for (side, fits) in [(23_170, true), (23_171, false), (60_000, false)] {
            fs::write(&path, claim(side)).unwrap();
            let read = read_textures(std::slice::from_ref(&path));
            assert_eq!(read.is_ok(), fits, "{side}");
            if let Err(e) = read {
                let expected =
                    format!("wall.png: is {side} × {side} pixels large, and a texture has 536870912");
                assert!(e.to_string().contains(&expected), "{e}");
            }
        }
    }

    #[test]
    fn textures_are_counted_together() {
        let mut together = Together::default();
        for _ in 0..2048 {
            together.add(2048, 2048).unwrap();
        }
        assert!(
            together
                .add(1, 1)
                .unwrap_err()
                .starts_with("is texture 2049 of the file")
        );
        assert!(Together { pixels: u64::MAX, textures: 1 }.add(9, 9).is_err());
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
        assert!(
            read_file(&dir.path().join("gone"))
                .unwrap_err()
                .to_string()
                .contains("cannot read")
        );
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
        for (path, texture) in paths.iter().zip(read_textures(&paths).unwrap()) {
            // The suite's names that start with x are broken on purpose.
            let broken = path.file_name().unwrap().to_str().unwrap().starts_with('x');
            assert_eq!(texture.is_err(), broken, "{}: {:?}", path.display(), texture.map(|_| ()));
        }
    }
}
