//! Faults of TOML files, as errors of this crate.

use crate::error::Error;
use std::path::Path;

/// Returns the error for a fault in a TOML file, with its line.
pub(crate) fn toml_fault(e: &toml::de::Error, text: &str, path: &Path) -> Error {
    let message = e.message().replace('\n', "; ");
    match e.span() {
        // An error at the very start is about the whole file: a table is missing.
        Some(span) if span.end > 0 => {
            let line = text.bytes().take(span.start).filter(|b| *b == b'\n').count() + 1;
            Error::line(path, line as u64, message)
        }
        _ => Error::format(path, message),
    }
}
