//! Matches at fixed distances: the 32 smallest and 32 around a line, or half as many of each.
//!
//! A filtered smooth image repeats at these distances and hardly anywhere else. It has steps at nearly equal
//! intervals along a line, and again nearly below in the next line. So there are no hashes and no chains.
//! Every byte is compared with the bytes at all distances, which takes one or two comparisons of registers.
//!
//! The results are the bits of a mask. A match lasts as long as the masks of successive places have a bit in
//! common. Long matches are compared directly, so the masks inside them are not needed.
//!
//! Depth, normals and coordinates of a view take 15 ms, and 52 ms with libdeflate at the same or larger sizes
//! (bench `compressors`).

use crate::WINDOW;
use crate::alphabet::LONGEST_MATCH;
use crate::hash_matcher::common;
use crate::simd::{Compare, ROW, WIDTH, joined};
use std::array::from_fn;
use std::hint::select_unpredictable;
use std::ops::{BitAnd, BitOr, Not};

/// The number of fixed distances.
pub(crate) const FIXED: usize = 2 * WIDTH;
/// The number of places whose masks are made at a time.
const TILE: usize = 512;
/// The number of places after a match that went beyond the existing masks.
const SHORT_TILE: usize = 128;
/// The room for masks: as many as the fastest cache takes.
const ROOM: usize = 2048;
/// The length from which a match is compared directly, instead of by masks.
const ASKED: usize = 64;
/// The number of masks that the search for a match may read.
const AHEAD: usize = ASKED + 8;

/// The distances that agree at a place, as bits. The upper `N` bits are for the `N` smallest distances, from
/// the highest bit for distance 1. The lower `N` bits are for the distances from a line − `N` / 2 + 1 to a
/// line + `N` / 2.
pub(crate) trait Mask<const N: usize>:
    Copy + Default + PartialEq + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// All distances.
    const ALL: Self;
    /// The smallest distances.
    const NEAR: Self;
    /// Returns the mask of a place with this `byte`, from the `near` bytes before it and the bytes around it
    /// in the line `above`.
    fn agreeing<C: Compare>(compare: C, near: &[u8; N], above: &[u8; N], byte: u8) -> Self;
    /// Makes the masks of a row of places from `place` on. The bytes around the first place in the line above
    /// begin at `above`.
    fn agreeing_in_row<C: Compare>(
        compare: C,
        data: &[u8],
        place: usize,
        above: usize,
        masks: &mut [Self; ROW],
    );
    /// Returns the mask of a single distance, by its number.
    fn bit(number: usize) -> Self;
    /// Returns the number of the first distance. The mask must not be empty.
    fn first(self) -> usize;
    /// Returns the index in [`fixed_distances`] of the distance with this number.
    fn fixed(number: usize) -> usize;
}

impl Mask<WIDTH> for u64 {
    const ALL: Self = Self::MAX;
    const NEAR: Self = Self::MAX << WIDTH;

    #[inline(always)]
    fn agreeing<C: Compare>(compare: C, near: &[u8; WIDTH], above: &[u8; WIDTH], byte: u8) -> Self {
        u64::from(compare.equal(near, byte)) << WIDTH | u64::from(compare.equal(above, byte))
    }

    #[inline(always)]
    fn agreeing_in_row<C: Compare>(
        compare: C,
        data: &[u8],
        place: usize,
        above: usize,
        masks: &mut [Self; ROW],
    ) {
        compare.equal_in_two(bytes(data, place - WIDTH), bytes(data, above), bytes(data, place), masks);
    }

    #[inline(always)]
    fn bit(number: usize) -> Self {
        1 << 63 >> number
    }

    #[inline(always)]
    fn first(self) -> usize {
        self.leading_zeros() as usize % FIXED
    }

    #[inline(always)]
    fn fixed(number: usize) -> usize {
        number
    }
}

const HALF: usize = WIDTH / 2;

impl Mask<HALF> for u32 {
    const ALL: Self = Self::MAX;
    const NEAR: Self = Self::MAX << HALF;

    #[inline(always)]
    fn agreeing<C: Compare>(compare: C, near: &[u8; HALF], above: &[u8; HALF], byte: u8) -> Self {
        compare.equal(&joined(near, above), byte)
    }

    #[inline(always)]
    fn agreeing_in_row<C: Compare>(
        compare: C,
        data: &[u8],
        place: usize,
        above: usize,
        masks: &mut [Self; ROW],
    ) {
        compare.equal_in_halves(bytes(data, place - HALF), bytes(data, above), bytes(data, place), masks);
    }

    #[inline(always)]
    fn bit(number: usize) -> Self {
        1 << 31 >> number
    }

    #[inline(always)]
    fn first(self) -> usize {
        self.leading_zeros() as usize % WIDTH
    }

    #[inline(always)]
    fn fixed(number: usize) -> usize {
        // The half around the line is the middle of the full set around the line.
        number + (number & HALF) / 2 * 3
    }
}

/// The masks of the places in a piece of the data.
pub(crate) struct FixedDistanceMatcher<M> {
    masks: Vec<M>,
    /// The place of the first of `masks`.
    start: usize,
    /// The place after the last of `masks`.
    end: usize,
    line: usize,
    distances: [usize; FIXED],
}

/// A match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FixedMatch {
    /// 3 to [`LONGEST_MATCH`] bytes.
    pub(crate) length: usize,
    /// The index of the distance in [`fixed_distances`].
    pub(crate) index: usize,
}

/// Returns the fixed distances: the 32 smallest, and 32 around a line.
pub(crate) fn fixed_distances(line: usize) -> [usize; FIXED] {
    from_fn(|i| {
        if i < WIDTH {
            i + 1
        } else {
            (line + i + 1).saturating_sub(WIDTH + WIDTH / 2)
        }
    })
}

/// Returns `N` bytes of `data`.
#[inline(always)]
fn bytes<const N: usize>(data: &[u8], from: usize) -> &[u8; N] {
    data[from..].first_chunk().expect("they are there")
}

/// Returns true if all distances around a line are possible.
fn has_line(line: usize) -> bool {
    (WIDTH..=WINDOW - WIDTH / 2).contains(&line)
}

/// Returns the mask of a place. The first bytes of the data have fewer bytes before them, and the first line
/// has no line above.
#[inline(always)]
fn agreeing<C: Compare, M: Mask<N>, const N: usize>(compare: C, data: &[u8], place: usize, line: usize) -> M {
    let byte = data[place];
    let Some(near) = place.checked_sub(N) else {
        let agree = (0..place).filter(|number| data[place - 1 - number] == byte);
        return agree.fold(M::default(), |mask, number| mask | M::bit(number));
    };
    let near = bytes(data, near);
    match place.checked_sub(line + N / 2).filter(|_| has_line(line)) {
        Some(above) => M::agreeing(compare, near, bytes(data, above), byte),
        None => M::agreeing(compare, near, near, byte) & M::NEAR,
    }
}

impl<M> FixedDistanceMatcher<M> {
    /// Makes a matcher for lines of `line` bytes.
    pub(crate) fn new(line: usize) -> Self {
        Self { masks: Vec::new(), start: 0, end: 0, line, distances: fixed_distances(line) }
    }

    /// Begins at the place `start` of new data.
    pub(crate) fn begin<const N: usize>(&mut self, start: usize)
    where
        M: Mask<N>,
    {
        self.masks.resize(ROOM + AHEAD, M::default());
        self.start = start;
        self.end = start;
    }

    /// Makes the masks from `at` on, as far as a match at `at` needs them. `at` must not go back. Returns the
    /// place before which matches may now be searched.
    #[inline(always)]
    pub(crate) fn reach<C: Compare, const N: usize>(&mut self, compare: C, data: &[u8], at: usize) -> usize
    where
        M: Mask<N>,
    {
        if at + AHEAD > self.end && self.end < data.len() {
            self.advance(compare, data, at);
        }
        if self.end < data.len() {
            self.end + 1 - AHEAD
        } else {
            self.end
        }
    }

    /// Makes the masks of the next tile of places.
    #[inline(always)]
    fn advance<C: Compare, const N: usize>(&mut self, compare: C, data: &[u8], at: usize)
    where
        M: Mask<N>,
    {
        let mut tile = TILE;
        if at > self.end {
            // The places between are inside a match, and their masks are not needed.
            self.start += at - self.end;
            self.end = at;
            tile = SHORT_TILE;
        }

        // Without room, the masks from `at` on move to the front.
        if self.end + tile > self.start + ROOM {
            self.masks.copy_within(at - self.start..self.end - self.start, 0);
            self.start = at;
        }

        let from = self.end;
        self.end = data.len().min(from + tile);
        let (masks, behind) = self.masks[from - self.start..].split_at_mut(self.end - from);
        if self.end == data.len() {
            // Nothing agrees after the end of the data.
            behind[..AHEAD].fill(M::default());
        }

        // Whole rows of places are compared at once, other places one by one.
        let above = self.line + N / 2;
        let rows = if has_line(self.line) && from >= above {
            masks.len() / ROW * ROW
        } else {
            0
        };
        let (rows, others) = masks.split_at_mut(rows);
        for (row, place) in rows.as_chunks_mut().0.iter_mut().zip((from..).step_by(ROW)) {
            M::agreeing_in_row(compare, data, place, place - above, row);
        }
        for (mask, place) in others.iter_mut().zip(from + rows.len()..) {
            *mask = agreeing(compare, data, place, self.line);
        }
    }

    /// Returns the places that have been [`reach`](Self::reach)ed.
    #[inline(always)]
    pub(crate) fn places(&self) -> Places<'_, M> {
        Places { masks: &self.masks, start: self.start, line: self.line, distances: &self.distances }
    }
}

/// The masks of some places.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a, M> {
    masks: &'a [M],
    /// The place of the first of `masks`.
    start: usize,
    line: usize,
    distances: &'a [usize; FIXED],
}

impl<M> Places<'_, M> {
    /// Returns the first place from `at` to `until` with a match of three bytes, or `until` if there is none.
    #[inline(always)]
    pub(crate) fn next<const N: usize>(self, at: usize, until: usize) -> usize
    where
        M: Mask<N>,
    {
        let masks = &self.masks[at - self.start..until + 2 - self.start];
        at + masks
            .array_windows()
            .take_while(|&&[a, b, c]| a & b & c == M::default())
            .count()
    }

    /// Returns the longest match at `at`, which must have been [`reach`](FixedDistanceMatcher::reach)ed. The
    /// nearest distance wins a tie.
    #[inline(always)]
    pub(crate) fn longest<C: Compare, const N: usize, const SHORTEST: usize>(
        self,
        compare: C,
        data: &[u8],
        at: usize,
    ) -> Option<FixedMatch>
    where
        M: Mask<N>,
    {
        const { assert!(SHORTEST >= 3 && SHORTEST <= ASKED) };
        let none = M::default();
        let masks: &[M; AHEAD] = self.masks[at - self.start..].first_chunk().expect("they were reached");
        let mut agree = masks[..SHORTEST].iter().fold(M::ALL, |agree, &mask| agree & mask);
        if agree == none {
            return None;
        }

        // Four places at a time.
        let mut length = SHORTEST;
        let [mut first, mut second, mut third, mut fourth] = from_fn(|i| masks[length + i]);
        loop {
            let next = agree & (first & second & (third & fourth));
            if next == none {
                break;
            }
            agree = next;
            length += 4;
            if length >= ASKED {
                return Some(self.extended(compare, data, at, agree, length));
            }
            [first, second, third, fourth] = from_fn(|i| masks[length + i]);
        }

        // Up to three places more, without a branch.
        let one = agree & first;
        let two = one & second;
        let three = two & third;
        length += usize::from(one != none) + usize::from(two != none) + usize::from(three != none);
        let agree = select_unpredictable(one != none, one, agree);
        let agree = select_unpredictable(two != none, two, agree);
        let agree = select_unpredictable(three != none, three, agree);
        Some(FixedMatch { length, index: M::fixed(agree.first()) })
    }

    /// Returns the longest match at `at` among the distances that `agree` in the first `length` bytes.
    #[inline(always)]
    fn extended<C: Compare, const N: usize>(
        self,
        compare: C,
        data: &[u8],
        at: usize,
        mut agree: M,
        length: usize,
    ) -> FixedMatch
    where
        M: Mask<N>,
    {
        let here = at + length;
        let end = data.len().min(at + LONGEST_MATCH);
        let mut best = FixedMatch { length: 0, index: 0 };
        loop {
            let number = agree.first();
            let index = M::fixed(number);
            let longer = length + common(data, here, here - self.distances[index], end - here);
            if longer > best.length {
                best = FixedMatch { length: longer, index };
            }
            if at + best.length == end {
                return best;
            }

            // A longer match agrees in the next byte too.
            let next = agreeing::<_, M, N>(compare, data, at + best.length, self.line);
            agree = agree & next & !M::bit(number);
            if agree == M::default() {
                return best;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_simd::Scalar;

    /// The plain reference: every distance, byte by byte.
    fn reference(data: &[u8], at: usize, line: usize, n: usize, shortest: usize) -> Option<(usize, usize)> {
        let reaches = (WIDTH..=WINDOW - WIDTH / 2).contains(&line) && at >= line + n / 2;
        let above = (line.saturating_sub(n / 2 - 1)..=line + n / 2).filter(|_| reaches);
        let mut best = None;
        for distance in (1..=n.min(at)).chain(above) {
            let here = data[at..].iter().take(LONGEST_MATCH);
            let length = here.zip(&data[at - distance..]).take_while(|(a, b)| a == b).count();
            if length >= shortest && best.is_none_or(|(most, _)| length > most) {
                best = Some((length, distance));
            }
        }
        best
    }

    fn check<M: Mask<N>, const N: usize, const SHORTEST: usize>(data: &[u8], line: usize, steps: &[usize]) {
        let mut matcher = FixedDistanceMatcher::<M>::new(line);
        // The second time starts in the middle, with the masks of the first time.
        for start in [0, data.len() / 2] {
            matcher.begin(start);
            let mut at = start;
            let mut steps = steps.iter().cycle();
            while at < data.len() {
                matcher.reach(Scalar, data, at);
                let found = matcher
                    .places()
                    .longest::<_, N, SHORTEST>(Scalar, data, at)
                    .map(|f| (f.length, fixed_distances(line)[f.index]));
                assert_eq!(found, reference(data, at, line, N, SHORTEST), "at {at}");
                at += steps.next().unwrap();
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_longest_of_all_distances_is_found(
            pieces in proptest::collection::vec((1usize..600, 1usize..200, 0u8..9), 1..24),
            line in prop_oneof![1usize..200, Just(WINDOW), Just(WINDOW - WIDTH / 2)],
            steps in proptest::collection::vec(1usize..259, 1..20),
        ) {
            // Pieces repeat at any distance, and each ends with another byte.
            let mut data: Vec<u8> = vec![];
            for (len, back, byte) in pieces {
                for _ in 0..len {
                    data.push(data.len().checked_sub(back).map_or(byte, |from| data[from]));
                }
                data.push(byte);
            }
            check::<u64, WIDTH, 3>(&data, line, &steps);
            check::<u64, WIDTH, 15>(&data, line, &steps);
            check::<u32, HALF, 3>(&data, line, &steps);
            check::<u32, HALF, 15>(&data, line, &steps);
        }
    }

    #[test]
    fn the_longest_match_reaches_over_pieces_of_the_data() {
        let data = vec![5; 3 * TILE];
        check::<u64, WIDTH, 3>(&data, 1000, &[258]);
        check::<u32, HALF, 15>(&data, 1000, &[258]);
    }
}
