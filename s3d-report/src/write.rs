//! The call that writes a report.

use crate::against;
use crate::content::{Content, ReadImage};
use crate::error::{Error, Result};
use crate::faults::{Fault, Faults};
use crate::first::First;
use crate::index::{FORM, Index, Verified, folder_name};
use crate::options::{MESH_FACES, PANO_WIDTHS, ReportOptions, THUMB_WIDTHS};
use crate::poster;
use crate::scores::Scores;
use crate::script::{MOST_BYTES, Scripts};
use s3d_dataset::store::{FolderKind, NewFile, NewFolder, check_apart};
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, DataSet, verify};
use s3d_io::fs::{create_dir, write_bytes, write_json, write_whole};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The page: markup, style and program in one file.
const PAGE: &str = include_str!("../web/dist/index.html");

/// The place of the data in a report of one file.
const DATA: &str = "<!-- data -->\n";

/// The end of the head that all pages share.
const HEAD_END: &str = "<meta name=\"viewport\"";

const GENERATOR: &str = "s3d report";

const KIND: FolderKind = FolderKind {
    about: "report.json",
    generator: GENERATOR,
    noun: "report",
    action: "use as the report's folder",
};

/// A report that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// The page to open in a browser.
    pub page: PathBuf,
    /// The number of panoramas in it.
    pub panoramas: usize,
    /// The number of views in it.
    pub views: usize,
    /// The size of its files in bytes.
    pub bytes: u64,
    /// The files of the data set that are missing or damaged. The page lists them, too.
    pub faults: Vec<Fault>,
}

/// `report.json`. It has no paths and no times, so that the same data set gives the same bytes.
#[derive(Serialize)]
struct About {
    generator: &'static str,
    version: &'static str,
    form: u32,
}

/// Writes the report of the data set in the folder `out` to `to`, a folder or one file, whole or not at all.
///
/// The bytes depend only on the data set, the name of its folder and the options. Files of the data set that
/// are missing or damaged are listed in the report, in [`Report::faults`] and as warnings; everything else is
/// shown. If an export did not finish, the report shows the files so far.
///
/// # Errors
/// [`Error::OutOfRange`] for the options. [`Error::OtherDataSet`] for scores of another data set.
/// [`Error::Occupied`] if a file at `to` is no report. [`Error::TooLarge`] for a single file.
/// [`Error::Dataset`] if there is no data set in `out`, its list of files or a file of scores is damaged,
/// `to` cannot be written or holds something else, or the call is cancelled.
pub fn report(out: &Path, to: &Path, options: &ReportOptions, ctx: &Context) -> Result<Report> {
    write(out, None, to, options, ctx)
}

/// Writes a report like [`report`], with the differences to the data set in the folder `against`. The page
/// shows both side by side.
///
/// # Errors
/// Fails like [`report`], for either data set.
pub fn report_against(
    out: &Path,
    against: &Path,
    to: &Path,
    options: &ReportOptions,
    ctx: &Context,
) -> Result<Report> {
    write(out, Some(against), to, options, ctx)
}

fn write(
    out: &Path,
    against: Option<&Path>,
    to: &Path,
    options: &ReportOptions,
    ctx: &Context,
) -> Result<Report> {
    let is_within = PANO_WIDTHS.contains(&options.pano_width)
        && THUMB_WIDTHS.contains(&options.thumbs)
        && MESH_FACES.contains(&options.mesh_faces);
    if !is_within {
        return Err(Error::OutOfRange(options.clone()));
    }
    if let Some(against) = against {
        // A data set that cannot be compared is refused before anything is written.
        check_apart(to, against)?;
        DataSet::open(out)?;
        DataSet::open(against)?;
    }
    let data = DataSet::open_as_far_as_it_is(out, ctx)?;
    let scores = options.scores.iter().map(|path| Scores::read(path, &data));
    let scores = scores.collect::<Result<Vec<_>>>()?;
    if let Some(poster) = &options.poster {
        check_apart(poster, out)?;
        check_apart(poster, to).map_err(|_| Error::PosterInReport(poster.clone()))?;
    }
    let destination = Destination::begin(ctx, to, out, options)?;

    // What cannot be drawn is told before the report is made.
    let poster = options.poster.as_ref().map(|place| {
        let file = NewFile::begin(ctx, place, options.overwrite || destination.was_placing())?;
        poster::draw(&data, file.path(), ctx)?;
        Ok::<_, Error>(file)
    });
    let poster = poster.transpose()?;

    let scripts = match &destination {
        Destination::Folder(folder) => {
            create_dir(&folder.path().join("data"))?;
            Scripts::Files(folder.path().to_owned())
        }
        Destination::File { .. } => Scripts::Page(Mutex::default()),
    };

    let written = match write_data(ctx, (out, &data), against, (options, &scores), &scripts) {
        Err(_) if scripts.is_too_large() => return Err(Error::TooLarge(MOST_BYTES)),
        written => written?,
    };
    let Data { index, panoramas, views, mut bytes } = written;
    let page = destination.page();
    if let Some(poster) = poster {
        // After a kill in between, the same call goes on.
        destination.begin_placing()?;
        poster.finish()?;
    }
    bytes += destination.finish(scripts)?;

    for sentence in data.missing_yet().into_iter().flatten() {
        ctx.warn(format_args!("{}: not finished: {sentence}", out.display()));
    }
    let report = Report { page, panoramas, views, bytes, faults: index.faults };
    for Fault { path, message } in &report.faults {
        ctx.warn(format_args!("{}: {message}", out.join(path).display()));
    }
    ctx.info(format_args!(
        "{}: {panoramas} panoramas and {views} views, {:.1} MB",
        report.page.display(),
        bytes as f64 / 1e6
    ));
    Ok(report)
}

/// The data of a report.
struct Data {
    index: Index,
    /// The number of panoramas and views that are shown.
    panoramas: usize,
    views: usize,
    bytes: u64,
}

/// Writes all but the page.
fn write_data(
    ctx: &Context,
    (out, data): (&Path, &DataSet),
    against: Option<&Path>,
    (options, scores): (&ReportOptions, &[Scores]),
    scripts: &Scripts,
) -> s3d_dataset::Result<Data> {
    let mut faults = Faults::default();
    for (path, message) in data.missing(ctx)? {
        faults.add(path, &message);
    }
    let content = Content::read(data, &mut faults)?;
    let made = content.write_files(ctx, options, scripts, &mut faults)?;

    let mut index = content.index(out, &made, faults)?;
    let mut bytes = made.bytes;
    for (i, scores) in scores.iter().enumerate() {
        bytes += scripts.write_list(&format!("scores_{i}"), scores)?;
    }
    index.scores = scores.len();
    if let Some(against) = against {
        bytes += against::write(ctx, (out, &content), against, options, scripts)?;
        index.against = Some(folder_name(against));
    }
    if options.verify {
        index.verified = Some(Verified::from(verify(out, &VerifyOptions::default(), ctx)?));
    }
    bytes += scripts.write_list("index", &index)?;
    bytes += scripts.write("first", &First::of(&index))?;

    Ok(Data { index, panoramas: shown_count(&made.panoramas), views: shown_count(&made.views), bytes })
}

fn shown_count(made: &[ReadImage]) -> usize {
    made.iter().filter(|made| made.seen.is_some()).count()
}

/// The place where a report is made.
enum Destination {
    Folder(NewFolder),
    File { place: PathBuf, file: NewFile },
}

impl Destination {
    fn begin(ctx: &Context, to: &Path, out: &Path, options: &ReportOptions) -> Result<Self> {
        if !options.single {
            return Ok(Self::Folder(NewFolder::begin(ctx, to, out, KIND, options.overwrite)?));
        }
        check_apart(to, out)?;
        let is_report = || std::fs::read(to).is_ok_and(|page| page.starts_with(head().as_bytes()));
        match to.symlink_metadata() {
            Ok(_) if !is_report() => Err(Error::Occupied(to.to_owned())),
            _ => Ok(Self::File { place: to.to_owned(), file: NewFile::begin(ctx, to, options.overwrite)? }),
        }
    }

    fn was_placing(&self) -> bool {
        match self {
            Self::Folder(folder) => folder.was_placing(),
            Self::File { file, .. } => file.was_placing(),
        }
    }

    fn begin_placing(&self) -> s3d_dataset::Result<()> {
        match self {
            Self::Folder(folder) => folder.begin_placing(),
            Self::File { file, .. } => file.begin_placing(),
        }
    }

    /// Returns the file to open in a browser.
    fn page(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => folder.place().join("index.html"),
            Self::File { place, .. } => place.clone(),
        }
    }

    /// Writes the page and puts everything in place. Returns the bytes written, without the bytes of the
    /// scripts.
    fn finish(self, scripts: Scripts) -> Result<u64> {
        match self {
            Self::Folder(folder) => {
                let mut bytes = write_bytes(&folder.path().join("index.html"), PAGE.as_bytes())?;
                let about = About { generator: GENERATOR, version: env!("CARGO_PKG_VERSION"), form: FORM };
                bytes += write_json(&folder.path().join(KIND.about), &about)?;
                folder.finish()?;
                Ok(bytes)
            }
            Self::File { file, .. } => {
                // The data stands before the body, whose content the program makes.
                let (before, program) = PAGE.split_once(DATA).unwrap_or((PAGE, ""));
                write_whole(file.path(), |page| {
                    page.write_all(before.as_bytes())?;
                    scripts
                        .into_elements()
                        .try_for_each(|element| page.write_all(element.as_bytes()))?;
                    page.write_all(program.as_bytes())
                })?;
                file.finish()?;
                Ok((before.len() + program.len()) as u64)
            }
        }
    }
}

/// Returns the beginning of every page.
fn head() -> &'static str {
    PAGE.split_once(HEAD_END).map_or(PAGE, |(head, _)| head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_out_of_range_are_refused_before_anything_is_read() {
        for (pano_width, thumbs, mesh_faces) in
            [(15, 256, 9999), (2048, 8, 9999), (20_000, 256, 9999), (2048, 4096, 9999), (2048, 256, 0)]
        {
            let options = ReportOptions { pano_width, thumbs, mesh_faces, ..ReportOptions::default() };
            let e = report("none".as_ref(), "to".as_ref(), &options, &Context::default()).unwrap_err();
            assert!(matches!(e, Error::OutOfRange(_)) && e.to_string().contains("16 to 2048"), "{e}");
        }
    }
}
