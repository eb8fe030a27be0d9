//! Matches at fixed distances: the 32 smallest, and 32 around a line.
//!
//! What filters leave of a smooth image repeats there and hardly anywhere else: steps that come at nearly
//! equal intervals along a line, and again nearly below in the next. So there are no hashes and no chains;
//! every byte is compared with those at all 64 distances, which takes two comparisons of registers. The
//! answers are the bits of a mask, and a match lasts as long as the masks of the places that follow have a
//! bit in common. Depth, normals and coordinates of a view take 20 ms so, 49 ms with libdeflate at the same
//! or larger sizes (bench `compressors`).

use crate::WINDOW;
use crate::alphabet::LONGEST_MATCH;
use crate::simd::{Compare, WIDTH};
use std::array::from_fn;
use std::hint::select_unpredictable;

/// How many fixed distances there are.
pub(crate) const FIXED: usize = 2 * WIDTH;
/// Places of which the masks are there at a time: as much as the fastest memory takes.
const TILE: usize = 2048;
/// Masks that a match's end may ask for.
const AHEAD: usize = LONGEST_MATCH + 4;

/// Which distances agree at the places of a piece of the data.
pub(crate) struct FixedDistanceMatcher {
    /// The highest bit for the distance 1, the 32nd for 32; the lower 32 for those from a line less 15 to a
    /// line and 16.
    masks: Vec<u64>,
    /// The first place of `masks`.
    start: usize,
    /// Behind the last place that was compared.
    end: usize,
    line: usize,
}

/// A match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FixedMatch {
    /// 3 to [`LONGEST_MATCH`].
    pub(crate) length: usize,
    /// Which of [`fixed_distances`].
    pub(crate) index: usize,
}

/// The distances that are asked for: the 32 smallest, and 32 around a line.
pub(crate) fn fixed_distances(line: usize) -> [usize; FIXED] {
    from_fn(|i| if i < WIDTH { i + 1 } else { (line + i + 1).saturating_sub(WIDTH + WIDTH / 2) })
}

impl FixedDistanceMatcher {
    /// For lines of `line` bytes.
    pub(crate) fn new(line: usize) -> Self {
        Self { masks: Vec::new(), start: 0, end: 0, line }
    }

    /// Begins with other data.
    pub(crate) fn begin(&mut self) {
        self.masks.resize(TILE + AHEAD, 0);
        (self.start, self.end) = (0, 0);
    }

    /// Sees to it that the masks of `at`, which does not go back, and of those ahead are there, and returns
    /// up to which place they are.
    #[inline(always)]
    pub(crate) fn reach<C: Compare>(&mut self, compare: C, data: &[u8], at: usize) -> usize {
        if at + AHEAD > self.end && self.end < data.len() {
            self.advance(compare, data, at);
        }
        if self.end < data.len() { self.end + 1 - AHEAD } else { self.end }
    }

    #[inline(always)]
    fn advance<C: Compare>(&mut self, compare: C, data: &[u8], at: usize) {
        let known = self.end.saturating_sub(at);
        self.masks.copy_within(at - self.start..at - self.start + known, 0);
        (self.start, self.end) = (at, data.len().min(at + TILE));
        let from = at + known;
        let (masks, behind) = self.masks[known..].split_at_mut(self.end - from);
        // Nothing is there behind the end.
        behind.fill(0);

        // The first bytes have less before them, and the first line none above it.
        let lines = if self.line < WIDTH || self.line + WIDTH / 2 > WINDOW {
            self.end
        } else {
            (self.line + WIDTH / 2).clamp(from, self.end)
        };
        let (first, masks) = masks.split_at_mut(lines - from);
        let whole = WIDTH.clamp(from, lines);
        let (fewer, first) = first.split_at_mut(whole - from);
        for (place, mask) in (from..whole).zip(fewer) {
            *mask =
                (1..=place).fold(0, |mask, d| mask | u64::from(data[place] == data[place - d]) << (64 - d));
        }
        let near = |place: usize| data[place.max(WIDTH) - WIDTH..].array_windows();
        for ((mask, near), &byte) in first.iter_mut().zip(near(whole)).zip(&data[whole..]) {
            *mask = u64::from(compare.equal(near, byte)) << WIDTH;
        }
        if lines == self.end {
            return;
        }
        let above = data[lines - self.line - WIDTH / 2..].array_windows();
        for (((mask, near), above), &byte) in masks.iter_mut().zip(near(lines)).zip(above).zip(&data[lines..])
        {
            *mask = compare.equal_in_two(near, above, byte);
        }
    }

    /// The places that have been [`reach`](Self::reach)ed.
    #[inline(always)]
    pub(crate) fn places(&self) -> Places<'_> {
        Places { masks: &self.masks, start: self.start }
    }
}

/// The masks of some places.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a> {
    masks: &'a [u64],
    /// The first of them.
    start: usize,
}

impl Places<'_> {
    /// The first place from `at` to `until` at which there is a match of three bytes; `until` if there is
    /// none.
    #[inline(always)]
    pub(crate) fn next(self, at: usize, until: usize) -> usize {
        let masks = &self.masks[at - self.start..until + 2 - self.start];
        at + masks.array_windows().take_while(|[a, b, c]| a & b & c == 0).count()
    }

    /// The longest match at `at`, which has been [`reach`](FixedDistanceMatcher::reach)ed: the nearest of
    /// several.
    #[inline(always)]
    pub(crate) fn longest<const SHORTEST: usize>(self, at: usize) -> Option<FixedMatch> {
        const {
            assert!(
                SHORTEST >= 3 && (LONGEST_MATCH - SHORTEST) % 4 >= 2,
                "only a third byte more may be too many"
            )
        };
        let masks: &[u64; AHEAD] = self.masks[at - self.start..].first_chunk().expect("they were reached");
        let mut agree = masks[..SHORTEST].iter().fold(u64::MAX, |agree, mask| agree & mask);
        if agree == 0 {
            return None;
        }
        let mut length = SHORTEST;
        let [mut first, mut second, mut third, mut fourth] = from_fn(|i| masks[length + i]);
        loop {
            let next = agree & (first & second & (third & fourth));
            if next == 0 || length + 4 > LONGEST_MATCH {
                break;
            }
            (agree, length) = (next, length + 4);
            [first, second, third, fourth] = from_fn(|i| masks[length + i]);
        }
        // Up to three more, without a branch.
        let one = agree & first;
        let two = one & second;
        let three = if length + 3 <= LONGEST_MATCH { two & third } else { 0 };
        length += usize::from(one != 0) + usize::from(two != 0) + usize::from(three != 0);
        let agree = select_unpredictable(one != 0, one, agree);
        let agree = select_unpredictable(two != 0, two, agree);
        let agree = select_unpredictable(three != 0, three, agree);
        // One bit at least is left.
        Some(FixedMatch { length, index: (agree.leading_zeros() as usize) & (FIXED - 1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_simd::Scalar;

    /// The plain way: every distance, byte by byte.
    fn reference(data: &[u8], at: usize, line: usize, shortest: usize) -> Option<(usize, usize)> {
        let reaches = (WIDTH..=WINDOW - WIDTH / 2).contains(&line) && at >= line + WIDTH / 2;
        let above = (line.saturating_sub(WIDTH / 2 - 1)..=line + WIDTH / 2).filter(|_| reaches);
        let mut best = None;
        for distance in (1..=WIDTH.min(at)).chain(above) {
            let here = data[at..].iter().take(LONGEST_MATCH);
            let length = here.zip(&data[at - distance..]).take_while(|(a, b)| a == b).count();
            if length >= shortest && best.is_none_or(|(most, _)| length > most) {
                best = Some((length, distance));
            }
        }
        best
    }

    fn check<const SHORTEST: usize>(data: &[u8], line: usize, steps: &[usize]) {
        let mut matcher = FixedDistanceMatcher::new(line);
        // A second time, with what the first left.
        for _ in 0..2 {
            matcher.begin();
            let (mut at, mut steps) = (0, steps.iter().cycle());
            while at < data.len() {
                matcher.reach(Scalar, data, at);
                let found = matcher
                    .places()
                    .longest::<SHORTEST>(at)
                    .map(|f| (f.length, fixed_distances(line)[f.index]));
                assert_eq!(found, reference(data, at, line, SHORTEST), "at {at}");
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
            // Pieces that repeat at any distance, each ended by another byte.
            let mut data: Vec<u8> = vec![];
            for (len, back, byte) in pieces {
                for _ in 0..len {
                    data.push(data.len().checked_sub(back).map_or(byte, |from| data[from]));
                }
                data.push(byte);
            }
            check::<3>(&data, line, &steps);
            check::<11>(&data, line, &steps);
        }
    }

    #[test]
    fn the_longest_match_reaches_over_pieces_of_the_data() {
        let data = vec![5; 3 * TILE];
        check::<3>(&data, 1000, &[258]);
        let mut matcher = FixedDistanceMatcher::new(1000);
        matcher.begin();
        matcher.reach(Scalar, &data, 0);
        matcher.reach(Scalar, &data, TILE - 100);
        assert_eq!(
            matcher.places().longest::<3>(TILE - 100),
            Some(FixedMatch { length: LONGEST_MATCH, index: 0 })
        );
    }
}
