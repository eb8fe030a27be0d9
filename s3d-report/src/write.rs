//! The call that writes a report.

use crate::against;
use crate::content::Content;
use crate::faults::{Fault, Faults};
use crate::index::{FORM, Verified, folder_name};
use crate::pixels::Widths;
use crate::script::Scripts;
use s3d_dataset::{
    Context, DataSet, Error, FolderKind, NewFile, NewFolder, Result, VerifyOptions, check_apart, verify,
};
use s3d_io::fs::{create_dir, write_bytes, write_json, write_whole};
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The page: markup, style and program in one file.
const PAGE: &str = include_str!("../web/dist/index.html");

/// Where the data of a report of one file goes.
const DATA: &str = "<!-- data -->\n";

/// Ends what every page begins with.
const HEAD_END: &str = "<meta name=\"viewport\"";

/// How many faces a page may be asked to show.
const MESH_FACES: RangeInclusive<u32> = 1000..=10_000_000;

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
    /// Faces of an area's mesh in the report; a larger mesh is simplified.
    pub mesh_faces: u32,
    /// Verify the data set as well, every pixel of it, and show what was found.
    pub verify: bool,
    /// All in one file, which is sent or published more easily; for small data sets.
    pub single: bool,
    /// Replace an earlier report.
    pub overwrite: bool,
}

impl Default for ReportOptions {
    fn default() -> Self {
        Self {
            pano_width: 2048,
            thumbs: 256,
            mesh_faces: 300_000,
            verify: false,
            single: false,
            overwrite: false,
        }
    }
}

impl ReportOptions {
    /// The images of panoramas.
    pub(crate) fn of_panoramas(&self) -> Widths {
        Widths { lossless: self.pano_width, rgb: self.pano_width, thumb: None }
    }

    /// The images of views.
    pub(crate) fn of_views(&self) -> Widths {
        Widths { lossless: self.thumbs, rgb: 2 * self.thumbs, thumb: Some(self.thumbs) }
    }
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// The page, to be opened by a browser.
    pub page: PathBuf,
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

/// Writes the report of the data set in the folder `out` to `to`, a folder or one file, whole or not at all.
/// The bytes depend on the data set, the name of its folder and the options alone. Files of the data set that
/// are missing or damaged are told in the report, in [`Report::faults`] and as warnings; the rest is shown.
/// Of an export that did not finish the report shows what is there so far.
///
/// # Errors
/// [`Error::Usage`] if there is something else in `to`, or the options are out of range; [`Error::File`] if
/// there is no data set in `out`, its list of files is damaged, or `to` cannot be written;
/// [`Error::Cancelled`]; [`Error::Temporary`].
pub fn report(out: &Path, to: &Path, options: &ReportOptions, ctx: &Context) -> Result<Report> {
    write(out, None, to, options, ctx)
}

/// The same, with what differs from the data set in the folder `against`: the page shows both side by side.
///
/// # Errors
/// As [`report`], of either data set.
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
    let within = (16..=16_384).contains(&options.pano_width) && (16..=2048).contains(&options.thumbs);
    if !within || !MESH_FACES.contains(&options.mesh_faces) {
        return Err(Error::Usage(format!(
            "panoramas of {} and views of {} pixels across, meshes of {} faces: 16 to 16384, 16 to 2048, and \
             1000 to 10000000 are possible",
            options.pano_width, options.thumbs, options.mesh_faces
        )));
    }
    if let Some(against) = against {
        // What cannot be compared is refused before anything is written.
        check_apart(to, against)?;
        DataSet::open(out)?;
        DataSet::open(against)?;
    }
    let data = DataSet::open_as_far_as_it_is(out, ctx)?;
    let place = Place::begin(ctx, to, out, options)?;
    let scripts = match &place {
        Place::Folder(folder) => {
            create_dir(&folder.path().join("data"))?;
            Scripts::Files(folder.path().to_owned())
        }
        Place::File { .. } => Scripts::Page(Mutex::default()),
    };
    let mut faults = Faults::default();
    for (path, message) in data.missing(ctx)? {
        faults.add(path, &message);
    }
    let content = Content::read(&data, &mut faults)?;
    let made = content.write_files(ctx, options, &scripts, &mut faults)?;
    let shown = |made: &[crate::content::ReadImage]| made.iter().filter(|made| made.seen.is_some()).count();
    let (panoramas, views) = (shown(&made.panoramas), shown(&made.views));
    let mut index = content.index(out, &made, faults)?;
    let mut bytes = made.bytes;
    if let Some(against) = against {
        bytes += against::write(ctx, (out, &content), against, options, &scripts)?;
        index.against = Some(folder_name(against));
    }
    if options.verify {
        index.verified = Some(Verified::from(verify(out, &VerifyOptions::default(), ctx)?));
    }
    bytes += scripts.write_list("index", &index)?;
    let page = place.page();
    bytes += place.finish(scripts)?;
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

/// Where a report is made.
enum Place {
    Folder(NewFolder),
    File { place: PathBuf, file: NewFile },
}

impl Place {
    fn begin(ctx: &Context, to: &Path, out: &Path, options: &ReportOptions) -> Result<Self> {
        if !options.single {
            return NewFolder::begin(ctx, to, out, KIND, options.overwrite).map(Self::Folder);
        }
        check_apart(to, out)?;
        let is_report = || std::fs::read(to).is_ok_and(|page| page.starts_with(head().as_bytes()));
        match to.symlink_metadata() {
            Ok(_) if !is_report() => Err(Error::Usage(format!(
                "{} is there already, and was not written by {GENERATOR}: choose another name with -o",
                to.display()
            ))),
            _ => Ok(Self::File { place: to.to_owned(), file: NewFile::begin(ctx, to, options.overwrite)? }),
        }
    }

    /// What a browser opens.
    fn page(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => folder.place().join("index.html"),
            Self::File { place, .. } => place.clone(),
        }
    }

    /// Writes the page, puts all in place, and returns the bytes written beside those of the scripts.
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
                // Before the body, whose content the program makes.
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

/// How every page begins.
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
            assert!(matches!(e, Error::Usage(_)) && e.to_string().contains("16 to 2048"), "{e}");
        }
    }
}
