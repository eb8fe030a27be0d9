//! The bytes of images and masks in an E57 file, and their pixels. Errors are sentences without a subject.

use crate::camera::picture::check_picture_bytes;
use crate::camera::programs::e57::E57File;
use crate::guarded::guarded;
use crate::image::texture::decode_texture;
use e57::Blob;
use image::{ImageReader, Limits};
use s3d_geom::Raster;
use std::io::Cursor;

/// Reads a blob. Its checksums are checked.
pub(super) fn read_blob(file: &mut E57File, blob: &Blob) -> Result<Vec<u8>, String> {
    if blob.length > file.size || blob.offset > file.size {
        return Err(format!(
            "claims {} bytes at byte {} of a file of {} bytes, which is cut short",
            blob.length, blob.offset, file.size
        ));
    }

    // The reader belongs to another crate, and panics on some damaged files.
    let mut bytes = Vec::new();
    guarded(|| file.reader.blob(blob, &mut bytes))
        .ok_or("is damaged")?
        .map_err(|e| format!("cannot be read: {e}"))?;
    if bytes.len() as u64 != blob.length {
        return Err(format!("claims {} bytes, and {} of them are there", blob.length, bytes.len()));
    }
    Ok(bytes)
}

/// Checks the size of an image and its end, like [`check_picture`](crate::camera::check_picture).
pub(super) fn check_image(bytes: &[u8], size: [u32; 2]) -> Result<(), String> {
    check_size(check_picture_bytes(bytes)?, size, "its projection")
}

/// Checks the size of a mask and its end.
pub(super) fn check_mask(bytes: &[u8], size: [u32; 2]) -> Result<(), String> {
    let found = check_picture_bytes(bytes).map_err(|message| format!("its mask {message}"))?;
    check_size(found, size, "the image").map_err(|message| format!("its mask {message}"))
}

fn check_size(found: [u32; 2], size: [u32; 2], owner: &str) -> Result<(), String> {
    if found == size {
        return Ok(());
    }
    let [w, h] = found;
    let [width, height] = size;
    Err(format!("has {w} × {h} pixels, and {owner} is for {width} × {height}"))
}

/// Decodes an image of the size that its projection is for.
pub(super) fn decode_image(bytes: Vec<u8>, size: [u32; 2]) -> Result<Raster<[u8; 3]>, String> {
    // The size is checked before the pixels take memory.
    check_image(&bytes, size)?;
    let image = decode_texture(bytes).map_err(|fault| fault.to_string())?.image;
    check_size([image.width(), image.height()], size, "its projection")?;
    Ok(image)
}

/// Decodes a mask: 255 where any colour of it is above 0, else 0. What its alpha channel says does not count.
pub(super) fn decode_mask(bytes: &[u8], size: [u32; 2]) -> Result<Raster<u8>, String> {
    check_mask(bytes, size)?;
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| format!("its mask cannot be read: {e}"))?;
    // The size was checked, and a pixel has 16 bytes at most.
    let count = u64::from(size[0]).saturating_mul(u64::from(size[1]));
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(count.saturating_mul(16).saturating_add(64 << 20));
    reader.limits(limits);

    let image = guarded(|| reader.decode())
        .ok_or("its mask is damaged")?
        .map_err(|e| format!("its mask cannot be decoded: {e}"))?;
    check_size([image.width(), image.height()], size, "the image")?;

    let color = image.color();
    let channels = usize::from(color.channel_count());
    let bytes_per_pixel = usize::from(color.bytes_per_pixel());
    let color_channels = channels - usize::from(color.has_alpha());
    let color_bytes = bytes_per_pixel / channels * color_channels;
    let pixels = image.as_bytes().chunks_exact(bytes_per_pixel);
    let mask = pixels.map(|pixel| {
        if pixel.iter().take(color_bytes).all(|b| *b == 0) {
            0
        } else {
            255
        }
    });
    Ok(Raster::from_vec(size[0], size[1], mask.collect()))
}
