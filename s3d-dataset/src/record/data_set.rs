//! A complete data set that is read: everything that is read of it is held against its list of files.

use crate::context::Context;
use crate::error::{Error, InputError, Result};
use crate::parallel::for_each_in_order;
use crate::record::manifest::{Head, Manifest};
use s3d_io::Error as FileError;
use s3d_io::dataset::{
    CheckedFile, DatasetImage, Domain, FileRecord, ImageName, Layout, PhotographRecord, read_conventions,
    read_file_list, read_photographs,
};
use s3d_io::fs::checksum_of_file;
use s3d_label::Taxonomy;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// A complete data set, to be read. Whatever is read of it is held against its list of files: sizes before a
/// file is opened, checksums of what is read as a whole. Files that the list does not name are refused.
///
/// ```no_run
/// use s3d_dataset::DataSet;
/// use s3d_dataset::s3d_io::dataset::Domain;
///
/// let data = DataSet::open("dataset".as_ref())?;
/// for image in data.images(data.areas()[0]) {
///     let png = data.read(&image.path(data.layout(), Domain::Rgb))?;
///     println!("{}: {} bytes", image.stem(), png.len());
/// }
/// # Ok::<(), s3d_dataset::Error>(())
/// ```
pub struct DataSet {
    pub(crate) layout: Layout,
    pub(crate) manifest: Manifest,
    pub(crate) files: Listed,
    /// Which classes and types of rooms its labels have.
    pub(crate) taxonomy: Taxonomy,
    /// If its export did not finish.
    pub(crate) unfinished: Option<Unfinished>,
}

/// What an export that did not finish has, and what it lacks.
pub(crate) struct Unfinished {
    /// The photographs that are views already, by area.
    pub(crate) photographs: BTreeMap<u32, Vec<PhotographRecord>>,
    /// What is not there yet, a sentence each.
    pub(crate) missing: Vec<String>,
}

impl DataSet {
    /// Opens the data set of this layout: its manifest, its list of files, and its conventions, which must
    /// agree.
    ///
    /// # Errors
    /// [`Error::File`] with the one that does not.
    pub(crate) fn open_in(layout: &Layout) -> Result<Self> {
        let manifest = Manifest::read(layout)?;
        let files = Listed::read(layout, &manifest)?;
        let path = layout.conventions();
        let found = read_conventions(files.checked(&path)?)?;
        if let Some(message) = manifest.contradiction_of(found) {
            return Err(FileError::format(&path, message).into());
        }
        let taxonomy = manifest.read_taxonomy(layout, |path| files.checked(path).map(drop))?;
        Ok(Self { layout: layout.clone(), manifest, files, taxonomy, unfinished: None })
    }

    /// The photographs of an area that became views.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File).
    pub fn photographs(&self, area: u32) -> Result<Vec<PhotographRecord>> {
        if let Some(unfinished) = &self.unfinished {
            return Ok(unfinished.photographs.get(&area).cloned().unwrap_or_default());
        }
        if self.manifest.area(area).is_none_or(|area| area.frames == 0) {
            return Ok(Vec::new());
        }
        Ok(read_photographs(self.files.checked(&self.layout.frames_json(area))?)?)
    }
}

/// Refuses the folder of an area, to be read as input, if it is one of a data set of ours and what is read of
/// it is not as it was written: meshes, points, poses, labels.
pub(crate) fn check_area(folder: &Path) -> Result<()> {
    let Ok(folder) = std::fs::canonicalize(folder) else { return Ok(()) };
    let Some(root) = folder.parent() else { return Ok(()) };
    let layout = &Layout::new(root);
    if !Head::read(&layout.manifest())?.is_some_and(|head| head.is_complete()) {
        return Ok(());
    }
    let DataSet { files, manifest, .. } = DataSet::open_in(layout)?;
    let mut read: Vec<PathBuf> = Vec::new();
    for part in ["3d", "data/pose", "pano/pose"] {
        read.extend(files.below(&folder.join(part)));
    }
    read.retain(|path| path.extension().is_none_or(|ending| ending != "ply"));
    read.extend(manifest.is_labelled().then(|| layout.labels_json()));
    for_each_in_order(&Context::default(), &read, || (), |(), path| Ok(files.checked(path).map(drop)?))
}

/// The files of a data set as they were written. Paths are whole ones; one that the list does not name is
/// refused.
pub(crate) struct Listed {
    root: PathBuf,
    records: BTreeMap<String, FileRecord>,
}

impl Listed {
    /// Those of these records.
    pub(crate) fn of(root: &Path, records: impl IntoIterator<Item = FileRecord>) -> Self {
        let records = records
            .into_iter()
            .map(|record| (record.path.clone(), record))
            .collect();
        Self { root: root.to_owned(), records }
    }

    /// Reads the list of a data set, which must be the one that its manifest tells of.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest) -> Result<Self, FileError> {
        let path = layout.file_list();
        let Some(told) = &manifest.files else {
            return Err(FileError::format(&layout.manifest(), "tells of no files.csv"));
        };
        let records = read_file_list(&path)?;
        let (_, sum) = checksum_of_file(&path)?;
        if sum != told.xxh3_128 {
            let message = format!("its checksum is {sum}, and the manifest tells of {}", told.xxh3_128);
            return Err(FileError::format(&path, message));
        }
        let (count, total) = (records.len() as u64, records.iter().map(|r| r.bytes).sum::<u64>());
        if (count, total) != (told.count, told.bytes) {
            return Err(FileError::format(
                &path,
                format!(
                    "{count} files of {total} bytes, and the manifest tells of {} of {}",
                    told.count, told.bytes
                ),
            ));
        }
        Ok(Self::of(layout.root(), records))
    }

    /// The records, sorted by path.
    pub(crate) fn records(&self) -> impl Iterator<Item = &FileRecord> {
        self.records.values()
    }

    /// How the list calls a file or folder.
    pub(crate) fn name(&self, path: &Path) -> String {
        let below = path.strip_prefix(&self.root).unwrap_or(path);
        let names: Vec<_> = below.iter().map(|name| name.to_string_lossy()).collect();
        names.join("/")
    }

    /// What is told of a file.
    pub(crate) fn record(&self, path: &Path) -> Result<&FileRecord, FileError> {
        let record = self.records.get(&self.name(path));
        record.ok_or_else(|| FileError::format(path, "files.csv does not name it"))
    }

    /// The path of a file whose size is the one that was written: one that is not read, or not as a whole.
    pub(crate) fn sized<'p>(&self, path: &'p Path) -> Result<&'p Path, FileError> {
        self.record(path)?.check_size(&self.root)?;
        Ok(path)
    }

    /// The path of a file whose content is the one that was written.
    pub(crate) fn checked<'p>(&self, path: &'p Path) -> Result<&'p Path, FileError> {
        self.record(path)?.check(&self.root)?;
        Ok(path)
    }

    /// The content of a file, if it is the one that was written.
    pub(crate) fn read_bytes(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        self.record(path)?.read(&self.root)
    }

    /// A file to be read piece by piece; its end is an error if it was not the one that was written.
    pub(crate) fn open(&self, path: &Path) -> Result<CheckedFile, FileError> {
        self.record(path)?.open(&self.root)
    }

    /// The size that was written.
    pub(crate) fn bytes(&self, path: &Path) -> Result<u64, FileError> {
        Ok(self.record(path)?.bytes)
    }

    /// The files below a folder, sorted.
    pub(crate) fn below(&self, folder: &Path) -> Vec<PathBuf> {
        let prefix = self.name(folder) + "/";
        let from = self.records.range(prefix.clone()..);
        let inside = from.take_while(|(name, _)| name.starts_with(&prefix));
        inside.map(|(_, record)| record.path_in(&self.root)).collect()
    }

    /// The images of an area, by scan location and room, views by number and the panorama last.
    pub(crate) fn images(&self, layout: &Layout, area: u32) -> Vec<DatasetImage> {
        let mut found: BTreeMap<_, Vec<Domain>> = BTreeMap::new();
        for path in self.below(&layout.area_dir(area)) {
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .and_then(ImageName::parse);
            let Some(ImageName { uuid, room, frame, domain }) = name else { continue };
            if path.parent() == Some(&*layout.image_dir(area, frame, domain)) {
                found.entry((uuid, room, frame)).or_default().push(domain);
            }
        }
        let in_order = |there: Vec<Domain>| Domain::ALL.into_iter().filter(|d| there.contains(d)).collect();
        let image =
            |((uuid, room, frame), there)| DatasetImage { area, uuid, room, frame, domains: in_order(there) };
        found.into_iter().map(image).collect()
    }

    /// What is wrong with the files that are `needed`, by path: they are gone, or of another size.
    pub(crate) fn faults(
        &self,
        ctx: &Context,
        needed: impl Fn(&Path) -> bool,
    ) -> Result<BTreeMap<String, FileError>> {
        let path = |record: &&FileRecord| needed(&record.path_in(&self.root));
        let records: Vec<&FileRecord> = self.records().filter(path).collect();
        let faults = Mutex::new(BTreeMap::new());
        for_each_in_order(
            ctx,
            &records,
            || (),
            |(), record| {
                if let Err(e) = record.check_size(&self.root) {
                    match Error::from(e) {
                        Error::File(e) => {
                            let mut faults = faults.lock().unwrap_or_else(PoisonError::into_inner);
                            faults.insert(record.path.clone(), e);
                        }
                        e => return Err(e),
                    }
                }
                Ok(())
            },
        )?;
        Ok(faults.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// Refuses a data set in which a file that is `needed` is gone, or is of another size.
    pub(crate) fn require(&self, ctx: &Context, needed: impl Fn(&Path) -> bool) -> Result<()> {
        let faults = self.faults(ctx, needed)?;
        let Some(first) = faults.values().next() else { return Ok(()) };
        Err(InputError::Damaged { dataset: self.root.clone(), files: faults.len(), first: first.to_string() }
            .into())
    }
}
