//! Names in options: of classes, and of shards.

use crate::error::{Result, UsageError};
use s3d_label::{Class, Taxonomy};
use serde::Serialize;
use std::str::FromStr;

/// Names of classes, from any taxonomy.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ClassList(pub Vec<String>);

impl ClassList {
    /// The classes in the taxonomy's order, without duplicates.
    ///
    /// # Errors
    /// [`UsageError::InvalidValue`] if no class has a name.
    pub fn classes(&self, taxonomy: &Taxonomy) -> Result<Vec<Class>> {
        let mut classes = Vec::with_capacity(self.0.len());
        for name in &self.0 {
            let class = taxonomy.class(name).map_err(|e| UsageError::InvalidValue {
                option: "stuff",
                value: name.clone(),
                why: e.to_string(),
            })?;
            classes.push(class);
        }
        classes.sort_unstable();
        classes.dedup();
        Ok(classes)
    }
}

impl FromStr for ClassList {
    type Err = String;

    /// Reads names of classes between commas, or `none`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        if text.trim() == "none" {
            return Ok(Self(Vec::new()));
        }
        let mut names: Vec<String> = text.split(',').map(|word| word.trim().to_owned()).collect();
        names.sort_unstable();
        names.dedup();
        if names.iter().any(String::is_empty) {
            return Err("must be names of classes between commas, or none".to_owned());
        }
        Ok(Self(names))
    }
}

/// The prefix of shards' names. It fits into a file name and a brace expansion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardPrefix(String);

impl ShardPrefix {
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for ShardPrefix {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let has_other = text.contains(|c: char| !c.is_ascii_alphanumeric() && !"_-.".contains(c));
        if text.is_empty() || text.starts_with('.') || has_other {
            return Err("must be letters, digits, _, - and ., and not begin with a .".to_owned());
        }
        Ok(Self(text.to_owned()))
    }
}
