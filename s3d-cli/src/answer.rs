//! The answer of a command: text on standard output, and JSON on request.

use crate::failure::Outcome;
use crate::upright::{upright_json, upright_text};
use clap::Args;
use s3d_dataset::store::NewFile;
use s3d_dataset::{Context, Error, Result};
use s3d_io::Error as FileError;
use s3d_io::fs::write_json;
use serde::Serialize;
use std::io::{self, ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

/// Where the answer goes as JSON.
#[derive(Clone, Debug, Args)]
pub(crate) struct JsonArgs {
    /// Write the whole answer as JSON, besides the text. With `-`, JSON replaces the text on standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Replace FILE if it exists.
    #[arg(long, requires = "json")]
    overwrite: bool,
}

impl JsonArgs {
    fn file(&self) -> Option<&Path> {
        self.json.as_deref().filter(|file| *file != Path::new("-"))
    }

    /// Refuses a file that exists already, before the work begins.
    pub(crate) fn check_free(&self) -> Result<()> {
        self.file()
            .map_or(Ok(()), |file| NewFile::check_free(file, self.overwrite))
    }

    /// Writes the answer to the file, if one is named.
    pub(crate) fn write(&self, answer: &impl Serialize, context: &Context) -> Result<()> {
        let Some(path) = self.file() else { return Ok(()) };
        let file = NewFile::begin(context, path, self.overwrite)?;
        write_json(file.path(), answer)?;
        file.finish()
    }

    /// Writes `text` or JSON to standard output.
    pub(crate) fn print(&self, answer: &impl Serialize, text: impl FnOnce() -> String) -> Outcome<()> {
        if self.json.is_none() || self.file().is_some() {
            return print(&text());
        }
        let json = serde_json::to_string_pretty(answer)
            .map_err(|e| FileError::io("standard output".as_ref(), "write", io::Error::from(e)))?;
        print_json(&(json + "\n"))
    }
}

/// Writes the answer of a command to standard output.
pub(crate) fn print(text: &str) -> Outcome<()> {
    write(&upright_text(text))
}

/// Writes the answer of a command in JSON to standard output.
pub(crate) fn print_json(json: &str) -> Outcome<()> {
    write(&upright_json(json))
}

fn write(text: &str) -> Outcome<()> {
    match stdout().write_all(text.as_bytes()) {
        // Whoever reads may stop early: `s3d stats OUT | head`.
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::from(FileError::io("standard output".as_ref(), "write", e)).into())
        }
        _ => Ok(()),
    }
}
