//! What decides the bytes of an area: everything that is read for it, with checksums.

use crate::context::Context;
use crate::error::Result;
use crate::export::input::area::AreaInput;
use crate::export::input::stamps::Stamps;
use crate::parallel::for_each_in_order;
use crate::record::listing::walk;
use crate::record::request::{InputRecord, Request, RequestedArea};
use s3d_io::Error as FileError;
use s3d_io::dataset::FileRecord;
use s3d_io::fs::{Checksum, ChecksumOfParts, checksum_of_file};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Size in bytes and checksum of each file.
type Sums<'a> = BTreeMap<&'a Path, (u64, Checksum)>;

/// Returns what each area asks for. All input files are read once, on all threads. `companions` are the
/// further files of each area's meshes. `stamps` tell whether files change meanwhile. Annotations and folders
/// that are `known` from a plan, and have as many bytes as then, keep the plan's checksum.
pub(crate) fn requested_areas(
    ctx: &Context,
    areas: &[AreaInput],
    companions: &[Vec<PathBuf>],
    known: Option<&Request>,
    stamps: &mut Stamps,
) -> Result<Vec<RequestedArea>> {
    let paths: Vec<Vec<PathBuf>> = areas
        .iter()
        .zip(companions)
        .map(|(area, besides)| [&area.sources[..], besides].concat())
        .collect();

    // The files of each path: the path itself, or the files in it. `taken` are the records that a plan knows.
    let mut files: Vec<Vec<Vec<PathBuf>>> = Vec::new();
    let mut taken: BTreeMap<(u32, &Path), InputRecord> = BTreeMap::new();
    for (area, of_area) in areas.iter().zip(&paths) {
        let mut listed = Vec::new();

        // A folder of photographs may hold much that is not read.
        let mut photographs = area.photographs.by_folder();
        for path in of_area {
            let files = match photographs.remove(path) {
                Some(files) => files,
                None if path.is_dir() => walk(path)?,
                None => vec![path.clone()],
            };

            let record = known.and_then(|known| known.input(area.number, &name_of(&area.path, path)));
            if (path.is_dir() || area.annotations.contains(path))
                && let Some(record) = record
                && total_bytes(&files)? == record.bytes
            {
                taken.insert((area.number, path), record.clone());
                listed.push(Vec::new());
            } else {
                listed.push(files);
            }
        }

        files.push(listed);
    }

    let mut all: Vec<&PathBuf> = files.iter().flatten().flatten().collect();
    all.sort();
    all.dedup();
    stamps.look(all.iter().copied())?;
    let sums = checksums(ctx, &all)?;
    stamps.check()?;

    let mut requested = Vec::new();
    for ((area, paths), files) in areas.iter().zip(&paths).zip(&files) {
        let mut inputs = Vec::new();
        for (path, files) in paths.iter().zip(files) {
            inputs.push(match taken.get(&(area.number, path.as_path())) {
                Some(record) => record.clone(),
                None => record_of(&area.path, path, files, &sums),
            });
        }
        inputs.extend(area.records.iter().cloned());

        requested.push(RequestedArea {
            area: area.number,
            place_cameras: area.cameras.distance_m(),
            see: area.cameras.share(),
            offset_m: area.frame.offset(),
            inputs,
        });
    }
    Ok(requested)
}

/// The size of a file in bytes, and its checksum.
fn sum_of(sums: &Sums<'_>, file: &Path) -> (u64, Checksum) {
    sums.get(file).copied().unwrap_or((0, Checksum::of(b"")))
}

/// The record of an input: a file, or a folder with `files` in it.
fn record_of(scene: &Path, path: &Path, files: &[PathBuf], sums: &Sums<'_>) -> InputRecord {
    let name = name_of(scene, path);
    if !path.is_dir() {
        let (bytes, xxh3_128) = sum_of(sums, path);
        return InputRecord { path: name, bytes, xxh3_128 };
    }

    let mut total = 0;
    let mut listed: Vec<(String, u64, Checksum)> = Vec::new();
    for file in files {
        let (bytes, sum) = sum_of(sums, file);
        listed.push((below(path, file), bytes, sum));
        total += bytes;
    }
    listed.sort();

    let mut lines = ChecksumOfParts::default();
    for (path, bytes, xxh3_128) in listed {
        lines.add(FileRecord { path, bytes, xxh3_128 }.to_line().as_bytes());
        lines.add(b"\n");
    }
    let (_, xxh3_128) = lines.finish();
    InputRecord { path: format!("{name}/"), bytes: total, xxh3_128 }
}

/// The total size of some files in bytes, without reading them.
fn total_bytes(files: &[PathBuf]) -> Result<u64> {
    let mut total = 0;
    for file in files {
        total += std::fs::metadata(file)
            .map_err(|e| FileError::io(file, "read", e))?
            .len();
    }
    Ok(total)
}

/// Size and checksum of each file.
fn checksums<'a>(ctx: &Context, files: &[&'a PathBuf]) -> Result<Sums<'a>> {
    let sums = Mutex::new(BTreeMap::new());
    let progress = ctx.progress("reading", "input files", files.len() as u64);
    for_each_in_order(
        ctx,
        files,
        || (),
        |(), path| {
            let sum = checksum_of_file(path)?;
            sums.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .insert(path.as_path(), sum);
            progress.add(1);
            Ok(())
        },
    )?;
    Ok(sums.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// The name of an input: its path from the folder of the scene that the user named, or else its last part.
pub(crate) fn name_of(scene: &Path, path: &Path) -> String {
    let folder = scene.parent().unwrap_or(Path::new(""));
    match path.strip_prefix(folder) {
        Ok(below) if below.is_relative() && below.components().next().is_some() => slashed(below),
        _ => path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned(),
    }
}

fn below(folder: &Path, file: &Path) -> String {
    slashed(file.strip_prefix(folder).unwrap_or(file))
}

fn slashed(path: &Path) -> String {
    path.iter()
        .map(|name| name.to_string_lossy())
        .collect::<Vec<_>>()
        .join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(scene: &str, path: &str) -> String {
        name_of(Path::new(scene), Path::new(path))
    }

    #[test]
    fn inputs_are_named_from_the_scenes_folder() {
        assert_eq!(name("scan/scene.toml", "scan/Area_1"), "Area_1");
        assert_eq!(name("scan/scene.toml", "scan/../shared/a.obj"), "../shared/a.obj");
        assert_eq!(name("scan/scene.toml", "/data/a.obj"), "a.obj");
        assert_eq!(name("scene.toml", "a/b.obj"), "a/b.obj");
        assert_eq!(name("scene.toml", "/data/b.obj"), "b.obj");
        assert_eq!(name("sets/area_3", "sets/area_3/3d/rgb.obj"), "area_3/3d/rgb.obj");
    }
}
