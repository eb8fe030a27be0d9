//! Errors of the crates as the exceptions of `s3d_py._errors`.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use s3d_dataset::Error;
use s3d_dataset::error::{OptionNames, UsageError};
use s3d_io::{Error as FileError, Place};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The options of calls as arguments of the Python package.
struct Arguments;

impl OptionNames for Arguments {
    fn option(&self, name: &str, value: Option<&str>) -> String {
        /// Arguments that are True or False.
        const SWITCHES: [&str; 5] = ["overwrite", "lenient", "keep_all", "full", "single"];
        match value {
            Some(value) if name == "allow" => format!("allow=[{value:?}]"),
            Some(value) if value.parse::<f64>().is_ok() => format!("{name}={value}"),
            Some(value) => format!("{name}={value:?}"),
            None if SWITCHES.contains(&name) => format!("{name}=True"),
            None => name.to_owned(),
        }
    }
}

/// The input does not fit together: `InputError`.
pub(crate) fn input(message: impl Into<String>) -> PyErr {
    raise("InputError", &message.into(), None)
}

/// A call that cannot be: `UsageError`.
pub(crate) fn usage(message: impl Into<String>) -> PyErr {
    raise("UsageError", &message.into(), None)
}

/// The exception that an error is. Options are named as arguments.
pub(crate) fn exception(error: &Error) -> PyErr {
    if let Some(folder) = without_data_set(error) {
        let path = folder.to_string_lossy().into_owned();
        let error = UsageError::NoDataSet { folder }.message(&Arguments);
        return raise("NoDataSetError", &error, Some((path, None)));
    }
    let class = match error {
        Error::Usage(UsageError::Memory { .. }) => "TooLargeError",
        Error::Usage(_) => "UsageError",
        Error::Input(_) => "InputError",
        Error::Temporary(_) => "TemporaryError",
        Error::Cancelled => "CancelledError",
        Error::File(file) => return of_file(file),
        _ => "Error",
    };
    raise(class, &error.message(&Arguments), None)
}

/// The folder that was to hold a data set, and holds none.
fn without_data_set(error: &Error) -> Option<PathBuf> {
    match error {
        Error::Usage(UsageError::NoDataSet { folder }) => Some(folder.clone()),
        Error::File(file) if file.path().ends_with("manifest.json") && !file.path().exists() => {
            file.path().parent().map(Path::to_owned)
        }
        _ => None,
    }
}

fn of_file(error: &FileError) -> PyErr {
    let path = error.path().to_string_lossy().into_owned();
    let (class, detail) = match error {
        FileError::Io { source, .. } if source.kind() == ErrorKind::NotFound => {
            ("MissingFileError", Some(("errno", source.raw_os_error().map(i64::from))))
        }
        FileError::Io { source, .. } => {
            ("FileAccessError", Some(("errno", source.raw_os_error().map(i64::from))))
        }
        FileError::Format { place: Place::Line(line), .. } => {
            ("FormatError", Some(("line", i64::try_from(*line).ok())))
        }
        FileError::Format { .. } => ("FormatError", None),
        FileError::Mesh { .. } => ("MeshError", None),
        FileError::Unsupported { .. } => ("UnsupportedError", None),
        _ => ("FileError", None),
    };
    raise(class, &error.to_string(), Some((path, detail)))
}

/// The path of a file, and its line or the system's number by the name of the argument.
type About = (String, Option<(&'static str, Option<i64>)>);

/// A class of `s3d_py._errors` with its message, and what file it is about.
fn raise(class: &str, message: &str, about: Option<About>) -> PyErr {
    let made = Python::attach(|py| {
        let errors = py.import("s3d_py._errors")?;
        let class = errors.getattr(class)?;
        let fields = PyDict::new(py);
        if let Some((path, detail)) = about {
            fields.set_item("path", path)?;
            if let Some((name, value)) = detail {
                fields.set_item(name, value)?;
            }
        }
        Ok(PyErr::from_value(class.call((message,), Some(&fields))?))
    });
    made.unwrap_or_else(|error: PyErr| error)
}

/// For what is a fault of this package.
pub(crate) fn fault(message: impl Into<String>) -> PyErr {
    PyRuntimeError::new_err(message.into())
}
