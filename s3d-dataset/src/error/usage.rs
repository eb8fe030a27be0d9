//! Calls that cannot be: options that are out of range or exclude each other, folders that hold something
//! else.

use crate::error::names::{FieldNames, OptionNames};
use std::fmt;
use std::path::PathBuf;

/// How many differences a message names.
const MAX_NAMED: usize = 8;

/// Why a call cannot be made. Nothing was changed.
///
/// Options are named as fields of the options structs; [`message`](UsageError::message) names them as the
/// users of a program write them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum UsageError {
    /// The value of an option is out of its range.
    OutOfRange {
        /// The option.
        option: &'static str,
        /// What its value must be: "at most 100000".
        range: String,
    },
    /// The value of an option is none that it can have.
    InvalidValue {
        /// The option.
        option: &'static str,
        /// Its value.
        value: String,
        /// Why it cannot have it, and what it can have.
        why: String,
    },
    /// A text is no uuid.
    InvalidUuid {
        /// The text.
        text: String,
    },
    /// An option needs labels, and the scene has none.
    NeedsLabels {
        /// The option.
        option: &'static str,
        /// Its value, if it has one.
        value: Option<String>,
    },
    /// All modalities that were asked for are images of labels, and the scene has none.
    NothingWithoutLabels,
    /// Something is not known unless one of these groups of options is given.
    Missing {
        /// What is not known, and of what.
        what: String,
        /// Groups of options: one of them is enough. An option with a word for its value, if it has one.
        groups: Vec<Vec<(&'static str, Option<&'static str>)>>,
    },
    /// An option belongs to other packages than the one that is made.
    ForeignOption {
        /// The option.
        option: &'static str,
        /// The packages that have it.
        packages: Vec<&'static str>,
    },
    /// A file is there already, and `overwrite` is not set.
    Exists {
        /// The file.
        path: PathBuf,
        /// What speaks for keeping it, if something does.
        note: Option<&'static str>,
    },
    /// A folder holds something that is not replaced unless `overwrite` is set.
    Holds {
        /// The folder.
        folder: PathBuf,
        /// What is in it: a name.
        entry: String,
        /// What `overwrite` would do.
        overwriting: Overwriting,
    },
    /// A folder holds something that was written by something else, and is never replaced.
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// What is in it: a name.
        entry: String,
        /// The program that writes such folders.
        generator: &'static str,
    },
    /// Something that s3d did not write lies where a part of the data set belongs.
    InTheWay {
        /// What lies there.
        path: PathBuf,
    },
    /// A link lies where s3d would write or remove files: they would lie elsewhere.
    Link {
        /// The link.
        path: PathBuf,
        /// Where it leads.
        target: PathBuf,
    },
    /// A folder holds a plan, and a data set was to go there.
    HoldsPlan {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder holds something, and a plan was to go there.
    HoldsNoPlan {
        /// The folder.
        folder: PathBuf,
        /// What is in it: a name.
        entry: String,
    },
    /// A folder holds the result of another call.
    OtherCall {
        /// The folder.
        folder: PathBuf,
        /// What it holds.
        held: Held,
        /// How the other call differs.
        differences: Vec<Difference>,
    },
    /// Two folders are shards of different calls.
    MixedShards {
        /// The first folder.
        first: PathBuf,
        /// Another folder.
        other: PathBuf,
        /// The differences between the calls for `first` ("there") and `other` ("now").
        differences: Vec<Difference>,
    },
    /// A shard was made by another version of s3d.
    OtherVersion {
        /// The folder of the shard.
        folder: PathBuf,
        /// The version that made it.
        there: String,
    },
    /// There is no shard to merge.
    NoShards,
    /// The data set would be written over its own input.
    OverInput {
        /// The folder of the data set.
        folder: PathBuf,
        /// A file or folder of the input.
        input: PathBuf,
    },
    /// What is to be made of a data set would lie in it, or it would lie in that.
    Nested {
        /// The place of what is to be made.
        place: PathBuf,
        /// The folder of the data set.
        dataset: PathBuf,
    },
    /// A folder holds no data set.
    NoDataSet {
        /// The folder.
        folder: PathBuf,
    },
    /// There is nothing to export.
    NoScenes,
    /// A result would not fit into memory.
    Memory {
        /// What takes memory: "1000000000000 points".
        what: String,
        /// The number of bytes.
        bytes: f64,
        /// The number of bytes that are free, if that is known.
        free: Option<f64>,
    },
    /// A file cannot have this name.
    WrongEnding {
        /// The file.
        path: PathBuf,
        /// Why, and which ending it must have.
        why: &'static str,
    },
}

/// What `overwrite` does with a folder that holds something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwriting {
    /// It writes beside what is there.
    Beside,
    /// It replaces this, such as "the package".
    Replaces(&'static str),
}

/// The result of another call that a folder holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// A complete data set.
    DataSet,
    /// An export that is not complete.
    UnfinishedExport,
    /// A plan.
    Plan,
}

/// How two calls differ in what decides the bytes of a data set.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// An option has another value.
    Option {
        /// The option.
        name: String,
        /// Its value in the earlier call, in words.
        there: String,
        /// Its value in this call, in words.
        now: String,
    },
    /// An option is set in one of the calls only.
    Switch {
        /// The option.
        name: String,
        /// The value that the one call sets, unless that is `true`.
        value: Option<String>,
        /// Whether this call sets it.
        now: bool,
    },
    /// Anything else, in words.
    Other(String),
}

impl UsageError {
    /// Returns the message with options named by `names`.
    pub fn message(&self, names: &dyn OptionNames) -> String {
        let overwrite = || names.option("overwrite", None);
        match self {
            Self::OutOfRange { option, range } => {
                format!("{}: must be {range}", names.option(option, None))
            }
            Self::InvalidValue { option, value, why } => {
                format!("{}: {why}", names.option(option, Some(value)))
            }
            Self::InvalidUuid { text } => format!("{text:?} is no uuid of 32 hexadecimal digits"),
            Self::NeedsLabels { option, value } => {
                format!("{} needs labels, and the scene has none", names.option(option, value.as_deref()))
            }
            Self::NothingWithoutLabels => {
                let modalities = names.option("modalities", None);
                format!("{modalities}: only images of labels, and the scene has none")
            }
            Self::Missing { what, groups } => {
                let mut ways = Vec::new();
                for options in groups {
                    let options: Vec<String> =
                        options.iter().map(|(name, value)| names.option(name, *value)).collect();
                    ways.push(options.join(" and "));
                }
                format!("{what}: give {}", ways.join(", or "))
            }
            Self::ForeignOption { option, packages } => {
                format!("{} belongs to {} only", names.option(option, None), packages.join(" and "))
            }
            Self::Exists { path, note: None } => {
                format!("{} is there already: replace it with {}", path.display(), overwrite())
            }
            Self::Exists { path, note: Some(note) } => {
                format!("{} is there already, and {note}: replace it with {}", path.display(), overwrite())
            }
            Self::Holds { folder, entry, overwriting } => {
                let instead = match overwriting {
                    Overwriting::Beside => "write into this one".to_owned(),
                    Overwriting::Replaces(what) => format!("replace {what} in it"),
                };
                format!(
                    "{} already holds {entry}: choose another folder, or {instead} with {}",
                    folder.display(),
                    overwrite()
                )
            }
            Self::Foreign { folder, entry, generator } => format!(
                "{} already holds {entry}, and was not written by {generator}: choose another folder",
                folder.display()
            ),
            Self::InTheWay { path } => format!(
                "{} is in the way, and was not written by s3d: move it, or choose another folder",
                path.display()
            ),
            Self::Link { path, target } => format!(
                "{} is a symbolic link to {}, where s3d would write and remove files: remove the link, or \
                 choose another folder (the output folder itself may be a link)",
                path.display(),
                target.display()
            ),
            Self::HoldsPlan { folder } => {
                format!("{} holds a plan: choose another folder", folder.display())
            }
            Self::HoldsNoPlan { folder, entry } => {
                format!("{} holds {entry}, and no plan: choose another folder", folder.display())
            }
            Self::OtherCall { folder, held: Held::Plan, differences } => {
                let differences = listed(differences, usize::MAX, names);
                format!("{} is a plan of another call ({differences})", folder.display())
            }
            Self::OtherCall { folder, held, differences } => format!(
                "{} already holds {held} of another call ({}): choose another folder, or replace it with {}",
                folder.display(),
                listed(differences, MAX_NAMED, names),
                overwrite()
            ),
            Self::MixedShards { first, other, differences } => format!(
                "{} and {} are shards of different calls: {} (\"there\" is {}, \"now\" is {})",
                first.display(),
                other.display(),
                listed(differences, MAX_NAMED, names),
                first.display(),
                other.display()
            ),
            Self::OtherVersion { folder, there } => format!(
                "{} is a shard by version {there} of s3d, and this is {}: merge with that version",
                folder.display(),
                env!("CARGO_PKG_VERSION")
            ),
            Self::NoShards => "there is no shard to merge".to_owned(),
            Self::OverInput { folder, input } => format!(
                "{}: the data set would be written over its own input {}: choose another folder",
                folder.display(),
                input.display()
            ),
            Self::Nested { place, dataset } => format!(
                "{} and the data set {} would lie in one another: choose another folder with {}",
                place.display(),
                dataset.display(),
                names.option("output", None)
            ),
            Self::NoDataSet { folder } => format!(
                "{}: no data set is there (no manifest.json): give the folder of one",
                folder.display()
            ),
            Self::NoScenes => "there is no scene to export: name one".to_owned(),
            Self::Memory { what, bytes, free } => {
                let gib = |bytes: f64| format!("{:.1} GiB", bytes / f64::from(1 << 30));
                let free = free.map_or_else(String::new, |free| format!(", and {} are free", gib(free)));
                format!("{what} take {} of memory{free}: ask for less", gib(*bytes))
            }
            Self::WrongEnding { path, why } => format!("{}: {why}", path.display()),
        }
    }
}

impl Difference {
    /// Returns it as a sentence with options named by `names`. "There" is the earlier call, "now" this one.
    pub fn message(&self, names: &dyn OptionNames) -> String {
        match self {
            Self::Option { name, there, now } => {
                format!("{} {there} there, {now} now", names.option(name, None))
            }
            Self::Switch { name, value, now: true } => {
                format!("{} now, not there", names.option(name, value.as_deref()))
            }
            Self::Switch { name, value, now: false } => {
                format!("{} there, not now", names.option(name, value.as_deref()))
            }
            Self::Other(text) => text.clone(),
        }
    }
}

/// The first `most` differences, in a line.
fn listed(differences: &[Difference], most: usize, names: &dyn OptionNames) -> String {
    let named: Vec<String> = differences.iter().take(most).map(|d| d.message(names)).collect();
    let more = match differences.len() - named.len() {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    named.join("; ") + &more
}

impl fmt::Display for UsageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message(&FieldNames))
    }
}

impl std::error::Error for UsageError {}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message(&FieldNames))
    }
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::DataSet => "a data set",
            Self::UnfinishedExport => "an unfinished export",
            Self::Plan => "a plan",
        })
    }
}
