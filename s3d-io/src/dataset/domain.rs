//! What the images of the data set show. Source: [`crate::formats`], "What is written".

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// What a file shows: a modality, which the data set calls a domain. All of them are images except the pose.
/// CONTRIBUTING.md lists what a new one needs.
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
    /// A colour for each instance, to look at.
    SemanticPretty,
    /// The places of classes in the taxonomy, as an image with a palette. It is not in the published data
    /// set.
    SemanticClass,
    /// World coordinates.
    GlobalXyz,
    /// The camera.
    Pose,
}

/// The error for a word that names no domain.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("no modality is called {word:?}; there are {}", names())]
pub struct UnknownDomain {
    /// The word.
    pub word: String,
}

impl Domain {
    /// All domains in the order of [`crate::formats`], which is the order of options, of manifests and of the
    /// columns of tables.
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

    /// The domains of the published data set in the same order. They are written by default.
    pub const PUBLISHED: [Self; 7] = [
        Self::Rgb,
        Self::Depth,
        Self::Normal,
        Self::Semantic,
        Self::SemanticPretty,
        Self::GlobalXyz,
        Self::Pose,
    ];

    /// Returns whether the domain shows labels.
    pub fn is_semantic(self) -> bool {
        matches!(self, Self::Semantic | Self::SemanticPretty | Self::SemanticClass)
    }

    /// Returns the name of the domain's folder, "normal". Users name the domain by it too.
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

    /// Returns the last word in the names of the domain's files: "normals". For all other domains it is the
    /// folder's name.
    pub fn suffix(self) -> &'static str {
        if self == Self::Normal { "normals" } else { self.folder() }
    }

    /// Returns the extension of the domain's files, without the dot.
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

    /// Finds the domain by the name of its folder.
    fn from_str(word: &str) -> Result<Self, UnknownDomain> {
        let found = Self::ALL.into_iter().find(|d| d.folder() == word);
        found.ok_or_else(|| UnknownDomain { word: word.to_owned() })
    }
}

/// Returns the names of all domains, as a sentence lists them.
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
