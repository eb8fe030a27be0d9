//! Checks the files of a data set against their list: which there are, their sizes and checksums.

use super::report::{Report, Topic};
use crate::context::Context;
use crate::error::Result;
use crate::parallel::for_each_in_order;
use crate::record::data_set::Listed;
use crate::record::manifest::Manifest;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, FileRecord, Frame, ImageName, Layout, file_list_checksum, read_file_list};
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

const LIST: (Topic, &str) = (Topic::Files, "the list of files");
const BYTES: (Topic, &str) = (Topic::Files, "sizes and checksums");
const EXTRA: (Topic, &str) = (Topic::Files, "files that no list names");

/// The list of files, if the data set has one.
pub(crate) struct Files {
    /// The records by path, each with a flag that is set once its file was checked.
    listed: Option<BTreeMap<String, (FileRecord, AtomicBool)>>,
}

impl Files {
    /// Reads the list, and checks it against the manifest.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest, report: &Report) -> Self {
        let path = layout.file_list();
        let Some(told) = &manifest.files else {
            let _ = report.ok(Topic::Files, Listed::read(layout, manifest));
            return Self { listed: None };
        };

        let records = report.read(Topic::Files, &path, read_file_list);
        report.expect(records.clone(), told.bytes);

        if let Some(records) = &records {
            let sum = file_list_checksum(records);
            let checks = report.of(LIST, &path);
            checks.check(sum == told.xxh3_128, || {
                format!("its checksum is {sum}, and the manifest tells of {}", told.xxh3_128)
            });
            let count = records.len() as u64;
            let bytes = records.iter().map(|r| r.bytes).sum::<u64>();
            checks.check((count, bytes) == (told.count, told.bytes), || {
                format!(
                    "{count} files of {bytes} bytes, and the manifest tells of {} of {}",
                    told.count, told.bytes
                )
            });
        }

        let listed = records.map(|records| {
            records
                .into_iter()
                .map(|record| (record.path.clone(), (record, AtomicBool::new(false))))
                .collect()
        });
        Self { listed }
    }

    /// Checks the size and checksum of a file that is there.
    pub(crate) fn check(&self, path: &Path, report: &Report) {
        self.check_by(path, report, |record| record.check(report.root()));
    }

    /// Does the same with bytes that were read from the file.
    pub(crate) fn check_bytes(&self, path: &Path, bytes: &[u8], report: &Report) {
        self.check_by(path, report, |record| record.check_bytes(report.root(), bytes));
    }

    fn check_by(&self, path: &Path, report: &Report, check: impl Fn(&FileRecord) -> Checked) {
        report.looked_at(1);
        let entry = self.listed.as_ref().and_then(|l| l.get(&report.relative(path)));
        if let Some((record, looked_at)) = entry {
            looked_at.store(true, Ordering::Relaxed);
            tell(check(record), report);
        }
    }

    /// Checks all files that were not checked yet, and reports files that are not listed.
    pub(crate) fn check_rest(
        &self,
        ctx: &Context,
        layout: &Layout,
        manifest: &Manifest,
        report: &Report,
    ) -> Result<()> {
        let there = all_files(layout, &manifest.area_numbers, report);
        let Some(listed) = &self.listed else {
            for path in &there {
                let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
                let is_image = is_in_images(layout, &manifest.area_numbers, path);
                report.check(!is_image || ImageName::parse(name).is_some(), EXTRA, path, || {
                    "is no file of a data set".to_owned()
                });
            }
            return Ok(());
        };

        check_places(layout, &manifest.area_numbers, listed.keys(), report);
        for path in &there {
            report.check(listed.contains_key(&report.relative(path)), EXTRA, path, || {
                "files.csv does not name it".to_owned()
            });
        }

        let mut left: Vec<&FileRecord> = listed
            .values()
            .filter(|(_, seen)| !seen.load(Ordering::Relaxed))
            .map(|(r, _)| r)
            .collect();

        // The largest come first, so that no thread is left with a large one at the end.
        left.sort_by_key(|r| std::cmp::Reverse(r.bytes));

        let progress = ctx.progress("reading", "files", left.len() as u64);
        for_each_in_order(
            ctx,
            &left,
            || (),
            |(), record| {
                report.looked_at(1);
                tell(record.check(report.root()), report);
                progress.add(1);
                Ok(())
            },
        )
    }
}

/// Checks that listed files are in the folders of the manifest's areas or among the tables, and that no
/// folder of another area is there.
fn check_places<'a>(
    layout: &Layout,
    areas: &[u32],
    listed: impl Iterator<Item = &'a String>,
    report: &Report,
) {
    let entries = layout.entries(areas);
    for name in listed {
        let path = layout.root().join(name);
        let is_known = entries.iter().any(|entry| path.starts_with(entry));
        report.check(is_known, EXTRA, &path, || "belongs to no area and no table of the manifest".to_owned());
    }

    let folders = fs::read_dir(layout.root()).into_iter().flatten().flatten();
    for folder in folders.filter(|entry| entry.path().is_dir()) {
        let name = folder.file_name().to_string_lossy().into_owned();
        let area = name.strip_prefix("area_").and_then(|number| number.parse::<u32>().ok());
        let is_known = area.is_none_or(|area| areas.contains(&area));
        report.check(is_known, EXTRA, &folder.path(), || "the manifest tells of no such area".to_owned());
    }
}

/// Whether a file has its listed size and checksum.
type Checked = std::result::Result<(), FileError>;

/// Counts both checks of a file, and reports a fault.
fn tell(checked: Checked, report: &Report) {
    report.checked(2);
    if let Err(e) = checked {
        report.wrong(BYTES, &e);
    }
}

/// All files of the data set without its manifest and list, sorted.
fn all_files(layout: &Layout, areas: &[u32], report: &Report) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in layout.entries(areas).into_iter().chain(layout.shared_dirs()) {
        if entry.is_dir() {
            files.extend(walk(&entry, report));
        } else if entry.exists() {
            files.push(entry);
        }
    }
    files.sort();
    files.dedup();
    files.retain(|f| *f != layout.manifest() && *f != layout.file_list());
    files
}

/// Whether a file lies in a folder of images.
fn is_in_images(layout: &Layout, areas: &[u32], path: &Path) -> bool {
    areas.iter().any(|a| {
        [Frame::Panorama, Frame::View(0)].into_iter().any(|frame| {
            Domain::ALL
                .into_iter()
                .any(|d| path.parent() == Some(&*layout.image_dir(*a, frame, d)))
        })
    })
}

/// All files below a folder, sorted; none if the folder is not there.
pub(crate) fn walk(folder: &Path, report: &Report) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];

    while let Some(folder) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == ErrorKind::NotFound => continue,
            Err(e) => {
                report.unreadable(Topic::Files, &FileError::io(&folder, "read", e));
                continue;
            }
        };
        for entry in entries.flatten() {
            let path = entry.path();
            if entry.file_type().is_ok_and(|t| t.is_dir()) {
                folders.push(path)
            } else {
                files.push(path)
            }
        }
    }

    files.sort();
    files
}
