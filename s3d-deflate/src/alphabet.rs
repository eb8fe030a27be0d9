//! The alphabets of RFC 1951 (3.2.5): symbols of literals, lengths and distances, how often they occur, and
//! their codes.

use crate::bit_writer::Bits;
use crate::huffman::canonical_codes;
use std::array::from_fn;

/// The longest match.
pub(crate) const LONGEST_MATCH: usize = 258;

/// Symbols of distances.
pub(crate) const DISTANCES: usize = 30;
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
    pub(crate) const FIXED: Self = {
        let mut litlen = [8; 288];
        let mut i = 144;
        while i < 280 {
            litlen[i] = if i < 256 { 9 } else { 7 };
            i += 1;
        }
        Self { litlen, distance: [5; 32] }
    };

    /// The codes: of literals and lengths, and of distances.
    pub(crate) fn codes(&self) -> ([Bits; 288], [Bits; 32]) {
        (codes(&self.litlen), codes(&self.distance))
    }

    /// Bits that the counted symbols take, without extra bits.
    pub(crate) fn bits(&self, counts: &Counts) -> u64 {
        let sum = |counts: &[u32], lengths: &[u8]| -> u64 {
            counts
                .iter()
                .zip(lengths)
                .map(|(&n, &l)| u64::from(n) * u64::from(l))
                .sum()
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
