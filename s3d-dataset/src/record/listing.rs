//! The files of a data set: found, recorded, and listed in `files.csv`.

use crate::context::Context;
use crate::error::Result;
use crate::parallel::for_each_in_order;
use crate::record::data_set::DataSet;
use crate::record::manifest::{FileList, Manifest};
use s3d_io::Error as FileError;
use s3d_io::dataset::{FileRecord, Layout, write_file_list};
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Returns whether a file is half-written, by a running process or by a killed one. See
/// [`s3d_io::fs::AtomicFile`].
pub(crate) fn is_part(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with(".s3d-") && name.ends_with(".part")
}

/// Returns all files in a folder and below, sorted, without half-written ones. Returns none if the folder
/// does not exist.
pub(crate) fn walk(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    visit_below(folder, |path| {
        let is_folder = path.is_dir();
        if !is_folder && !is_part(path) {
            files.push(path.to_owned());
        }
        Ok(is_folder)
    })?;
    files.sort();
    Ok(files)
}

/// Removes half-written files of a killed process in a folder, and if `below`, in the folders below it. Does
/// not follow links.
pub(crate) fn remove_parts(folder: &Path, below: bool) -> Result<()> {
    visit_below(folder, |path| {
        let is_folder = path.is_dir() && !path.is_symlink();
        if !is_folder && is_part(path) {
            fs::remove_file(path).map_err(|e| FileError::io(path, "remove", e))?;
        }
        Ok(is_folder && below)
    })
}

/// Calls `visit` with each path in a folder, and with the paths in each folder for which it returns true.
pub(crate) fn visit_below(folder: &Path, mut visit: impl FnMut(&Path) -> Result<bool>) -> Result<()> {
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for path in children(&folder)? {
            if visit(&path)? {
                folders.push(path);
            }
        }
    }
    Ok(())
}

/// Returns the paths in a folder, in any order. Returns none if the folder does not exist.
pub(crate) fn children(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e| FileError::io(folder, "read the folder", e);
    match fs::read_dir(folder) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        entries => {
            let paths = entries.map_err(failed)?.map(|entry| entry.map(|entry| entry.path()));
            Ok(paths.collect::<Result<_, _>>().map_err(failed)?)
        }
    }
}

/// Returns the records of existing files, sorted. Reads the files on all threads.
pub(crate) fn records(ctx: &Context, layout: &Layout, paths: &[PathBuf]) -> Result<Vec<FileRecord>> {
    let records = Mutex::new(Vec::with_capacity(paths.len()));
    for_each_in_order(
        ctx,
        paths,
        || (),
        |(), path| {
            let record = FileRecord::of_file(layout.root(), path)?;
            records.lock().unwrap_or_else(PoisonError::into_inner).push(record);
            Ok(())
        },
    )?;
    let mut records = records.into_inner().unwrap_or_else(PoisonError::into_inner);
    records.sort();
    Ok(records)
}

/// Returns the faults of recorded files, a sentence each, with the index of the file. Reads the files on all
/// threads.
pub(crate) fn faults(ctx: &Context, layout: &Layout, files: &[&FileRecord]) -> Result<Vec<(usize, String)>> {
    let faults = Mutex::new(Vec::new());
    let progress = ctx.progress("checking", "files", files.len() as u64);
    let numbered: Vec<(usize, &FileRecord)> = files.iter().copied().enumerate().collect();
    for_each_in_order(
        ctx,
        &numbered,
        || (),
        |(), (index, record)| {
            if let Some(fault) = record.fault(layout.root()) {
                faults
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .push((*index, fault));
            }
            progress.add(1);
            Ok(())
        },
    )?;
    let mut faults = faults.into_inner().unwrap_or_else(PoisonError::into_inner);
    faults.sort();
    Ok(faults)
}

/// Writes `files.csv`. Returns its entry in the manifest.
pub(crate) fn write(layout: &Layout, records: &[FileRecord]) -> Result<FileList> {
    let path = layout.file_list();
    let (_, xxh3_128) = write_file_list(&path, records)?;
    Ok(FileList {
        list: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        count: records.len() as u64,
        bytes: records.iter().map(|r| r.bytes).sum(),
        xxh3_128,
    })
}

/// Writes `files.csv` and the manifest of a complete data set after a change. The files of `changed` are new,
/// and all others that fulfil `is_gone` no longer exist.
pub(crate) fn write_changed(
    data: &DataSet,
    manifest: &mut Manifest,
    changed: Vec<FileRecord>,
    is_gone: impl Fn(&str) -> bool,
    staged: &Layout,
) -> Result<()> {
    let kept = data.files.records().filter(|record| !is_gone(&record.path)).cloned();
    let all: BTreeMap<String, FileRecord> = kept
        .chain(changed)
        .map(|record| (record.path.clone(), record))
        .collect();
    let all: Vec<FileRecord> = all.into_values().collect();
    manifest.files = Some(write(staged, &all)?);
    manifest.write(staged)
}
