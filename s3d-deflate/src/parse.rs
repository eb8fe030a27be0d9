//! Parses data into tokens: decides which bytes become literals and which become matches.

use crate::WINDOW;
use crate::alphabet::LONGEST_MATCH;
use crate::bit_writer::BitWriter;
use crate::block::write_block;
use crate::costs::Costs;
use crate::fixed_distance::{FixedDistanceMatcher, Mask};
use crate::hash_matcher::HashMatcher;
use crate::search::{Candidates, Search};
use crate::simd::{Compare, Kernel, dispatch};
use crate::tokens::{BLOCK, Tokens};

/// The largest number of steps that are skipped.
const LONGEST_STEP: usize = 32;
/// Longer matches pay, whatever their bytes cost as literals.
const PAYING: usize = 5;
/// The length from which matches are taken in a search for long ones.
const LONG: usize = 15;
/// The step in a search for long matches. A match that begins between two places is found at the second.
const LONG_STEP: usize = 4;
/// The number of bytes at the end that are not searched.
const TAIL: usize = LONGEST_MATCH + 8;

/// A pass over data.
pub(crate) struct Parser<'a> {
    pub(crate) hash_matcher: &'a mut HashMatcher,
    pub(crate) all_distances: &'a mut FixedDistanceMatcher<u64>,
    pub(crate) half_of_distances: &'a mut FixedDistanceMatcher<u32>,
    pub(crate) tokens: &'a mut Tokens,
    pub(crate) costs: &'a mut Costs,
    pub(crate) search: Search,
    /// A place where a block ends, because data of another kind follows.
    pub(crate) boundary: usize,
}

impl Parser<'_> {
    /// Writes `data` as blocks, in the widest registers that make it faster.
    pub(crate) fn run(self, data: &[u8], out: &mut BitWriter<'_>) {
        if self.search.candidates.are_of_a_hash() {
            dispatch(ByHash { parser: self, data, out });
        } else {
            dispatch(AtFixedDistances { parser: self, data, out });
        }
    }

    /// Writes `data` as blocks, with matches at the fixed distances only.
    #[inline(always)]
    pub(crate) fn at_fixed_distances<C: Compare>(self, compare: C, data: &[u8], out: &mut BitWriter<'_>) {
        let Self { all_distances: all, half_of_distances: half, tokens, costs, search, boundary, .. } = self;
        let mut at = 0;
        for (until, is_last) in [(boundary.min(data.len()), false), (data.len(), true)] {
            // A stream without data has a block too.
            if at == until && !(is_last && data.is_empty()) {
                continue;
            }
            let mut part = FixedPart { data, at, until, tokens, costs, out };
            at = match search.candidates {
                Candidates::HalfOfFixedDistances => part.parse::<_, _, _, 3>(compare, half),
                Candidates::LongFixedDistances => part.parse::<_, _, _, LONG>(compare, all),
                Candidates::SplitFixedDistances if is_last => part.parse::<_, _, _, LONG>(compare, half),
                _ => part.parse::<_, _, _, 3>(compare, all),
            };
        }
    }

    /// Writes `data` as blocks, with matches at places of the same hash and a line back.
    #[inline(always)]
    pub(crate) fn by_hash(self, data: &[u8], out: &mut BitWriter<'_>) {
        // Edges at an angle are shifted by a sample or two from line to line.
        let line = self.search.line;
        let s = self.search.sample;
        let around = [line, line.saturating_sub(s), line + s, line.saturating_sub(2 * s), line + 2 * s];
        // For very short and very long lines, any other distance will do.
        let around = around.map(|distance| distance.clamp(1, WINDOW));
        match self.search.candidates {
            Candidates::Hash1 => self.parse_by_hash::<1, 1, 0, 3, 3>(data, [], out),
            Candidates::Hash2 => self.parse_by_hash::<1, 2, 1, 3, 3>(data, [around[0]], out),
            Candidates::Hash4 => self.parse_by_hash::<1, 4, 5, 1, 2>(data, around, out),
            _ => self.parse_by_hash::<4, 16, 5, 1, 1>(data, around, out),
        }
    }

    /// Searches for a match every `STEP` bytes, among the last `WAYS` places of the hash, which are in
    /// `WORDS` words, and at `ROWS` distances. `PIXEL` bytes are a pixel. If `PIXEL` is more than one, each
    /// line starts with one byte of the filter.
    #[inline(always)]
    fn parse_by_hash<
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
        let Self { hash_matcher, tokens, costs, search, boundary, .. } = self;
        hash_matcher.begin::<WORDS>();
        tokens.clear();

        let end = data.len().saturating_sub(TAIL);
        let mut at = 1;
        let mut line_end = search.line;
        // The first byte of the block, and its number of symbols so far.
        let mut block = 0;
        let mut symbols = 0;
        // The first byte that is not in a token.
        let mut pending = 0;

        while at < end {
            // Go to the next first byte of a pixel.
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

            let places = hash_matcher.insert::<WORDS>(data, at);
            let mut found = hash_matcher.best::<WORDS, WAYS, ROWS>(data, at, places, rows, costs);
            if found.gain <= 0 {
                if STEP > PIXEL {
                    hash_matcher.insert::<WORDS>(data, at + PIXEL);
                }
                at += STEP + PIXEL * ((at - pending) >> search.patience).min(LONGEST_STEP);
            } else {
                // The next place may have a better match.
                let mut known = at + PIXEL;
                while found.length < search.lazy && at + PIXEL < end {
                    let places = hash_matcher.insert::<WORDS>(data, at + PIXEL);
                    let next = hash_matcher.best::<WORDS, WAYS, ROWS>(data, at + PIXEL, places, rows, costs);
                    known = at + 2 * PIXEL;
                    if next.gain <= found.gain {
                        break;
                    }
                    at += PIXEL;
                    found = next;
                }

                // The match may begin earlier, at a place that was skipped.
                while at > pending.max(found.distance)
                    && found.length < LONGEST_MATCH
                    && data[at - 1] == data[at - 1 - found.distance]
                {
                    at -= 1;
                    found.length += 1;
                }

                tokens.literals(data, pending, at);
                tokens.any_match(found.length, found.distance);
                symbols += at - pending + 1;
                at += found.length;
                pending = at;

                // Remember the places in the match. The places in a run are all alike.
                let until = at.min(end);
                let run = found.distance <= 8 && found.distance < found.length;
                if run || found.length > search.remember {
                    known += (until.saturating_sub(known) / PIXEL).saturating_sub(4) * PIXEL;
                }
                while known < until {
                    hash_matcher.insert::<WORDS>(data, known);
                    known += PIXEL;
                }
            }

            let full = symbols + (at - pending) >= BLOCK || block < boundary && at >= boundary;
            if full && at < end {
                tokens.literals(data, pending, at);
                write_block(data, block..at, tokens, false, costs, out);
                tokens.clear();
                block = at;
                symbols = 0;
                pending = at;
            }
        }

        tokens.literals(data, pending, data.len());
        write_block(data, block..data.len(), tokens, true, costs, out);
    }
}

/// A part of the data, for the search at fixed distances.
struct FixedPart<'a, 'b> {
    data: &'a [u8],
    /// The first byte of the part.
    at: usize,
    /// The first byte of the next part.
    until: usize,
    tokens: &'a mut Tokens,
    costs: &'a mut Costs,
    out: &'a mut BitWriter<'b>,
}

impl FixedPart<'_, '_> {
    /// Writes the part as blocks, with matches of at least `SHORTEST` bytes, which is 3 or [`LONG`]. Returns
    /// the place where it ended: the last match may extend into the next part.
    #[inline(always)]
    fn parse<C: Compare, M: Mask<N>, const N: usize, const SHORTEST: usize>(
        &mut self,
        compare: C,
        matcher: &mut FixedDistanceMatcher<M>,
    ) -> usize {
        let Self { data, mut at, until, ref mut tokens, ref mut costs, ref mut out } = *self;
        matcher.begin(at);
        tokens.clear();

        // The first byte of the block, and the first byte that is not in a token.
        let mut block = at;
        let mut pending = at;
        // The place where the block is full if no match comes before.
        let mut full = at + BLOCK;
        loop {
            at = at.min(data.len());
            if at >= full.min(until) {
                let last = at == data.len();
                tokens.literals(data, pending, at);
                write_block(data, block..at, tokens, last, costs, out);
                if at >= until {
                    return at;
                }
                tokens.clear();
                block = at;
                pending = at;
                full = at + BLOCK;
            }

            // The search pauses where the block may be full or masks are missing.
            let pause = matcher.reach(compare, data, at).min(full).min(until);
            let places = matcher.places();
            while at < pause {
                let Some(mut found) = places.longest::<C, N, SHORTEST>(compare, data, at) else {
                    at = if SHORTEST == 3 {
                        places.next(at + 1, pause)
                    } else {
                        at + LONG_STEP
                    };
                    continue;
                };

                if SHORTEST <= PAYING && found.length <= PAYING && !costs.pays(data, at, found) {
                    at += 1;
                    continue;
                }

                // The match may begin earlier, at a place that was skipped.
                if SHORTEST > PAYING {
                    let distance = tokens.fixed_distances[found.index];
                    while at > pending.max(distance)
                        && found.length < LONGEST_MATCH
                        && data[at - 1] == data[at - 1 - distance]
                    {
                        at -= 1;
                        found.length += 1;
                    }
                }

                tokens.literals(data, pending, at);
                tokens.fixed_match(found.index, found.length);
                at += found.length;
                pending = at;
                full += found.length - 1;
            }
        }
    }
}

struct AtFixedDistances<'a, 'b, 'c> {
    parser: Parser<'a>,
    data: &'b [u8],
    out: &'b mut BitWriter<'c>,
}

impl Kernel for AtFixedDistances<'_, '_, '_> {
    type Output = ();
    const GAINS_FROM_AVX512: bool = true;

    #[inline(always)]
    fn run<C: Compare>(self, compare: C) {
        self.parser.at_fixed_distances(compare, self.data, self.out);
    }
}

struct ByHash<'a, 'b, 'c> {
    parser: Parser<'a>,
    data: &'b [u8],
    out: &'b mut BitWriter<'c>,
}

impl Kernel for ByHash<'_, '_, '_> {
    type Output = ();
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) {
        self.parser.by_hash(self.data, self.out);
    }
}
