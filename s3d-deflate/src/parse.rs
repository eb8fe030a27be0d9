//! Data to tokens: which bytes are written as they are, and which as repetitions.

use crate::bit_writer::BitWriter;
use crate::block::{LONGEST, Prices, write_block};
use crate::fixed_distance::{Anywhere, Compare, Nearby};
use crate::hash_matcher::{Finder, WINDOW};
use crate::tokens::{BLOCK, Tokens};

/// How hard and where repetitions are looked for.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Which earlier places a place is compared with.
    pub candidates: Candidates,
    /// Bytes from one line to the next.
    pub line: usize,
    /// Bytes from one sample of a line to the next.
    pub sample: usize,
    /// Bytes, 4 to 8, of which a repetition consists at least, but those a line back.
    pub hash_bytes: u32,
    /// A repetition shorter than this is dropped if the next place has a better one.
    pub lazy: usize,
    /// A repetition as long as this is taken at once.
    pub nice: usize,
    /// Every place in a repetition as long as this is remembered; of longer ones, and of runs, a few at the end.
    pub remember: usize,
    /// After 2ⁿ bytes without a repetition, places are passed over, more and more.
    pub patience: u32,
}

/// Which earlier places a place is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Candidates {
    /// The last of its hash, at every third byte: for noisy pixels of three bytes.
    Noise,
    /// The two last of its hash and that a line back, at every third byte: for pixels of three bytes in patches.
    Patches,
    /// The four last of its hash and those around a line back, at every second byte: for steps along lines.
    Steps,
    /// The sixteen last of its hash and those around a line back.
    Many,
    /// Those at the 64 distances of [`Nearby`](crate::fixed_distance::Nearby), at every byte: for smooth surfaces. Of all else, only
    /// the line matters to it.
    Nearby,
    /// The same, but only long repetitions, and not at every byte: where bytes as they are cost little.
    NearbyLong,
}

/// Places passed over at most.
const LONGEST_STEP: usize = 32;
/// Bytes of which the price as literals is asked for; where there are short repetitions, longer ones pay anyway.
const PRICED: usize = 8;
/// Bytes, at least, of repetitions where only long ones are looked for: more than are priced.
const LONG: usize = 11;
/// Steps to the next place where only long ones are looked for: if there was none, and if it cost too much. What begins
/// between two places is found at the second.
const LONG_STEPS: (usize, usize) = (2, 4);
/// Bytes at the end in which nothing is looked for.
const TAIL: usize = LONGEST + 8;

/// Loops over bytes. `run` is `#[inline(always)]`, so that it is compiled once for any processor and once for wide registers.
pub trait Work {
    /// What they make.
    type Output;
    /// Makes it.
    fn run(self) -> Self::Output;
}

/// Does `work` in registers of 32 bytes where the processor has them; integers give the same anywhere.
pub fn wide<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has what was just asked for.
        #[allow(unsafe_code)]
        return unsafe { wide_x86_64(work) };
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn wide_x86_64<W: Work>(work: W) -> W::Output {
    work.run()
}

/// With registers of 32 bytes.
#[cfg(target_arch = "x86_64")]
struct Avx2;

#[cfg(target_arch = "x86_64")]
impl Compare for Avx2 {
    #[inline(always)]
    fn equal(window: &[u8; 32], byte: u8) -> u32 {
        use std::arch::x86_64::*;
        // SAFETY: the window has the 32 bytes; only `run_x86_64_v3` asks, where the processor has AVX2.
        #[allow(unsafe_code)]
        unsafe {
            let window = _mm256_loadu_si256(window.as_ptr().cast());
            _mm256_movemask_epi8(_mm256_cmpeq_epi8(window, _mm256_set1_epi8(byte as i8))) as u32
        }
    }
}

/// With the same registers, and comparisons that answer with bits.
#[cfg(target_arch = "x86_64")]
struct Avx512;

#[cfg(target_arch = "x86_64")]
impl Compare for Avx512 {
    #[inline(always)]
    fn equal(window: &[u8; 32], byte: u8) -> u32 {
        use std::arch::x86_64::*;
        // SAFETY: the window has the 32 bytes; only `run_x86_64_v4` asks, where the processor has AVX-512BW and VL.
        #[allow(unsafe_code)]
        unsafe {
            _mm256_cmpeq_epi8_mask(_mm256_loadu_si256(window.as_ptr().cast()), _mm256_set1_epi8(byte as i8))
        }
    }
}

/// One pass over data.
pub(crate) struct Parser<'a> {
    pub(crate) finder: &'a mut Finder,
    pub(crate) nearby: &'a mut Nearby,
    pub(crate) tokens: &'a mut Tokens,
    pub(crate) prices: &'a mut Prices,
    pub(crate) search: Search,
    /// A place where a block ends, as the data is of another kind after it.
    pub(crate) boundary: usize,
}

impl Parser<'_> {
    /// Writes `data` as blocks.
    pub(crate) fn run(self, data: &[u8], out: &mut BitWriter<'_>) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2")
            && std::arch::is_x86_feature_detected!("lzcnt")
        {
            if matches!(self.search.candidates, Candidates::Nearby | Candidates::NearbyLong)
                && std::arch::is_x86_feature_detected!("avx512bw")
                && std::arch::is_x86_feature_detected!("avx512vl")
            {
                // SAFETY: the processor has what was just asked for.
                #[allow(unsafe_code)]
                return unsafe { self.run_x86_64_v4(data, out) };
            }
            // SAFETY: the processor has what was just asked for.
            #[allow(unsafe_code)]
            return unsafe { self.run_x86_64_v3(data, out) };
        }
        self.run_as::<Anywhere>(data, out);
    }

    /// The same, compiled for counting zeros and for shifts in one instruction; integers give the same bits anywhere.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
    fn run_x86_64_v3(self, data: &[u8], out: &mut BitWriter<'_>) {
        self.run_as::<Avx2>(data, out);
    }

    /// The same at fixed distances, with registers of bits.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,avx512bw,avx512vl")]
    fn run_x86_64_v4(self, data: &[u8], out: &mut BitWriter<'_>) {
        match self.search.candidates {
            Candidates::NearbyLong => self.parse_nearby::<Avx512, LONG>(data, out),
            _ => self.parse_nearby::<Avx512, 3>(data, out),
        }
    }

    /// The same, compiled for any processor of the kind.
    #[inline(always)]
    pub(crate) fn run_as<C: Compare>(self, data: &[u8], out: &mut BitWriter<'_>) {
        let line = self.search.line;
        // Lines seen at an angle are shifted against each other by a sample or two.
        let s = self.search.sample;
        let around = [line, line.saturating_sub(s), line + s, line.saturating_sub(2 * s), line + 2 * s];
        // Very short and very long lines: any other distance will do.
        let around = around.map(|distance| distance.clamp(1, WINDOW));
        let above = [around[0]];
        match self.search.candidates {
            Candidates::Noise => self.parse::<1, 1, 0, 3, 3>(data, [], out),
            Candidates::Patches => self.parse::<1, 2, 1, 3, 3>(data, above, out),
            Candidates::Steps => self.parse::<1, 4, 5, 1, 2>(data, around, out),
            Candidates::Many => self.parse::<4, 16, 5, 1, 1>(data, around, out),
            Candidates::Nearby => self.parse_nearby::<C, 3>(data, out),
            Candidates::NearbyLong => self.parse_nearby::<C, LONG>(data, out),
        }
    }

    /// Repetitions of `SHORTEST` bytes and more are looked for where there is none.
    #[inline(always)]
    fn parse_nearby<C: Compare, const SHORTEST: usize>(self, data: &[u8], out: &mut BitWriter<'_>) {
        let Self { nearby, tokens, prices, boundary, .. } = self;
        let steps = if SHORTEST > PRICED { LONG_STEPS } else { (1, 1) };
        nearby.begin();
        tokens.clear();
        // The block's first byte, the first that is in no token, and the place where the block is full if no repetition
        // comes before.
        let (mut at, mut block, mut pending, mut full) = (0, 0, 0, BLOCK);
        loop {
            at = at.min(data.len());
            if at >= full || block < boundary && at >= boundary || at >= data.len() {
                let last = at >= data.len();
                tokens.literals(data, pending, at);
                write_block(data, block..at, tokens, last, prices, out);
                if last {
                    return;
                }
                tokens.clear();
                (block, pending, full) = (at, at, at + BLOCK);
            }
            // Where there is something else to do than to look for repetitions: the block may be full, or words are missing.
            let mut pause = nearby.reach::<C>(data, at).min(full);
            if block < boundary {
                pause = pause.min(boundary);
            }
            let places = nearby.places();
            while at < pause {
                let Some(mut found) = places.longest::<SHORTEST>(at) else {
                    at = if SHORTEST == 3 { places.next(at + 1, pause) } else { at + steps.0 };
                    continue;
                };
                if (SHORTEST > PRICED || found.length <= PRICED)
                    && !prices.pays::<PRICED, SHORTEST>(data, at, found)
                {
                    at += steps.1;
                    continue;
                }
                if steps != (1, 1) {
                    let distance = tokens.lanes[found.lane];
                    while at > pending.max(distance)
                        && found.length < LONGEST
                        && data[at - 1] == data[at - 1 - distance]
                    {
                        at -= 1;
                        found.length += 1;
                    }
                }
                tokens.literals(data, pending, at);
                tokens.repetition_in(found.lane, found.length);
                at += found.length;
                pending = at;
                full += found.length - 1;
            }
        }
    }

    /// `PIXEL` bytes belong together, after one byte at the start of each line if there is more than one. Every
    /// `STEP` bytes a repetition is looked for.
    #[inline(always)]
    fn parse<
        const WORDS: usize,
        const WAYS: usize,
        const ROWS: usize,
        const PIXEL: usize,
        const STEP: usize,
    >(
        self,
        data: &[u8],
        rows: [usize; ROWS],
        out: &mut BitWriter<'_>,
    ) {
        let Self { finder, tokens, prices, search, boundary, .. } = self;
        finder.begin::<WORDS>();
        tokens.clear();
        let end = data.len().saturating_sub(TAIL);
        let mut at = 1;
        // The block's first byte, its symbols so far, and the first byte that is in no token.
        let (mut block, mut symbols, mut pending) = (0, 0, 0);
        let mut line_end = search.line;
        while at < end {
            if PIXEL > 1 {
                while at >= line_end {
                    line_end += search.line;
                }
                let phase = (line_end - at) % PIXEL;
                if phase != 0 || line_end - at == search.line {
                    at += phase.max(1);
                    continue;
                }
            }
            let places = finder.insert::<WORDS>(data, at);
            let mut found = finder.best::<WORDS, WAYS, ROWS>(data, at, places, rows, prices);
            if found.gain <= 0 {
                if STEP > PIXEL {
                    finder.insert::<WORDS>(data, at + PIXEL);
                }
                at += STEP + PIXEL * ((at - pending) >> search.patience).min(LONGEST_STEP);
            } else {
                let mut known = at + PIXEL;
                while found.length < search.lazy && at + PIXEL < end {
                    let places = finder.insert::<WORDS>(data, at + PIXEL);
                    let next = finder.best::<WORDS, WAYS, ROWS>(data, at + PIXEL, places, rows, prices);
                    known = at + 2 * PIXEL;
                    if next.gain <= found.gain {
                        break;
                    }
                    at += PIXEL;
                    found = next;
                }
                // It may have begun before, at a place passed over.
                while at > pending.max(found.distance)
                    && found.length < LONGEST
                    && data[at - 1] == data[at - 1 - found.distance]
                {
                    at -= 1;
                    found.length += 1;
                }
                tokens.literals(data, pending, at);
                tokens.repetition(found.length, found.distance);
                symbols += at - pending + 1;
                at += found.length;
                pending = at;
                let until = at.min(end);
                // The places in a run are all alike.
                let run = found.distance <= 8 && found.distance < found.length;
                if run || found.length > search.remember {
                    known += (until.saturating_sub(known) / PIXEL).saturating_sub(4) * PIXEL;
                }
                while known < until {
                    finder.insert::<WORDS>(data, known);
                    known += PIXEL;
                }
            }
            let full = symbols + (at - pending) >= BLOCK || block < boundary && at >= boundary;
            if full && at < end {
                tokens.literals(data, pending, at);
                write_block(data, block..at, tokens, false, prices, out);
                tokens.clear();
                (block, symbols, pending) = (at, 0, at);
            }
        }
        tokens.literals(data, pending, data.len());
        write_block(data, block..data.len(), tokens, true, prices, out);
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::arch::is_x86_feature_detected as has;

    proptest! {
        #[test]
        fn all_processors_compare_alike(
            upper in proptest::array::uniform32(0u8..4),
            lower in proptest::array::uniform32(0u8..4),
            byte in 0u8..4,
        ) {
            let expected = Anywhere::equal_in_two(&upper, &lower, byte);
            prop_assert_eq!(expected >> 32, u64::from(Anywhere::equal(&upper, byte)));
            if has!("avx2") {
                prop_assert_eq!(Avx2::equal_in_two(&upper, &lower, byte), expected);
            }
            if has!("avx512bw") && has!("avx512vl") {
                prop_assert_eq!(Avx512::equal_in_two(&upper, &lower, byte), expected);
            }
        }
    }
}
