//! Repetitions at fixed distances: the 32 smallest, and 32 around a line.
//!
//! What filters leave of a smooth image repeats there and hardly anywhere else: steps that come at nearly equal intervals
//! along a line, and again nearly below in the next. So nothing is remembered and no hash is asked; every byte is
//! compared with those at all 64 distances, which takes two comparisons of registers. The answers are the bits of a word,
//! and a repetition lasts as long as the words of the places that follow have a bit in common.

use crate::block::LONGEST;
use crate::hash_matcher::WINDOW;
use std::array::from_fn;
use std::hint::select_unpredictable;

/// Distances of each of the two kinds.
pub(crate) const LANES: usize = 32;
/// Places of which the words are there at a time: as much as the fastest memory takes.
const TILE: usize = 2048;
/// Words that a repetition's end may ask for.
const AHEAD: usize = LONGEST + 4;

/// Compares bytes, in registers where the processor has wide ones.
pub(crate) trait Compare {
    /// Which bytes of `window` are `byte`: a bit for each, the first lowest.
    fn equal(window: &[u8; LANES], byte: u8) -> u32;

    /// The same of two windows, those of the first in the upper half.
    #[inline(always)]
    fn equal_in_two(upper: &[u8; LANES], lower: &[u8; LANES], byte: u8) -> u64 {
        u64::from(Self::equal(upper, byte)) << LANES | u64::from(Self::equal(lower, byte))
    }
}

/// For any processor.
pub(crate) struct Anywhere;

impl Compare for Anywhere {
    #[inline(always)]
    fn equal(window: &[u8; LANES], byte: u8) -> u32 {
        const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
        let expected = u64::from(byte) * 0x0101_0101_0101_0101;
        let mut equal = 0;
        for (i, eight) in window.as_chunks::<8>().0.iter().enumerate() {
            let differ = u64::from_le_bytes(*eight) ^ expected;
            // The highest bit of each byte that is 0, then all of them side by side.
            let zeros = !(((differ & LOW) + LOW) | differ | LOW);
            equal |= ((zeros >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i);
        }
        equal as u32
    }
}

/// Which distances agree at the places of a piece of the data.
pub(crate) struct Nearby {
    /// The highest bit for the distance 1, the 32nd for 32; the lower 32 for those from a line less 15 to a line and 16.
    words: Vec<u64>,
    /// The first place of `words`.
    start: usize,
    /// Behind the last place that was compared.
    end: usize,
    line: usize,
}

/// A repetition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Repeated {
    /// 3 to [`LONGEST`].
    pub(crate) length: usize,
    /// Which of the distances: see [`lanes`].
    pub(crate) lane: usize,
}

/// The distances that are asked for: the 32 smallest, and 32 around a line.
pub(crate) fn lanes(line: usize) -> [usize; 2 * LANES] {
    from_fn(|lane| if lane < LANES { lane + 1 } else { (line + lane + 1).saturating_sub(LANES + LANES / 2) })
}

impl Nearby {
    /// For lines of `line` bytes.
    pub(crate) fn new(line: usize) -> Self {
        Self { words: Vec::new(), start: 0, end: 0, line }
    }

    /// Begins with other data.
    pub(crate) fn begin(&mut self) {
        self.words.resize(TILE + AHEAD, 0);
        (self.start, self.end) = (0, 0);
    }

    /// Sees to it that the words of `at`, which does not go back, and of those ahead are there; up to which place, it
    /// returns.
    #[inline(always)]
    pub(crate) fn reach<C: Compare>(&mut self, data: &[u8], at: usize) -> usize {
        if at + AHEAD > self.end && self.end < data.len() {
            self.advance::<C>(data, at);
        }
        if self.end < data.len() { self.end + 1 - AHEAD } else { self.end }
    }

    #[inline(always)]
    fn advance<C: Compare>(&mut self, data: &[u8], at: usize) {
        let known = self.end.saturating_sub(at);
        self.words.copy_within(at - self.start..at - self.start + known, 0);
        (self.start, self.end) = (at, data.len().min(at + TILE));
        let from = at + known;
        let (words, behind) = self.words[known..].split_at_mut(self.end - from);
        // Nothing is there behind the end.
        behind.fill(0);

        // The first bytes have less before them, and the first line none above it.
        let lines = if self.line < LANES || self.line + LANES / 2 > WINDOW {
            self.end
        } else {
            (self.line + LANES / 2).clamp(from, self.end)
        };
        let (first, words) = words.split_at_mut(lines - from);
        let whole = LANES.clamp(from, lines);
        let (fewer, first) = first.split_at_mut(whole - from);
        for (place, word) in (from..whole).zip(fewer) {
            *word = (1..=place).fold(0, |w, d| w | u64::from(data[place] == data[place - d]) << (64 - d));
        }
        let near = |place: usize| data[place.max(LANES) - LANES..].array_windows();
        for ((word, near), &byte) in first.iter_mut().zip(near(whole)).zip(&data[whole..]) {
            *word = u64::from(C::equal(near, byte)) << LANES;
        }
        if lines == self.end {
            return;
        }
        let above = data[lines - self.line - LANES / 2..].array_windows();
        for (((word, near), above), &byte) in words.iter_mut().zip(near(lines)).zip(above).zip(&data[lines..])
        {
            *word = C::equal_in_two(near, above, byte);
        }
    }

    /// The places that have been [`reach`](Self::reach)ed.
    #[inline(always)]
    pub(crate) fn places(&self) -> Places<'_> {
        Places { words: &self.words, start: self.start }
    }
}

/// The words of some places.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a> {
    words: &'a [u64],
    /// The first of them.
    start: usize,
}

impl Places<'_> {
    /// The first place from `at` to `until` at which there is a repetition of three bytes; `until` if there is none.
    #[inline(always)]
    pub(crate) fn next(self, at: usize, until: usize) -> usize {
        let words = &self.words[at - self.start..until + 2 - self.start];
        at + words.array_windows().take_while(|[a, b, c]| a & b & c == 0).count()
    }

    /// The longest repetition at `at`, which has been [`reach`](Nearby::reach)ed: the nearest of several.
    #[inline(always)]
    pub(crate) fn longest<const SHORTEST: usize>(self, at: usize) -> Option<Repeated> {
        const { assert!(SHORTEST >= 3 && (LONGEST - SHORTEST) % 4 >= 2, "only a third byte more may be too many") };
        let words: &[u64; AHEAD] = self.words[at - self.start..].first_chunk().expect("they were reached");
        let mut agree = words[..SHORTEST].iter().fold(u64::MAX, |agree, word| agree & word);
        if agree == 0 {
            return None;
        }
        let mut length = SHORTEST;
        let [mut first, mut second, mut third, mut fourth] = from_fn(|i| words[length + i]);
        loop {
            let next = agree & (first & second & (third & fourth));
            if next == 0 || length + 4 > LONGEST {
                break;
            }
            (agree, length) = (next, length + 4);
            [first, second, third, fourth] = from_fn(|i| words[length + i]);
        }
        // Up to three more, without a branch.
        let one = agree & first;
        let two = one & second;
        let three = if length + 3 <= LONGEST { two & third } else { 0 };
        length += usize::from(one != 0) + usize::from(two != 0) + usize::from(three != 0);
        let agree = select_unpredictable(one != 0, one, agree);
        let agree = select_unpredictable(two != 0, two, agree);
        let agree = select_unpredictable(three != 0, three, agree);
        // One bit at least is left.
        Some(Repeated { length, lane: (agree.leading_zeros() as usize) & (2 * LANES - 1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The plain way: every distance, byte by byte.
    fn reference(data: &[u8], at: usize, line: usize, shortest: usize) -> Option<(usize, usize)> {
        let reaches = (LANES..=WINDOW - LANES / 2).contains(&line) && at >= line + LANES / 2;
        let above = (line.saturating_sub(LANES / 2 - 1)..=line + LANES / 2).filter(|_| reaches);
        let mut best = None;
        for distance in (1..=LANES.min(at)).chain(above) {
            let here = data[at..].iter().take(LONGEST);
            let length = here.zip(&data[at - distance..]).take_while(|(a, b)| a == b).count();
            if length >= shortest && best.is_none_or(|(most, _)| length > most) {
                best = Some((length, distance));
            }
        }
        best
    }

    fn check<C: Compare, const SHORTEST: usize>(data: &[u8], line: usize, steps: &[usize]) {
        let mut nearby = Nearby::new(line);
        // A second time, with what the first left.
        for _ in 0..2 {
            nearby.begin();
            let (mut at, mut steps) = (0, steps.iter().cycle());
            while at < data.len() {
                nearby.reach::<C>(data, at);
                let found = nearby.places().longest::<SHORTEST>(at).map(|f| (f.length, lanes(line)[f.lane]));
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
            line in prop_oneof![1usize..200, Just(WINDOW), Just(WINDOW - LANES / 2)],
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
            check::<Anywhere, 3>(&data, line, &steps);
            check::<Anywhere, 11>(&data, line, &steps);
        }

        #[test]
        fn equal_bytes_are_found_in_a_window(window in proptest::array::uniform32(0u8..4), low in 0u8..4) {
            for (window, byte) in [(window, low), (window.map(|b| b.wrapping_sub(2)), low.wrapping_sub(2))] {
                let expected = (0..LANES).fold(0, |w, i| w | u32::from(window[i] == byte) << i);
                prop_assert_eq!(Anywhere::equal(&window, byte), expected);
            }
        }
    }

    #[test]
    fn the_longest_repetition_reaches_over_pieces_of_the_data() {
        let data = vec![5; 3 * TILE];
        check::<Anywhere, 3>(&data, 1000, &[258]);
        let mut nearby = Nearby::new(1000);
        nearby.begin();
        nearby.reach::<Anywhere>(&data, 0);
        nearby.reach::<Anywhere>(&data, TILE - 100);
        assert_eq!(nearby.places().longest::<3>(TILE - 100), Some(Repeated { length: LONGEST, lane: 0 }));
    }
}
