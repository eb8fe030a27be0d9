//! Bits and Huffman codes of the picture data of a JPEG. Source: ITU-T T.81, annexes C and F.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::image::jpeg::scans::Fault;

/// The number of bits of a code that are looked up at once.
const FAST: u32 = 9;

/// A Huffman table.
pub(super) struct HuffmanTable {
    /// Length and symbol by the first [`FAST`] bits; the length 0 stands for a longer code.
    fast: Vec<(u8, u8)>,
    /// For each length from 1 to 16: the code behind its last one, and what leads from a code to the index of
    /// its symbol.
    lengths: [(u32, i32); 17],
    symbols: Vec<u8>,
}

impl HuffmanTable {
    /// Makes a table from the numbers of codes of 1 to 16 bits, and the symbols.
    pub(super) fn new(counts: &[u8; 16], symbols: &[u8]) -> Self {
        let mut table =
            Self { fast: vec![(0, 0); 1 << FAST], lengths: [(0, 0); 17], symbols: symbols.to_vec() };

        let mut code: u32 = 0;
        let mut index: u32 = 0;
        for (length, count) in (1..=16_u8).zip(counts) {
            let first = code;
            for symbol in symbols.iter().skip(index as usize).take(usize::from(*count)) {
                if let Some(spare) = FAST.checked_sub(u32::from(length)) {
                    let from = (code << spare) as usize;
                    let entries = table.fast.iter_mut().skip(from).take(1 << spare);
                    entries.for_each(|entry| *entry = (length, *symbol));
                }
                code = code.wrapping_add(1);
            }
            if let Some(entry) = table.lengths.get_mut(usize::from(length)) {
                *entry = (code, index.cast_signed().wrapping_sub(first.cast_signed()));
            }
            index = index.saturating_add(u32::from(*count));
            code = code.wrapping_shl(1);
        }
        table
    }
}

/// The bits of a scan, up to the next mark.
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    /// The position of the next byte to take.
    at: usize,
    /// The last `count` of its bits are taken from `bytes` and not read yet.
    buffer: u64,
    count: u32,
}

impl<'a> Bits<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, buffer: 0, count: 0 }
    }

    /// Takes bytes up to a mark, without the zeros that mark a byte of ones as no mark.
    fn fill(&mut self) {
        while self.count <= 48 {
            let (byte, size) = match self.bytes.get(self.at..) {
                Some([0xff, 0, ..]) => (0xff, 2),
                Some([0xff, ..] | []) | None => return,
                Some([byte, ..]) => (*byte, 1),
            };
            self.at = self.at.saturating_add(size);
            self.buffer = self.buffer << 8 | u64::from(byte);
            self.count = self.count.saturating_add(8);
        }
    }

    /// Reads a number of up to 16 bits.
    pub(super) fn take(&mut self, bits: u32) -> Result<u32, Fault> {
        if self.count < bits {
            self.fill();
        }
        self.count = self.count.checked_sub(bits).ok_or(Fault::Damaged)?;
        let mask = 1_u64.wrapping_shl(bits).wrapping_sub(1);
        Ok(u32::try_from(self.buffer >> self.count & mask).unwrap_or(0))
    }

    /// Reads a symbol.
    pub(super) fn symbol(&mut self, table: &HuffmanTable) -> Result<u8, Fault> {
        if self.count < 16 {
            self.fill();
        }
        // Zeros stand for bits behind the end.
        let ahead = match self.count.checked_sub(16) {
            Some(behind) => self.buffer >> behind,
            None => self.buffer << 16_u32.saturating_sub(self.count),
        };
        let ahead = (ahead & 0xffff) as u32;

        let (mut length, mut symbol) = table
            .fast
            .get((ahead >> (16 - FAST)) as usize)
            .copied()
            .unwrap_or_default();
        if length == 0 {
            (length, symbol) = long_code(table, ahead).ok_or(Fault::Damaged)?;
        }
        self.take(u32::from(length))?;
        Ok(symbol)
    }

    /// Reads a number of this many bits with a sign. Source: T.81, F.2.2.1, EXTEND.
    pub(super) fn signed(&mut self, bits: u32) -> Result<i32, Fault> {
        let value = self.take(bits)?.cast_signed();
        let half = 1_i32.wrapping_shl(bits) >> 1;
        let is_negative = value < half;
        let lowest = 1_i32.wrapping_sub(1_i32.wrapping_shl(bits));
        Ok(if is_negative { value.wrapping_add(lowest) } else { value })
    }

    /// Goes to the next mark, or the end of the bytes. Returns its position, how many whole bytes were left
    /// before it, and whether all of them are zeros.
    pub(super) fn skip_to_mark(mut self) -> (usize, usize, bool) {
        let mut whole = (self.count / 8) as usize;
        let bits = self.count & !7;
        let mut are_zeros = self.buffer & 1_u64.wrapping_shl(bits).wrapping_sub(1) == 0;
        loop {
            match self.bytes.get(self.at..) {
                // Bytes of ones before a mark fill up.
                Some([0xff, 0xff, ..]) => self.at = self.at.saturating_add(1),
                Some([0xff, 0, ..]) => {
                    self.at = self.at.saturating_add(2);
                    whole = whole.saturating_add(1);
                    are_zeros = false;
                }
                Some([0xff, ..] | []) | None => return (self.at, whole, are_zeros),
                Some([byte, ..]) => {
                    self.at = self.at.saturating_add(1);
                    whole = whole.saturating_add(1);
                    are_zeros &= *byte == 0;
                }
            }
        }
    }
}

/// Finds a code of more than [`FAST`] bits at the beginning of 16 bits. Returns its length and its symbol.
fn long_code(table: &HuffmanTable, ahead: u32) -> Option<(u8, u8)> {
    for (length, (behind, to_index)) in (0_u8..=16).zip(&table.lengths).skip(FAST as usize).skip(1) {
        let code = ahead >> 16_u32.saturating_sub(u32::from(length));
        if code < *behind {
            let index = usize::try_from(code.cast_signed().wrapping_add(*to_index)).ok()?;
            return Some((length, *table.symbols.get(index)?));
        }
    }
    None
}
