//! Tables that decode prefix codes. Source: RFC 1951, 3.2.2 and 3.2.5.
//!
//! The next bits of the stream, lowest first, are an index into a table. Codes longer than the index continue
//! in a second table, which is stored after the first.

use crate::Error;
use crate::alphabet::CodeLengths;

/// The number of bits of an index into the table of literals and lengths.
pub(super) const LITLEN_BITS: u32 = 11;
/// The size of the table of literals and lengths, with second tables. Less than 2,400 entries are used, since
/// no code has more than 15 bits. A power of two, so that an index can be masked.
pub(super) const LITLEN_SIZE: usize = 4096;
/// The number of bits of an index into the table of distances.
pub(super) const DISTANCE_BITS: u32 = 8;
/// The size of the table of distances. At most 402 entries are used.
pub(super) const DISTANCE_SIZE: usize = 512;
/// The number of bits of an index into the table of code lengths, whose codes have up to seven bits.
pub(super) const LENGTHS_BITS: u32 = 7;
/// The size of the table of code lengths.
pub(super) const LENGTHS_SIZE: usize = 128;

/// The longest code, in bits.
const LONGEST: usize = 15;

/// The meaning of the bits of an index. All lengths are in bits.
///
/// | bits | literals | length or distance | second table |
/// |---|---|---|---|
/// | 0–7 | length of all codes | length of the code and the extra bits | length of the first index |
/// | 8–12 | number of literals, 1 or 2 | length of the code | length of the second index |
/// | 13, 14 | | 13: end of the block; 14: no symbol | 13 and 14 |
/// | 15 | set | | |
/// | 16–31 | the first, the second | the smallest value | the place of the table |
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub(super) struct Entry(u32);

const LITERAL: u32 = 1 << 15;
const END: u32 = 1 << 13;
const NONE: u32 = 1 << 14;

impl Entry {
    #[inline(always)]
    pub(super) fn is_literal(self) -> bool {
        self.0 & LITERAL != 0
    }

    /// Returns true if the entry is neither literals nor a length or distance.
    #[inline(always)]
    pub(super) fn is_special(self) -> bool {
        self.0 & (END | NONE) != 0
    }

    #[inline(always)]
    pub(super) fn is_second_table(self) -> bool {
        self.0 & (END | NONE) == END | NONE
    }

    #[inline(always)]
    pub(super) fn is_end(self) -> bool {
        self.0 & (END | NONE) == END
    }

    /// Returns the number of bits of the stream that the entry takes.
    #[inline(always)]
    pub(super) fn bits(self) -> u32 {
        self.0 & 0x3f
    }

    /// Returns the number of literals.
    #[inline(always)]
    pub(super) fn literals(self) -> usize {
        (self.0 >> 8 & 3) as usize
    }

    /// Returns the literals in order. In a table of code lengths, the first byte is the symbol.
    #[inline(always)]
    pub(super) fn bytes(self) -> [u8; 2] {
        ((self.0 >> 16) as u16).to_le_bytes()
    }

    /// Returns the length or distance. `bits` begin with its code.
    #[inline(always)]
    pub(super) fn value(self, bits: u64) -> usize {
        let extra = (bits & !(u64::MAX << self.bits())) >> (self.0 >> 8 & 0x1f);
        (self.0 >> 16) as usize + extra as usize
    }

    /// Returns the place in the whole table of an entry of the second table. `bits` are the bits after the
    /// first index.
    #[inline(always)]
    fn place(self, bits: u64) -> usize {
        (self.0 >> 16) as usize + (bits & !(u64::MAX << (self.0 >> 8 & 0x1f))) as usize
    }

    fn literal(byte: u32) -> Self {
        Self(LITERAL | 1 << 8 | byte << 16)
    }

    /// Makes an entry of values from `least` on, with `extra` extra bits.
    fn value_from(least: u32, extra: u32) -> Self {
        Self(least << 16 | extra)
    }

    /// Adds the number of bits of the code.
    fn behind(self, code: u32) -> Self {
        let is_value = self.0 & (LITERAL | END | NONE) == 0;
        Self(self.0 + code + if is_value { code << 8 } else { 0 })
    }

    fn second_table(first: usize, bits: u32, index: u32) -> Self {
        Self((first as u32) << 16 | END | NONE | bits << 8 | index)
    }
}

/// The meaning of symbols.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Alphabet {
    Litlen,
    Distance,
    /// Code lengths: the symbols stand for themselves.
    Lengths,
}

impl Alphabet {
    fn entry(self, symbol: usize) -> Entry {
        let symbol = symbol as u32;
        // The reverse of `alphabet::length_symbol` and `distance_symbol`.
        match (self, symbol) {
            (Self::Lengths, _) | (Self::Litlen, 0..=255) => Entry::literal(symbol),
            (Self::Litlen, 256) => Entry(END),
            (Self::Litlen, 257..=264) => Entry::value_from(symbol - 254, 0),
            (Self::Litlen, 265..=284) => {
                let extra = (symbol - 261) / 4;
                Entry::value_from(3 + ((4 + (symbol - 261) % 4) << extra), extra)
            }
            (Self::Litlen, 285) => Entry::value_from(258, 0),
            (Self::Distance, 0..=3) => Entry::value_from(symbol + 1, 0),
            (Self::Distance, 4..=29) => {
                let extra = symbol / 2 - 1;
                Entry::value_from(1 + ((2 + symbol % 2) << extra), extra)
            }
            _ => Entry(NONE),
        }
    }

    fn index_bits(self) -> u32 {
        match self {
            Self::Litlen => LITLEN_BITS,
            Self::Distance => DISTANCE_BITS,
            Self::Lengths => LENGTHS_BITS,
        }
    }
}

/// Returns the number of codes of the longest length that are not used.
fn codes_left(counts: &[u32; LONGEST + 1]) -> Result<i64, Error> {
    let mut left = 1i64;
    for count in &counts[1..] {
        left = 2 * left - i64::from(*count);
        if left < 0 {
            return Err(Error::damaged("too many codes of a length"));
        }
    }
    Ok(left)
}

/// Returns the symbols that have a code, in the order of the lengths of their codes.
fn symbols_by_length(lengths: &[u8], counts: &[u32; LONGEST + 1]) -> [u16; 320] {
    let mut next = [0usize; LONGEST + 2];
    (1..=LONGEST).for_each(|length| next[length + 1] = next[length] + counts[length] as usize);
    let mut sorted = [0u16; 320];
    for (symbol, length) in (0..).zip(lengths).filter(|(_, length)| **length > 0) {
        let place = &mut next[usize::from(*length) & LONGEST];
        sorted[*place] = symbol;
        *place += 1;
    }
    sorted
}

/// A table of `N` entries, a power of two.
pub(super) struct Table<const N: usize> {
    alphabet: Alphabet,
    entries: Box<[Entry; N]>,
    is_fixed: bool,
}

impl<const N: usize> Table<N> {
    pub(super) fn new(alphabet: Alphabet) -> Self {
        Self { alphabet, entries: Box::new([Entry(NONE); N]), is_fixed: false }
    }

    /// Returns the entry whose index is the next bits of the stream.
    #[inline(always)]
    pub(super) fn first(&self, bits: u64, index_bits: u32) -> Entry {
        self.entries[bits as usize & ((1 << index_bits) - 1) & (N - 1)]
    }

    /// Returns the entry in a second table. `bits` are the bits after the first index.
    #[inline(always)]
    pub(super) fn second(&self, entry: Entry, bits: u64) -> Entry {
        self.entries[entry.place(bits) & (N - 1)]
    }

    /// Builds the table for blocks with fixed codes.
    pub(super) fn build_fixed(&mut self) -> Result<(), Error> {
        if self.is_fixed {
            return Ok(());
        }
        match self.alphabet {
            Alphabet::Litlen => self.build(&CodeLengths::FIXED.litlen)?,
            _ => self.build(&CodeLengths::FIXED.distance)?,
        }
        self.is_fixed = true;
        Ok(())
    }

    /// Builds the table for codes with these lengths, by symbol. A symbol of length 0 has no code.
    pub(super) fn build(&mut self, lengths: &[u8]) -> Result<(), Error> {
        self.is_fixed = false;
        let mut counts = [0u32; LONGEST + 1];
        lengths
            .iter()
            .for_each(|length| counts[usize::from(*length) & LONGEST] += 1);
        counts[0] = 0;

        let codes: u32 = counts.iter().sum();
        let left = codes_left(&counts)?;
        // A single distance may have a code of one bit. Without distances, there may be no code.
        let is_single = self.alphabet == Alphabet::Distance && (codes == 0 || (codes == 1 && counts[1] == 1));
        if left > 0 && !is_single {
            return Err(Error::damaged("an incomplete set of codes"));
        }

        let sorted = symbols_by_length(lengths, &counts);
        let index_bits = self.alphabet.index_bits();
        let size = 1usize << index_bits;
        if is_single {
            self.entries[..size].fill(Entry(NONE));
        }

        let mut symbols = sorted[..codes as usize].iter();
        // The code, with its bits in the order of the stream.
        let mut code = 0usize;
        // The number of entries that are filled. Doubling them repeats the entries of shorter codes.
        let mut made = 1usize;
        // The prefix of the current second table, its place and the number of bits of its index.
        let mut second = (usize::MAX, 0, 0);
        let mut end = size;

        for length in 1..=LONGEST as u32 {
            let first = length.min(index_bits);
            while made < 1 << first {
                self.entries.copy_within(..made, made);
                made *= 2;
            }
            for n in (0..counts[length as usize]).rev() {
                let Some(symbol) = symbols.next() else { break };
                let entry = self.alphabet.entry(usize::from(*symbol));

                if length <= index_bits {
                    self.entries[code] = entry.behind(length);
                } else {
                    let prefix = code & (size - 1);
                    if prefix != second.0 {
                        // The index has as many bits as the remaining codes with this prefix need.
                        let mut bits = length - index_bits;
                        let mut room = (1i64 << bits) - i64::from(n + 1);
                        while room > 0 && index_bits + bits < LONGEST as u32 {
                            bits += 1;
                            room = 2 * room - i64::from(counts[(index_bits + bits) as usize]);
                        }
                        second = (prefix, end, bits);
                        self.entries[prefix] = Entry::second_table(end, bits, index_bits);
                        end += 1 << bits;
                    }

                    let (_, begin, bits) = second;
                    let entry = entry.behind(length - index_bits);
                    let step = 1 << (length - index_bits);
                    let places = (begin + (code >> index_bits)..begin + (1 << bits)).step_by(step);
                    places.for_each(|place| self.entries[place] = entry);
                }

                // The next code: add one at its last bit, which is the highest here.
                let zeros = code ^ ((1 << length) - 1);
                code = zeros
                    .checked_ilog2()
                    .map_or(0, |bit| code & ((1 << bit) - 1) | 1 << bit);
            }
        }

        if self.alphabet == Alphabet::Litlen {
            self.pair_literals();
        }
        Ok(())
    }

    /// Makes entries of two literals, for indices with room for both codes. It starts from the last, because
    /// each entry reads an earlier one, which must still be a single literal.
    fn pair_literals(&mut self) {
        for index in (0..1usize << LITLEN_BITS).rev() {
            let one = self.entries[index];
            let two = self.entries[index >> one.bits()];
            let bits = one.bits() + two.bits();
            if one.is_literal() && two.is_literal() && bits <= LITLEN_BITS {
                let bytes = one.0 & 0x00ff_0000 | (two.0 & 0x00ff_0000) << 8;
                self.entries[index] = Entry(LITERAL | 2 << 8 | bits | bytes);
            }
        }
    }
}
