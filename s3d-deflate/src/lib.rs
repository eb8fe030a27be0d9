//! Compression of images' samples in the format zlib (RFC 1950, RFC 1951).
//!
//! General libraries are at a loss with what filters leave of an image: they look for repetitions one after the other
//! in chains, and the processor guesses wrong at each. Here, as they do,
//!
//! - a repetition is looked for at fixed distances, the smallest and those around a line back, where nearly all are if an
//!   image is smooth ([`fixed_distance`]); or, in other images, at the last places that have the same hash ([`hash_matcher`]). All are
//!   compared at once, without a branch;
//! - it is taken if it costs fewer bits than what it stands for, by the code of the block before ([`block::Prices`]), so
//!   that noise is written as literals;
//! - each block is a list of small numbers ([`tokens`]), has its own code ([`huffman`]), and is written in the shortest of
//!   the format's three ways ([`block`]).
//!
//! Everything is done with integers and depends on the data alone: the same bytes on every machine.

#![expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "a writer, on the way of every byte of an image: places are those that its own search found"
)]

mod bit_writer;
mod block;
mod fixed_distance;
mod hash_matcher;
mod huffman;
mod parse;
pub mod png;
mod tokens;

pub use parse::{Candidates, Search, Work, wide};

use bit_writer::BitWriter;
use block::Prices;
use fixed_distance::Nearby;
use hash_matcher::Finder;
use parse::Parser;
use tokens::Tokens;

/// Compresses one stream after the other. What one of them taught about costs serves the next, so a stream's bytes
/// depend on those before: make a new one for each file.
pub struct Deflater {
    search: Search,
    finder: Finder,
    nearby: Nearby,
    prices: Option<Prices>,
    tokens: Tokens,
}

/// How much of the first data is looked at to begin with.
const SAMPLE: usize = 1 << 15;

impl Deflater {
    /// With its own memory.
    pub fn new(search: Search) -> Self {
        let finder = Finder::new(search.hash_bytes, search.nice);
        let nearby = Nearby::new(search.line);
        let tokens = Tokens::new(fixed_distance::lanes(search.line));
        Self { search, finder, nearby, prices: None, tokens }
    }

    /// Appends `data` to `out`, compressed. At `boundary` (0 for none) begins data of another kind.
    pub fn zlib(&mut self, data: &[u8], boundary: usize, out: &mut Vec<u8>) {
        // Deflate, 32 KiB back; no claim about the effort; divisible by 31.
        out.extend([0x78, 0x01]);
        let (finder, nearby, tokens) = (&mut self.finder, &mut self.nearby, &mut self.tokens);
        let sample = &data[..data.len().min(SAMPLE)];
        let prices = self.prices.get_or_insert_with(|| Prices::guess(sample, tokens));
        let mut bits = BitWriter::new(out);
        Parser { finder, nearby, tokens, prices, search: self.search, boundary }.run(data, &mut bits);
        bits.finish();
        out.extend(simd_adler32::adler32(&data).to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SEARCH: Search = Search {
        candidates: Candidates::Steps,
        line: 31,
        sample: 1,
        hash_bytes: 4,
        lazy: 16,
        nice: 64,
        remember: 32,
        patience: 6,
    };

    /// One of each kind, from the quickest to the most thorough.
    fn searches() -> Vec<Search> {
        use Candidates::{Many, Nearby, NearbyLong, Noise, Patches, Steps};
        let with = |candidates, hash_bytes| Search { candidates, hash_bytes, ..SEARCH };
        let short = Search { lazy: 0, nice: 8, remember: 0, patience: 0, ..SEARCH };
        vec![
            with(Noise, 8),
            with(Patches, 6),
            short,
            with(Steps, 4),
            with(Many, 4),
            with(Nearby, 4),
            with(NearbyLong, 4),
        ]
    }

    /// Another implementation reads it, to the last byte.
    fn inflated(stream: &[u8], len: usize) -> Vec<u8> {
        let mut out = Vec::with_capacity(len + 1);
        let mut reader = flate2::Decompress::new(true);
        let status = reader.decompress_vec(stream, &mut out, flate2::FlushDecompress::Finish).unwrap();
        assert_eq!(status, flate2::Status::StreamEnd);
        assert_eq!(reader.total_in(), stream.len() as u64);
        out
    }

    fn check(data: &[u8], boundary: usize) {
        for search in searches() {
            let mut deflater = Deflater::new(search);
            // A second time with what the first taught.
            for _ in 0..2 {
                let mut out = Vec::new();
                deflater.zlib(data, boundary, &mut out);
                assert_eq!(inflated(&out, data.len()), data, "{search:?}");
                assert!(out.len() <= data.len() + 5 * data.len().div_ceil(BLOCK_AT_LEAST) + 16, "{search:?}");
            }
        }
    }

    /// No block but the last and that at a boundary is of fewer bytes, nearly.
    const BLOCK_AT_LEAST: usize = 8_000;

    fn noise(len: usize, values: u32) -> Vec<u8> {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % values) as u8
        };
        (0..len).map(|_| next()).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]
        /// Pieces repeated at any distance, with noise between them.
        #[test]
        fn data_comes_back(
            pieces in proptest::collection::vec((0usize..400, 1usize..3000, 1u32..256), 0..40),
            boundary in 0usize..20_000,
        ) {
            let mut data: Vec<u8> = Vec::new();
            for (len, back, values) in pieces {
                data.extend(noise(len % 61, values));
                for _ in 0..len.min(data.len()) {
                    data.push(data[data.len() - back.min(data.len())]);
                }
            }
            check(&data, boundary);
        }
    }

    #[test]
    fn runs_noise_and_small_alphabets_come_back() {
        for len in [0, 1, 2, 3, 265, 266, 267, 275, 300, 40_000, 200_000] {
            for values in [1, 2, 3, 17, 256] {
                check(&noise(len, values), len / 2);
            }
        }
    }

    #[test]
    fn repetitions_as_far_back_as_they_may_be_are_found() {
        // Noise that comes back after the longest distance, and after one more.
        let find = |distance: usize| {
            let once = noise(distance, 256);
            let data = [&once[..], &once[..10_000]].concat();
            let mut out = Vec::new();
            Deflater::new(Search { candidates: Candidates::Many, patience: 20, ..SEARCH })
                .zlib(&data, 0, &mut out);
            assert_eq!(inflated(&out, data.len()), data);
            out.len()
        };
        assert!(find(1 << 15) < (1 << 15) + 500, "{}", find(1 << 15));
        assert!(find((1 << 15) + 1) > (1 << 15) + 9_000);
    }

    #[test]
    fn bytes_do_not_depend_on_the_processor() {
        // The path for any processor against the one that was chosen.
        let data = [noise(30_000, 3), noise(5_000, 256), noise(30_000, 1)].concat();
        for search in searches() {
            let mut chosen = Vec::new();
            Deflater::new(search).zlib(&data, 40_000, &mut chosen);
            let mut plain = vec![0x78, 0x01];
            let mut bits = BitWriter::new(&mut plain);
            let mut tokens = Tokens::new(fixed_distance::lanes(search.line));
            Parser {
                finder: &mut Finder::new(search.hash_bytes, search.nice),
                nearby: &mut Nearby::new(search.line),
                prices: &mut Prices::guess(&data[..SAMPLE], &tokens),
                tokens: &mut tokens,
                search,
                boundary: 40_000,
            }
            .run_as::<fixed_distance::Anywhere>(&data, &mut bits);
            bits.finish();
            assert_eq!(plain, chosen[..chosen.len() - 4], "{search:?}");
        }
    }
}
