//! Inflating (RFC 1951, in the zlib format of RFC 1950) into memory whose size is known.
//!
//! Why not a library: the libraries in Rust take longer for most compressed images. These are milliseconds of
//! a core per image of 1080², of a real scan and of the built-in scene (`cargo bench -p s3d-io --bench
//! inflate`):
//!
//! | image | this | fdeflate | zlib-rs |
//! |---|---|---|---|
//! | RGB | 4.2, 3.0 | 5.7, 4.0 | 7.2, 4.6 |
//! | depth | 1.2, 0.91 | 1.5, 1.05 | 1.5, 1.12 |
//! | normals | 0.56, 0.26 | 1.21, 2.19 | 0.97, 1.54 |
//! | labels | 0.36, 0.25 | 0.41, 0.26 | 0.34, 0.21 |
//!
//! A look-up returns up to two literals. The next look-up is under way while a match is copied. A match at a
//! small distance is a pattern that is made in registers, so the output is not read again.

mod decode;
mod table;

use crate::Error;
use decode::Decoder;
use table::{Alphabet, Table};

/// Inflates one stream after the other.
///
/// ```
/// use s3d_deflate::{Deflater, Inflater, Search};
///
/// let mut stream = Vec::new();
/// Deflater::new(Search::smooth(64))?.zlib(&[7; 1000], None, &mut stream);
/// let mut bytes = [0; 1000];
/// let mut inflater = Inflater::default();
/// inflater.zlib(&stream, &mut bytes)?;
/// assert_eq!(bytes, [7; 1000]);
///
/// let error = inflater.zlib(&stream, &mut bytes[1..]).unwrap_err();
/// assert_eq!(error.to_string(), "a damaged zlib stream: it has more than 999 bytes in it");
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
pub struct Inflater {
    litlen: Table<{ table::LITLEN_SIZE }>,
    distances: Table<{ table::DISTANCE_SIZE }>,
}

impl Default for Inflater {
    /// Makes an inflater with memory of its own, 18 kB.
    fn default() -> Self {
        Self { litlen: Table::new(Alphabet::Litlen), distances: Table::new(Alphabet::Distance) }
    }
}

impl Inflater {
    /// Fills `out` with the content of a zlib stream, which must have exactly as many bytes. Bytes after the
    /// stream are ignored.
    ///
    /// # Errors
    /// [`Error::Stream`] if the stream is damaged, has a wrong checksum, ends early, wants a dictionary, or
    /// has fewer or more bytes. `out` may be overwritten in part then.
    pub fn zlib(&mut self, stream: &[u8], out: &mut [u8]) -> Result<(), Error> {
        let sum = self.inflate(stream, out)?;
        if sum == simd_adler32::adler32(&&*out) {
            Ok(())
        } else {
            Err(Error::damaged("its checksum is wrong"))
        }
    }

    /// Fills `out` like [`Self::zlib`], without checking the checksum. For streams in files with a checksum
    /// of their own, such as PNG.
    ///
    /// # Errors
    /// The errors of [`Self::zlib`], except for a wrong checksum.
    pub fn zlib_without_checksum(&mut self, stream: &[u8], out: &mut [u8]) -> Result<(), Error> {
        self.inflate(stream, out).map(drop)
    }

    /// Inflates, and returns the checksum that the stream claims.
    fn inflate(&mut self, stream: &[u8], out: &mut [u8]) -> Result<u32, Error> {
        let level = s3d_simd::level().without_avx512();
        s3d_simd::dispatch!(level, _simd => self.run(stream, out))
    }

    #[inline(always)]
    fn run(&mut self, stream: &[u8], out: &mut [u8]) -> Result<u32, Error> {
        let mut decoder = Decoder::new(stream, out)?;
        loop {
            let (is_last, kind) = decoder.block()?;
            match kind {
                0 => decoder.stored()?,
                1 => {
                    self.litlen.build_fixed()?;
                    self.distances.build_fixed()?;
                    decoder.compressed(&self.litlen, &self.distances)?;
                }
                2 => {
                    decoder.code_lengths(&mut self.litlen, &mut self.distances)?;
                    decoder.compressed(&self.litlen, &self.distances)?;
                }
                _ => return Err(Error::damaged("a block of an unknown kind")),
            }
            if is_last {
                return decoder.finish();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Candidates, Deflater, Search};
    use proptest::prelude::*;
    use s3d_simd::{ProvenLevel, dispatch};

    /// Inflates at every level of instructions. All results must agree.
    fn inflate(stream: &[u8], len: usize) -> Result<Vec<u8>, Error> {
        let made = ProvenLevel::all().into_iter().map(|level| {
            let mut inflater = Inflater::default();
            let mut out = vec![0; len];
            let done = dispatch!(level, _simd => inflater.run(stream, &mut out));
            done.map(|_| out)
        });
        let made: Vec<_> = made.collect();
        made.iter().for_each(|one| assert_eq!(*one, made[0]));
        made[0].clone()
    }

    /// Inflates with fdeflate.
    fn by_fdeflate(stream: &[u8], len: usize) -> Option<Vec<u8>> {
        let mut out = vec![0; len];
        let mut decompressor = fdeflate::Decompressor::new();
        decompressor.ignore_adler32();
        let (_, made) = decompressor.read(stream, &mut out, 0, true).ok()?;
        (decompressor.is_done() && made == len).then_some(out)
    }

    fn by_zlib_rs(data: &[u8], level: u32) -> Vec<u8> {
        use std::io::Write;
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(level));
        encoder.write_all(data).unwrap();
        encoder.finish().unwrap()
    }

    fn by_us(data: &[u8], candidates: Candidates) -> Vec<u8> {
        let mut out = Vec::new();
        let search = Search { candidates, ..Search::smooth(31) };
        Deflater::new(search).unwrap().zlib(data, None, &mut out);
        out
    }

    /// Makes pieces of noise of some number of values, repeated at some distance.
    fn data() -> impl Strategy<Value = Vec<u8>> {
        let piece = (0usize..700, prop_oneof![1usize..40, 1usize..40_000], 1u32..256, 0usize..90);
        (proptest::collection::vec(piece, 0..40), any::<u32>()).prop_map(|(pieces, mut state)| {
            let mut data: Vec<u8> = Vec::new();
            for (len, distance, values, noise) in pieces {
                for _ in 0..noise {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    data.push(((state >> 16) % values) as u8);
                }
                for _ in 0..len.min(data.len()) {
                    data.push(data[data.len() - distance.min(data.len())]);
                }
            }
            data
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn what_was_compressed_comes_back(data in data()) {
            for level in [0, 1, 4, 9] {
                prop_assert_eq!(inflate(&by_zlib_rs(&data, level), data.len()), Ok(data.clone()));
            }
            for candidates in [Candidates::Hash16, Candidates::FixedDistances] {
                prop_assert_eq!(inflate(&by_us(&data, candidates), data.len()), Ok(data.clone()));
            }
            let stream = fdeflate::compress_to_vec(&data);
            prop_assert_eq!(inflate(&stream, data.len()), Ok(data));
        }

        /// A damaged stream that fdeflate refuses is refused. Streams that both read are read alike.
        #[test]
        fn damage_is_found_as_fdeflate_finds_it(
            data in data(),
            level in prop_oneof![Just(0u32), Just(1), Just(6)],
            changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
            cut in any::<prop::sample::Index>(),
            cuts in any::<bool>(),
            more in -3isize..4,
        ) {
            let mut stream = by_zlib_rs(&data, level);
            // The codes are near the beginning.
            let near = stream.len().min(if cuts { 60 } else { usize::MAX });
            changes.iter().for_each(|(at, to)| stream[at.index(near)] = *to);
            if cuts {
                stream.truncate(cut.index(stream.len() + 1));
            }
            let len = data.len().saturating_add_signed(more);
            if let Ok(ours) = inflate(&stream, len) {
                prop_assert_eq!(by_fdeflate(&stream, len), Some(ours));
            }
        }
    }

    #[test]
    fn nothing_is_refused_that_fdeflate_reads() {
        // Short streams with one bit changed at every place. Each of the two implementations is stricter in
        // one respect: about incomplete codes, or about single codes.
        let data: Vec<u8> = (0..2000u32).map(|i| (i * i / 97) as u8).collect();
        let mut both = 0;
        let mut other = 0;
        for level in [0, 1, 9] {
            let stream = by_zlib_rs(&data, level);
            for at in 0..stream.len() {
                for bit in 0..8 {
                    let mut stream = stream.clone();
                    stream[at] ^= 1 << bit;
                    match (inflate(&stream, data.len()).ok(), by_fdeflate(&stream, data.len())) {
                        (Some(ours), theirs) => {
                            assert_eq!(Some(ours), theirs, "level {level}, byte {at}, bit {bit}");
                            both += 1;
                        }
                        (None, Some(_)) => other += 1,
                        (None, None) => {}
                    }
                }
            }
        }
        assert!(both > 10_000 && other == 0, "{both}, {other}");
    }

    #[test]
    fn streams_that_end_early_are_refused() {
        let data: Vec<u8> = (0..3000u32).map(|i| (i * i / 97) as u8).collect();
        for level in [0, 1, 9] {
            let stream = by_zlib_rs(&data, level);
            for len in 0..stream.len() {
                assert!(inflate(&stream[..len], data.len()).is_err(), "{len} of {}", stream.len());
            }
            for (len, word) in
                [(data.len() - 1, "more than 2999"), (data.len() + 1, "2999"), (0, "more than 0")]
            {
                let message = inflate(&stream, len).unwrap_err().to_string();
                assert!(len > data.len() || message.contains(word), "{message}");
            }
        }
    }

    #[test]
    fn checksums_are_looked_at_where_they_are_wanted() {
        let mut stream = by_zlib_rs(b"abcabcabc", 6);
        let mut inflater = Inflater::default();
        let mut out = [0; 9];
        inflater.zlib(&stream, &mut out).unwrap();
        assert_eq!(&out, b"abcabcabc");
        *stream.last_mut().unwrap() ^= 1;
        let message = inflater.zlib(&stream, &mut out).unwrap_err().to_string();
        assert_eq!(message, "a damaged zlib stream: its checksum is wrong");
        out.fill(0);
        inflater.zlib_without_checksum(&stream, &mut out).unwrap();
        assert_eq!(&out, b"abcabcabc");
    }

    #[test]
    fn heads_are_looked_at() {
        let stream = by_zlib_rs(b"abc", 6);
        let message = |head: [u8; 2]| inflate(&[&head, &stream[2..]].concat(), 3).unwrap_err().to_string();
        for head in [[0x79, 0x01], [0x78, 0x02], [0x88, 0x1c]] {
            assert_eq!(message(head), "a damaged zlib stream: its header is invalid");
        }
        assert_eq!(message([0x78, 0x20]), "a damaged zlib stream: it wants a dictionary");
        assert_eq!(inflate(&[], 0).unwrap_err().to_string(), "a damaged zlib stream: it ends early");
    }
}
