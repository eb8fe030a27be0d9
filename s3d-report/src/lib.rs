//! An offline report of a data set: a page that opens from the disk by a double click.
//!
//! [`report`] reads a data set and writes a folder: `index.html`, which has the page with its style and its
//! program in it, and `data/`, which has reduced images, the mesh and what is known of them. Nothing in
//! the data set is altered. `docs/report.md` describes the files of the folder; the page itself is
//! in `web/`, in TypeScript, and its bundle in `web/dist/`, so that no Node is needed to build this crate.
//!
//! ```no_run
//! use s3d_report::{Context, ReportOptions, report};
//!
//! let options = ReportOptions::default();
//! let made = report("dataset".as_ref(), "dataset_report".as_ref(), &options, &Context::default())?;
//! println!("{}: {} views", made.page.display(), made.views);
//! # Ok::<(), s3d_report::Error>(())
//! ```

// What a file holds must not make it panic.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::panic, clippy::string_slice, clippy::indexing_slicing)
)]

mod against;
mod areas;
mod content;
mod faults;
mod index;
mod mesh;
mod packed;
mod pixels;
mod reduce;
mod script;
mod selection;
mod write;

pub use faults::Fault;
pub use s3d_dataset::{Context, Error, Result};
pub use write::{Report, ReportOptions, report, report_against};

#[doc = include_str!("../docs/report.md")]
pub mod files {}

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
