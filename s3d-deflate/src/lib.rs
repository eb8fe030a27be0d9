//! Deflate (RFC 1951) in the zlib format (RFC 1950) for filtered images, and the filters of PNG and of
//! OpenEXR's ZIP, in both directions.
//!
//! # Compress
//!
//! [`Deflater`] compresses bytes into a zlib stream that every reader of PNG, OpenEXR or zlib reads. A
//! [`Search`] says where it looks for matches; its constructors are for kinds of images. The bytes depend on
//! the data alone and are the same on every processor.
//!
//! # Inflate
//!
//! [`Inflater`] reads the zlib streams of every writer, into memory whose size is known.
//!
//! # Filter
//!
//! [`png`] has the filters of PNG. [`exr`] has the byte order and differences of OpenEXR's ZIP.
//!
//! # Example
//!
//! The samples of a PNG file, filtered and compressed:
//!
//! ```
//! use s3d_deflate::png::{self, Filter};
//! use s3d_deflate::{Deflater, Search};
//!
//! // A grey ramp of 300 × 200 pixels with 16 bits each, big-endian as in PNG.
//! let gray = |i: u16| 1000 + 3 * (i % 300) + i / 300;
//! let samples: Vec<u8> = (0..300 * 200).flat_map(|i| gray(i).to_be_bytes()).collect();
//! let filtered = png::filter(&samples, 2 * 300, 2, Filter::Paeth)?;
//! let mut stream = Vec::new();
//! Deflater::new(Search::depth(1 + 2 * 300))?.zlib(&filtered, None, &mut stream);
//! // The filter leaves only the slope of a plane.
//! assert!(stream.len() < samples.len() / 50, "{}", stream.len());
//!
//! // Any reader of zlib streams reads it. An IDAT chunk contains such a stream.
//! let read = fdeflate::decompress_to_vec(&stream).expect("a zlib stream");
//! assert_eq!(read, filtered);
//! # Ok::<(), s3d_deflate::Error>(())
//! ```
//!
//! # How it is fast
//!
//! General libraries walk chains of earlier places one by one. On filtered images, the processor mispredicts
//! at each. This crate does it differently:
//!
//! - It looks for matches at fixed distances: the smallest, and those around a line back. A smooth image has
//!   nearly all its matches there. For other images, it looks at the last places with the same hash. It
//!   compares all candidates at once, without a branch.
//! - It takes a match if the match costs fewer bits than its bytes as literals, by the codes of the block
//!   before. Noise therefore becomes literals.
//! - A block is a list of small numbers. One loop counts them and another writes them, without a branch on
//!   their kind. Every block has its own codes, and is written in the shortest of the three forms of the
//!   format.
//!
//! # Why not a library
//!
//! A location of a real scan has 52 views of 1080² and a panorama of 4096 × 2048, each in six images. Their
//! files take 1.6 s of processor time with this crate, 4.7 s (6 % larger) with libdeflate and 5.6 s (3 %
//! larger) with zlib-rs. The whole location takes 2.4 s, so the crate saves 56 to 62 % of a location. `cargo
//! bench -p s3d-io --bench compressors` repeats the measurement; the README has the figures by image.

#![expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "speed: the places in the encoder come from its own search, and the decoder checks the places \
              that a stream names"
)]

mod alphabet;
mod bit_writer;
mod block;
mod costs;
pub mod exr;
mod fixed_distance;
mod hash_matcher;
mod huffman;
mod inflate;
mod parse;
pub mod png;
mod search;
mod simd;
mod tokens;

pub use inflate::Inflater;
pub use search::{Candidates, Search};

use bit_writer::BitWriter;
use costs::Costs;
use fixed_distance::{FixedDistanceMatcher, fixed_distances};
use hash_matcher::HashMatcher;
use parse::Parser;
use tokens::Tokens;

/// The largest distance of a match, in bytes.
const WINDOW: usize = 1 << 15;

/// The errors of this crate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting of a [`Search`] is out of its range.
    #[error("{setting} is {value}, not {min} to {max}")]
    Setting {
        /// The name of the field.
        setting: &'static str,
        /// The value of the field.
        value: usize,
        /// The smallest valid value.
        min: usize,
        /// The largest valid value.
        max: usize,
    },
    /// Samples are not whole lines, or a line is not whole pixels.
    #[error("{len} bytes or pixels are not whole lines or pixels of {line}")]
    PartialLine {
        /// The number of bytes or pixels.
        len: usize,
        /// The number of them in a line (or of bytes in a pixel).
        line: usize,
    },
    /// A line of a PNG image begins with a number that is not the number of a filter.
    #[error("a filter of number {number}, not 0 to 4")]
    UnknownFilter {
        /// The number.
        number: u8,
    },
    /// A zlib stream cannot be read.
    #[error("a damaged zlib stream: {about}")]
    Stream {
        /// The fault of the stream.
        about: std::borrow::Cow<'static, str>,
    },
}

impl Error {
    fn damaged(about: impl Into<std::borrow::Cow<'static, str>>) -> Self {
        Self::Stream { about: about.into() }
    }
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// Compresses one stream after the other.
///
/// A stream takes its expected costs from the codes of the stream before, so its bytes depend on earlier
/// streams. Make a new `Deflater` for each file if equal input has to give equal files.
///
/// ```
/// use s3d_deflate::{Deflater, Error, Search};
///
/// let mut deflater = Deflater::new(Search::smooth(64))?;
/// let mut out = Vec::new();
/// deflater.zlib(&[7; 1000], None, &mut out);
/// assert_eq!(fdeflate::decompress_to_vec(&out).expect("a zlib stream"), [7; 1000]);
///
/// let wrong = Deflater::new(Search { hash_bytes: 3, ..Search::smooth(64) });
/// assert_eq!(wrong.err().expect("too few").to_string(), "hash_bytes is 3, not 4 to 8");
/// # Ok::<(), Error>(())
/// ```
pub struct Deflater {
    search: Search,
    hash_matcher: HashMatcher,
    all_distances: FixedDistanceMatcher<u64>,
    half_of_distances: FixedDistanceMatcher<u32>,
    costs: Option<Costs>,
    tokens: Tokens,
}

/// The number of bytes of the first data from which the first costs are guessed.
const SAMPLE: usize = 1 << 15;

impl Deflater {
    /// Makes a compressor with memory of its own, 600 kB to 1.1 MB.
    ///
    /// # Errors
    /// [`Error::Setting`] if a setting of `search` is out of its range.
    pub fn new(search: Search) -> Result<Self, Error> {
        search.check()?;
        Ok(Self {
            search,
            hash_matcher: HashMatcher::new(search.hash_bytes, search.nice),
            all_distances: FixedDistanceMatcher::new(search.line),
            half_of_distances: FixedDistanceMatcher::new(search.line),
            costs: None,
            tokens: Tokens::new(fixed_distances(search.line)),
        })
    }

    /// Appends `data` to `out` as a zlib stream. If data of another kind begins at `boundary`, it gets codes
    /// of its own.
    pub fn zlib(&mut self, data: &[u8], boundary: Option<usize>, out: &mut Vec<u8>) {
        // The header: deflate with a window of 32 KiB, the lowest level, divisible by 31.
        out.extend([0x78, 0x01]);

        let sample = &data[..data.len().min(SAMPLE)];
        let costs = self.costs.get_or_insert_with(|| Costs::guess(sample, &self.tokens));
        let mut bits = BitWriter::new(out);
        let parser = Parser {
            hash_matcher: &mut self.hash_matcher,
            all_distances: &mut self.all_distances,
            half_of_distances: &mut self.half_of_distances,
            tokens: &mut self.tokens,
            costs,
            search: self.search,
            boundary: boundary.unwrap_or(0),
        };
        parser.run(data, &mut bits);
        bits.finish();

        out.extend(simd_adler32::adler32(&data).to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SEARCH: Search = Search {
        candidates: Candidates::Hash4,
        line: 31,
        sample: 1,
        hash_bytes: 4,
        lazy: 16,
        nice: 64,
        remember: 32,
        patience: 6,
    };

    fn search_with(candidates: Candidates, hash_bytes: u32) -> Search {
        Search { candidates, hash_bytes, ..SEARCH }
    }

    /// Returns one search of each kind, from the quickest to the most thorough.
    fn searches() -> Vec<Search> {
        use Candidates::{
            FixedDistances, HalfOfFixedDistances, Hash1, Hash2, Hash4, Hash16, LongFixedDistances,
            SplitFixedDistances,
        };
        let short = Search { lazy: 0, nice: 8, remember: 0, patience: 0, ..SEARCH };
        vec![
            search_with(Hash1, 8),
            search_with(Hash2, 6),
            short,
            search_with(Hash4, 4),
            search_with(Hash16, 4),
            search_with(FixedDistances, 4),
            search_with(HalfOfFixedDistances, 4),
            search_with(LongFixedDistances, 4),
            search_with(SplitFixedDistances, 4),
        ]
    }

    /// Inflates with another implementation, which must read the stream to the last byte.
    fn inflated(stream: &[u8], len: usize) -> Vec<u8> {
        let mut out = Vec::with_capacity(len + 1);
        let mut reader = flate2::Decompress::new(true);
        let status = reader
            .decompress_vec(stream, &mut out, flate2::FlushDecompress::Finish)
            .unwrap();
        assert_eq!(status, flate2::Status::StreamEnd);
        assert_eq!(reader.total_in(), stream.len() as u64);
        out
    }

    fn check(data: &[u8], boundary: usize) {
        for search in searches() {
            let mut deflater = Deflater::new(search).unwrap();
            // The second time, with the costs of the first.
            for _ in 0..2 {
                let mut out = Vec::new();
                deflater.zlib(data, Some(boundary), &mut out);
                assert_eq!(inflated(&out, data.len()), data, "{search:?}");
                assert!(out.len() <= data.len() + 5 * data.len().div_ceil(BLOCK_AT_LEAST) + 16, "{search:?}");
            }
        }
    }

    /// Nearly the smallest number of bytes of a block, except the last block and the one at a boundary.
    const BLOCK_AT_LEAST: usize = 60_000;

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
        /// The data is pieces repeated at any distance, with noise between them.
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

    /// Compresses noise that repeats after `distance` bytes, and returns the size.
    fn size_with_repeat_at(distance: usize) -> usize {
        let once = noise(distance, 256);
        let data = [&once[..], &once[..10_000]].concat();
        let mut out = Vec::new();
        let search = Search { candidates: Candidates::Hash16, patience: 20, ..SEARCH };
        Deflater::new(search).unwrap().zlib(&data, None, &mut out);
        assert_eq!(inflated(&out, data.len()), data);
        out.len()
    }

    #[test]
    fn matches_as_far_back_as_they_may_be_are_found() {
        assert!(size_with_repeat_at(1 << 15) < (1 << 15) + 500, "{}", size_with_repeat_at(1 << 15));
        assert!(size_with_repeat_at((1 << 15) + 1) > (1 << 15) + 9_000);
    }

    #[test]
    fn bytes_do_not_depend_on_the_processor() {
        // Compares the path for any processor with the chosen path.
        let data = [noise(30_000, 3), noise(5_000, 256), noise(30_000, 1)].concat();
        for search in searches() {
            let mut chosen = Vec::new();
            Deflater::new(search).unwrap().zlib(&data, Some(40_000), &mut chosen);

            let mut plain = vec![0x78, 0x01];
            let mut bits = BitWriter::new(&mut plain);
            let mut tokens = Tokens::new(fixed_distances(search.line));
            let parser = Parser {
                hash_matcher: &mut HashMatcher::new(search.hash_bytes, search.nice),
                all_distances: &mut FixedDistanceMatcher::new(search.line),
                half_of_distances: &mut FixedDistanceMatcher::new(search.line),
                costs: &mut Costs::guess(&data[..SAMPLE], &tokens),
                tokens: &mut tokens,
                search,
                boundary: 40_000,
            };
            if search.candidates.are_of_a_hash() {
                parser.by_hash(&data, &mut bits);
            } else {
                parser.at_fixed_distances(s3d_simd::Scalar, &data, &mut bits);
            }
            bits.finish();

            assert_eq!(plain, chosen[..chosen.len() - 4], "{search:?}");
        }
    }

    #[test]
    fn settings_out_of_range_are_errors() {
        let wrong = [
            Search { line: 0, ..SEARCH },
            Search { line: usize::MAX, ..SEARCH },
            Search { sample: 0, ..SEARCH },
            Search { hash_bytes: 9, ..SEARCH },
            Search { patience: 32, ..SEARCH },
        ];
        for search in wrong {
            assert!(matches!(Deflater::new(search).err(), Some(Error::Setting { .. })), "{search:?}");
        }

        // The ends of the ranges are valid.
        let data = noise(20_000, 5);
        for candidates in searches().iter().map(|search| search.candidates) {
            for (line, sample, patience) in
                [(1, 1 << 28, 31), (1 << 28, 1, 0), (2, isize::MAX as usize / 4, 0)]
            {
                let search =
                    Search { candidates, line, sample, patience, lazy: usize::MAX, nice: 0, ..SEARCH };
                let mut out = Vec::new();
                Deflater::new(search).unwrap().zlib(&data, Some(usize::MAX), &mut out);
                assert_eq!(inflated(&out, data.len()), data, "{search:?}");
            }
        }
    }

    /// Exports of different versions are compared byte by byte. These are the sizes and Adler checksums of
    /// two streams of each search.
    #[test]
    fn streams_stay_as_they_are() {
        let data = [noise(50_000, 3), noise(5_000, 256), noise(30_000, 1)].concat();
        let sums = searches().into_iter().map(|search| {
            let mut deflater = Deflater::new(search).unwrap();
            let mut out = Vec::new();
            deflater.zlib(&data, Some(40_000), &mut out);
            deflater.zlib(&data, None, &mut out);
            (out.len(), simd_adler32::adler32(&out.as_slice()))
        });
        let expected = [
            (38093, 205180257),
            (37966, 568849016),
            (37927, 849425034),
            (37805, 1477704196),
            (37801, 2362825579),
            (37222, 1457468797),
            (37439, 149145433),
            (37775, 3547464443),
            (37252, 1377042261),
        ];
        assert_eq!(sums.collect::<Vec<_>>(), expected);
    }
}
