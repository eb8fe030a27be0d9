//! Finds JPEG files that are cut off. The decoder draws missing rows in grey, without an error.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::guarded::guarded;
use memchr::memchr;
use s3d_geom::Raster;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The grey that the decoder draws for missing rows.
const NOTHING: u8 = 128;

/// The fewest zeros at the end of a file that cannot belong to a picture.
const FILL: usize = 32;

/// The number of bytes that the decoder reads ahead.
const AHEAD: usize = 16;

/// Describes what is missing of a JPEG that was decoded to `image`: a sentence that follows its name. Returns
/// `None` for a whole picture.
///
/// The file is decoded once more only if it does not end with its end mark, or if the last row of `image`
/// looks empty.
pub(crate) fn missing(bytes: &[u8], image: &Raster<[u8; 3]>) -> Option<String> {
    let JpegEnd { at, is_progressive } = end(bytes);
    let data = match at {
        // Missing scans leave no trace in the last row.
        Some(_) if is_progressive || !ends_alike(image) => return None,
        // The decoder reads zeros after an end mark, without an error. The mark is cut off, so that it
        // notices the end.
        Some(at) => [bytes.get(..at).unwrap_or(bytes), &[0; AHEAD]].concat(),
        None => bytes.to_vec(),
    };
    if decode(&data, true).is_some() {
        return None;
    }

    let height = usize::try_from(image.height()).ok()?;
    let rows = decode(&data, false).map_or(0, |samples| {
        let row = samples.len().checked_div(height).unwrap_or(0).max(1);
        let missing = samples
            .rchunks(row)
            .take_while(|row| row.iter().all(|sample| *sample == NOTHING));
        height.saturating_sub(missing.count())
    });

    Some(match at {
        Some(_) => format!("is damaged: about {rows} of its {height} rows are there"),
        None if is_progressive && rows > 0 => {
            "is cut off: it is a progressive JPEG, of which only a coarse picture is there".to_owned()
        }
        None => format!("is cut off: about {rows} of its {height} rows are there"),
    })
}

/// Returns whether the last row repeats itself, as a row does that is decoded from zeros. Its two ends do not
/// count.
fn ends_alike(image: &Raster<[u8; 3]>) -> bool {
    const BLOCK: usize = 16;
    let width = usize::try_from(image.width()).unwrap_or(usize::MAX).max(1);
    let row = image.pixels().rchunks(width).next().unwrap_or_default();
    let middle = row.get(BLOCK..width.saturating_sub(BLOCK)).unwrap_or_default();
    middle.iter().zip(middle.iter().skip(BLOCK)).all(|(a, b)| a == b)
}

/// Returns a JPEG without the zeros at its end. A download that reserves its size and is cut off leaves them,
/// and the decoder would take them for a picture.
pub(crate) fn without_fill(bytes: &[u8]) -> &[u8] {
    let zeros = bytes.iter().rev().take_while(|b| **b == 0).count();
    if zeros < FILL || end(bytes).at.is_some() {
        return bytes;
    }
    bytes.get(..bytes.len().saturating_sub(zeros)).unwrap_or(bytes)
}

/// How a JPEG ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct JpegEnd {
    /// The position of the end mark, if there is one.
    at: Option<usize>,
    /// Whether the picture is progressive: each scan refines all rows.
    is_progressive: bool,
}

/// Follows the segments of a JPEG to its end mark. Source: ITU-T T.81, annex B.
fn end(bytes: &[u8]) -> JpegEnd {
    let mut is_progressive = false;
    // The start mark comes first.
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let Some(at) = memchr(0xff, rest) {
        let from = rest.get(at..).unwrap_or_default();
        rest = from.get(1..).unwrap_or_default();
        let Some((&mark, after)) = rest.split_first() else { break };
        match mark {
            0xd9 => {
                return JpegEnd { at: Some(bytes.len().saturating_sub(from.len())), is_progressive };
            }
            // A fill byte; the next byte is the mark.
            0xff => {}
            // An escaped byte of the picture, or a mark without a segment.
            0x00 | 0x01 | 0xd0..=0xd8 => rest = after,
            _ => {
                is_progressive |= mark == 0xc2;
                let length = after.first_chunk().map_or(0, |n| usize::from(u16::from_be_bytes(*n)));
                rest = after.get(length..).unwrap_or_default();
            }
        }
    }
    JpegEnd { at: None, is_progressive }
}

/// Decodes the samples. Returns `None` if nothing can be decoded, or if `strict` and something is missing.
fn decode(bytes: &[u8], strict: bool) -> Option<Vec<u8>> {
    let options = DecoderOptions::default()
        .set_strict_mode(strict)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    guarded(move || decoder.decode().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::texture::decode_texture;
    use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};
    use std::fs;
    use std::io::Cursor;
    use std::path::Path;

    /// Encodes a picture of noise, so that every row takes its share of the bytes.
    fn noise(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let image = ImageBuffer::from_fn(width, height, |x, y| {
            let n = x.wrapping_mul(374_761_393).wrapping_add(y.wrapping_mul(668_265_263));
            let n = (n ^ n >> 13).wrapping_mul(1_274_126_177);
            Rgb([(n >> 8) as u8, (n >> 16) as u8, (n >> 24) as u8])
        });
        DynamicImage::from(image)
            .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Jpeg)
            .unwrap();
        bytes
    }

    fn fault(bytes: Vec<u8>) -> Option<String> {
        decode_texture(bytes).err().map(|fault| fault.to_string())
    }

    #[test]
    fn a_cut_picture_is_told_with_its_rows() {
        let whole = noise(64, 640);
        assert_eq!(fault(whole.clone()), None);
        for percent in [5, 20, 50, 80, 95] {
            let cut = whole[..whole.len() * percent / 100].to_vec();
            // A download that reserved its size leaves zeros at the end.
            let filled = [&cut[..], &vec![0; whole.len() - cut.len()]].concat();
            // Repair tools add an end mark.
            let ended = [&cut[..], b"\xff\xd9"].concat();
            for (bytes, word) in [(cut, "cut off"), (filled, "cut off"), (ended, "damaged")] {
                let message = fault(bytes).unwrap_or_else(|| panic!("{percent} %, {word}"));
                let rows = message.split(' ').find_map(|word| word.parse::<usize>().ok()).unwrap();
                assert!(message.contains(word) && message.contains("of its 640 rows"), "{message}");
                assert!(rows.abs_diff(640 * percent / 100) <= 48, "{percent} %: {message}");
            }
        }
    }

    #[test]
    fn what_is_whole_is_read_whatever_is_behind_it() {
        let whole = noise(64, 64);
        assert_eq!(fault([&whole[..], b"SEFH of a camera"].concat()), None);
        // Only the end mark is lost.
        assert_eq!(fault(whole[..whole.len() - 2].to_vec()), None);
        // Pictures of one colour, even the grey of missing rows, take next to no bytes a row.
        for (width, height) in [(1, 1), (8, 8), (9, 200), (64, 64), (200, 17)] {
            for color in [[128u8; 3], [0; 3], [250, 3, 90]] {
                let image = DynamicImage::from(ImageBuffer::from_pixel(width, height, Rgb(color)));
                let mut plain = Vec::new();
                image.write_to(&mut Cursor::new(&mut plain), ImageFormat::Jpeg).unwrap();
                assert_eq!(fault(plain), None, "{width} × {height}, {color:?}");
            }
        }
    }

    /// With one, three and four channels, and progressive.
    #[test]
    fn every_kind_of_jpeg_is_told() {
        let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/texture");
        for name in ["base.jpg", "gray.jpg", "cmyk.jpg", "prog.jpg"] {
            let whole = fs::read(seeds.join(name)).unwrap();
            assert_eq!(fault(whole.clone()), None, "{name}");
            let scan = whole.windows(2).position(|w| w == b"\xff\xda").unwrap();
            let cut = whole[..scan + (whole.len() - scan) / 2].to_vec();
            let message = fault(cut).unwrap_or_else(|| panic!("{name}"));
            assert!(
                message.contains("cut off") || message.contains("cannot be decoded"),
                "{name}: {message}"
            );
        }
    }

    #[test]
    fn pictures_in_the_header_do_not_end_the_file() {
        let whole = noise(16, 16);
        let thumbnail = [b"\xff\xe1\0\x08\xff\xd8\xff\xd9\0\0", &whole[2..]].concat();
        let with = [&whole[..2], &thumbnail].concat();
        assert_eq!(end(&with).at, Some(with.len() - 2));
        assert_eq!(end(&with[..with.len() - 2]).at, None);
        assert_eq!(
            [&b""[..], b"\xff\xd8\xff", b"\xff\xd8\xff\xc2\0"].map(|bytes| end(bytes).is_progressive),
            [false, false, true]
        );
    }
}
