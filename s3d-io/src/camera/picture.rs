//! Photographs: PNG and JPEG files of any kind.

use crate::error::{Error, Result};
use crate::fs::open::{open_file, read_file};
use crate::guarded::guarded;
#[cfg(feature = "e57")]
use crate::image::texture::texture_size;
use crate::image::texture::{TextureFault, decode_texture};
use image::metadata::Orientation;
use image::{ImageDecoder, ImageReader};
use s3d_geom::Raster;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::Path;

/// The bytes at the end of a file in which a picture's end mark is looked for. Cameras write a little after
/// the mark.
const TAIL: u64 = 1024;

/// Reads a PNG or JPEG file of any kind as 8-bit R G B.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file is not such an image, or is damaged.
pub fn read_picture(path: &Path) -> Result<Raster<[u8; 3]>> {
    decode_picture(read_file(path)?, path)
}

/// Reads like [`read_picture`], from the file's bytes. Errors call the file `name`.
///
/// # Errors
/// Like [`read_picture`].
pub fn decode_picture(bytes: Vec<u8>, name: &Path) -> Result<Raster<[u8; 3]>> {
    let texture = decode_texture(bytes).map_err(|fault| match fault {
        TextureFault::TooLarge(message) => Error::unsupported(name, message),
        TextureFault::Unreadable(message) => Error::format(name, message),
    })?;
    Ok(texture.image)
}

/// Returns the width and height of a PNG or JPEG file in pixels, from its header.
///
/// # Errors
/// Like [`read_picture`].
pub fn read_picture_size(path: &Path) -> Result<(u32, u32)> {
    size_of(BufReader::new(open_file(path)?), path)
}

/// Returns the size of the picture that `encoded` holds. Errors call it `name`.
fn size_of(encoded: impl BufRead + Seek, name: &Path) -> Result<(u32, u32)> {
    let reader = ImageReader::new(encoded)
        .with_guessed_format()
        .map_err(|e| Error::io(name, "read", e))?;
    let size =
        guarded(|| reader.into_dimensions()).ok_or_else(|| unreadable(name, "its header is damaged"))?;
    size.map_err(|e| unreadable(name, &e.to_string()))
}

/// Returns how a PNG or JPEG file asks to be turned before it is shown, as EXIF numbers it: 1 as it is, 3
/// upside down, 6 and 8 on a side; 2, 4, 5 and 7 are also mirrored. Returns 1 if the file does not say.
///
/// [`read_picture`] returns the pixels as they are stored, because programs that reconstruct from photographs
/// do the same.
///
/// # Errors
/// Like [`read_picture`].
pub fn read_picture_turn(path: &Path) -> Result<u8> {
    turn_of(BufReader::new(open_file(path)?), path)
}

/// Returns how the picture that `encoded` holds asks to be turned. Errors call it `name`.
pub(crate) fn turn_of(encoded: impl BufRead + Seek, name: &Path) -> Result<u8> {
    let reader = ImageReader::new(encoded)
        .with_guessed_format()
        .map_err(|e| Error::io(name, "read", e))?;
    let turn = guarded(|| reader.into_decoder()?.orientation())
        .ok_or_else(|| unreadable(name, "its header is damaged"))?;
    turn.map(Orientation::to_exif)
        .map_err(|e| unreadable(name, &e.to_string()))
}

/// Returns the size like [`read_picture_size`], and checks that the picture is complete.
///
/// A file without an end mark is decoded, and is an error if rows are missing. The check is quick for all
/// other files.
///
/// # Errors
/// Like [`read_picture`].
pub fn check_picture(path: &Path) -> Result<(u32, u32)> {
    check_encoded(&mut BufReader::new(open_file(path)?), path)
}

/// Checks like [`check_picture`], the picture that `encoded` holds. Errors call it `name`.
pub(crate) fn check_encoded(encoded: &mut (impl BufRead + Seek), name: &Path) -> Result<(u32, u32)> {
    let size = size_of(&mut *encoded, name)?;
    let failed = |e| Error::io(name, "read", e);

    let length = encoded.seek(SeekFrom::End(0)).map_err(failed)?;
    let mut tail = Vec::new();
    encoded
        .seek(SeekFrom::Start(length.saturating_sub(TAIL)))
        .map_err(failed)?;
    encoded.read_to_end(&mut tail).map_err(failed)?;

    if !has_end(&tail) {
        let mut whole = Vec::new();
        encoded.rewind().map_err(failed)?;
        encoded.read_to_end(&mut whole).map_err(failed)?;
        decode_picture(whole, name)?;
    }
    Ok(size)
}

/// Tells whether the last bytes of a picture hold its end mark. A PNG ends with the chunk IEND, a JPEG with
/// the mark FF D9.
fn has_end(tail: &[u8]) -> bool {
    tail.windows(4).any(|w| w == b"IEND") || tail.windows(2).any(|w| w == b"\xff\xd9")
}

/// Returns the width and height of a picture in pixels, and checks that it is complete, like
/// [`check_picture`]. The error is a sentence without a subject.
#[cfg(feature = "e57")]
pub(crate) fn check_picture_bytes(bytes: &[u8]) -> std::result::Result<[u32; 2], String> {
    let size = texture_size(bytes).map_err(|fault| fault.to_string())?;
    let tail_start = bytes.len().saturating_sub(TAIL as usize);
    if !bytes.get(tail_start..).is_some_and(has_end) {
        decode_texture(bytes.to_vec()).map_err(|fault| fault.to_string())?;
    }
    Ok(size)
}

fn unreadable(path: &Path, why: &str) -> Error {
    Error::format(path, format!("is no picture that can be read: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};

    /// Returns the JPEG with an EXIF block that says how it is to be turned.
    fn turned(jpeg: &[u8], turn: u8) -> Vec<u8> {
        let tiff =
            [b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(), &[turn, 0, 0, 0, 0, 0, 0]];
        let exif = [b"Exif\0\0".as_slice(), &tiff.concat()].concat();
        let length = (exif.len() as u16 + 2).to_be_bytes();
        [&jpeg[..2], &[0xff, 0xe1], &length, &exif, &jpeg[2..]].concat()
    }

    #[test]
    fn how_a_picture_is_to_be_turned_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("photo.jpg");
        let image = DynamicImage::from(ImageBuffer::from_pixel(24, 16, Rgb([50u8, 60, 70])));
        image.save_with_format(&path, ImageFormat::Jpeg).unwrap();
        assert_eq!(read_picture_turn(&path).unwrap(), 1);

        let plain = std::fs::read(&path).unwrap();
        for turn in 1..=8 {
            std::fs::write(&path, turned(&plain, turn)).unwrap();
            assert_eq!(read_picture_turn(&path).unwrap(), turn);
            // The pixels are returned as they are stored.
            assert_eq!(check_picture(&path).unwrap(), (24, 16));
            let read = read_picture(&path).unwrap();
            assert_eq!((read.width(), read.height()), (24, 16));
        }

        image.save_with_format(&path, ImageFormat::Png).unwrap();
        assert_eq!(read_picture_turn(&path).unwrap(), 1);
        std::fs::write(&path, b"none").unwrap();
        assert!(
            read_picture_turn(&path)
                .unwrap_err()
                .to_string()
                .contains("no picture that can be read")
        );
    }

    #[test]
    fn cut_pictures_are_errors_before_they_are_needed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("photo");
        let image = ImageBuffer::from_fn(64, 32, |x, y| Rgb([(x * 37 % 256) as u8, (y * 91 % 256) as u8, 7]));
        let image = DynamicImage::from(image);
        for (format, words) in
            [(ImageFormat::Jpeg, "of its 32 rows are there"), (ImageFormat::Png, "cannot be decoded")]
        {
            image.save_with_format(&path, format).unwrap();
            assert_eq!(check_picture(&path).unwrap(), (64, 32));
            let whole = std::fs::read(&path).unwrap();
            std::fs::write(&path, &whole[..whole.len() * 7 / 10]).unwrap();
            assert_eq!(read_picture_size(&path).unwrap(), (64, 32));
            for fault in [check_picture(&path).unwrap_err(), read_picture(&path).unwrap_err()] {
                assert!(fault.to_string().contains(words), "{fault}");
            }
            // A file that only seems to have no end is decoded: much is written after the end here.
            std::fs::write(&path, [&whole[..], &[1; 2 * TAIL as usize]].concat()).unwrap();
            assert_eq!(check_picture(&path).unwrap(), (64, 32));
        }
    }
}
