//! Matches at the last places of the same hash: an RGB view in 8.3 ms against libdeflate's 15.6, a view of
//! labels in 2.3 against zlib-rs's 4.1, at equal size (bench `compressors`).

use crate::WINDOW;
use crate::alphabet::LONGEST_MATCH;
use crate::costs::Costs;
use std::array::from_fn;

/// Bits of the hash.
const HASH_BITS: u32 = 13;
/// Bytes of a match whose cost as literals is asked for.
const COUNTED: usize = 32;
/// Places remembered in one word.
const PLACES: usize = 4;

/// The last places of each hash, newest first. All are compared, without a branch, which noise would have
/// mispredicted.
pub(crate) struct HashMatcher {
    /// Rows of words; in a word four places modulo 2¹⁶. Words, as a row just stored is loaded again at once
    /// in runs.
    table: Vec<u64>,
    hash_bytes: u32,
    /// Length from which a match is taken without looking further.
    nice: usize,
}

/// A match.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Match {
    pub(crate) length: usize,
    pub(crate) distance: usize,
    /// Bits that it is expected to save over literals; at most 0 if there is none.
    pub(crate) gain: i32,
}

#[inline(always)]
fn word(data: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(data[at..at + 8].try_into().expect("eight bytes"))
}

/// How many bytes from `a` and from `b` on are the same, up to `most`.
#[inline(always)]
pub(crate) fn common(data: &[u8], a: usize, b: usize, most: usize) -> usize {
    let (x, y) = (&data[a..a + most], &data[b..b + most]);
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
    /// Places are found by a hash of 4 to 8 bytes.
    pub(crate) fn new(hash_bytes: u32, nice: usize) -> Self {
        Self { table: Vec::new(), hash_bytes, nice }
    }

    /// Forgets everything, and makes rows of `WORDS`.
    pub(crate) fn begin<const WORDS: usize>(&mut self) {
        self.table.clear();
        self.table.resize(WORDS << HASH_BITS, 0);
    }

    /// Remembers the place `at`, and gives those of the same hash.
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

    /// The longest match at `at` among `places` and at the distances `rows`, the nearest of equally long
    /// ones. There are 8 bytes and more after it, and it is not the first place.
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
        // Whatever the table says (it may be out of date), it is some place before, and what is there is
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
        let (mut best, mut whole) = (0, 0u32);
        for i in 0..WAYS + ROWS {
            let differ = word(until, at - distance(i)) ^ here;
            // Equal bytes × 32, and below that the order.
            best = best.max((differ.trailing_zeros() & !7) << 2 | (31 - i as u32));
            whole |= u32::from(differ == 0) << i;
        }
        let (first, mut length) = (31 - (best & 31) as usize, best as usize >> 5);
        if length < 3 {
            return Match::default();
        }

        // What the first bytes cost as literals; in an array, so that the length needs no branch.
        let mut literals = [0; 9];
        for i in 0..8 {
            literals[i + 1] = literals[i] + costs.literal((here >> (8 * i)) as u8);
        }
        let mut distance_found = distance(first);
        let mut saved = literals[length];
        if length == 8 {
            let most = LONGEST_MATCH.min(data.len() - at);
            length = common(data, at - distance_found, at, most);
            whole &= whole - 1;
            while whole != 0 && length < self.nice {
                let (d, last) = (distance(whole.trailing_zeros() as usize), length - 7);
                whole &= whole - 1;
                if word(data, at - d + last) == word(data, at + last) {
                    let n = common(data, at - d, at, most);
                    if n > length {
                        (length, distance_found) = (n, d);
                    }
                }
            }
            if length >= self.nice {
                return Match { length, distance: distance_found, gain: i32::MAX };
            }
            let rest = data[at + 8..at + length.min(COUNTED)]
                .iter()
                .map(|&byte| costs.literal(byte));
            // What follows costs a bit at least.
            saved += rest.sum::<u32>() + length.saturating_sub(COUNTED) as u32;
        }
        let gain = saved as i32 - costs.any_match(length, distance_found) as i32;
        Match { length, distance: distance_found, gain }
    }
}
