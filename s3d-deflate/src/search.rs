//! The settings of the search for matches.

use crate::Error;

/// The largest line and sample, so that distances around a line do not overflow.
const MAX_BYTES: usize = isize::MAX as usize / 4;

/// The settings of the search for matches.
///
/// The constructors return settings that were chosen on images of scans; `..` changes some of them:
///
/// ```
/// use s3d_deflate::Search;
///
/// // Lines of 640 pixels of 3 bytes, after the byte of the filter. Takes less time, for larger files.
/// let search = Search { nice: 16, patience: 3, ..Search::photo(1 + 3 * 640) };
/// assert_eq!(search.sample, 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// The earlier places with which a place is compared.
    pub candidates: Candidates,
    /// The number of bytes from one line to the next, with the byte of the filter: 1 to `isize::MAX / 4`.
    pub line: usize,
    /// The number of bytes from one sample of a line to the next: 1 to `isize::MAX / 4`. A line is also
    /// compared with the line before shifted by one and two samples.
    pub sample: usize,
    /// The number of bytes in a hash, 4 to 8. Matches are at least as long, except at the distance of a line.
    pub hash_bytes: u32,
    /// A match shorter than this is dropped if the next place has a better match.
    pub lazy: usize,
    /// A match of at least this length is taken at once.
    pub nice: usize,
    /// All places in a match up to this length are remembered. In longer matches and in runs, only a few
    /// places at the end are.
    pub remember: usize,
    /// After 2ⁿ bytes without a match, the search skips more and more places. `patience` is n, 0 to 31.
    pub patience: u32,
}

/// The earlier places with which a place is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Candidates {
    /// The last place of the same hash, at every third byte: for noisy pixels of three bytes.
    Hash1,
    /// The last two places of the same hash and the place a line back, at every third byte: for patches of
    /// pixels of three bytes.
    Hash2,
    /// The last four places of the same hash and the places around a line back, at every second byte: for
    /// steps along lines.
    Hash4,
    /// The last sixteen places of the same hash and the places around a line back, at every byte.
    Hash16,
    /// The places 1 to 32 bytes back, and a line − 15 to a line + 16 bytes back, at every byte: for smooth
    /// surfaces. Besides `candidates`, only `line` matters.
    FixedDistances,
    /// The places 1 to 16 bytes back, and a line − 7 to a line + 8 bytes back, at every byte: for smooth
    /// surfaces, in less time and larger files.
    HalfOfFixedDistances,
    /// The places of `FixedDistances`, but only for matches of at least 15 bytes, at every fourth byte: for
    /// data whose literals cost little.
    LongFixedDistances,
    /// `FixedDistances` before the boundary of the data. After it, the places of `HalfOfFixedDistances`, only
    /// for matches of at least 15 bytes, at every fourth byte. For numbers whose noisy bytes come apart,
    /// before the others.
    SplitFixedDistances,
}

impl Candidates {
    pub(crate) const fn are_of_a_hash(self) -> bool {
        matches!(self, Self::Hash1 | Self::Hash2 | Self::Hash4 | Self::Hash16)
    }
}

impl Search {
    /// Returns settings for noisy colours, three channels of 8 bits, after Paeth's filter.
    pub const fn photo(line: usize) -> Self {
        Self {
            candidates: Candidates::Hash1,
            line,
            sample: 3,
            hash_bytes: 8,
            lazy: 0,
            nice: 32,
            remember: 32,
            patience: 5,
        }
    }

    /// Returns settings for pixels of three bytes that are constant in patches, after the filter "up", in the
    /// least time.
    pub const fn patches(line: usize) -> Self {
        Self { candidates: Candidates::Hash2, hash_bytes: 6, nice: 64, patience: 8, ..Self::photo(line) }
    }

    /// Returns settings for the same images as [`Search::patches`], in smaller files.
    pub const fn labels(line: usize) -> Self {
        Self { candidates: Candidates::Hash4, hash_bytes: 4, lazy: 258, nice: 258, ..Self::patches(line) }
    }

    /// Returns settings for data that changes little along a line and from line to line: normals without a
    /// filter.
    pub const fn smooth(line: usize) -> Self {
        Self { candidates: Candidates::HalfOfFixedDistances, ..Self::photo(line) }
    }

    /// Returns settings for OpenEXR's blocks of floats of so many bytes, with even bytes before odd bytes.
    pub const fn floats(line: usize, bytes: usize) -> Self {
        // Half floats have their exponents in the odd bytes.
        let candidates = if bytes == 2 {
            Candidates::SplitFixedDistances
        } else {
            Candidates::FixedDistances
        };
        Self { candidates, ..Self::photo(line) }
    }

    /// Returns settings for 16-bit samples of smooth surfaces, such as depth, after Paeth's filter, which
    /// leaves small numbers.
    pub const fn depth(line: usize) -> Self {
        Self { candidates: Candidates::LongFixedDistances, sample: 2, ..Self::thorough(line, 2) }
    }

    /// Returns settings for any image with samples of so many bytes: the smallest files, in several times the
    /// time.
    pub const fn thorough(line: usize, sample: usize) -> Self {
        Self { candidates: Candidates::Hash16, sample, remember: 258, ..Self::labels(line) }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let settings = [
            ("line", self.line, 1, MAX_BYTES),
            ("sample", self.sample, 1, MAX_BYTES),
            ("hash_bytes", self.hash_bytes as usize, 4, 8),
            ("patience", self.patience as usize, 0, 31),
        ];
        settings.into_iter().try_for_each(|(setting, value, min, max)| {
            if (min..=max).contains(&value) {
                Ok(())
            } else {
                Err(Error::Setting { setting, value, min, max })
            }
        })
    }
}
