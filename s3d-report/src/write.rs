//! The call that writes a report.

use crate::content::Content;
use crate::faults::{Fault, Faults};
use crate::index::FORM;
use crate::script::write_script;
use s3d_dataset::{Context, DataSet, Error, FolderKind, NewFolder, Result};
use s3d_io::fs::{create_dir, write_bytes, write_json};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The page: markup, style and program in one file.
const PAGE: &str = include_str!("../web/dist/index.html");

const GENERATOR: &str = "s3d report";

const KIND: FolderKind = FolderKind {
    about: "report.json",
    generator: GENERATOR,
    noun: "report",
    action: "use as the report's folder",
};

/// How a report is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportOptions {
    /// Width of panoramas in pixels; the data set's own if that is less.
    pub pano_width: u32,
    /// Width of the views' images in pixels; their colours are twice as wide where they are shown large.
    pub thumbs: u32,
    /// Replace an earlier report.
    pub overwrite: bool,
}

impl Default for ReportOptions {
    fn default() -> Self {
        Self { pano_width: 2048, thumbs: 256, overwrite: false }
    }
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// The folder; `index.html` in it is the page.
    pub folder: PathBuf,
    /// Panoramas in it.
    pub panoramas: usize,
    /// Views in it.
    pub views: usize,
    /// Bytes of its files.
    pub bytes: u64,
    /// What is missing or damaged in the data set, and told in the report.
    pub faults: Vec<Fault>,
}

/// What `report.json` says. No paths and no times: the same data set gives the same bytes.
#[derive(Serialize)]
struct About {
    generator: &'static str,
    version: &'static str,
    form: u32,
}

/// Writes the report of the data set in the folder `out` to the folder `to`, whole or not at all. The bytes
/// depend on the data set, the name of its folder and the options alone. Files of the data set that are
/// missing or damaged are told in the report, in [`Report::faults`] and as warnings; the rest is shown.
///
/// # Errors
/// [`Error::Usage`] if there is something else in `to`, or the options are out of range; [`Error::File`] if
/// there is no complete data set in `out`, its list of files is damaged, or `to` cannot be written;
/// [`Error::Cancelled`]; [`Error::Temporary`].
pub fn report(out: &Path, to: &Path, options: &ReportOptions, ctx: &Context) -> Result<Report> {
    if !(16..=16_384).contains(&options.pano_width) || !(16..=2048).contains(&options.thumbs) {
        return Err(Error::Usage(format!(
            "panoramas of {} and views of {} pixels across: 16 to 16384 and 16 to 2048 are possible",
            options.pano_width, options.thumbs
        )));
    }
    let data = DataSet::open(out)?;
    let folder = NewFolder::begin(ctx, to, out, KIND, options.overwrite)?;
    create_dir(&folder.path().join("data"))?;
    let mut faults = Faults::default();
    for (path, message) in data.missing(ctx)? {
        let shown = message.split_once(&path).map_or(message.as_str(), |(_, rest)| rest);
        faults.add(path.clone(), shown.trim_start_matches([':', ' ']));
    }
    let content = Content::read(&data, &mut faults)?;
    let made = content.write_pictures(ctx, options, folder.path(), &mut faults)?;
    let shown = |made: &[crate::content::ReadImage]| made.iter().filter(|made| made.seen.is_some()).count();
    let (panoramas, views) = (shown(&made.panoramas), shown(&made.views));
    let index = content.index(out, &made, faults)?;
    let mut bytes = made.bytes + write_script(folder.path(), "index", &index)?;
    bytes += write_bytes(&folder.path().join("index.html"), PAGE.as_bytes())?;
    let about = About { generator: GENERATOR, version: env!("CARGO_PKG_VERSION"), form: FORM };
    bytes += write_json(&folder.path().join(KIND.about), &about)?;
    folder.finish()?;
    let report = Report { folder: to.to_owned(), panoramas, views, bytes, faults: index.faults };
    for Fault { path, message } in &report.faults {
        ctx.warn(format_args!("{}: {message}", out.join(path).display()));
    }
    ctx.info(format_args!(
        "{}: {panoramas} panoramas and {views} views, {:.1} MB",
        to.join("index.html").display(),
        bytes as f64 / 1e6
    ));
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_out_of_range_are_refused_before_anything_is_read() {
        for (pano_width, thumbs) in [(15, 256), (2048, 8), (20_000, 256), (2048, 4096)] {
            let options = ReportOptions { pano_width, thumbs, overwrite: false };
            let e = report("none".as_ref(), "to".as_ref(), &options, &Context::default()).unwrap_err();
            assert!(matches!(e, Error::Usage(_)) && e.to_string().contains("16 to 2048"), "{e}");
        }
    }
}
