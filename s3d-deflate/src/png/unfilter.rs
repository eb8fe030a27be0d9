//! Removing the filters of PNG. Source: the PNG specification, section 9.
//!
//! In a line with Paeth's filter, each pixel waits for the pixel before. So several successive lines are
//! restored together, each a pixel behind the line above it: 16 bytes at a time, without a branch, about ten
//! times as fast.

use super::expected;
use crate::Error;
use crate::simd::{Compare, Kernel, dispatch};

/// Removes the filters from some lines of an image, in place. All five filters of PNG are known.
///
/// The lines are in the form that [`filter`](super::filter) returns: for each line the number of the filter,
/// which stays, and then `line` bytes, `pixel` bytes per pixel. `above` is the unfiltered line before the
/// first, without a number; at the top of an image it is `None`.
///
/// ```
/// use s3d_deflate::png::{Filter, filter, unfilter};
///
/// let gray = [5, 8, 11, 15, 18, 21];
/// let mut lines = filter(&gray, 3, 1, Filter::Paeth)?;
/// unfilter(&mut lines, None, 3, 1)?;
/// assert_eq!(lines, [4, 5, 8, 11, 4, 15, 18, 21]);
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
///
/// # Errors
/// [`Error::PartialLine`] if `lines` are not whole lines, `above` is not one line, or a line is not whole
/// pixels; [`Error::UnknownFilter`] if the number of a filter is above 4. Nothing is changed then.
pub fn unfilter(lines: &mut [u8], above: Option<&[u8]>, line: usize, pixel: usize) -> Result<(), Error> {
    if line == 0 || !lines.len().is_multiple_of(line + 1) {
        return Err(Error::PartialLine { len: lines.len(), line: line + 1 });
    }
    if pixel == 0 || !line.is_multiple_of(pixel) {
        return Err(Error::PartialLine { len: line, line: pixel });
    }
    if let Some(number) = lines.iter().step_by(line + 1).find(|number| **number > 4) {
        return Err(Error::UnknownFilter { number: *number });
    }

    let nothing;
    let mut above = match above {
        Some(above) if above.len() == line => above,
        Some(above) => return Err(Error::PartialLine { len: above.len(), line }),
        None => {
            nothing = vec![0; line];
            &nothing
        }
    };

    let together = match pixel {
        2 | 3 => 8,
        _ => usize::MAX,
    };
    let mut rest = lines;
    while !rest.is_empty() {
        let many = together.saturating_mul(line + 1);
        let is_wave = rest.len() >= many && rest[..many].iter().step_by(line + 1).all(|number| *number == 4);
        let (these, others) = rest.split_at_mut(if is_wave { many } else { line + 1 });
        match (is_wave, pixel) {
            (true, 2) => dispatch(Lines::<2, 2, 8, 16> { lines: these, above }),
            (true, _) => dispatch(Lines::<3, 4, 8, 32> { lines: these, above }),
            (false, _) => single(these, above, pixel),
        }
        above = &these[these.len() - line..];
        rest = others;
    }
    Ok(())
}

/// Restores one line with any filter, byte by byte. Tests compare the fast form with this one.
fn single(line: &mut [u8], above: &[u8], pixel: usize) {
    let Some((number, line)) = line.split_first_mut() else { return };
    let left = |line: &[u8], i: usize| i.checked_sub(pixel).map_or(0, |i| line[i]);
    match number {
        1 => (pixel..line.len()).for_each(|i| line[i] = line[i].wrapping_add(line[i - pixel])),
        2 => line
            .iter_mut()
            .zip(above)
            .for_each(|(here, above)| *here = here.wrapping_add(*above)),
        3 => (0..line.len()).for_each(|i| {
            line[i] = line[i].wrapping_add(((u16::from(left(line, i)) + u16::from(above[i])) / 2) as u8);
        }),
        4 => (0..line.len()).for_each(|i| {
            line[i] = line[i].wrapping_add(expected(left(line, i), above[i], left(above, i)));
        }),
        _ => {}
    }
}

/// The neighbours of the next pixels of lines that are restored together.
#[derive(Clone, Copy)]
struct Wave<const B: usize> {
    left: [u8; B],
    corner: [u8; B],
}

impl<const B: usize> Wave<B> {
    /// Returns the next pixel of each line, in `L` lanes per line. `above` is the pixel above the next pixel
    /// of the first line.
    #[inline(always)]
    fn step<const L: usize>(&mut self, above: u32, filtered: [u8; B]) -> [u8; B] {
        // The pixel of a line a step ago is now above the pixel of the next line.
        let mut up = [0; B];
        up[L..].copy_from_slice(&self.left[..B - L]);
        up[..L].copy_from_slice(&above.to_le_bytes()[..L]);
        let mut next = [0; B];
        for i in 0..B {
            next[i] = expected(self.left[i], up[i], self.corner[i]).wrapping_add(filtered[i]);
        }
        *self = Self { left: next, corner: up };
        next
    }
}

/// `R` lines with Paeth's filter. Pixels have `P` bytes, and take `L` of `B` lanes.
struct Lines<'a, const P: usize, const L: usize, const R: usize, const B: usize> {
    lines: &'a mut [u8],
    above: &'a [u8],
}

impl<const P: usize, const L: usize, const R: usize, const B: usize> Kernel for Lines<'_, P, L, R, B> {
    type Output = ();
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) {
        wave::<P, L, R, B>(self.lines, self.above);
    }
}

#[inline(always)]
fn wave<const P: usize, const L: usize, const R: usize, const B: usize>(lines: &mut [u8], above: &[u8]) {
    let above = above.as_chunks::<P>().0;
    let width = above.len();
    let mut rest = lines;
    let mut rows: [&mut [[u8; P]]; R] = std::array::from_fn(|_| {
        let (line, others) = std::mem::take(&mut rest).split_at_mut(1 + P * width);
        rest = others;
        line[1..].as_chunks_mut().0
    });

    // At the beginning and the end, not every line has a pixel. Before its first pixel, a line has zeros.
    let mut wave = Wave { left: [0; B], corner: [0; B] };
    let first = (R - 1).min(width);
    (0..first).for_each(|at| edge::<P, L, R, B>(&mut wave, &mut rows, above, at));

    if width >= R {
        let steps = width - first;
        let mut lag = R;
        let mut rows = rows.each_mut().map(|row| {
            lag -= 1;
            &mut row[lag..][..steps]
        });
        let above = &above[first..][..steps];

        // A local copy stays in registers.
        let mut here = wave;
        for x in 0..steps {
            let mut filtered = [0; B];
            for (r, row) in rows.iter().enumerate() {
                filtered[L * r..][..L].copy_from_slice(&load(&row[x]).to_le_bytes()[..L]);
            }
            let samples = here.step::<L>(load(&above[x]), filtered);
            for (r, row) in rows.iter_mut().enumerate() {
                row[x].copy_from_slice(&samples[L * r..][..P]);
            }
        }
        wave = here;
    }

    (first.max(width)..width + R - 1).for_each(|at| edge::<P, L, R, B>(&mut wave, &mut rows, above, at));
}

/// Makes a step in which line `r` is at its pixel `at - r`, if it has one.
#[inline(always)]
fn edge<const P: usize, const L: usize, const R: usize, const B: usize>(
    wave: &mut Wave<B>,
    rows: &mut [&mut [[u8; P]]; R],
    above: &[[u8; P]],
    at: usize,
) {
    let pixel = |r: usize| at.checked_sub(r);
    let mut filtered = [0; B];
    for (r, row) in rows.iter().enumerate() {
        let pixel = pixel(r).and_then(|x| row.get(x)).map_or(0, load);
        filtered[L * r..][..L].copy_from_slice(&pixel.to_le_bytes()[..L]);
    }
    let samples = wave.step::<L>(above.get(at).map_or(0, load), filtered);
    for (r, row) in rows.iter_mut().enumerate() {
        if let Some(here) = pixel(r).and_then(|x| row.get_mut(x)) {
            here.copy_from_slice(&samples[L * r..][..P]);
        }
    }
}

/// Loads a pixel of two or three bytes.
#[inline(always)]
fn load<const P: usize>(pixel: &[u8; P]) -> u32 {
    let low = u32::from(u16::from_le_bytes([pixel[0], pixel[1]]));
    if P == 3 { low | u32::from(pixel[2]) << 16 } else { low }
}

#[cfg(test)]
mod tests {
    use super::super::{Filter, filter};
    use super::*;
    use proptest::prelude::*;

    /// Restores one line after the other.
    fn plain(lines: &mut [u8], line: usize, pixel: usize) {
        let mut above = vec![0; line];
        for line in lines.chunks_exact_mut(line + 1) {
            single(line, &above, pixel);
            above.copy_from_slice(&line[1..]);
        }
    }

    proptest! {
        #[test]
        fn the_fast_form_is_the_plain_one(
            (pixel, width, lines) in (1usize..5, 1usize..30, 1usize..24).prop_flat_map(|(pixel, width, n)| {
                // Paeth's filter is more frequent than the others, and some lines have similar neighbours.
                let line = (prop_oneof![3 => Just(4u8), 1 => 0u8..5], prop_oneof![Just(3u8), Just(255u8)])
                    .prop_flat_map(move |(number, most)| {
                        proptest::collection::vec(0..=most, pixel * width)
                            .prop_map(move |bytes| [vec![number], bytes].concat())
                    });
                let lines = proptest::collection::vec(line, n).prop_map(|lines| lines.concat());
                (Just(pixel), Just(width), lines)
            }),
            cut in 0usize..24,
        ) {
            let line = pixel * width;
            let mut expected = lines.clone();
            plain(&mut expected, line, pixel);
            let mut whole = lines.clone();
            unfilter(&mut whole, None, line, pixel).unwrap();
            prop_assert_eq!(&whole, &expected);

            // The same in two parts.
            let mut parts = lines;
            let (first, second) = parts.split_at_mut((cut * (line + 1)).min(expected.len()));
            unfilter(first, None, line, pixel).unwrap();
            let above = (!first.is_empty()).then(|| &first[first.len() - line..]);
            unfilter(second, above, line, pixel).unwrap();
            prop_assert_eq!(parts, expected);
        }

        #[test]
        fn what_was_filtered_comes_back(bytes in proptest::collection::vec(any::<u8>(), 12 * 20)) {
            for by in [Filter::None, Filter::Up, Filter::Paeth] {
                for pixel in [1, 2, 3, 6] {
                    let mut lines = filter(&bytes, 12, pixel, by).unwrap();
                    unfilter(&mut lines, None, 12, pixel).unwrap();
                    let back: Vec<u8> = lines.chunks_exact(13).flat_map(|line| line[1..].to_vec()).collect();
                    prop_assert_eq!(&back, &bytes);
                }
            }
        }
    }

    fn unfilter_error(len: usize, above: Option<&[u8]>, line: usize, pixel: usize) -> Error {
        let mut lines = vec![0; len];
        unfilter(&mut lines, above, line, pixel).unwrap_err()
    }

    #[test]
    fn what_is_no_line_is_refused() {
        assert_eq!(unfilter_error(12, None, 4, 1), Error::PartialLine { len: 12, line: 5 });
        assert_eq!(unfilter_error(12, None, 0, 1), Error::PartialLine { len: 12, line: 1 });
        assert_eq!(unfilter_error(15, None, 4, 3), Error::PartialLine { len: 4, line: 3 });
        assert_eq!(unfilter_error(15, Some(&[0; 3]), 4, 2), Error::PartialLine { len: 3, line: 4 });
        let mut lines = [4, 1, 1, 5, 1, 1];
        assert_eq!(unfilter(&mut lines, None, 2, 2), Err(Error::UnknownFilter { number: 5 }));
        assert_eq!(lines, [4, 1, 1, 5, 1, 1]);
    }
}
