//! The alphabets of RFC 1951 (3.2.5): the symbols of literals, lengths and distances, their counts and their
//! codes.

use crate::bit_writer::Bits;
use crate::huffman::canonical_codes;
use std::array::from_fn;

/// The longest match.
pub(crate) const LONGEST_MATCH: usize = 258;

/// The number of symbols of distances.
pub(crate) const DISTANCES: usize = 30;

/// The longest code of a symbol, in bits. It is one less than the format allows, so that four codes are
/// written in one step.
pub(crate) const LONGEST_CODE: u8 = 14;

/// Returns the symbol of a length of 3 to 258, counted from 257, and its number of extra bits.
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

/// Returns the symbol of a distance of 1 to 32,768, and its number of extra bits.
#[inline(always)]
pub(crate) const fn distance_symbol(distance: usize) -> (usize, u32) {
    let d = distance - 1;
    // The first four distances have a symbol each; `| 2` makes the logarithm fit them.
    let extra = (d | 2).ilog2() - 1;
    (2 * extra as usize + (d >> extra), extra)
}

/// For each length − 3, the symbol and its number of extra bits.
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
    /// Code lengths of literals and lengths.
    pub(crate) litlen: [u8; 288],
    pub(crate) distance: [u8; 32],
}

impl CodeLengths {
    /// The code lengths of blocks with fixed codes.
    pub(crate) const FIXED: Self = {
        let mut litlen = [8; 288];
        let mut i = 144;
        while i < 280 {
            litlen[i] = if i < 256 { 9 } else { 7 };
            i += 1;
        }
        Self { litlen, distance: [5; 32] }
    };

    /// Returns the codes of literals and lengths, and the codes of distances.
    pub(crate) fn codes(&self) -> ([Bits; 288], [Bits; 32]) {
        (codes(&self.litlen), codes(&self.distance))
    }

    /// Returns the number of bits of the counted symbols, without extra bits.
    pub(crate) fn bits(&self, counts: &Counts) -> u64 {
        sum_of_bits(&counts.litlen, &self.litlen) + sum_of_bits(&counts.distance, &self.distance)
    }
}

fn sum_of_bits(counts: &[u32], lengths: &[u8]) -> u64 {
    counts
        .iter()
        .zip(lengths)
        .map(|(&n, &l)| u64::from(n) * u64::from(l))
        .sum()
}

fn codes<const N: usize>(lengths: &[u8; N]) -> [Bits; N] {
    let mut codes = [0; N];
    canonical_codes(lengths, &mut codes);
    from_fn(|i| Bits::new(codes[i].into(), lengths[i].into()))
}

/// The counts of the symbols.
pub(crate) struct Counts {
    pub(crate) litlen: [u32; 288],
    pub(crate) distance: [u32; 32],
    /// The number of extra bits of lengths and distances.
    pub(crate) extra: u64,
}
