//! Writes JPEG files, and finds those that are cut off or damaged. The decoder draws something in any case,
//! without an error.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

mod bits;
mod encode;
mod scans;

pub use encode::encode_jpeg;

use crate::image::jpeg::scans::{Damage, damage};
use memchr::memchr;

/// The fewest zeros at the end of a file that cannot belong to a picture.
const FILL: usize = 32;

/// Describes what is missing of a JPEG of so many rows, or damaged: a sentence that follows its name. Returns
/// `None` for a whole picture.
pub(crate) fn fault(bytes: &[u8], height: u32) -> Option<String> {
    let what = damage(bytes)?;
    let (state, are) = match end(bytes) {
        Some(_) => ("damaged", "right"),
        None => ("cut off", "there"),
    };
    Some(match what {
        Damage::Row(rows) => format!("is {state}: about {rows} of its {height} rows are {are}"),
        Damage::Coarse => {
            format!("is {state}: it is a progressive JPEG, of which only a coarse picture is {are}")
        }
        Damage::TooLong => format!("is {state}: it has data behind its last row"),
        Damage::MissingComponents => format!("is {state}: some of its colours are missing"),
    })
}

/// Returns a JPEG without the zeros at its end. A download that reserves its size and is cut off leaves them,
/// and the decoder would take them for a picture.
pub(crate) fn without_fill(bytes: &[u8]) -> &[u8] {
    let zeros = bytes.iter().rev().take_while(|b| **b == 0).count();
    if zeros < FILL || end(bytes).is_some() {
        return bytes;
    }
    bytes.get(..bytes.len().saturating_sub(zeros)).unwrap_or(bytes)
}

/// Follows the segments of a JPEG to its end mark, and returns its position. Source: ITU-T T.81, annex B.
fn end(bytes: &[u8]) -> Option<usize> {
    // The start mark comes first.
    let mut rest = bytes.get(2..).unwrap_or_default();
    loop {
        let at = memchr(0xff, rest)?;
        let from = rest.get(at..).unwrap_or_default();
        rest = from.get(1..).unwrap_or_default();
        let (&mark, after) = rest.split_first()?;
        match mark {
            0xd9 => return Some(bytes.len().saturating_sub(from.len())),
            // A fill byte; the next byte is the mark.
            0xff => {}
            // An escaped byte of the picture, or a mark without a segment.
            0x00 | 0x01 | 0xd0..=0xd8 => rest = after,
            _ => {
                let length = after.first_chunk().map_or(0, |n| usize::from(u16::from_be_bytes(*n)));
                rest = after.get(length..).unwrap_or_default();
            }
        }
    }
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

    fn fault_of(bytes: Vec<u8>) -> Option<String> {
        decode_texture(bytes).err().map(|fault| fault.to_string())
    }

    #[test]
    fn a_cut_picture_is_told_with_its_rows() {
        let whole = noise(64, 640);
        assert_eq!(fault_of(whole.clone()), None);
        for percent in [5, 20, 50, 80, 95] {
            let cut = whole[..whole.len() * percent / 100].to_vec();
            // A download that reserved its size leaves zeros at the end.
            let filled = [&cut[..], &vec![0; whole.len() - cut.len()]].concat();
            // Repair tools add an end mark.
            let ended = [&cut[..], b"\xff\xd9"].concat();
            for (bytes, word) in [(cut, "cut off"), (filled, "cut off"), (ended, "damaged")] {
                let message = fault_of(bytes).unwrap_or_else(|| panic!("{percent} %, {word}"));
                let rows = message.split(' ').find_map(|word| word.parse::<usize>().ok()).unwrap();
                assert!(message.contains(word) && message.contains("of its 640 rows"), "{message}");
                assert!(rows.abs_diff(640 * percent / 100) <= 48, "{percent} %: {message}");
            }
        }
    }

    #[test]
    fn what_is_whole_is_read_whatever_is_behind_it() {
        let whole = noise(64, 64);
        assert_eq!(fault_of([&whole[..], b"SEFH of a camera"].concat()), None);
        // Only the end mark is lost.
        assert_eq!(fault_of(whole[..whole.len() - 2].to_vec()), None);
        // Pictures of one colour, even the grey of missing rows, take next to no bytes a row.
        for (width, height) in [(1, 1), (8, 8), (9, 200), (64, 64), (200, 17)] {
            for color in [[128u8; 3], [0; 3], [250, 3, 90]] {
                let image = DynamicImage::from(ImageBuffer::from_pixel(width, height, Rgb(color)));
                let mut plain = Vec::new();
                image.write_to(&mut Cursor::new(&mut plain), ImageFormat::Jpeg).unwrap();
                assert_eq!(fault_of(plain), None, "{width} × {height}, {color:?}");
            }
        }
    }

    /// With one, three and four channels, and progressive.
    #[test]
    fn every_kind_of_jpeg_is_told() {
        for name in ["base.jpg", "gray.jpg", "cmyk.jpg", "prog.jpg"] {
            let whole = seed(name);
            assert_eq!(fault_of(whole.clone()), None, "{name}");
            let scan = whole.windows(2).position(|w| w == b"\xff\xda").unwrap();
            let cut = whole[..scan + (whole.len() - scan) / 2].to_vec();
            let message = fault_of(cut).unwrap_or_else(|| panic!("{name}"));
            assert!(
                message.contains("cut off") || message.contains("cannot be decoded"),
                "{name}: {message}"
            );
        }
    }

    fn seed(name: &str) -> Vec<u8> {
        fs::read(
            Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("fuzz/seeds/texture")
                .join(name),
        )
        .unwrap()
    }

    fn positions(bytes: &[u8], mark: [u8; 2]) -> Vec<usize> {
        let found = bytes.windows(2).enumerate().filter(|(_, pair)| *pair == mark);
        found.map(|(at, _)| at).collect()
    }

    /// Changes eight bytes at each of 40 places in the scans, one place at a time. In a few cases, what comes
    /// out still makes sense.
    #[test]
    fn damage_inside_is_told() {
        for (name, whole, least) in [
            ("noise", noise(64, 640), 37),
            ("restart.jpg", seed("restart.jpg"), 25),
            ("refined.jpg", seed("refined.jpg"), 28),
        ] {
            assert_eq!(fault_of(whole.clone()), None, "{name}");
            let scan = positions(&whole, [0xff, 0xda])[0] + 14;
            let told = (0..40_usize).filter(|place| {
                let mut bytes = whole.clone();
                let at = scan + (bytes.len() - 10 - scan) * place / 40;
                bytes[at..at + 8].iter_mut().for_each(|byte| *byte ^= 0x35);
                fault_of(bytes).is_some()
            });
            let told = told.count();
            assert!(told >= least, "{name}: {told} of 40");
        }
    }

    #[test]
    fn restart_marks_come_in_order() {
        let whole = seed("restart.jpg");
        let [first, second] = [0xd0, 0xd1].map(|mark| positions(&whole, [0xff, mark])[0]);
        let mut swapped = whole.clone();
        swapped.swap(first + 1, second + 1);
        let without = [&whole[..first], &whole[first + 2..]].concat();
        let too_long = [&whole[..second], &[0x5a], &whole[second..]].concat();
        for (bytes, rows) in [(swapped, 0), (without, 0), (too_long, 16)] {
            let message = fault_of(bytes).unwrap();
            assert_eq!(message, format!("is damaged: about {rows} of its 40 rows are right"));
        }
    }

    /// Some cameras fill up with zeros. Other bytes behind the last row are of rows that were lost.
    #[test]
    fn only_zeros_may_stand_before_the_end_mark() {
        for whole in [seed("base.jpg"), seed("refined.jpg")] {
            let before_end = whole.len() - 2;
            let with = |bytes: &[u8]| [&whole[..before_end], bytes, b"\xff\xd9"].concat();
            for padding in [&[0; 15][..], &[0xff; 3]] {
                assert_eq!(fault_of(with(padding)), None);
            }
            for rest in [&[0x5a][..], &[0; 17]] {
                let message = fault_of(with(rest)).unwrap();
                assert!(message.contains("damaged: it has data behind its last row"), "{message}");
            }
        }
    }

    #[test]
    fn pictures_in_the_header_do_not_end_the_file() {
        let whole = noise(16, 16);
        let thumbnail = [b"\xff\xe1\0\x08\xff\xd8\xff\xd9\0\0", &whole[2..]].concat();
        let with = [&whole[..2], &thumbnail].concat();
        assert_eq!(end(&with), Some(with.len() - 2));
        assert_eq!(end(&with[..with.len() - 2]), None);
        for bytes in [&b""[..], b"\xff\xd8\xff", b"\xff\xd8\xff\xc2\0"] {
            assert_eq!((end(bytes), damage(bytes)), (None, None));
        }
    }
}
