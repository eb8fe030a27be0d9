//! How hard and where matches are looked for.

use crate::Error;

/// Distances around a line are computed without overflow.
const MAX_BYTES: usize = isize::MAX as usize / 4;

/// How hard and where matches are looked for. The constructors give settings that were chosen on images of
/// scans; `..` changes some of them:
///
/// ```
/// use s3d_deflate::Search;
///
/// // Pixels of 3 bytes, 640 a line, after the filter's byte. Less time for larger files.
/// let search = Search { nice: 16, patience: 3, ..Search::photo(1 + 3 * 640) };
/// assert_eq!(search.sample, 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Which earlier places a place is compared with.
    pub candidates: Candidates,
    /// Bytes from one line to the next, the filter's own byte included: 1 to `isize::MAX / 4`.
    pub line: usize,
    /// Bytes from one sample of a line to the next: likewise. Lines are also compared shifted by one and two.
    pub sample: usize,
    /// Bytes that a hash is made of, 4 to 8, and so the shortest match but at the distance of a line.
    pub hash_bytes: u32,
    /// A match shorter than this is dropped if the next place has a better one.
    pub lazy: usize,
    /// A match as long as this is taken at once.
    pub nice: usize,
    /// Every place in a match as long as this is remembered; of longer ones, and of runs, a few at the end.
    pub remember: usize,
    /// After 2ⁿ bytes without a match, places are passed over, more and more: n is 31 at most.
    pub patience: u32,
}

/// Which earlier places a place is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Candidates {
    /// The last of its hash, at every third byte: for noisy pixels of three bytes.
    Hash1,
    /// The two last of its hash and that a line back, at every third byte: for pixels of three bytes in
    /// patches.
    Hash2,
    /// The four last of its hash and those around a line back, at every second byte: for steps along lines.
    Hash4,
    /// The sixteen last of its hash and those around a line back.
    Hash16,
    /// Those 1 to 32 bytes back and those a line less 15 to a line and 16 back, at every byte: for smooth
    /// surfaces. Of the other settings, only `line` matters.
    FixedDistances,
    /// Those 1 to 16 bytes back and those a line less 7 to a line and 8 back, at every byte: likewise, in
    /// less time, in larger files.
    HalfOfFixedDistances,
    /// As `FixedDistances`, but only matches of 15 bytes and more, at every fourth byte: where literals cost
    /// little.
    LongFixedDistances,
    /// As `FixedDistances` before the data's boundary; after it only matches of 15 bytes and more, at every
    /// fourth byte, of `HalfOfFixedDistances`: where numbers have their noisy bytes apart, before the others.
    SplitFixedDistances,
}

impl Candidates {
    pub(crate) const fn are_of_a_hash(self) -> bool {
        matches!(self, Self::Hash1 | Self::Hash2 | Self::Hash4 | Self::Hash16)
    }
}

impl Search {
    /// For colours with noise, 8 bits a channel, three channels, after Paeth's filter.
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

    /// For three bytes a pixel that are constant in patches, after the filter "up", in the least time.
    pub const fn patches(line: usize) -> Self {
        Self { candidates: Candidates::Hash2, hash_bytes: 6, nice: 64, patience: 8, ..Self::photo(line) }
    }

    /// The same in smaller files.
    pub const fn labels(line: usize) -> Self {
        Self { candidates: Candidates::Hash4, hash_bytes: 4, lazy: 258, nice: 258, ..Self::patches(line) }
    }

    /// For what changes little along a line and from line to line: normals without a filter.
    pub const fn smooth(line: usize) -> Self {
        Self { candidates: Candidates::HalfOfFixedDistances, ..Self::photo(line) }
    }

    /// For OpenEXR's blocks of floats of so many bytes, of which even bytes come before odd ones.
    pub const fn floats(line: usize, bytes: usize) -> Self {
        // Half floats have their exponents in the odd bytes.
        let candidates = if bytes == 2 {
            Candidates::SplitFixedDistances
        } else {
            Candidates::FixedDistances
        };
        Self { candidates, ..Self::photo(line) }
    }

    /// For 16-bit samples of smooth surfaces after Paeth's filter, such as depth, of which small numbers are
    /// left.
    pub const fn depth(line: usize) -> Self {
        Self { candidates: Candidates::LongFixedDistances, sample: 2, ..Self::thorough(line, 2) }
    }

    /// For any image with samples of so many bytes: the smallest files, in several times the time.
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
