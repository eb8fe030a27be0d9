//! Input that does not fit together, or of which nothing useful can be made.

use crate::condition::Condition;
use crate::error::names::{FieldNames, OptionNames};
use std::fmt;
use std::path::PathBuf;

/// Why nothing can be made of the input of a call.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum InputError {
    /// A file, or what it names, does not fit the rest of the input.
    Unfit {
        /// The file or folder; a name in words for a scene in memory.
        path: PathBuf,
        /// What does not fit, and what to do.
        why: String,
    },
    /// An area does not fit together.
    UnfitArea {
        /// The number of the area.
        area: u32,
        /// What does not fit, and what to do.
        why: String,
    },
    /// Two scenes are the same area.
    SameArea {
        /// A scene.
        first: PathBuf,
        /// The other scene.
        second: PathBuf,
        /// The number of their area.
        area: u32,
    },
    /// One scene has labels, and another has none.
    MixedLabels {
        /// A scene with labels.
        with: PathBuf,
        /// A scene without.
        without: PathBuf,
    },
    /// Two scenes have other classes.
    MixedTaxonomies {
        /// A scene, and the name of its taxonomy.
        first: (PathBuf, String),
        /// Another scene, and the name of its taxonomy.
        second: (PathBuf, String),
    },
    /// Labels make no table.
    Labels {
        /// Why.
        why: String,
    },
    /// There are more labels than loaders of the data set can tell apart.
    TooManyLabels {
        /// How many labels there are.
        labels: usize,
        /// How many there may be.
        most: usize,
    },
    /// There are more points than anybody can mean.
    TooManyPoints {
        /// How many points there would be.
        points: f64,
        /// How many a square metre would have. `None` if their number itself was asked for.
        points_per_m2: Option<f64>,
        /// How many there may be.
        most: f64,
    },
    /// A disk has no space for what is to be written.
    NoSpace {
        /// How much is needed, and how much is free, in words.
        why: String,
    },
    /// A result would be of no use.
    Useless {
        /// What would be of no use: "the data set".
        what: &'static str,
        /// What is done with it: "export it".
        action: &'static str,
        /// What is wrong, a sentence each.
        reasons: Vec<String>,
        /// The conditions that are not met. A call that allows them goes on.
        conditions: Vec<Condition>,
    },
    /// A data set has no labels, and something is to be made of them.
    WithoutLabels {
        /// The folder of the data set.
        dataset: PathBuf,
        /// What needs labels: "COCO needs".
        needs: &'static str,
    },
    /// A data set has nothing of what is to be packed.
    NothingToPack {
        /// The folder of the data set.
        dataset: PathBuf,
        /// What it has none of: "panoramas".
        what: String,
    },
    /// Files of a data set are missing or damaged.
    Damaged {
        /// The folder of the data set.
        dataset: PathBuf,
        /// How many files are.
        files: usize,
        /// What is wrong with the first of them.
        first: String,
    },
    /// Files of a data set that was complete are missing or cut, and `overwrite` makes it again.
    Remake {
        /// What is wrong, and where.
        what: String,
    },
    /// Parts of an export are missing or damaged.
    Incomplete {
        /// What is missing, and where.
        what: String,
        /// What to do.
        remedy: String,
    },
}

impl InputError {
    /// Returns the message with options named by `names`.
    pub fn message(&self, names: &dyn OptionNames) -> String {
        match self {
            Self::Unfit { path, why } => format!("{}: {why}", path.display()),
            Self::UnfitArea { area, why } => format!("area {area}: {why}"),
            Self::SameArea { first, second, area } => format!(
                "{} and {} are both area {area}: give each scene an area of its own",
                first.display(),
                second.display()
            ),
            Self::MixedLabels { with, without } => format!(
                "{} has labels and {} has none: export them into data sets of their own",
                with.display(),
                without.display()
            ),
            Self::MixedTaxonomies { first, second } => format!(
                "{} has the classes of {} and {} has the classes of {}: export them into data sets of their \
                 own",
                first.0.display(),
                first.1,
                second.0.display(),
                second.1
            ),
            Self::Labels { why } | Self::NoSpace { why } => why.clone(),
            Self::TooManyLabels { labels, most } => format!(
                "{labels} labels are more than {most}: loaders of the data set take a label's index from G \
                 and B of a pixel alone, and a pixel with an R for one without a label; export the areas \
                 in several data sets"
            ),
            Self::TooManyPoints { points, points_per_m2: None, most } => format!(
                "{points:.1e} points are more than {most:.0e}: is the mesh in metres? or ask for fewer"
            ),
            Self::TooManyPoints { points, points_per_m2: Some(density), most } => format!(
                "{density} points a m² on {:.1} m² are {points:.1e} points, more than {most:.0e}: is the \
                 mesh in metres? or lower {}",
                points / density,
                names.option("points_per_m2", None)
            ),
            Self::Useless { what, action, reasons, conditions } => {
                let allow: Vec<String> = conditions
                    .iter()
                    .map(|c| names.option("allow", Some(c.name())))
                    .collect();
                format!(
                    "{what} would be of no use: {} (to {action} all the same: {})",
                    reasons.join("; "),
                    allow.join(" ")
                )
            }
            Self::WithoutLabels { dataset, needs } => {
                format!("{}: {needs} labels, and the data set was exported without", dataset.display())
            }
            Self::NothingToPack { dataset, what } => {
                format!("{}: the data set has no {what} to pack", dataset.display())
            }
            Self::Damaged { dataset, files, first } => {
                let them = match files {
                    1 => "a file that is needed is".to_owned(),
                    n => format!("{n} files that are needed are"),
                };
                format!(
                    "{}: {them} missing or damaged, as {first}; `s3d verify` tells all that is wrong",
                    dataset.display()
                )
            }
            Self::Remake { what } => {
                format!("{what}; make the data set again with {}", names.option("overwrite", None))
            }
            Self::Incomplete { what, remedy } => format!("{what}: {remedy}"),
        }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message(&FieldNames))
    }
}

impl std::error::Error for InputError {}
