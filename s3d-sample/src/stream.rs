//! Streams of random numbers, each for one unit of work.
//!
//! Units never share a generator. The generator of a unit follows from the seed and the name of the unit
//! alone, so threads, order and other draws cannot change its numbers.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Returns the generator of the unit of work that `purpose`, `seed`, `name` and `number` name.
///
/// It is ChaCha with 8 rounds, counter and nonce 0. The 32-byte key holds `seed` (8 bytes), `number` (4
/// bytes), `purpose` (4 bytes) and the FNV-1a hash of `name` in UTF-8 (16 bytes); integers are little-endian.
/// A change of this layout changes every data set.
pub(crate) fn stream(purpose: [u8; 4], seed: u64, name: &str, number: u32) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..12].copy_from_slice(&number.to_le_bytes());
    key[12..16].copy_from_slice(&purpose);
    key[16..].copy_from_slice(&fnv1a_128(name.as_bytes()).to_le_bytes());
    ChaCha8Rng::from_seed(key)
}

/// The 128-bit FNV-1a hash (draft-eastlake-fnv). It only has to tell names apart: ChaCha spreads the bits.
fn fnv1a_128(bytes: &[u8]) -> u128 {
    const OFFSET_BASIS: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = (1 << 88) + 0x13b;
    bytes
        .iter()
        .fold(OFFSET_BASIS, |hash, &byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME))
}

/// Draws a number uniform in [0, 1): the upper 53 bits of the next 64, as a fraction.
pub(crate) fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    fraction(rng.next_u64() >> 11)
}

/// Draws a number uniform in (0, 1], for logarithms.
pub(crate) fn uniform_above_zero(rng: &mut ChaCha8Rng) -> f64 {
    fraction((rng.next_u64() >> 11) + 1)
}

fn fraction(bits: u64) -> f64 {
    // `bits` is at most 2⁵³, so the conversion is exact.
    bits as f64 / (1u64 << 53) as f64
}

/// Draws a normal number with mean 0 and deviation 1 by the method of Box and Muller. A call takes two
/// uniform numbers; the first gives the radius. The second normal number that they could give is not used.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * libm::log(uniform_above_zero(rng))).sqrt();
    radius * libm::cos(2.0 * std::f64::consts::PI * uniform(rng))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Test vectors of draft-eastlake-fnv.
        assert_eq!(fnv1a_128(b""), 0x6c62272e07bb014262b821756295c58d);
        assert_eq!(fnv1a_128(b"a"), 0xd228cb696f1a8caf78912b704e4a8964);
        assert_eq!(fnv1a_128(b"foobar"), 0x343e1662793c64bf6f0d3597ba446f18);
    }

    fn first_of(purpose: [u8; 4], seed: u64, name: &str, number: u32) -> u64 {
        stream(purpose, seed, name, number).next_u64()
    }

    #[test]
    fn every_part_of_the_name_counts() {
        let mut all = vec![
            first_of(*b"view", 1, "a", 1),
            first_of(*b"pick", 1, "a", 1),
            first_of(*b"view", 2, "a", 1),
            first_of(*b"view", 1 << 63, "a", 1),
            first_of(*b"view", 1, "b", 1),
            first_of(*b"view", 1, "", 1),
            first_of(*b"view", 1, "a", 2),
            first_of(*b"view", 1, "a", 1 << 31),
        ];
        assert_eq!(all[0], first_of(*b"view", 1, "a", 1));
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 8);
    }

    #[test]
    fn fractions_end_where_they_should() {
        assert_eq!(fraction(0), 0.0);
        assert_eq!(fraction((1 << 53) - 1), 1.0 - f64::EPSILON / 2.0);
        assert_eq!(fraction(1 << 53), 1.0);
    }
}
