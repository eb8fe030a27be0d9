//! Errors of the crates as the exceptions of `s3d_py._errors`.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use s3d_dataset::Error;
use s3d_io::{Error as FileError, Place};
use std::io::ErrorKind;

/// A call that cannot be: `UsageError`.
pub(crate) fn usage(message: impl Into<String>) -> PyErr {
    exception(&Error::Usage(message.into()))
}

/// The input does not fit together: `InputError`.
pub(crate) fn input(message: impl Into<String>) -> PyErr {
    raise("InputError", &message.into(), None)
}

/// The exception that an error is.
pub(crate) fn exception(error: &Error) -> PyErr {
    match error {
        Error::Usage(text) => raise("UsageError", text, None),
        Error::Input(text) => raise("InputError", text, None),
        Error::Temporary(text) => raise("TemporaryError", text, None),
        Error::Cancelled => raise("CancelledError", &error.to_string(), None),
        Error::File(file) => of_file(file),
        other => raise("Error", &other.to_string(), None),
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
        let message = errors.call_method1("in_python", (message,))?;
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
