//! Matches at the last places with the same hash.
//!
//! An RGB view takes 8.3 ms, 15.6 with libdeflate; a view of labels takes 2.3 ms, 4.1 with zlib-rs. The sizes
//! are equal (bench `compressors`).

use crate::WINDOW;
use crate::alphabet::LONGEST_MATCH;
use crate::costs::Costs;
use std::array::from_fn;

/// The number of bits of the hash.
const HASH_BITS: u32 = 13;
/// The number of bytes of a match whose cost as literals is added up.
const COUNTED: usize = 32;
/// The number of places in one word of the table.
const PLACES: usize = 4;

/// The last places of each hash, newest first. All are compared without a branch, which noise would make
/// unpredictable.
pub(crate) struct HashMatcher {
    /// A row of words per hash. A word holds four places modulo 2¹⁶. Words are fast because a run loads a
    /// row again just after it was stored.
    table: Vec<u64>,
    hash_bytes: u32,
    /// The length from which a match is taken without looking further.
    nice: usize,
}

/// A match.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Match {
    pub(crate) length: usize,
    pub(crate) distance: usize,
    /// The number of bits that the match saves over literals, as expected; 0 or less if it saves none.
    pub(crate) gain: i32,
}

#[inline(always)]
fn word(data: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(data[at..at + 8].try_into().expect("eight bytes"))
}

/// Returns the number of equal bytes from `a` and from `b` on, at most `most`.
#[inline(always)]
pub(crate) fn common(data: &[u8], a: usize, b: usize, most: usize) -> usize {
    let x = &data[a..a + most];
    let y = &data[b..b + most];
    let mut n = 0;
    for (p, q) in x.as_chunks::<8>().0.iter().zip(y.as_chunks::<8>().0) {
        let differ = u64::from_le_bytes(*p) ^ u64::from_le_bytes(*q);
        if differ != 0 {
            return n + differ.trailing_zeros() as usize / 8;
        }
        n += 8;
    }
    n + x[n..].iter().zip(&y[n..]).take_while(|(p, q)| p == q).count()
}

impl HashMatcher {
    /// Makes a matcher whose hash is over 4 to 8 bytes.
    pub(crate) fn new(hash_bytes: u32, nice: usize) -> Self {
        Self { table: Vec::new(), hash_bytes, nice }
    }

    /// Forgets all places, and makes rows of `WORDS` words.
    pub(crate) fn begin<const WORDS: usize>(&mut self) {
        self.table.clear();
        self.table.resize(WORDS << HASH_BITS, 0);
    }

    /// Remembers the place `at`, and returns the earlier places of the same hash.
    #[inline(always)]
    pub(crate) fn insert<const WORDS: usize>(&mut self, data: &[u8], at: usize) -> [u64; WORDS] {
        let hash = (word(data, at) << (64 - 8 * self.hash_bytes)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let row = &mut self.table.as_chunks_mut::<WORDS>().0[(hash >> (64 - HASH_BITS)) as usize];
        let before = *row;
        let carried = |i: usize| {
            if i == 0 {
                (at & 0xffff) as u64
            } else {
                before[i - 1] >> 48
            }
        };
        *row = from_fn(|i| before[i] << 16 | carried(i));
        before
    }

    /// Returns the longest match at `at` among `places` and at the distances `rows`. The first candidate wins
    /// a tie. At least 8 bytes must follow `at`, and `at` must not be 0.
    #[inline(always)]
    pub(crate) fn best<const WORDS: usize, const WAYS: usize, const ROWS: usize>(
        &self,
        data: &[u8],
        at: usize,
        places: [u64; WORDS],
        rows: [usize; ROWS],
        costs: &Costs,
    ) -> Match {
        let here = word(data, at);

        // The table may be out of date, but it always gives some earlier place, and the bytes there are
        // compared.
        let distance = |i: usize| {
            let distance = if i < WAYS {
                let place = (places[i / PLACES] >> (16 * (i % PLACES))) as usize;
                (at.wrapping_sub(place).wrapping_sub(1) & (WINDOW - 1)) + 1
            } else {
                rows[i - WAYS]
            };
            distance.min(at)
        };

        let until = &data[..at + 8];
        let mut best = 0;
        let mut whole = 0u32;
        for i in 0..WAYS + ROWS {
            let differ = word(until, at - distance(i)) ^ here;
            // The number of equal bytes × 32, and in the low bits the order of candidates.
            best = best.max((differ.trailing_zeros() & !7) << 2 | (31 - i as u32));
            whole |= u32::from(differ == 0) << i;
        }
        let first = 31 - (best & 31) as usize;
        let mut length = best as usize >> 5;
        if length < 3 {
            return Match::default();
        }

        // The costs of the first bytes as literals. The array of sums saves a branch on the length.
        let mut literals = [0; 9];
        for i in 0..8 {
            literals[i + 1] = literals[i] + costs.literal((here >> (8 * i)) as u8);
        }
        let mut distance_found = distance(first);
        let mut saved = literals[length];

        // Several candidates may go on after eight bytes.
        if length == 8 {
            let most = LONGEST_MATCH.min(data.len() - at);
            length = common(data, at - distance_found, at, most);
            whole &= whole - 1;
            while whole != 0 && length < self.nice {
                let d = distance(whole.trailing_zeros() as usize);
                let last = length - 7;
                whole &= whole - 1;
                if word(data, at - d + last) == word(data, at + last) {
                    let n = common(data, at - d, at, most);
                    if n > length {
                        length = n;
                        distance_found = d;
                    }
                }
            }
            if length >= self.nice {
                return Match { length, distance: distance_found, gain: i32::MAX };
            }

            let rest = data[at + 8..at + length.min(COUNTED)]
                .iter()
                .map(|&byte| costs.literal(byte));
            // Further literals cost at least a bit each.
            saved += rest.sum::<u32>() + length.saturating_sub(COUNTED) as u32;
        }

        let gain = saved as i32 - costs.any_match(length, distance_found) as i32;
        Match { length, distance: distance_found, gain }
    }
}
