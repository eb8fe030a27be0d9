//! Blocks: what was found becomes bits, in whichever of the three forms of RFC 1951 is shortest.

use crate::bit_writer::{BitWriter, Bits};
use crate::fixed_distance::{LANES, Repeated};
use crate::huffman::{canonical_codes, code_lengths};
use crate::tokens::{Tokens, count_bytes};
use std::array::from_fn;
use std::ops::Range;

/// The longest repetition.
pub(crate) const LONGEST: usize = 258;

const END_OF_BLOCK: usize = 256;
const LITERALS_AND_LENGTHS: usize = 286;
pub(crate) const DISTANCES: usize = 30;
/// The order in which the lengths of the code for code lengths are written.
const LENGTHS_ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
/// The longest code of a symbol, in bits: one less than the format allows, so that four are written in one step.
const LONGEST_CODE: u8 = 14;
/// What a symbol that has not occurred is taken to cost, in bits; a distance's symbol costs no more than the second.
const RARE: u8 = 13;
const FAR: u8 = 9;

/// The symbol of a length of 3 to 258, counted from 257, and its number of extra bits.
const fn length_symbol(length: usize) -> (usize, u32) {
    if length == 258 {
        return (28, 0);
    }
    let l = length - 3;
    if l < 8 {
        return (l, 0);
    }
    let extra = l.ilog2() - 2;
    (4 * extra as usize + (l >> extra), extra)
}

/// The symbol of a distance of 1 to 32,768 and its number of extra bits.
#[inline(always)]
pub(crate) const fn distance_symbol(distance: usize) -> (usize, u32) {
    let d = distance - 1;
    // The first four have symbols of their own, as if they had a bit more.
    let extra = (d | 2).ilog2() - 1;
    (2 * extra as usize + (d >> extra), extra)
}

/// Symbol and number of extra bits by length − 3.
pub(crate) const LENGTH_SYMBOLS: [(u8, u8); 256] = {
    let mut table = [(0, 0); 256];
    let mut i = 0;
    while i < 256 {
        let (symbol, extra) = length_symbol(i + 3);
        table[i] = (symbol as u8, extra as u8);
        i += 1;
    }
    table
};

/// What things cost in bits, as far as is known when they are chosen: by the code of the block before.
pub(crate) struct Prices {
    literals: [u8; 256],
    /// By length − 3, with its extra bits.
    lengths: [u8; 256],
    /// By the distance's logarithm, rounded down, with its extra bits.
    distances: [u8; 16],
    /// The same by lane.
    lanes: [u8; 2 * LANES],
}

impl Prices {
    /// Before there was a block: literals as they are distributed in `data`.
    pub(crate) fn guess(data: &[u8], tokens: &Tokens) -> Self {
        let mut codes = Codes { litlen: [0; 288], distance: [5; 32] };
        let mut counts = [0; 256];
        count_bytes(data, &mut counts);
        code_lengths(&counts, LONGEST_CODE, &mut codes.litlen[..256]);
        codes.litlen[257..].fill(7);
        Self::of(&codes, tokens)
    }

    fn of(codes: &Codes, tokens: &Tokens) -> Self {
        let price = |length: u8| if length == 0 { RARE } else { length };
        let distances: [u8; 16] = from_fn(|log| {
            // Two symbols have that logarithm, nearly.
            let shorter = codes.distance[2 * log].min(codes.distance[(2 * log + 1).min(DISTANCES - 1)]);
            price(shorter).min(FAR) + (log as u8).saturating_sub(1)
        });
        Self {
            literals: from_fn(|byte| price(codes.litlen[byte])),
            lengths: LENGTH_SYMBOLS
                .map(|(symbol, extra)| price(codes.litlen[257 + usize::from(symbol)]) + extra),
            lanes: tokens.lanes.map(|distance| distances[distance.ilog2() as usize & 15]),
            distances,
        }
    }

    #[inline(always)]
    pub(crate) fn literal(&self, byte: u8) -> u32 {
        self.literals[usize::from(byte)].into()
    }

    #[inline(always)]
    pub(crate) fn repetition(&self, length: usize, distance: usize) -> u32 {
        u32::from(self.lengths[length - 3]) + u32::from(self.distances[distance.ilog2() as usize & 15])
    }

    /// Whether a repetition of what is at `at`, of `SHORTEST` bytes at least, costs less than its bytes as they are. Only the
    /// first `PRICED` of them are asked.
    #[inline(always)]
    pub(crate) fn pays<const PRICED: usize, const SHORTEST: usize>(
        &self,
        data: &[u8],
        at: usize,
        found: Repeated,
    ) -> bool {
        let price = u32::from(self.lengths[found.length - 3]) + u32::from(self.lanes[found.lane]);
        let here: &[u8; PRICED] = data[at..].first_chunk().unwrap_or(&[0; PRICED]);
        let literals = here.map(|byte| self.literal(byte));
        if SHORTEST >= PRICED {
            return literals.iter().sum::<u32>() * found.length as u32 / PRICED as u32 > price;
        }
        // In an array, so that the length needs no branch.
        let (mut sums, mut sum) = ([0; PRICED], 0);
        for (at, literal) in sums.iter_mut().zip(literals) {
            sum += literal;
            *at = sum;
        }
        sums[found.length.min(PRICED) - 1] * found.length.max(PRICED) as u32 / PRICED as u32 > price
    }
}

/// The lengths of the codes of a block, 0 of symbols that do not occur.
struct Codes {
    litlen: [u8; 288],
    distance: [u8; 32],
}

impl Codes {
    /// The codes of fixed blocks.
    const FIXED: Self = {
        let mut litlen = [8; 288];
        let mut i = 144;
        while i < 280 {
            litlen[i] = if i < 256 { 9 } else { 7 };
            i += 1;
        }
        Self { litlen, distance: [5; 32] }
    };

    /// The codes themselves: of literals and lengths, and of distances.
    fn values(&self) -> ([Bits; 288], [Bits; 32]) {
        (values(&self.litlen), values(&self.distance))
    }

    fn cost(&self, counts: &Counts) -> u64 {
        let sum = |counts: &[u32], lengths: &[u8]| -> u64 {
            counts.iter().zip(lengths).map(|(&n, &l)| u64::from(n) * u64::from(l)).sum()
        };
        sum(&counts.litlen, &self.litlen) + sum(&counts.distance, &self.distance)
    }
}

fn values<const N: usize>(lengths: &[u8; N]) -> [Bits; N] {
    let mut codes = [0; N];
    canonical_codes(lengths, &mut codes);
    from_fn(|i| Bits::new(codes[i].into(), lengths[i].into()))
}

/// How often each symbol occurs.
pub(crate) struct Counts {
    pub(crate) litlen: [u32; 288],
    pub(crate) distance: [u32; 32],
    /// Extra bits of lengths and distances.
    pub(crate) extra: u64,
}

/// The lengths of both codes, themselves coded.
struct Description {
    /// Symbol and value of its extra bits.
    items: Vec<(u8, u8)>,
    lengths: [u8; 19],
    codes: [u16; 19],
    /// Number of lengths of literals and lengths, of distances, and of those in `lengths`, in the order of the format.
    counts: [usize; 3],
    bits: u64,
}

const DESCRIPTION_EXTRA: [u32; 19] = {
    let mut extra = [0; 19];
    (extra[16], extra[17], extra[18]) = (2, 3, 7);
    extra
};

impl Description {
    fn new(codes: &Codes) -> Self {
        let used = |lengths: &[u8], least: usize| {
            lengths.iter().rposition(|&l| l > 0).map_or(least, |i| least.max(i + 1))
        };
        let (litlens, distances) = (used(&codes.litlen, 257), used(&codes.distance, 1));
        let mut all = [0; LITERALS_AND_LENGTHS + DISTANCES];
        all[..litlens].copy_from_slice(&codes.litlen[..litlens]);
        all[litlens..][..distances].copy_from_slice(&codes.distance[..distances]);

        let mut items = Vec::with_capacity(litlens + distances);
        for same in all[..litlens + distances].chunk_by(|a, b| a == b) {
            let (length, mut n) = (same[0], same.len());
            if length > 0 {
                items.push((length, 0));
                n -= 1;
            }
            while n >= 3 {
                let (symbol, least, most) = match (length, n) {
                    (0, 11..) => (18, 11, 138),
                    (0, _) => (17, 3, 10),
                    _ => (16, 3, 6),
                };
                let take = n.min(most);
                items.push((symbol, (take - least) as u8));
                n -= take;
            }
            items.extend((0..n).map(|_| (length, 0)));
        }
        let mut counts = [0; 19];
        items.iter().for_each(|&(symbol, _)| counts[usize::from(symbol)] += 1);
        let (mut lengths, mut code_values) = ([0; 19], [0; 19]);
        code_lengths(&counts, 7, &mut lengths);
        canonical_codes(&lengths, &mut code_values);
        let written = LENGTHS_ORDER.iter().rposition(|&i| lengths[i] > 0).map_or(4, |i| 4.max(i + 1));
        let bits =
            (0..19).map(|i| u64::from(counts[i]) * (u64::from(lengths[i]) + u64::from(DESCRIPTION_EXTRA[i])));
        let bits = 14 + 3 * written as u64 + bits.sum::<u64>();
        Self { items, lengths, codes: code_values, counts: [litlens, distances, written], bits }
    }

    fn write(&self, out: &mut BitWriter<'_>) {
        let [litlens, distances, written] = self.counts;
        out.add(litlens as u64 - 257, 5);
        out.add(distances as u64 - 1, 5);
        out.add(written as u64 - 4, 4);
        for i in &LENGTHS_ORDER[..written] {
            out.flush();
            out.add(u64::from(self.lengths[*i]), 3);
        }
        for &(symbol, value) in &self.items {
            let s = usize::from(symbol);
            out.flush();
            out.add(u64::from(self.codes[s]), self.lengths[s].into());
            out.add(value.into(), DESCRIPTION_EXTRA[s]);
        }
        out.flush();
    }
}

/// Writes what is in `place` of `data` as one block, as `tokens` take it apart, and learns what things cost.
#[inline(always)]
pub(crate) fn write_block(
    data: &[u8],
    place: Range<usize>,
    tokens: &mut Tokens,
    last: bool,
    prices: &mut Prices,
    out: &mut BitWriter<'_>,
) {
    let mut counts = tokens.count(data);
    counts.litlen[END_OF_BLOCK] = 1;

    let mut codes = Codes { litlen: [0; 288], distance: [0; 32] };
    code_lengths(&counts.litlen, LONGEST_CODE, &mut codes.litlen);
    code_lengths(&counts.distance, LONGEST_CODE, &mut codes.distance);
    *prices = Prices::of(&codes, tokens);
    let description = Description::new(&codes);
    let dynamic = description.bits + codes.cost(&counts) + counts.extra;
    let fixed = Codes::FIXED.cost(&counts) + counts.extra;
    let stored = 8 * place.len() as u64 + 40 * place.len().div_ceil(0xffff).max(1) as u64;
    let first = u64::from(last);
    if stored < dynamic.min(fixed) {
        write_stored(&data[place], last, out);
        return;
    }
    out.reserve(dynamic.min(fixed) + 3);
    let codes = if fixed <= dynamic {
        out.add(first | 1 << 1, 3);
        &Codes::FIXED
    } else {
        out.add(first | 2 << 1, 3);
        description.write(out);
        &codes
    };
    let (litlen, distance) = codes.values();
    tokens.write(data, &litlen, &distance, out);
    out.append(litlen[END_OF_BLOCK]);
    out.flush();
}

fn write_stored(data: &[u8], last: bool, out: &mut BitWriter<'_>) {
    let mut pieces = data.chunks(0xffff).peekable();
    while let Some(piece) = pieces.next() {
        out.reserve(8 * piece.len() as u64 + 64);
        out.add(u64::from(last && pieces.peek().is_none()), 3);
        out.align();
        out.add(piece.len() as u64 | (piece.len() as u64 ^ 0xffff) << 16, 32);
        out.flush();
        out.bytes(piece);
    }
}
