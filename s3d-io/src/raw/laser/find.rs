//! Finds laser scans in files and folders, and lists them.

use crate::cloud::kind::kind_of_content;
use crate::error::{Error, Result};
use crate::fs::open::{list_folder, open_file};
use crate::raw::form::RawForm;
use crate::raw::laser::source::{Listed, Part, ScanSource};
use crate::raw::laser::{LaserScans, ScanInfo, Trajectory, check, origins};
use crate::raw::options::RawOptions;
use s3d_geom::glam::DVec3;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The first bytes that are looked at.
const HEAD: u64 = 4096;

/// The endings of scanners' files in a folder. Others may be anything.
const SCANNERS: [&str; 6] = ["e57", "ptx", "las", "laz", "pts", "pcd"];

/// The endings of texts that may be points.
const TEXTS: [&str; 5] = ["asc", "xyz", "txt", "csv", "pts"];

/// What was found at a path.
#[derive(Clone, Debug)]
pub(in crate::raw) struct Found {
    pub(in crate::raw) form: RawForm,
    path: PathBuf,
}

/// Finds laser scans. Only names, and first bytes of files, are looked at.
pub(in crate::raw) fn find(path: &Path) -> Result<Option<Found>> {
    let form = if path.is_dir() {
        if let Some(list) = origins::find_in(path) {
            return Ok(Some(Found { form: RawForm::OriginList, path: list }));
        }
        (!scanner_files(path)?.is_empty()).then_some(RawForm::ScanFolder)
    } else {
        form_of(path)?
    };
    Ok(form.map(|form| Found { form, path: path.to_owned() }))
}

/// Returns the files of scanners in a folder, sorted by name.
fn scanner_files(dir: &Path) -> Result<Vec<PathBuf>> {
    let mut files = list_folder(dir)?;
    files.retain(|path| has_ending(path, &SCANNERS) && path.is_file());
    Ok(files)
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let is_one = |ending: &std::ffi::OsStr| endings.iter().any(|e| ending.eq_ignore_ascii_case(e));
    path.extension().is_some_and(is_one)
}

/// Returns what a file is. The first bytes come before the ending.
fn form_of(path: &Path) -> Result<Option<RawForm>> {
    let mut head = Vec::new();
    open_file(path)?
        .take(HEAD)
        .read_to_end(&mut head)
        .map_err(|e| Error::io(path, "read", e))?;
    Ok(match kind_of_content(&head) {
        Some("e57") => Some(RawForm::E57),
        Some("ply") if is_mesh(path) => None,
        Some(_) => Some(RawForm::Points),
        None if has_ending(path, &["ptx"]) || is_ptx(&head) => Some(RawForm::Ptx),
        None if has_ending(path, &["las", "laz", "e57"]) => Some(RawForm::Points),
        None if origins::is_list(path) => Some(RawForm::OriginList),
        None => (has_ending(path, &TEXTS) && is_rows(&head)).then_some(RawForm::Points),
    })
}

#[cfg(feature = "text")]
fn is_ptx(head: &[u8]) -> bool {
    super::ptx::is_ptx(head)
}

#[cfg(not(feature = "text"))]
fn is_ptx(_: &[u8]) -> bool {
    false
}

#[cfg(feature = "text")]
fn is_rows(head: &[u8]) -> bool {
    crate::cloud::text::is_rows(head)
}

#[cfg(not(feature = "text"))]
fn is_rows(_: &[u8]) -> bool {
    false
}

/// Returns whether a PLY file has faces.
pub(in crate::raw) fn is_mesh(path: &Path) -> bool {
    #[cfg(feature = "ply")]
    {
        let source = crate::fs::source::Source::file(path);
        crate::cloud::ply::read::open_vertices(&source).is_ok_and(|(_, _, has_faces)| has_faces)
    }
    #[cfg(not(feature = "ply"))]
    {
        let _ = path;
        false
    }
}

/// Lists the scans of a file. Tables have one, whose scanner stood at `origin` in the file's frame.
fn list(path: &Path, form: RawForm, origin: Option<DVec3>, options: &RawOptions) -> Result<Listed> {
    let (mut scans, warnings) = match form {
        RawForm::E57 => list_e57(path, options)?,
        RawForm::Ptx => list_ptx(path, options)?,
        _ => (vec![table(path)], Vec::new()),
    };
    let origin = origin.map(|origin| options.world_from_file.transform_point3(origin));
    for (scan, _) in &mut scans {
        scan.origin_m = scan.origin_m.or(origin);
    }
    Ok((scans, warnings))
}

#[cfg(feature = "e57")]
fn list_e57(path: &Path, options: &RawOptions) -> Result<Listed> {
    super::e57::list(path, options)
}

#[cfg(not(feature = "e57"))]
fn list_e57(path: &Path, _: &RawOptions) -> Result<Listed> {
    Err(Error::not_built_in(path, "e57"))
}

#[cfg(feature = "text")]
fn list_ptx(path: &Path, options: &RawOptions) -> Result<Listed> {
    super::ptx::list(path, options)
}

#[cfg(not(feature = "text"))]
fn list_ptx(path: &Path, _: &RawOptions) -> Result<Listed> {
    Err(Error::not_built_in(path, "text"))
}

/// Returns the scan that a table of points is.
fn table(path: &Path) -> (ScanInfo, ScanSource) {
    let info = ScanInfo {
        uuid: None,
        name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        path: path.to_owned(),
        origin_m: None,
        pose: None,
        grid: None,
        points: None,
        has_colors: false,
        has_intensity: false,
        has_times: false,
    };
    (info, ScanSource::new(path.to_owned(), Part::All))
}

impl Found {
    /// Lists the scans, and looks at the first points of each.
    pub(in crate::raw) fn open(&self, options: &RawOptions) -> Result<LaserScans> {
        let path = &self.path;
        let mut files = Vec::new();
        let of = |path: PathBuf, origin| {
            let form = form_of(&path)?;
            Ok((path, form.unwrap_or(RawForm::Points), origin))
        };
        let parts: Vec<(PathBuf, RawForm, Option<DVec3>)> = match self.form {
            RawForm::OriginList => {
                files.push(path.clone());
                let listed = origins::read(path)?.into_iter();
                listed
                    .map(|(path, origin)| of(path, Some(origin)))
                    .collect::<Result<_>>()?
            }
            RawForm::ScanFolder => {
                let listed = scanner_files(path)?.into_iter();
                listed.map(|path| of(path, options.origin_m)).collect::<Result<_>>()?
            }
            form => vec![(path.clone(), form, options.origin_m)],
        };

        let mut scans = Vec::new();
        let mut warnings = Vec::new();
        for (path, form, origin) in parts {
            let (listed, doubts) = list(&path, form, origin, options)?;
            scans.extend(listed);
            warnings.extend(doubts);
        }
        let (scans, sources) = scans.into_iter().unzip();

        let trajectory = match &options.trajectory {
            Some(path) => {
                files.push(path.clone());
                Some(Trajectory::read(path, &options.world_from_file)?)
            }
            None => None,
        };
        let mut found = LaserScans {
            form: self.form,
            warnings,
            files,
            scans,
            sources,
            trajectory,
            world_from_file: options.world_from_file,
            columns: options.columns.clone(),
            on_fault: options.on_fault,
        };
        check::look(&mut found)?;
        Ok(found)
    }
}
