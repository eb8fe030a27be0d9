//! What the numbers and words of a file mean.

use s3d_io::Error as FileError;
use s3d_io::fs::read_json;
use s3d_label::{Class, Taxonomy};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Numbers that are no class unless the names say otherwise: those that loaders ignore.
const NO_CLASS: [i64; 3] = [-100, -1, 255];

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
    /// The file that says them.
    file: Option<PathBuf>,
}

impl<'t> ClassNames<'t> {
    /// Reads the names beside a file, or takes the order of the taxonomy.
    ///
    /// # Errors
    /// [`FileError`] if the names are damaged, or the taxonomy does not know them.
    pub(super) fn beside(path: &Path, taxonomy: &'t Taxonomy) -> Result<Self, FileError> {
        let file = Self::places(path).into_iter().find(|path| path.is_file());
        let mut classes: BTreeMap<String, Option<Class>> = BTreeMap::new();
        if let Some(file) = &file {
            let words: Vec<(String, Option<String>)> = match read_json(file)? {
                Document::List(names) => (0..).map(|n: u32| n.to_string()).zip(names).collect(),
                Document::Words(words) => words.into_iter().collect(),
            };
            for (word, name) in words {
                let class = match name.as_deref() {
                    None | Some("") => None,
                    Some(name) => class_of(taxonomy, name).map_err(|why| {
                        FileError::format(file, format!("{word:?}: {why}; null is for no class"))
                    })?,
                };
                classes.insert(word, class);
            }
        } else {
            let places = (0..).zip(taxonomy.classes());
            classes.extend(places.map(|(n, class): (u32, _)| (n.to_string(), Some(*class))));
        }
        for number in NO_CLASS {
            classes.entry(number.to_string()).or_insert(None);
        }
        Ok(Self { taxonomy, classes, file })
    }

    /// Whether a file says them.
    pub(super) fn are_said(&self) -> bool {
        self.file.is_some()
    }

    /// The places where names may be.
    fn places(path: &Path) -> [PathBuf; 2] {
        let mut own = path.file_stem().unwrap_or_default().to_owned();
        own.push(".classes.json");
        [own.into(), PathBuf::from("classes.json")].map(|name| path.with_file_name(name))
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

/// Returns the class that a word means, by name or alias; `None` for a word that means no class.
fn class_of(taxonomy: &Taxonomy, word: &str) -> Result<Option<Class>, String> {
    match taxonomy.meaning(word) {
        Some(class) => Ok(class),
        None => taxonomy.class(word).map(Some).map_err(|e| e.to_string()),
    }
}
