//! The costs of literals and matches in bits, which decide which are taken.

use crate::alphabet::{CodeLengths, DISTANCES, LENGTH_SYMBOLS, LONGEST_CODE};
use crate::fixed_distance::{FIXED, FixedMatch};
use crate::huffman::code_lengths;
use crate::tokens::{Tokens, count_bytes};
use std::array::from_fn;

/// The assumed cost of a symbol that has not occurred.
const RARE: u8 = 13;
/// The largest assumed cost of the symbol of a distance.
const FAR: u8 = 9;

/// The expected costs of literals and matches in bits, by the codes of the block before.
pub(crate) struct Costs {
    literals: [u8; 256],
    /// For each length − 3, with extra bits.
    lengths: [u8; 256],
    /// For each logarithm of the distance, rounded down, with extra bits.
    distances: [u8; 16],
    /// For each fixed distance, with extra bits.
    fixed_distances: [u8; FIXED],
}

impl Costs {
    /// Guesses the costs for the first block. Literals cost as their distribution in `data` says.
    pub(crate) fn guess(data: &[u8], tokens: &Tokens) -> Self {
        let mut lengths = CodeLengths { litlen: [0; 288], distance: [5; 32] };
        let mut counts = [0; 256];
        count_bytes(data, &mut counts);
        code_lengths(&counts, LONGEST_CODE, &mut lengths.litlen[..256]);
        lengths.litlen[257..].fill(7);
        Self::of(&lengths, tokens)
    }

    /// Returns the costs by the codes of a block.
    pub(crate) fn of(lengths: &CodeLengths, tokens: &Tokens) -> Self {
        let distances: [u8; 16] = from_fn(|log| {
            // Two symbols have this logarithm, except at the ends.
            let shorter = lengths.distance[2 * log].min(lengths.distance[(2 * log + 1).min(DISTANCES - 1)]);
            cost_of(shorter).min(FAR) + (log as u8).saturating_sub(1)
        });
        Self {
            literals: from_fn(|byte| cost_of(lengths.litlen[byte])),
            lengths: LENGTH_SYMBOLS
                .map(|(symbol, extra)| cost_of(lengths.litlen[257 + usize::from(symbol)]) + extra),
            fixed_distances: tokens
                .fixed_distances
                .map(|distance| distances[distance.ilog2() as usize & 15]),
            distances,
        }
    }

    #[inline(always)]
    pub(crate) fn literal(&self, byte: u8) -> u32 {
        self.literals[usize::from(byte)].into()
    }

    #[inline(always)]
    pub(crate) fn any_match(&self, length: usize, distance: usize) -> u32 {
        u32::from(self.lengths[length - 3]) + u32::from(self.distances[distance.ilog2() as usize & 15])
    }

    /// Returns true if a match at `at` costs less than its bytes as literals. The cost of the literals is
    /// extrapolated from the first three.
    #[inline(always)]
    pub(crate) fn pays(&self, data: &[u8], at: usize, found: FixedMatch) -> bool {
        const PRICED: usize = 3;
        let cost = u32::from(self.lengths[found.length - 3]) + u32::from(self.fixed_distances[found.index]);
        let here: &[u8; PRICED] = data[at..].first_chunk().unwrap_or(&[0; PRICED]);
        here.map(|byte| self.literal(byte)).iter().sum::<u32>() * found.length as u32 / PRICED as u32 > cost
    }
}

fn cost_of(length: u8) -> u8 {
    if length == 0 { RARE } else { length }
}
