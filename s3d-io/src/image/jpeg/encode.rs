//! Writes JPEG files.

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use s3d_geom::Raster;

/// Encodes 8-bit RGB as a JPEG file of this quality, from 1 to 100. The colours change a little: use PNG
/// where they are numbers.
///
/// # Panics
/// If the image has no pixel, or a side of more than 65,535.
#[expect(clippy::expect_used, reason = "a writer, into memory")]
pub fn encode_jpeg(image: &Raster<[u8; 3]>, quality: u8) -> Vec<u8> {
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality)
        .encode(image.pixels().as_flattened(), image.width(), image.height(), ExtendedColorType::Rgb8)
        .expect("memory takes any bytes");
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_back_nearly() {
        let pixels = (0..48 * 32)
            .map(|i| [(i % 48 * 5) as u8, (i / 48 * 7) as u8, 90])
            .collect();
        let image = Raster::from_vec(48, 32, pixels);
        let file = encode_jpeg(&image, 95);
        let back = image::load_from_memory(&file).unwrap().to_rgb8();
        assert_eq!(back.dimensions(), (48, 32));
        for (pixel, expected) in back.pixels().zip(image.pixels()) {
            for (channel, expected) in pixel.0.iter().zip(expected) {
                assert!(channel.abs_diff(*expected) <= 4, "{pixel:?} for {expected:?}");
            }
        }
    }
}
