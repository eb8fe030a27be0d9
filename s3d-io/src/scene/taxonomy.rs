//! The key `taxonomy` of a `scene.toml`, and taxonomies in files of their own.

use crate::dataset::taxonomy::{read_taxonomy_json, taxonomy};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::scene::toml_fault::toml_fault;
use s3d_label::{Taxonomy, TaxonomyDefinition};
use serde::de::value::MapAccessDeserializer;
use serde::{Deserialize, Deserializer, de};
use std::fmt;
use std::path::{Path, PathBuf};

/// The entry as it is written: a name, a file, or the taxonomy itself.
pub(crate) enum TaxonomyEntry {
    Named(String),
    Here(TaxonomyDefinition),
}

impl<'de> Deserialize<'de> for TaxonomyEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = TaxonomyEntry;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a taxonomy, a file such as \"my_classes.toml\", or a table with `name` and \
                     `classes`",
                )
            }
            fn visit_str<E: de::Error>(self, word: &str) -> std::result::Result<TaxonomyEntry, E> {
                Ok(TaxonomyEntry::Named(word.to_owned()))
            }
            fn visit_map<A: de::MapAccess<'de>>(
                self,
                map: A,
            ) -> std::result::Result<TaxonomyEntry, A::Error> {
                TaxonomyDefinition::deserialize(MapAccessDeserializer::new(map)).map(TaxonomyEntry::Here)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl TaxonomyEntry {
    /// Returns the taxonomy that a scene at `path` means, and the file that it was read from, if there is
    /// one.
    pub(crate) fn taxonomy(self, path: &Path) -> Result<(Taxonomy, Option<PathBuf>)> {
        let word = match self {
            Self::Named(word) => word,
            Self::Here(definition) => return Ok((taxonomy(path, definition)?, None)),
        };

        if let Some(known) = Taxonomy::built_in(&word) {
            return Ok((known, None));
        }

        let file = path.parent().unwrap_or(Path::new("")).join(&word);
        if file.is_file() {
            return Ok((read_taxonomy(&file)?, Some(file)));
        }

        let known = Taxonomy::BUILT_IN.join(", ");
        let message = format!(
            "taxonomy = {word:?} is neither one of {known}, nor a file: {} is not there",
            file.display()
        );
        Err(Error::format(path, message))
    }
}

/// Reads a taxonomy: TOML, or JSON (`.json`) as in `assets/taxonomy.json` of a data set.
///
/// ```toml
/// name = "hotel"                    # what the taxonomy is called
/// clutter = "other"                 # the class of unknown words; left out: there is none
/// [[classes]]
/// name = "bed"                      # letters and digits
/// id = 4                            # left out: the place in the list, from 1
/// color = [255, 187, 120]           # left out: one that no other class has
/// kind = "thing"                    # or "stuff"; left out: stuff if it counts as ceiling, floor or wall
/// aliases = ["double bed", "cot"]   # other words for it
/// counts_as = "clutter"             # which class of S3DIS, or of this taxonomy, it counts as
/// [[classes]]
/// name = "other"
/// [[rooms]]                         # types of rooms; left out: S3DIS's
/// name = "bedroom"                  # letters
/// aliases = ["Bedroom"]
/// counts_as = "lounge"
/// [aliases]                         # more words; "": unlabelled
/// "0" = ""
/// ```
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`], with the line if the file is not TOML or has unknown keys, with the
/// entry if it is not a taxonomy.
pub fn read_taxonomy(path: &Path) -> Result<Taxonomy> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return read_taxonomy_json(path);
    }
    let bytes = read_file(path)?;
    parse_taxonomy(
        std::str::from_utf8(&text_of(&bytes, path)?)
            .map_err(|_| Error::format(path, "is no text in UTF-8; a taxonomy is a text file in TOML"))?,
        path,
    )
}

/// Reads like [`read_taxonomy`], from the text of a TOML file. Errors call the file `path`.
///
/// # Errors
/// Like [`read_taxonomy`].
pub fn parse_taxonomy(text: &str, path: &Path) -> Result<Taxonomy> {
    taxonomy(path, toml::from_str(text).map_err(|e| toml_fault(&e, text, path))?)
}
