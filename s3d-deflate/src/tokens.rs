//! The content of a block as a list of small numbers: literals, lengths, distances and extra bits.
//!
//! All of them are counted and written in the same way, without a branch on the kind, which would be
//! mispredicted. Only long runs of literals stay in the data, and are counted and written from there.

use crate::WINDOW;
use crate::alphabet::{Counts, DISTANCES, LENGTH_SYMBOLS, LONGEST_MATCH, distance_symbol};
use crate::bit_writer::{BitWriter, Bits};
use crate::fixed_distance::FIXED;

/// The number of symbols in a block. Steps over several bytes may add a few more.
pub(crate) const BLOCK: usize = 64_000;
/// The largest number of tokens in a block. A match takes up to four.
const ROOM: usize = 4 * (BLOCK + 4 * LONGEST_MATCH);

/// The first token of lengths, after the literals. There is one for each length, with its extra bits.
const LENGTH: usize = 256;
/// The first token of distances. There is one for each symbol, without extra bits.
const DISTANCE: usize = LENGTH + LONGEST_MATCH - 2;
/// The first token of the [fixed distances](crate::fixed_distance::fixed_distances). There is one for each,
/// with its extra bits.
const FIXED_DISTANCE: usize = DISTANCE + DISTANCES;
/// The first token of bare bits: the empty one, two of one bit, four of two bits, and so on up to
/// [`MOST_BITS`].
const BITS: usize = FIXED_DISTANCE + FIXED;
const MOST_BITS: u32 = 7;
/// The number of different tokens.
const KINDS: usize = BITS + (2 << MOST_BITS) - 1;
/// The number of entries in a table of tokens, a power of two.
const SLOTS: usize = KINDS.next_power_of_two();

/// Returns the token of `count` bits of `value`, at most [`MOST_BITS`]. The other bits of `value` are 0.
#[inline(always)]
fn bits_token(value: usize, count: u32) -> u16 {
    (BITS + (1 << count) - 1 + value) as u16
}

/// The number of successive literals from which they stay in the data, instead of becoming tokens.
const LONG: usize = 64;

/// The bits of the tokens of bare bits.
const ALONE: [Bits; KINDS - BITS] = {
    let mut table = [Bits::new(0, 0); KINDS - BITS];
    let mut i = 0;
    while i < table.len() {
        let count = (i + 1).ilog2();
        table[i] = Bits::new(i as u64 + 1 - (1 << count), count);
        i += 1;
    }
    table
};

/// The tokens of a block.
pub(crate) struct Tokens {
    tokens: Box<[u16; ROOM]>,
    len: usize,
    literal_runs: Vec<LiteralRun>,
    /// The fixed distances.
    pub(crate) fixed_distances: [usize; FIXED],
}

/// A run of many literals.
struct LiteralRun {
    /// The number of tokens before the run, a multiple of four.
    tokens: usize,
    /// The place of the first byte in the data.
    from: usize,
    /// The number of bytes, a multiple of four.
    len: usize,
}

impl Tokens {
    /// Starts without tokens. `fixed_distances` are the distances for [`fixed_match`](Self::fixed_match).
    pub(crate) fn new(fixed_distances: [usize; FIXED]) -> Self {
        let fixed_distances = fixed_distances.map(|distance| distance.clamp(1, WINDOW));
        let tokens = vec![0; ROOM].try_into().expect("as many");
        Self { tokens, len: 0, literal_runs: Vec::new(), fixed_distances }
    }

    /// Removes all tokens.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
        self.literal_runs.clear();
    }

    /// Adds the bytes of `data` in `from..to` as literals.
    #[inline(always)]
    pub(crate) fn literals(&mut self, data: &[u8], mut from: usize, to: usize) {
        const FEW: usize = 16;

        if to - from >= LONG {
            from = self.literal_run(from, to);
        }

        // Sixteen are copied at once, even if there are fewer; later tokens overwrite the excess.
        let few = data[from..]
            .first_chunk::<FEW>()
            .zip(self.tokens[self.len..].first_chunk_mut());
        let done = few.map_or(0, |(bytes, tokens)| {
            *tokens = bytes.map(u16::from);
            FEW
        });
        self.len += to - from;

        if to - from > done {
            let tokens = &mut self.tokens[..self.len];
            let rest = &data[from + done..to];
            let begin = tokens.len() - rest.len();
            tokens[begin..]
                .iter_mut()
                .zip(rest)
                .for_each(|(token, byte)| *token = u16::from(*byte));
        }
    }

    /// Adds a run of literals, a multiple of four. Returns the place of the first literal that is left.
    #[cold]
    #[inline(never)]
    fn literal_run(&mut self, from: usize, to: usize) -> usize {
        self.pad();
        let len = (to - from) & !3;
        self.literal_runs.push(LiteralRun { tokens: self.len, from, len });
        from + len
    }

    /// Fills up to a multiple of four with tokens of no bits.
    fn pad(&mut self) {
        let len = self.len.next_multiple_of(4);
        self.push([bits_token(0, 0); 3]);
        self.len = len;
    }

    /// Adds a match of 3 to 258 bytes, 1 to 32,768 bytes back.
    #[inline(always)]
    pub(crate) fn any_match(&mut self, length: usize, distance: usize) {
        let (symbol, extra) = distance_symbol(distance);
        let value = (distance - 1) & ((1 << extra) - 1);
        let first = extra.min(MOST_BITS);
        self.push([
            (LENGTH + length - 3) as u16,
            (DISTANCE + symbol) as u16,
            bits_token(value & ((1 << first) - 1), first),
            bits_token(value >> first, extra - first),
        ]);
    }

    /// Adds a match of 3 to 258 bytes at one of the fixed distances.
    #[inline(always)]
    pub(crate) fn fixed_match(&mut self, index: usize, length: usize) {
        self.push([(LENGTH + length - 3) as u16, (FIXED_DISTANCE + index) as u16]);
    }

    #[inline(always)]
    fn push<const N: usize>(&mut self, tokens: [u16; N]) {
        self.tokens[self.len..self.len + N].copy_from_slice(&tokens);
        self.len += N;
    }

    /// Counts the symbols. `data` are the bytes that were given to [`literals`](Self::literals).
    pub(crate) fn count(&mut self, data: &[u8]) -> Counts {
        self.pad();

        // With four tables, equal tokens in a row do not wait for each other.
        let mut tables = [[0u16; SLOTS]; 4];
        for four in self.tokens[..self.len].as_chunks::<4>().0 {
            for (table, &token) in tables.iter_mut().zip(four) {
                table[usize::from(token) % SLOTS] += 1;
            }
        }
        let mut counts = [0u32; SLOTS];
        for table in &tables {
            counts
                .iter_mut()
                .zip(table)
                .for_each(|(n, more)| *n += u32::from(*more));
        }

        let mut sums = Counts { litlen: [0; 288], distance: [0; 32], extra: 0 };
        sums.litlen[..LENGTH].copy_from_slice(&counts[..LENGTH]);
        for run in &self.literal_runs {
            count_bytes(&data[run.from..run.from + run.len], &mut sums.litlen);
        }

        let lengths = LENGTH_SYMBOLS.chunk_by(|(a, _), (b, _)| a == b);
        let mut rest = &counts[LENGTH..DISTANCE];
        for same in lengths {
            let (these, others) = rest.split_at(same.len());
            let (symbol, extra) = same[0];
            let n = these.iter().sum::<u32>();
            sums.litlen[257 + usize::from(symbol)] += n;
            sums.extra += u64::from(n) * u64::from(extra);
            rest = others;
        }

        sums.distance[..DISTANCES].copy_from_slice(&counts[DISTANCE..FIXED_DISTANCE]);
        for (&n, distance) in counts[FIXED_DISTANCE..BITS].iter().zip(self.fixed_distances) {
            let (symbol, extra) = distance_symbol(distance);
            sums.distance[symbol] += n;
            sums.extra += u64::from(n) * u64::from(extra);
        }

        for count in 1..=MOST_BITS {
            let n = counts[usize::from(bits_token(0, count))..][..1 << count]
                .iter()
                .sum::<u32>();
            sums.extra += u64::from(n) * u64::from(count);
        }
        sums
    }

    /// Writes all tokens. The caller has made [room](BitWriter::reserve).
    #[inline(always)]
    pub(crate) fn write(
        &self,
        data: &[u8],
        litlen: &[Bits; 288],
        distance: &[Bits; 32],
        out: &mut BitWriter<'_>,
    ) {
        let mut table = [Bits::default(); SLOTS];
        for (entry, bits) in table.iter_mut().zip(&litlen[..LENGTH]) {
            *entry = *bits;
        }
        for (i, (entry, (symbol, extra))) in
            table[LENGTH..DISTANCE].iter_mut().zip(LENGTH_SYMBOLS).enumerate()
        {
            let value = if extra == 0 { 0 } else { i & ((1 << extra) - 1) };
            *entry = litlen[257 + usize::from(symbol)].then(Bits::new(value as u64, extra.into()));
        }

        table[DISTANCE..FIXED_DISTANCE].copy_from_slice(&distance[..DISTANCES]);
        for (entry, of) in table[FIXED_DISTANCE..BITS].iter_mut().zip(self.fixed_distances) {
            let (symbol, extra) = distance_symbol(of);
            *entry = distance[symbol].then(Bits::new((of as u64 - 1) & ((1 << extra) - 1), extra));
        }
        table[BITS..KINDS].copy_from_slice(&ALONE);

        let literals: &[Bits; LENGTH] = table.first_chunk().expect("they come first");
        let mut done = 0;
        for run in &self.literal_runs {
            out.add_all::<_, _, false>(self.tokens[done..run.tokens].as_chunks().0, &table);
            out.add_all::<_, _, true>(data[run.from..run.from + run.len].as_chunks().0, literals);
            done = run.tokens;
        }
        out.add_all::<_, _, false>(self.tokens[done..self.len].as_chunks().0, &table);
    }
}

/// Counts the bytes of `data`, and adds the counts to `counts`.
pub(crate) fn count_bytes(data: &[u8], counts: &mut [u32]) {
    // With eight tables, equal bytes near each other do not wait for each other.
    let mut tables = [[0u32; 256]; 8];
    let (eights, rest) = data.as_chunks::<8>();
    for eight in eights {
        let mut word = u64::from_le_bytes(*eight);
        for table in &mut tables {
            table[(word & 0xff) as usize] += 1;
            word >>= 8;
        }
    }
    rest.iter().for_each(|&byte| tables[0][usize::from(byte)] += 1);
    for (i, count) in counts[..256].iter_mut().enumerate() {
        *count += tables.iter().map(|t| t[i]).sum::<u32>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed_distance::fixed_distances;
    use proptest::prelude::*;

    /// Codes that are the numbers of the symbols, in 9 and 5 bits.
    const PLAIN: ([Bits; 288], [Bits; 32]) = {
        let mut litlen = [Bits::new(0, 0); 288];
        let mut distance = [Bits::new(0, 0); 32];
        let mut i = 0;
        while i < 288 {
            litlen[i] = Bits::new(i as u64, 9);
            i += 1;
        }
        i = 0;
        while i < 32 {
            distance[i] = Bits::new(i as u64, 5);
            i += 1;
        }
        (litlen, distance)
    };

    proptest! {
        #[test]
        fn symbols_are_counted_and_written_in_order(
            parts in proptest::collection::vec(
                (0usize..200, 3usize..=258, 1usize..=WINDOW, 0usize..FIXED),
                0..40,
            ),
            line in 50usize..40_000,
        ) {
            let data: Vec<u8> = (0..10_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
            let mut tokens = Tokens::new(fixed_distances(line));
            tokens.clear();

            // The plain reference: symbol by symbol, each with its extra bits.
            let mut litlen = [0; 288];
            let mut distances = [0; 32];
            let mut extra = 0;
            let mut expected = vec![];
            let mut plain = BitWriter::new(&mut expected);
            plain.reserve(1 << 20);
            let mut put = |value: usize, count: u32| {
                plain.add(value as u64, count);
                plain.flush();
            };
            let mut at = 0;
            for (i, (literals, length, distance, index)) in parts.into_iter().enumerate() {
                tokens.literals(&data, at, at + literals);
                for &byte in &data[at..at + literals] {
                    litlen[usize::from(byte)] += 1;
                    put(byte.into(), 9);
                }
                at += literals;
                let distance = if i % 2 == 0 {
                    tokens.any_match(length, distance);
                    distance
                } else {
                    tokens.fixed_match(index, length);
                    tokens.fixed_distances[index]
                };
                let (symbol, bits) = LENGTH_SYMBOLS[length - 3];
                litlen[257 + usize::from(symbol)] += 1;
                put(257 + usize::from(symbol), 9);
                put((length - 3) % (1 << bits) * usize::from(bits > 0), bits.into());
                let (symbol, more) = distance_symbol(distance);
                distances[symbol] += 1;
                put(symbol, 5);
                put((distance - 1) % (1 << more), more);
                extra += u64::from(bits) + u64::from(more);
            }
            plain.finish();

            let counts = tokens.count(&data);
            prop_assert_eq!((counts.litlen, counts.distance, counts.extra), (litlen, distances, extra));
            let mut written = vec![];
            let mut out = BitWriter::new(&mut written);
            out.reserve(1 << 20);
            tokens.write(&data, &PLAIN.0, &PLAIN.1, &mut out);
            out.finish();
            prop_assert_eq!(written, expected);
        }
    }
}
