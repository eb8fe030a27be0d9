//! How much time the compression of images may take.

use std::fmt;
use std::str::FromStr;

/// How much time the compression of images may take. The pixels are the same for all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Compression {
    /// Like [`Balanced`](Self::Balanced), but with less time for colours and labels, whose files get up to a
    /// quarter larger.
    Fast,
    /// About as small as libpng's level 6 and OpenEXR's ZIP, in about a tenth of their time.
    #[default]
    Balanced,
    /// Up to an eighth smaller than [`Balanced`](Self::Balanced), and five to seven times slower.
    Small,
}

impl Compression {
    /// All levels, the fastest first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Balanced, Self::Small];

    /// Returns its name: `fast`, `balanced` or `small`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Small => "small",
        }
    }
}

impl fmt::Display for Compression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that names no compression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no compression is called {word:?}; there are fast, balanced and small")]
pub struct UnknownCompression {
    /// The word.
    pub word: String,
}

impl FromStr for Compression {
    type Err = UnknownCompression;

    fn from_str(word: &str) -> Result<Self, UnknownCompression> {
        let found = Self::ALL.into_iter().find(|c| c.name() == word);
        found.ok_or_else(|| UnknownCompression { word: word.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for compression in Compression::ALL {
            assert_eq!(compression.to_string().parse(), Ok(compression));
        }
        let error = "best".parse::<Compression>().unwrap_err();
        assert_eq!(
            error.to_string(),
            "no compression is called \"best\"; there are fast, balanced and small"
        );
    }
}
