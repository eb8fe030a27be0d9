//! The faults of a data set, which its report lists.

use s3d_dataset::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A file that is missing or damaged, or does not fit the others.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct Fault {
    /// The path of the file below the folder of the data set, with `/`.
    pub path: String,
    /// What is wrong with it.
    pub message: String,
}

/// The faults that were found, one for each file, ordered by path.
#[derive(Debug, Default)]
pub(crate) struct Faults(BTreeMap<String, String>);

impl Faults {
    /// Returns the value that was read. A wrong file becomes a fault, and `None`. Any other error stays an
    /// error.
    pub(crate) fn keep<T>(&mut self, root: &Path, read: Result<T>) -> Result<Option<T>> {
        match read {
            Ok(value) => Ok(Some(value)),
            Err(Error::File(e)) => {
                self.add(name(root, e.path()), &e.message());
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }

    /// Adds a fault, unless the file has one.
    pub(crate) fn add(&mut self, path: String, message: &str) {
        self.0.entry(path).or_insert_with(|| message.to_owned());
    }

    /// Adds the faults that another thread found.
    pub(crate) fn extend(&mut self, others: Vec<Fault>) {
        others
            .into_iter()
            .for_each(|Fault { path, message }| self.add(path, &message));
    }

    pub(crate) fn into_vec(self) -> Vec<Fault> {
        self.0
            .into_iter()
            .map(|(path, message)| Fault { path, message })
            .collect()
    }
}

/// Returns the path of a file below the folder of the data set.
pub(crate) fn name(root: &Path, path: &Path) -> String {
    let below = path.strip_prefix(root).unwrap_or(path);
    below
        .iter()
        .map(|part| part.to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_one_fault_below_the_folder() {
        let root = Path::new("a/data");
        let mut faults = Faults::default();
        let wrong = |text: &str| -> Result<()> {
            Err(s3d_io::Error::format(&root.join("area_1").join("views.json"), text).into())
        };
        assert_eq!(faults.keep(root, wrong("no JSON")).unwrap(), None);
        assert_eq!(faults.keep(root, wrong("gone")).unwrap(), None);
        assert_eq!(faults.keep(root, Ok(3)).unwrap(), Some(3));
        assert!(faults.keep::<()>(root, Err(Error::Cancelled)).is_err());
        let fault = Fault { path: "area_1/views.json".into(), message: "no JSON".into() };
        assert_eq!(faults.into_vec(), [fault]);
    }
}
