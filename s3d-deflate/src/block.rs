//! Blocks: writes literals and matches in the shortest of the three forms of RFC 1951.

use crate::alphabet::{CodeLengths, DISTANCES, LONGEST_CODE};
use crate::bit_writer::BitWriter;
use crate::costs::Costs;
use crate::huffman::{canonical_codes, code_lengths};
use crate::tokens::Tokens;
use std::ops::Range;

const END_OF_BLOCK: usize = 256;
const LITERALS_AND_LENGTHS: usize = 286;

/// The order in which the code lengths of the code length alphabet are written.
const CODE_LENGTH_ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/// The header of a block with dynamic codes: the code lengths of both alphabets, coded themselves.
struct DynamicHeader {
    /// The symbols of the code length alphabet, and the values of their extra bits.
    symbols: Vec<(u8, u8)>,
    lengths: [u8; 19],
    codes: [u16; 19],
    /// The numbers of code lengths: for literals and lengths, for distances, and for the code length
    /// alphabet. The format writes them as HLIT + 257, HDIST + 1 and HCLEN + 4.
    counts: [usize; 3],
    bits: u64,
}

/// The extra bits of the symbols of the code length alphabet.
const CODE_LENGTH_EXTRA: [u32; 19] = {
    let mut extra = [0; 19];
    extra[16] = 2;
    extra[17] = 3;
    extra[18] = 7;
    extra
};

impl DynamicHeader {
    fn new(block: &CodeLengths) -> Self {
        let litlens = used_symbols(&block.litlen, 257);
        let distances = used_symbols(&block.distance, 1);
        let mut all = [0; LITERALS_AND_LENGTHS + DISTANCES];
        all[..litlens].copy_from_slice(&block.litlen[..litlens]);
        all[litlens..][..distances].copy_from_slice(&block.distance[..distances]);

        let mut symbols = Vec::with_capacity(litlens + distances);
        for same in all[..litlens + distances].chunk_by(|a, b| a == b) {
            let length = same[0];
            let mut n = same.len();
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
        let mut lengths = [0; 19];
        let mut codes = [0; 19];
        code_lengths(&counts, 7, &mut lengths);
        canonical_codes(&lengths, &mut codes);

        let written = CODE_LENGTH_ORDER
            .iter()
            .rposition(|&i| lengths[i] > 0)
            .map_or(4, |i| 4.max(i + 1));
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

/// Returns the number of symbols up to the last that occurs, at least `min`.
fn used_symbols(lengths: &[u8], min: usize) -> usize {
    lengths.iter().rposition(|&l| l > 0).map_or(min, |i| min.max(i + 1))
}

/// Writes the bytes in `place` of `data` as one block. `tokens` are the literals and matches of the block.
/// Sets `costs` from the codes of the block.
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

    // The shortest form wins.
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
