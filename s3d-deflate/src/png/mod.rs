//! The filters of PNG, which subtract from each byte a prediction from its neighbours. Source: the PNG
//! specification, section 9.
//!
//! Why not the adaptive filter of the `png` crate: it makes normals 42 % larger and nothing smaller, and
//! takes twice the time. The crate also does not return filtered bytes (README, "Filters").

mod unfilter;

pub use unfilter::unfilter;

use crate::Error;
use crate::simd::{Compare, Kernel, dispatch};

/// The prediction of a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Filter {
    /// No prediction: the bytes stay.
    None,
    /// The byte of the pixel above.
    Up,
    /// One of the bytes of the pixels to the left, above and above left: the one nearest to left + above −
    /// above left.
    Paeth,
}

/// Filters the lines of an image, with `line` bytes per line and `pixel` bytes per pixel. Returns for each
/// line the number of the filter and then its bytes.
///
/// ```
/// use s3d_deflate::png::{Filter, filter};
///
/// // Two lines of three pixels of one byte: a plane that grows by 3 per column and 10 per line.
/// assert_eq!(filter(&[5, 8, 11, 15, 18, 21], 3, 1, Filter::Up)?, [2, 5, 8, 11, 2, 10, 10, 10]);
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
///
/// # Errors
/// [`Error::PartialLine`] if `bytes` are not whole lines, or a line is not whole pixels.
pub fn filter(bytes: &[u8], line: usize, pixel: usize, filter: Filter) -> Result<Vec<u8>, Error> {
    if line == 0 || !bytes.len().is_multiple_of(line) {
        return Err(Error::PartialLine { len: bytes.len(), line });
    }
    if pixel == 0 || !line.is_multiple_of(pixel) {
        return Err(Error::PartialLine { len: line, line: pixel });
    }
    Ok(dispatch(Filtering { bytes, line, pixel, filter }))
}

/// Returns true if `filtered` (the number of the filter and then its bytes) is the filtered form of `line`.
///
/// `above` is the line above; at the top of an image it is zeros. The filters of [`Filter`] are known; for
/// the other filters of PNG the result is `false`. This takes a fraction of the time of [`unfilter`] and a
/// comparison.
///
/// ```
/// use s3d_deflate::png::{Filter, filter, is_filtered};
///
/// let gray = [5, 8, 11, 15, 18, 21];
/// let lines = filter(&gray, 3, 1, Filter::Paeth)?;
/// assert!(is_filtered(&lines[4..], &gray[3..], &gray[..3], 1));
/// assert!(!is_filtered(&lines[4..], &[15, 18, 22], &gray[..3], 1));
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
pub fn is_filtered(filtered: &[u8], line: &[u8], above: &[u8], pixel: usize) -> bool {
    let Some((number, filtered)) = filtered.split_first() else { return false };
    if pixel == 0 || filtered.len() != line.len() || above.len() != line.len() || line.len() < pixel {
        return false;
    }
    match number {
        0 => filtered == line,
        2 | 4 => dispatch(Comparison { filtered, line, above, pixel, is_paeth: *number == 4 }),
        _ => false,
    }
}

struct Comparison<'a> {
    filtered: &'a [u8],
    line: &'a [u8],
    above: &'a [u8],
    pixel: usize,
    is_paeth: bool,
}

impl Kernel for Comparison<'_> {
    type Output = bool;
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) -> bool {
        let Self { filtered, line, above, pixel, is_paeth } = self;
        let as_above = |n: usize| {
            let bytes = filtered[..n].iter().zip(&line[..n]).zip(&above[..n]);
            let mut differ = 0;
            for ((filtered, here), above) in bytes {
                differ |= filtered ^ here.wrapping_sub(*above);
            }
            differ == 0
        };
        if !is_paeth {
            return as_above(line.len());
        }

        // Without a left neighbour, the prediction is the pixel above.
        let mut differ = u8::from(!as_above(pixel));
        let heres = filtered[pixel..].iter().zip(&line[pixel..]).zip(&above[pixel..]);
        for (((filtered, here), &above), (&left, &corner)) in heres.zip(line.iter().zip(above)) {
            differ |= filtered ^ here.wrapping_sub(expected(left, above, corner));
        }
        differ == 0
    }
}

struct Filtering<'a> {
    bytes: &'a [u8],
    line: usize,
    pixel: usize,
    filter: Filter,
}

impl Kernel for Filtering<'_> {
    type Output = Vec<u8>;
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) -> Vec<u8> {
        let Self { bytes, line, pixel, filter } = self;
        let mut out = vec![0; bytes.len() / line * (line + 1)];

        let first = vec![0; line];
        let mut above = first.as_slice();
        for (here, out) in bytes.chunks_exact(line).zip(out.chunks_exact_mut(line + 1)) {
            let Some((number, out)) = out.split_first_mut() else { continue };
            *number = match filter {
                Filter::None => 0,
                Filter::Up => 2,
                Filter::Paeth => 4,
            };
            match filter {
                Filter::None => out.copy_from_slice(here),
                Filter::Up => out
                    .iter_mut()
                    .zip(here.iter().zip(above))
                    .for_each(|(o, (h, a))| *o = h.wrapping_sub(*a)),
                Filter::Paeth => paeth(here, above, pixel, out),
            }
            above = here;
        }
        out
    }
}

#[inline(always)]
fn paeth(here: &[u8], above: &[u8], pixel: usize, out: &mut [u8]) {
    // Without a left neighbour, the prediction is the pixel above.
    for ((o, h), a) in out.iter_mut().zip(here).zip(above).take(pixel) {
        *o = h.wrapping_sub(*a);
    }
    let lefts = here.iter().zip(above);
    let heres = here[pixel..].iter().zip(&above[pixel..]);
    for ((o, (&here, &above)), (&left, &corner)) in out[pixel..].iter_mut().zip(heres).zip(lefts) {
        *o = here.wrapping_sub(expected(left, above, corner));
    }
}

/// Returns the prediction of Paeth's filter.
#[inline(always)]
fn expected(left: u8, above: u8, corner: u8) -> u8 {
    // The distances of left + above − corner from the three neighbours, in bytes: twice as many go into a
    // register as numbers of 16 bits.
    let from_left = distance(above, corner);
    let from_above = distance(left, corner);
    // If both are on one side of the corner, the corner is at least as far as each of them.
    let is_far = (above >= corner) == (left >= corner);
    let from_corner = if is_far {
        u8::MAX
    } else {
        distance(from_left, from_above)
    };
    let least = from_left.min(from_above).min(from_corner);
    let nearer = if from_above == least { above } else { corner };
    if from_left == least { left } else { nearer }
}

#[inline(always)]
fn distance(a: u8, b: u8) -> u8 {
    a.max(b).wrapping_sub(a.min(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_ramp_leaves_its_start_and_its_slope() {
        // Two lines of three pixels of one byte: a plane that grows by 3 per column and 10 per line.
        let plane = [5, 8, 11, 15, 18, 21];
        assert_eq!(filter(&plane, 3, 1, Filter::None).unwrap(), [0, 5, 8, 11, 0, 15, 18, 21]);
        assert_eq!(filter(&plane, 3, 1, Filter::Up).unwrap(), [2, 5, 8, 11, 2, 10, 10, 10]);
        // By Paeth, the first byte follows from above. The next is 3 more than the left one, 15, which is
        // nearer to 18 than 8 and 5.
        assert_eq!(filter(&plane, 3, 1, Filter::Paeth).unwrap(), [4, 5, 3, 3, 4, 10, 3, 3]);
    }

    fn plain_paeth(left: u8, above: u8, corner: u8) -> u8 {
        let plane = i16::from(left) + i16::from(above) - i16::from(corner);
        let far = |byte: u8| (plane - i16::from(byte)).abs();
        let nearer = if far(above) <= far(corner) { above } else { corner };
        if far(left) <= far(above) && far(left) <= far(corner) {
            left
        } else {
            nearer
        }
    }

    #[test]
    fn bytes_are_expected_as_the_specification_has_it() {
        for [left, above] in (0..=u16::MAX).map(u16::to_le_bytes) {
            let other = (0..=u8::MAX).find(|&c| expected(left, above, c) != plain_paeth(left, above, c));
            assert_eq!(other, None, "{left}, {above}");
        }
    }

    #[test]
    fn ties_go_to_the_left_and_then_above() {
        // left + above − corner is equally far from two of them.
        assert_eq!(expected(10, 10, 10), 10);
        assert_eq!(expected(12, 8, 10), 10);
        assert_eq!(expected(20, 10, 15), 15);
        assert_eq!(expected(7, 9, 7), 9);
        assert_eq!(expected(9, 7, 7), 9);
        assert_eq!(expected(0, 2, 1), 1);
        assert_eq!(expected(1, 3, 5), 1);
        assert_eq!(expected(3, 1, 5), 1);
    }

    proptest! {
        #[test]
        fn filtered_lines_are_known_again(
            (pixel, line, bytes) in (1usize..5, 1usize..30).prop_flat_map(|(pixel, width)| {
                let line = pixel * width;
                (Just(pixel), Just(line), proptest::collection::vec(any::<u8>(), 4 * line))
            }),
            (at, by) in (0usize..4, 1u8..),
        ) {
            let rows: Vec<&[u8]> = bytes.chunks(line).collect();
            for filters in [Filter::None, Filter::Up, Filter::Paeth] {
                let mut lines = filter(&bytes, line, pixel, filters).unwrap();
                let top = vec![0; line];
                let all = |lines: &[u8]| {
                    let upper = std::iter::once(top.as_slice()).chain(rows.iter().copied());
                    let known = lines.chunks(line + 1).zip(&rows).zip(upper);
                    known.map(|((f, row), above)| is_filtered(f, row, above, pixel)).collect::<Vec<_>>()
                };
                prop_assert_eq!(all(&lines), [true; 4]);

                // Change the first and the last byte of a line.
                for place in [1, line] {
                    let place = at * (line + 1) + place;
                    lines[place] = lines[place].wrapping_add(by);
                    let others: [bool; 4] = std::array::from_fn(|row| row != at);
                    prop_assert_eq!(all(&lines), others);
                    lines[place] = lines[place].wrapping_sub(by);
                }
            }
        }
    }

    fn filter_error(len: usize, line: usize, pixel: usize) -> Error {
        filter(&[0; 12][..len], line, pixel, Filter::Paeth).unwrap_err()
    }

    #[test]
    fn parts_of_lines_and_of_pixels_are_errors() {
        assert_eq!(filter_error(12, 5, 1), Error::PartialLine { len: 12, line: 5 });
        assert_eq!(filter_error(12, 0, 1), Error::PartialLine { len: 12, line: 0 });
        assert_eq!(filter_error(12, 4, 3), Error::PartialLine { len: 4, line: 3 });
        assert_eq!(filter_error(12, 4, 0), Error::PartialLine { len: 4, line: 0 });
        assert_eq!(filter(&[], 4, 2, Filter::Paeth), Ok(vec![]));
    }
}
