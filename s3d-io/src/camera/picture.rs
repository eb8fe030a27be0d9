//! Photographs: PNG and JPEG files of any kind.

use crate::error::{Error, Result};
use crate::fs::open::{open_file, read_file};
use crate::guarded::guarded;
use crate::image::texture::{TextureFault, decode_texture};
use image::ImageReader;
use s3d_geom::Raster;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The bytes at the end of a picture in which the mark of its end is looked for. Cameras write a little
/// behind it.
const TAIL: u64 = 1024;

/// Reads a PNG or JPEG file of any kind as 8-bit R G B.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no such image or is damaged.
pub fn read_picture(path: &Path) -> Result<Raster<[u8; 3]>> {
    decode_picture(read_file(path)?, path)
}

/// As [`read_picture`], from the file's bytes; errors call it `name`.
///
/// # Errors
/// As [`read_picture`].
pub fn decode_picture(bytes: Vec<u8>, name: &Path) -> Result<Raster<[u8; 3]>> {
    let texture = decode_texture(bytes).map_err(|fault| match fault {
        TextureFault::TooLarge(message) => Error::unsupported(name, message),
        TextureFault::Unreadable(message) => Error::format(name, message),
    })?;
    Ok(texture.image)
}

/// Width and height of a PNG or JPEG file, from its first bytes.
///
/// # Errors
/// As [`read_picture`].
pub fn read_picture_size(path: &Path) -> Result<(u32, u32)> {
    let file = BufReader::new(open_file(path)?);
    let reader = ImageReader::new(file).with_guessed_format().map_err(|e| Error::io(path, "read", e))?;
    let failed = |why: &str| Error::format(path, format!("is no picture that can be read: {why}"));
    let size = guarded(|| reader.into_dimensions()).ok_or_else(|| failed("its header is damaged"))?;
    size.map_err(|e| failed(&e.to_string()))
}

/// As [`read_picture_size`], of a picture that is there to its end: one that does not look so is decoded, and
/// is an error if rows of it are missing. Quick for all others.
///
/// # Errors
/// As [`read_picture`].
pub fn check_picture(path: &Path) -> Result<(u32, u32)> {
    let size = read_picture_size(path)?;
    let failed = |e| Error::io(path, "read", e);
    let mut file = open_file(path)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut tail = Vec::new();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL))).map_err(failed)?;
    file.read_to_end(&mut tail).map_err(failed)?;
    // The last chunk of a PNG, the last mark of a JPEG.
    let has_end = tail.windows(4).any(|w| w == b"IEND") || tail.windows(2).any(|w| w == b"\xff\xd9");
    if !has_end {
        read_picture(path)?;
    }
    Ok(size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};

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
            // What only seems to have no end is read: much is written behind it.
            std::fs::write(&path, [&whole[..], &[1; 2 * TAIL as usize]].concat()).unwrap();
            assert_eq!(check_picture(&path).unwrap(), (64, 32));
        }
    }
}
