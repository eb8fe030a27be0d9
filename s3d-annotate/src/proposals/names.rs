//! What the numbers and words of a file mean.

use s3d_io::Error as FileError;
use s3d_io::fs::{read_file, read_json};
use s3d_label::{Class, Taxonomy};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Numbers that are no class unless the names say otherwise: those that loaders ignore.
const NO_CLASS: [i64; 3] = [-100, -1, 255];

/// The names of lists, the first ones first. Beside a file, `NAME.` and each of these comes before them.
const LISTS: [&str; 2] = ["classes.json", "classes.csv"];

/// What `classes.json` holds.
#[derive(Deserialize)]
#[serde(untagged)]
enum Document {
    List(Vec<Option<String>>),
    Words(BTreeMap<String, Option<String>>),
}

/// The meaning of the numbers and words of a file.
pub(super) struct ClassNames<'t> {
    pub(super) taxonomy: &'t Taxonomy,
    /// The class of each number or word; `None` for no class.
    pub(super) classes: BTreeMap<String, Option<Class>>,
    /// The class of ranges of numbers, each of which is an instance.
    ranges: Vec<(RangeInclusive<i64>, Option<Class>)>,
    /// The file that says them.
    file: Option<PathBuf>,
}

impl<'t> ClassNames<'t> {
    /// Reads the names beside a file or in a folder, or takes the order of the taxonomy.
    ///
    /// # Errors
    /// [`FileError`] if the names are damaged, or the taxonomy does not know them.
    pub(super) fn beside(path: &Path, taxonomy: &'t Taxonomy) -> Result<Self, FileError> {
        if let Some(file) = Self::places(path).into_iter().find(|path| path.is_file()) {
            return Self::read(file, taxonomy);
        }
        let places = (0..).zip(taxonomy.classes());
        let classes = places.map(|(n, class): (u32, _)| (n.to_string(), Some(*class)));
        Ok(Self::new(taxonomy, classes.collect(), None))
    }

    /// Reads a list of names: JSON, or lines `number,name`.
    ///
    /// # Errors
    /// Like [`ClassNames::beside`].
    pub(super) fn read(file: PathBuf, taxonomy: &'t Taxonomy) -> Result<Self, FileError> {
        let words: Vec<(String, Option<String>)> = if file.extension().is_some_and(|ending| ending == "csv") {
            lines(&file)?
        } else {
            match read_json(&file)? {
                Document::List(names) => (0..).map(|n: u32| n.to_string()).zip(names).collect(),
                Document::Words(words) => words.into_iter().collect(),
            }
        };
        Self::of_words(words, file, taxonomy)
    }

    /// Returns the names that are at their places in a list of `file`.
    ///
    /// # Errors
    /// [`FileError`] if the taxonomy does not know one.
    pub(super) fn of_words(
        words: Vec<(String, Option<String>)>,
        file: PathBuf,
        taxonomy: &'t Taxonomy,
    ) -> Result<Self, FileError> {
        let mut classes = BTreeMap::new();
        for (word, name) in words {
            let class = match name.as_deref() {
                None | Some("") => None,
                Some(name) => class_of(taxonomy, name).map_err(|why| {
                    FileError::format(&file, format!("{word:?}: {why}; null is for no class"))
                })?,
            };
            classes.insert(word, class);
        }
        Ok(Self::new(taxonomy, classes, Some(file)))
    }

    fn new(
        taxonomy: &'t Taxonomy,
        mut classes: BTreeMap<String, Option<Class>>,
        file: Option<PathBuf>,
    ) -> Self {
        let range = |(word, class): (&String, &Option<Class>)| {
            let (first, last) = word.split_once('-')?;
            Some((first.trim().parse().ok()?..=last.trim().parse().ok()?, *class))
        };
        let ranges = classes.iter().filter_map(range).collect();
        for number in NO_CLASS {
            classes.entry(number.to_string()).or_insert(None);
        }
        Self { taxonomy, classes, ranges, file }
    }

    /// Whether a file says them.
    pub(super) fn are_said(&self) -> bool {
        self.file.is_some()
    }

    /// The places where names may be.
    fn places(path: &Path) -> Vec<PathBuf> {
        let inside = LISTS.map(|name| path.join(name));
        let own = LISTS.map(|name| {
            let mut own = path.file_stem().unwrap_or_default().to_owned();
            own.push(".");
            own.push(name);
            path.with_file_name(own)
        });
        let beside = LISTS.map(|name| path.with_file_name(name));
        [inside, own, beside].concat()
    }

    /// Whether the file names numbers of instances, as in `"500-599": "chair"`.
    pub(super) fn has_ranges(&self) -> bool {
        !self.ranges.is_empty()
    }

    /// Returns what the range of a number means, if it is in one.
    pub(super) fn class_of_range(&self, number: i64) -> Option<Option<Class>> {
        let mut ranges = self.ranges.iter();
        ranges
            .find(|(range, _)| range.contains(&number))
            .map(|(_, class)| *class)
    }

    /// Whether the file, or the taxonomy without one, gives a number a class, alone or in a range.
    pub(super) fn knows(&self, number: i64) -> bool {
        self.class_of_range(number).is_some()
            || matches!(self.classes.get(&number.to_string()), Some(Some(_)))
    }

    /// Returns the class that a number means; `None` for no class.
    ///
    /// # Errors
    /// A sentence if the number has no meaning.
    pub(super) fn class_of_number(&self, number: i64) -> Result<Option<Class>, String> {
        match self.classes.get(&number.to_string()) {
            Some(class) => Ok(*class),
            None if number < 0 => Ok(None),
            None => Err(format!("class {number}, which has no meaning: {}", self.advice())),
        }
    }

    /// Returns what to do about a number or a word without a meaning.
    pub(super) fn advice(&self) -> String {
        match &self.file {
            Some(file) => format!("add it to {}; \"\" is for no class", file.display()),
            None => format!(
                "numbers are places among the {} classes of {}, from 0; for others, say names in \
                 NAME.classes.json beside the file, as in {{\"4\": {:?}, \"9\": \"\"}}",
                self.taxonomy.classes().len(),
                self.taxonomy.name(),
                self.taxonomy.classes().last().map_or("chair", |class| class.name())
            ),
        }
    }
}

/// Reads lines of a number and a name. A first line without a number is a heading.
fn lines(file: &Path) -> Result<Vec<(String, Option<String>)>, FileError> {
    let text = String::from_utf8_lossy(&read_file(file)?).into_owned();
    let mut words = Vec::new();
    for (place, line) in (1u64..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let plain = |part: &str| part.trim().trim_matches('"').to_owned();
        let parts = line.split_once(',').map(|(number, name)| (plain(number), plain(name)));
        match parts {
            Some((number, name)) if number.starts_with(|c: char| c.is_ascii_digit() || c == '-') => {
                words.push((number, Some(name)));
            }
            Some(_) if place == 1 => {}
            _ => return Err(FileError::line(file, place, "is no number and name, such as 5,chair")),
        }
    }
    Ok(words)
}

/// Returns the class that a word means, by name or alias; `None` for a word that means no class.
fn class_of(taxonomy: &Taxonomy, word: &str) -> Result<Option<Class>, String> {
    match taxonomy.meaning(word) {
        Some(class) => Ok(class),
        None => taxonomy.class(word).map(Some).map_err(|e| e.to_string()),
    }
}
