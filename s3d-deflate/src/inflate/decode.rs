//! Decodes the bits of a stream into bytes.

use super::table::{
    Alphabet, DISTANCE_BITS, DISTANCE_SIZE, Entry, LENGTHS_BITS, LENGTHS_SIZE, LITLEN_BITS, LITLEN_SIZE,
    Table,
};
use crate::Error;
use crate::alphabet::LONGEST_MATCH;

/// The number of bytes of the stream that a round of the fast loop may read: two words.
const INPUT: usize = 16;
/// The number of bytes that a round may write: literals, a match, and the excess of its last pattern, which
/// is overwritten later.
const OUTPUT: usize = 8 + LONGEST_MATCH + PATTERN;
/// The number of bytes that are written at once.
const PATTERN: usize = 32;

/// The order in which the lengths of the codes of code lengths are stored (3.2.7).
const ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

type Litlen = Table<LITLEN_SIZE>;
type Distance = Table<DISTANCE_SIZE>;

/// A stream that is being read.
pub(super) struct Decoder<'a> {
    stream: &'a [u8],
    /// The place of the next byte to read.
    at: usize,
    /// The next bits, lowest first. `count` of them are valid. The bits above are 0 or the bits that follow.
    bits: u64,
    count: u32,
    out: &'a mut [u8],
    /// The place of the next byte to write.
    to: usize,
}

impl<'a> Decoder<'a> {
    /// Reads the header (RFC 1950, 2.2).
    pub(super) fn new(stream: &'a [u8], out: &'a mut [u8]) -> Result<Self, Error> {
        let Some(([method, flags], _)) = stream.split_first_chunk() else { return Err(ends_early()) };
        if method & 0x0f != 8 || method >> 4 > 7 || !u16::from_be_bytes([*method, *flags]).is_multiple_of(31)
        {
            return Err(Error::damaged("its header is invalid"));
        }
        if flags & 0x20 != 0 {
            return Err(Error::damaged("it wants a dictionary"));
        }
        Ok(Self { stream, at: 2, bits: 0, count: 0, out, to: 0 })
    }

    /// Reads the first bits of a block. Returns whether it is the last one, and its kind.
    pub(super) fn block(&mut self) -> Result<(bool, u64), Error> {
        let bits = self.take(3)?;
        Ok((bits & 1 != 0, bits >> 1))
    }

    /// Fills `bits`, as far as the stream goes.
    #[inline(always)]
    fn fill(&mut self) {
        if self.at + 8 <= self.stream.len() {
            return fill(self.stream, &mut self.at, &mut self.bits, &mut self.count);
        }
        while self.count < 56
            && let Some(byte) = self.stream.get(self.at)
        {
            self.bits |= u64::from(*byte) << self.count;
            self.at += 1;
            self.count += 8;
        }
    }

    fn take(&mut self, count: u32) -> Result<u64, Error> {
        self.fill();
        let bits = self.bits & !(u64::MAX << count);
        self.consume(count)?;
        Ok(bits)
    }

    fn consume(&mut self, count: u32) -> Result<(), Error> {
        self.count = self.count.checked_sub(count).ok_or_else(ends_early)?;
        self.bits >>= count;
        Ok(())
    }

    /// Reads a block that is not compressed (3.2.4).
    pub(super) fn stored(&mut self) -> Result<(), Error> {
        self.align();
        let len = self.take(16)?;
        let check = self.take(16)?;
        if len != check ^ 0xffff {
            return Err(Error::damaged("the length of a stored block does not match its complement"));
        }
        self.align();
        let len = len as usize;
        let bytes = self.stream.get(self.at..self.at + len).ok_or_else(ends_early)?;
        let Some(out) = self.out.get_mut(self.to..self.to + len) else { return Err(self.too_long()) };
        out.copy_from_slice(bytes);
        self.at += len;
        self.to += len;
        Ok(())
    }

    /// Goes to the next whole byte.
    fn align(&mut self) {
        self.at -= (self.count / 8) as usize;
        self.bits = 0;
        self.count = 0;
    }

    /// Reads the codes of a block (3.2.7), and builds their tables.
    pub(super) fn code_lengths(
        &mut self,
        litlen: &mut Litlen,
        distances: &mut Distance,
    ) -> Result<(), Error> {
        let litlen_count = self.take(5)? as usize + 257;
        let distance_count = self.take(5)? as usize + 1;
        let codes = self.take(4)? as usize + 4;
        if litlen_count > 286 || distance_count > 30 {
            return Err(Error::damaged("a block with more codes than there are symbols"));
        }

        let mut of_lengths = [0; 19];
        for symbol in &ORDER[..codes] {
            of_lengths[*symbol] = self.take(3)? as u8;
        }
        let mut table = Table::<LENGTHS_SIZE>::new(Alphabet::Lengths);
        table.build(&of_lengths)?;

        let mut lengths = [0; 286 + 30];
        let all = litlen_count + distance_count;
        let mut next = 0;
        while next < all {
            self.fill();
            let entry = table.first(self.bits, LENGTHS_BITS);
            self.consume(entry.bits())?;
            let [symbol, _] = entry.bytes();
            let (length, repeats) = match symbol {
                16 => {
                    let Some(last) = next.checked_sub(1) else {
                        return Err(Error::damaged("a repetition before the first code length"));
                    };
                    (lengths[last], 3 + self.take(2)? as usize)
                }
                17 => (0, 3 + self.take(3)? as usize),
                18 => (0, 11 + self.take(7)? as usize),
                length => (length, 1),
            };
            if repeats > all - next {
                return Err(Error::damaged("more code lengths than codes"));
            }
            lengths[next..next + repeats].fill(length);
            next += repeats;
        }

        if lengths[256] == 0 {
            return Err(Error::damaged("a block without an end"));
        }
        litlen.build(&lengths[..litlen_count])?;
        distances.build(&lengths[litlen_count..all])
    }

    /// Decodes the content of a block with these codes.
    #[inline(always)]
    pub(super) fn compressed(&mut self, litlen: &Litlen, distances: &Distance) -> Result<(), Error> {
        loop {
            if self.at + INPUT <= self.stream.len() && self.to + OUTPUT <= self.out.len() {
                if self.fast(litlen, distances)? {
                    return Ok(());
                }
            } else if self.one(litlen, distances)? {
                return Ok(());
            }
        }
    }

    /// Decodes until the end of the stream or of the output is near. Returns true at the end of the block.
    #[inline(always)]
    fn fast(&mut self, litlen: &Litlen, distances: &Distance) -> Result<bool, Error> {
        let stream = self.stream;
        let out = &mut *self.out;
        let mut at = self.at;
        let mut bits = self.bits;
        let mut count = self.count;
        let mut to = self.to;
        let input_end = stream.len() - INPUT;
        let output_end = out.len() - OUTPUT;
        let mut ends = Ok(false);

        // A round begins with 56 bits, and with the entry of the first of them.
        fill(stream, &mut at, &mut bits, &mut count);
        let mut entry = litlen.first(bits, LITLEN_BITS);
        while at <= input_end && to <= output_end {
            // The bits are enough for three entries of literals of up to eleven bits each, and a length of up
            // to twenty bits with its extra bits.
            for _ in 0..3 {
                if !entry.is_literal() {
                    break;
                }
                let literals = entry;
                bits >>= literals.bits();
                count -= literals.bits();
                entry = litlen.first(bits, LITLEN_BITS);
                out[to..to + 2].copy_from_slice(&literals.bytes());
                to += literals.literals();
            }
            if entry.is_literal() {
                fill(stream, &mut at, &mut bits, &mut count);
                continue;
            }

            // A longer code, the end of the block, or no code.
            if entry.is_special() {
                bits >>= entry.bits();
                count -= entry.bits();
                if entry.is_second_table() {
                    entry = litlen.second(entry, bits);
                    if entry.is_literal() {
                        bits >>= entry.bits();
                        count -= entry.bits();
                        out[to] = entry.bytes()[0];
                        to += 1;
                        fill(stream, &mut at, &mut bits, &mut count);
                        entry = litlen.first(bits, LITLEN_BITS);
                        continue;
                    }
                    if entry.is_special() {
                        bits >>= entry.bits();
                        count -= entry.bits();
                    }
                }
                if entry.is_special() {
                    ends = if entry.is_end() {
                        Ok(true)
                    } else {
                        Err(Error::damaged(NO_CODE))
                    };
                    break;
                }
            }

            let length = entry.value(bits);
            bits >>= entry.bits();
            count -= entry.bits();
            fill(stream, &mut at, &mut bits, &mut count);

            let mut place = distances.first(bits, DISTANCE_BITS);
            if place.is_special() {
                if place.is_second_table() {
                    bits >>= place.bits();
                    count -= place.bits();
                    place = distances.second(place, bits);
                }
                if place.is_special() {
                    ends = Err(Error::damaged(NO_CODE));
                    break;
                }
            }
            let distance = place.value(bits);
            bits >>= place.bits();
            count -= place.bits();
            if distance > to {
                ends = Err(Error::damaged(TOO_FAR));
                break;
            }

            // The next entry is loaded while bytes are copied.
            fill(stream, &mut at, &mut bits, &mut count);
            entry = litlen.first(bits, LITLEN_BITS);
            copy(out, to, distance, length);
            to += length;
        }

        self.at = at;
        self.bits = bits;
        self.count = count;
        self.to = to;
        ends
    }

    /// Decodes one symbol, or two literals, however near the ends are. Returns true at the end of the block.
    fn one(&mut self, litlen: &Litlen, distances: &Distance) -> Result<bool, Error> {
        let entry = self.entry(litlen, LITLEN_BITS)?;
        if entry.is_literal() {
            self.consume(entry.bits())?;
            let literals = entry.literals();
            let Some(out) = self.out.get_mut(self.to..self.to + literals) else {
                return Err(self.too_long());
            };
            out.copy_from_slice(&entry.bytes()[..literals]);
            self.to += literals;
            return Ok(false);
        }

        if entry.is_special() {
            self.consume(entry.bits())?;
            return if entry.is_end() {
                Ok(true)
            } else {
                Err(Error::damaged(NO_CODE))
            };
        }

        let length = self.value(entry)?;
        let entry = self.entry(distances, DISTANCE_BITS)?;
        if entry.is_special() {
            return Err(Error::damaged(NO_CODE));
        }
        let distance = self.value(entry)?;
        if distance > self.to {
            return Err(Error::damaged(TOO_FAR));
        }
        if length > self.out.len() - self.to {
            return Err(self.too_long());
        }

        for place in self.to..self.to + length {
            self.out[place] = self.out[place - distance];
        }
        self.to += length;
        Ok(false)
    }

    /// Returns the entry of the next bits. If it is in a second table, the index into the first is consumed.
    fn entry<const N: usize>(&mut self, table: &Table<N>, index_bits: u32) -> Result<Entry, Error> {
        self.fill();
        let entry = table.first(self.bits, index_bits);
        if !entry.is_second_table() {
            return Ok(entry);
        }
        self.consume(entry.bits())?;
        Ok(table.second(entry, self.bits))
    }

    fn value(&mut self, entry: Entry) -> Result<usize, Error> {
        let value = entry.value(self.bits);
        self.consume(entry.bits())?;
        Ok(value)
    }

    /// Returns the checksum after the last block (RFC 1950, 2.2).
    pub(super) fn finish(mut self) -> Result<u32, Error> {
        self.align();
        if self.to < self.out.len() {
            return Err(Error::damaged(format!("it has {} bytes in it, not {}", self.to, self.out.len())));
        }
        let sum = self.stream.get(self.at..).and_then(|rest| rest.first_chunk());
        sum.map(|sum| u32::from_be_bytes(*sum)).ok_or_else(ends_early)
    }

    fn too_long(&self) -> Error {
        Error::damaged(format!("it has more than {} bytes in it", self.out.len()))
    }
}

const NO_CODE: &str = "bits that are no code";
const TOO_FAR: &str = "a match before the first byte";

fn ends_early() -> Error {
    Error::damaged("it ends early")
}

/// Fills `bits` to at least 56 bits. The stream must have a word more.
#[inline(always)]
fn fill(stream: &[u8], at: &mut usize, bits: &mut u64, count: &mut u32) {
    *bits |= word(stream, *at) << *count;
    *at += (63 - *count) as usize / 8;
    *count |= 56;
}

#[inline(always)]
fn word(bytes: &[u8], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

#[inline(always)]
fn put(out: &mut [u8], at: usize, word: u64) {
    out[at..at + 8].copy_from_slice(&word.to_le_bytes());
}

/// The numbers that turn repeating bytes into a pattern.
#[derive(Clone, Copy)]
struct Repeat {
    /// The bits of the repeating bytes.
    mask: u64,
    /// The factor that repeats them over a word.
    factor: u64,
    /// The number of bits of a word after which the next word begins.
    shift: u32,
    /// The number of bytes of a pattern that are whole repetitions.
    step: usize,
}

/// For each distance below 8.
const REPEAT: [Repeat; 8] = {
    let mut table = [Repeat { mask: 0, factor: 0, shift: 0, step: PATTERN }; 8];
    let mut distance = 1;
    while distance < 8 {
        let mut shift = 0;
        while shift < 64 {
            table[distance].factor |= 1 << shift;
            shift += 8 * distance;
        }
        table[distance].mask = !(u64::MAX << (8 * distance));
        table[distance].shift = 8 * (8 % distance) as u32;
        table[distance].step = PATTERN - PATTERN % distance;
        distance += 1;
    }
    table
};

/// Copies a match: `length` bytes from `distance` before. Up to [`PATTERN`] bytes after it are overwritten.
#[inline(always)]
fn copy(out: &mut [u8], to: usize, distance: usize, length: usize) {
    let from = to - distance;

    if distance >= PATTERN {
        let mut done = 0;
        while done < length {
            let mut bytes = [0; PATTERN];
            bytes.copy_from_slice(&out[from + done..from + done + PATTERN]);
            out[to + done..to + done + PATTERN].copy_from_slice(&bytes);
            done += PATTERN;
        }
    } else if distance >= 8 {
        let mut done = 0;
        while done < length {
            put(out, to + done, word(out, from + done));
            put(out, to + done + 8, word(out, from + done + 8));
            done += 16;
        }
    } else {
        let Repeat { mask, factor, shift, step } = REPEAT[distance];
        let mut pattern = [0; PATTERN];
        let mut last = (word(out, from) & mask).wrapping_mul(factor);
        for word in pattern.as_chunks_mut().0 {
            *word = last.to_le_bytes();
            last = (last >> shift & mask).wrapping_mul(factor);
        }

        let mut done = 0;
        while done < length {
            out[to + done..to + done + PATTERN].copy_from_slice(&pattern);
            done += step;
        }
    }
}
