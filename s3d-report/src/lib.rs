//! An offline report of a data set: a page that opens from the disk by a double click.
//!
//! [`report`] reads a data set and writes a folder. `index.html` is the page with its style and its program.
//! `data/` has reduced images, the mesh, and their tables. The data set is not altered. [`report_against`]
//! shows another data set beside it, with the differences. [`poster`] makes one picture of a data set.
//!
//! [`files`] describes the files of the folder. The source of the page is in `web/`, in TypeScript.
//! Its bundle is in `web/dist/`, so that this crate builds without Node.
//!
//! ```no_run
//! use s3d_report::{Context, ReportOptions, report};
//!
//! let options = ReportOptions::default();
//! let made = report("dataset".as_ref(), "dataset_report".as_ref(), &options, &Context::default())?;
//! println!("{}: {} views", made.page.display(), made.views);
//! # Ok::<(), s3d_report::Error>(())
//! ```

// No content of a file may make this crate panic.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::panic, clippy::string_slice, clippy::indexing_slicing)
)]

mod against;
mod areas;
mod content;
mod error;
mod faults;
mod figures;
mod first;
mod ground;
mod index;
mod mesh;
mod options;
mod pixels;
mod poster;
mod raster;
mod relations;
mod scores;
mod script;
mod selection;
mod storeys;
mod write;

pub use error::{Error, Result};
pub use faults::Fault;
pub use figures::{FiguresOptions, figures};
pub use options::ReportOptions;
pub use poster::poster;
pub use s3d_dataset::Context;
pub use write::{Report, report, report_against};

#[doc = include_str!("../docs/report.md")]
pub mod files {}

/// The example of the README, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
