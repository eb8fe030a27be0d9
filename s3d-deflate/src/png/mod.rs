//! PNG's filters: each byte less what its neighbours let expect. Source: the PNG specification, section 9.
//!
//! Why not the `png` crate's adaptive filter: it makes normals 42 % larger and nothing smaller, takes twice
//! the time, and filtered bytes cannot be had from that crate (README, "Filters").

mod unfilter;

pub use unfilter::unfilter;

use crate::Error;
use crate::simd::{Compare, Kernel, dispatch};

/// What a byte is expected to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Filter {
    /// Nothing is expected: the bytes stay.
    None,
    /// As the pixel above.
    Up,
    /// As that of the neighbours to the left, above and between them that is nearest to the plane through
    /// them.
    Paeth,
}

/// The lines of an image, `line` bytes each and `pixel` bytes a pixel, filtered: for each line the filter's
/// number and then its bytes.
///
/// ```
/// use s3d_deflate::png::{Filter, filter};
///
/// // Two lines of three pixels of one byte: a plane, 3 a column and 10 a line.
/// assert_eq!(filter(&[5, 8, 11, 15, 18, 21], 3, 1, Filter::Up)?, [2, 5, 8, 11, 2, 10, 10, 10]);
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
///
/// # Errors
/// [`Error::PartialLine`] if `bytes` are not whole lines, or a line not whole pixels.
pub fn filter(bytes: &[u8], line: usize, pixel: usize, filter: Filter) -> Result<Vec<u8>, Error> {
    if line == 0 || !bytes.len().is_multiple_of(line) {
        return Err(Error::PartialLine { len: bytes.len(), line });
    }
    if pixel == 0 || !line.is_multiple_of(pixel) {
        return Err(Error::PartialLine { len: line, line: pixel });
    }
    Ok(dispatch(Filtering { bytes, line, pixel, filter }))
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
                Filter::Up => {
                    out.iter_mut().zip(here.iter().zip(above)).for_each(|(o, (h, a))| *o = h.wrapping_sub(*a))
                }
                Filter::Paeth => paeth(here, above, pixel, out),
            }
            above = here;
        }
        out
    }
}

#[inline(always)]
fn paeth(here: &[u8], above: &[u8], pixel: usize, out: &mut [u8]) {
    // Without a left neighbour, the one above is the nearest.
    for ((o, h), a) in out.iter_mut().zip(here).zip(above).take(pixel) {
        *o = h.wrapping_sub(*a);
    }
    let lefts = here.iter().zip(above);
    let heres = here[pixel..].iter().zip(&above[pixel..]);
    for ((o, (&here, &above)), (&left, &corner)) in out[pixel..].iter_mut().zip(heres).zip(lefts) {
        *o = here.wrapping_sub(expected(left, above, corner));
    }
}

#[inline(always)]
fn expected(left: u8, above: u8, corner: u8) -> u8 {
    let [l, a, c] = [left, above, corner].map(i16::from);
    // How far the plane's value, l + a − c, is from each of them.
    let (from_left, from_above, from_corner) = ((a - c).abs(), (l - c).abs(), (l + a - 2 * c).abs());
    let nearer = if from_above <= from_corner { above } else { corner };
    if from_left <= from_above && from_left <= from_corner { left } else { nearer }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_leaves_its_start_and_its_slope() {
        // Two lines of three pixels of one byte: a plane, 3 a column and 10 a line.
        let plane = [5, 8, 11, 15, 18, 21];
        assert_eq!(filter(&plane, 3, 1, Filter::None).unwrap(), [0, 5, 8, 11, 0, 15, 18, 21]);
        assert_eq!(filter(&plane, 3, 1, Filter::Up).unwrap(), [2, 5, 8, 11, 2, 10, 10, 10]);
        // By Paeth: from above; then 3 more than the left, as that is nearest to 18 of 15, 8 and 5.
        assert_eq!(filter(&plane, 3, 1, Filter::Paeth).unwrap(), [4, 5, 3, 3, 4, 10, 3, 3]);
    }

    #[test]
    fn ties_go_to_the_left_and_then_above() {
        // left + above − corner is as far from both of them.
        assert_eq!(expected(10, 10, 10), 10);
        assert_eq!(expected(12, 8, 10), 10);
        assert_eq!(expected(20, 10, 15), 15);
        assert_eq!(expected(7, 9, 7), 9);
        assert_eq!(expected(9, 7, 7), 9);
        assert_eq!(expected(0, 2, 1), 1);
        assert_eq!(expected(1, 3, 5), 1);
        assert_eq!(expected(3, 1, 5), 1);
    }

    #[test]
    fn parts_of_lines_and_of_pixels_are_errors() {
        let error = |len, line, pixel| filter(&[0; 12][..len], line, pixel, Filter::Paeth).unwrap_err();
        assert_eq!(error(12, 5, 1), Error::PartialLine { len: 12, line: 5 });
        assert_eq!(error(12, 0, 1), Error::PartialLine { len: 12, line: 0 });
        assert_eq!(error(12, 4, 3), Error::PartialLine { len: 4, line: 3 });
        assert_eq!(error(12, 4, 0), Error::PartialLine { len: 4, line: 0 });
        assert_eq!(filter(&[], 4, 2, Filter::Paeth), Ok(vec![]));
    }
}
