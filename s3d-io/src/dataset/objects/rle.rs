//! The run lengths by which COCO writes masks.
//!
//! Pixels are counted column by column. Runs of pixels outside and inside of the mask take turns, the first
//! is outside. In the text each run is a number of 5 bits a character, the lowest first: bit 5 says that
//! more follow, bit 4 of the last is its sign, and 48 is added. From the fourth on, runs are differences to
//! the run two before. Source: cocodataset/cocoapi, `common/maskApi.c`, `rleToString` and `rleFrString`.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A mask in COCO's compressed run lengths, as `pycocotools.mask.decode` takes it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunLengths {
    /// Height and width of the image.
    pub size: [u32; 2],
    /// The runs as text.
    pub counts: String,
}

impl RunLengths {
    /// Encodes the mask of an image of `size` (width, height). Pixel (x, y) has the number x · height + y;
    /// `stretches` are the numbers of the mask's pixels, sorted, and within the image.
    pub fn encode(size: [u32; 2], stretches: &[Range<u64>]) -> Self {
        let [width, height] = size;
        let pixels = u64::from(width) * u64::from(height);
        let mut runs = Vec::new();
        let mut at = 0;
        for stretch in stretches {
            runs.push(stretch.start.saturating_sub(at));
            runs.push(stretch.end.saturating_sub(stretch.start));
            at = stretch.end;
        }
        if at < pixels || runs.is_empty() {
            runs.push(pixels.saturating_sub(at));
        }

        let mut counts = String::new();
        for (place, run) in runs.iter().enumerate() {
            let before = if place > 2 {
                runs.get(place - 2).copied().unwrap_or(0)
            } else {
                0
            };
            push_number(&mut counts, (*run as i64).wrapping_sub(before as i64));
        }
        Self { size: [height, width], counts }
    }

    /// Returns the stretches of pixels, as [`RunLengths::encode`] takes them. Returns `None` if the text is
    /// no mask of an image of this size.
    pub fn decode(&self) -> Option<Vec<Range<u64>>> {
        let pixels = self.size.iter().map(|side| u64::from(*side)).product();
        let mut runs: Vec<u64> = Vec::new();
        let mut stretches = Vec::new();
        let mut at = 0u64;

        let mut rest = self.counts.as_bytes();
        while !rest.is_empty() {
            let number = take_number(&mut rest)?;
            let place = runs.len();
            let before = if place > 2 { runs.get(place - 2).copied()? } else { 0 };
            let run = u64::try_from(number.checked_add_unsigned(before)?).ok()?;
            let end = at.checked_add(run).filter(|end| *end <= pixels)?;
            if place % 2 == 1 && run > 0 {
                stretches.push(at..end);
            }
            runs.push(run);
            at = end;
        }
        (at == pixels).then_some(stretches)
    }
}

/// Appends a number.
fn push_number(text: &mut String, mut number: i64) {
    loop {
        let mut bits = (number & 0x1f) as u8;
        number >>= 5;
        // The sign of what is left is that of bit 4.
        let is_last = number == if bits & 0x10 == 0 { 0 } else { -1 };
        if !is_last {
            bits |= 0x20;
        }
        text.push(char::from(bits + 48));
        if is_last {
            return;
        }
    }
}

/// Takes a number from the front of a text. Returns `None` if it is none, or longer than 60 bits.
fn take_number(text: &mut &[u8]) -> Option<i64> {
    let mut number = 0i64;
    for place in 0..12 {
        let (first, rest) = text.split_first()?;
        *text = rest;
        let bits = first.checked_sub(48).filter(|bits| *bits < 64)?;
        number |= i64::from(bits & 0x1f) << (5 * place);
        if bits & 0x20 == 0 {
            let is_negative = bits & 0x10 != 0;
            return Some(if is_negative {
                number | (-1 << (5 * (place + 1)))
            } else {
                number
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn texts_are_those_of_pycocotools() {
        // pycocotools 2.0.11, mask.encode of images of 5 × 4 and 2,000 × 1,000.
        let text = |ends: &[[u64; 2]]| {
            let stretches: Vec<Range<u64>> = ends.iter().map(|[start, end]| *start..*end).collect();
            RunLengths::encode([5, 4], &stretches).counts
        };
        assert_eq!(text(&[]), "d0");
        assert_eq!(text(&[[0, 20]]), "0d0");
        assert_eq!(text(&[[3, 6], [9, 15]]), "33332");
        assert_eq!(text(&[[0, 1], [2, 3], [9, 12]]), "0110522");
        let large = RunLengths::encode([2000, 1000], &[100..1500, 3000..900_000, 900_005..900_006]);
        assert_eq!(large.counts, "T3h[1l^1`cZk0YaNiPdTOeVbQ1");
    }

    proptest! {
        #[test]
        fn masks_are_read_back(
            width in 1u32..50,
            height in 1u32..50,
            ends in prop::collection::btree_set(0u64..2500, 0..40),
        ) {
            let pixels = u64::from(width) * u64::from(height);
            let ends: Vec<u64> = ends.into_iter().filter(|end| *end <= pixels).collect();
            let stretches: Vec<Range<u64>> = ends.as_chunks::<2>().0.iter().map(|[a, b]| *a..*b).collect();
            let text = RunLengths::encode([width, height], &stretches);
            prop_assert_eq!(text.decode(), Some(stretches));
        }

        #[test]
        fn any_text_is_read_or_refused(counts in "[ -~]{0,40}", width in 0u32..9, height in 0u32..9) {
            if let Some(stretches) = (RunLengths { size: [height, width], counts }).decode() {
                prop_assert!(stretches.iter().all(|s| s.start < s.end && s.end <= u64::from(width * height)));
            }
        }
    }
}
