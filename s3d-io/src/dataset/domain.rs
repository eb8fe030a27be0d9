//! What an image of the data set shows. Source: formats.md, "What is written".

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// What a file shows: a modality, which the data set calls a domain. All are images but the pose.
/// CONTRIBUTING.md has what a new one needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Domain {
    /// Colour.
    Rgb,
    /// Depth, 512 units a metre.
    Depth,
    /// Surface normals.
    Normal,
    /// Indices into `semantic_labels.json`.
    Semantic,
    /// A colour per instance, for looking at.
    SemanticPretty,
    /// Places of classes in the taxonomy, as an image with a palette. Not in the published data set.
    SemanticClass,
    /// World coordinates.
    GlobalXyz,
    /// The camera.
    Pose,
}

/// A word that names no domain.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("no modality is called {word:?}; there are {}", names())]
pub struct UnknownDomain {
    /// The word.
    pub word: String,
}

impl Domain {
    /// All of them, in the order of formats.md: that of options, of manifests, and of the columns of tables.
    pub const ALL: [Self; 8] = [
        Self::Rgb,
        Self::Depth,
        Self::Normal,
        Self::Semantic,
        Self::SemanticPretty,
        Self::SemanticClass,
        Self::GlobalXyz,
        Self::Pose,
    ];

    /// Those of the published data set, in their order: what is written if nobody says otherwise.
    pub const PUBLISHED: [Self; 7] = [
        Self::Rgb,
        Self::Depth,
        Self::Normal,
        Self::Semantic,
        Self::SemanticPretty,
        Self::GlobalXyz,
        Self::Pose,
    ];

    /// Whether it shows labels.
    pub fn is_semantic(self) -> bool {
        matches!(self, Self::Semantic | Self::SemanticPretty | Self::SemanticClass)
    }

    /// Its folder, by which users name it too: "normal".
    pub fn folder(self) -> &'static str {
        match self {
            Self::Rgb => "rgb",
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Semantic => "semantic",
            Self::SemanticPretty => "semantic_pretty",
            Self::SemanticClass => "semantic_class",
            Self::GlobalXyz => "global_xyz",
            Self::Pose => "pose",
        }
    }

    /// What stands at the end of its files' names: "normals". The folder's name for all other domains.
    pub fn suffix(self) -> &'static str {
        if self == Self::Normal { "normals" } else { self.folder() }
    }

    /// The ending of its files, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Rgb | Self::Depth | Self::Normal => "png",
            Self::Semantic | Self::SemanticPretty | Self::SemanticClass => "png",
            Self::GlobalXyz => "exr",
            Self::Pose => "json",
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.folder())
    }
}

impl FromStr for Domain {
    type Err = UnknownDomain;

    /// From the name of the folder.
    fn from_str(word: &str) -> Result<Self, UnknownDomain> {
        let found = Self::ALL.into_iter().find(|d| d.folder() == word);
        found.ok_or_else(|| UnknownDomain { word: word.to_owned() })
    }
}

/// All of them in a sentence.
fn names() -> String {
    let [others @ .., last] = Domain::ALL.map(Domain::folder);
    format!("{} and {last}", others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_the_names_of_folders() {
        for domain in Domain::ALL {
            assert_eq!(domain.to_string().parse(), Ok(domain));
        }
        let message = "normals".parse::<Domain>().unwrap_err().to_string();
        let all =
            "there are rgb, depth, normal, semantic, semantic_pretty, semantic_class, global_xyz and pose";
        assert_eq!(message, format!("no modality is called \"normals\"; {all}"));
    }
}
