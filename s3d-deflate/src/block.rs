//! Blocks: literals and matches become bits, in whichever of the three forms of RFC 1951 is shortest.

use crate::bit_writer::{BitWriter, Bits};
use crate::costs::Costs;
use crate::huffman::{canonical_codes, code_lengths};
use crate::tokens::Tokens;
use std::array::from_fn;
use std::ops::Range;

/// The longest match.
pub(crate) const LONGEST_MATCH: usize = 258;

const END_OF_BLOCK: usize = 256;
const LITERALS_AND_LENGTHS: usize = 286;
pub(crate) const DISTANCES: usize = 30;
/// The order in which the code lengths of the code length alphabet are written.
const CODE_LENGTH_ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
/// The longest code of a symbol, in bits: one less than the format allows, so that four are written in one
/// step.
pub(crate) const LONGEST_CODE: u8 = 14;

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

/// The code lengths of a block, 0 for symbols that do not occur.
pub(crate) struct CodeLengths {
    /// Of literals and lengths.
    pub(crate) litlen: [u8; 288],
    pub(crate) distance: [u8; 32],
}

impl CodeLengths {
    /// Those of blocks with fixed codes.
    const FIXED: Self = {
        let mut litlen = [8; 288];
        let mut i = 144;
        while i < 280 {
            litlen[i] = if i < 256 { 9 } else { 7 };
            i += 1;
        }
        Self { litlen, distance: [5; 32] }
    };

    /// The codes: of literals and lengths, and of distances.
    fn codes(&self) -> ([Bits; 288], [Bits; 32]) {
        (codes(&self.litlen), codes(&self.distance))
    }

    /// Bits that the counted symbols take, without extra bits.
    fn bits(&self, counts: &Counts) -> u64 {
        let sum = |counts: &[u32], lengths: &[u8]| -> u64 {
            counts.iter().zip(lengths).map(|(&n, &l)| u64::from(n) * u64::from(l)).sum()
        };
        sum(&counts.litlen, &self.litlen) + sum(&counts.distance, &self.distance)
    }
}

fn codes<const N: usize>(lengths: &[u8; N]) -> [Bits; N] {
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

/// The header of a block with dynamic codes: the code lengths of both alphabets, themselves coded.
struct DynamicHeader {
    /// Symbols of the code length alphabet, and the values of their extra bits.
    symbols: Vec<(u8, u8)>,
    lengths: [u8; 19],
    codes: [u16; 19],
    /// HLIT, HDIST and HCLEN of the format, plus what it takes off them: how many code lengths there are for
    /// literals and lengths, for distances, and of the code length alphabet.
    counts: [usize; 3],
    bits: u64,
}

/// Extra bits of the code length alphabet's symbols.
const CODE_LENGTH_EXTRA: [u32; 19] = {
    let mut extra = [0; 19];
    (extra[16], extra[17], extra[18]) = (2, 3, 7);
    extra
};

impl DynamicHeader {
    fn new(block: &CodeLengths) -> Self {
        let used =
            |lengths: &[u8], min: usize| lengths.iter().rposition(|&l| l > 0).map_or(min, |i| min.max(i + 1));
        let (litlens, distances) = (used(&block.litlen, 257), used(&block.distance, 1));
        let mut all = [0; LITERALS_AND_LENGTHS + DISTANCES];
        all[..litlens].copy_from_slice(&block.litlen[..litlens]);
        all[litlens..][..distances].copy_from_slice(&block.distance[..distances]);

        let mut symbols = Vec::with_capacity(litlens + distances);
        for same in all[..litlens + distances].chunk_by(|a, b| a == b) {
            let (length, mut n) = (same[0], same.len());
            if length > 0 {
                symbols.push((length, 0));
                n -= 1;
            }
            while n >= 3 {
                let (symbol, min, max) = match (length, n) {
                    (0, 11..) => (18, 11, 138),
                    (0, _) => (17, 3, 10),
                    _ => (16, 3, 6),
                };
                let take = n.min(max);
                symbols.push((symbol, (take - min) as u8));
                n -= take;
            }
            symbols.extend((0..n).map(|_| (length, 0)));
        }
        let mut counts = [0; 19];
        symbols.iter().for_each(|&(symbol, _)| counts[usize::from(symbol)] += 1);
        let (mut lengths, mut codes) = ([0; 19], [0; 19]);
        code_lengths(&counts, 7, &mut lengths);
        canonical_codes(&lengths, &mut codes);
        let written = CODE_LENGTH_ORDER.iter().rposition(|&i| lengths[i] > 0).map_or(4, |i| 4.max(i + 1));
        let bits =
            (0..19).map(|i| u64::from(counts[i]) * (u64::from(lengths[i]) + u64::from(CODE_LENGTH_EXTRA[i])));
        let bits = 14 + 3 * written as u64 + bits.sum::<u64>();
        Self { symbols, lengths, codes, counts: [litlens, distances, written], bits }
    }

    fn write(&self, out: &mut BitWriter<'_>) {
        let [litlens, distances, written] = self.counts;
        out.add(litlens as u64 - 257, 5);
        out.add(distances as u64 - 1, 5);
        out.add(written as u64 - 4, 4);
        for i in &CODE_LENGTH_ORDER[..written] {
            out.flush();
            out.add(u64::from(self.lengths[*i]), 3);
        }
        for &(symbol, value) in &self.symbols {
            let s = usize::from(symbol);
            out.flush();
            out.add(u64::from(self.codes[s]), self.lengths[s].into());
            out.add(value.into(), CODE_LENGTH_EXTRA[s]);
        }
        out.flush();
    }
}

/// Writes the bytes in `place` of `data` as one block: `tokens` are its literals and matches. Sets `costs` to
/// those of the block's codes.
#[inline(always)]
pub(crate) fn write_block(
    data: &[u8],
    place: Range<usize>,
    tokens: &mut Tokens,
    last: bool,
    costs: &mut Costs,
    out: &mut BitWriter<'_>,
) {
    let mut counts = tokens.count(data);
    counts.litlen[END_OF_BLOCK] = 1;

    let mut lengths = CodeLengths { litlen: [0; 288], distance: [0; 32] };
    code_lengths(&counts.litlen, LONGEST_CODE, &mut lengths.litlen);
    code_lengths(&counts.distance, LONGEST_CODE, &mut lengths.distance);
    *costs = Costs::of(&lengths, tokens);
    let header = DynamicHeader::new(&lengths);
    let dynamic = header.bits + lengths.bits(&counts) + counts.extra;
    let fixed = CodeLengths::FIXED.bits(&counts) + counts.extra;
    let stored = 8 * place.len() as u64 + 40 * place.len().div_ceil(0xffff).max(1) as u64;
    let first = u64::from(last);
    if stored < dynamic.min(fixed) {
        write_stored(&data[place], last, out);
        return;
    }
    out.reserve(dynamic.min(fixed) + 3);
    let lengths = if fixed <= dynamic {
        out.add(first | 1 << 1, 3);
        &CodeLengths::FIXED
    } else {
        out.add(first | 2 << 1, 3);
        header.write(out);
        &lengths
    };
    let (litlen, distance) = lengths.codes();
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
