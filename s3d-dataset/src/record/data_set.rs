//! A complete data set for reading. Everything read from it is checked against its list of files.

use crate::context::Context;
use crate::error::{Error, InputError, Result};
use crate::parallel::for_each_in_order;
use crate::record::manifest::{Head, Manifest};
use s3d_io::Error as FileError;
use s3d_io::dataset::{
    BundledFile, CheckedFile, DatasetImage, Domain, FileRecord, ImageName, Layout, PhotographRecord,
    file_list_checksum, read_bundle, read_conventions, read_file_list, read_photographs, read_png_size,
    read_png_size_from,
};
use s3d_label::Taxonomy;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// A complete data set for reading. Everything read from it is checked against its list of files: the size
/// before a file is opened, the checksum if the whole file is read. Files that the list does not name are
/// refused.
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
    /// The classes and room types of its labels.
    pub(crate) taxonomy: Taxonomy,
    /// Set if the export did not finish.
    pub(crate) unfinished: Option<Unfinished>,
}

/// What an unfinished export has, and what it lacks.
pub(crate) struct Unfinished {
    /// The photographs that have views already, by area.
    pub(crate) photographs: BTreeMap<u32, Vec<PhotographRecord>>,
    /// What is missing, a sentence each.
    pub(crate) missing: Vec<String>,
}

impl DataSet {
    /// Opens the data set of this layout. Its manifest, its list of files and its conventions must agree.
    ///
    /// # Errors
    /// [`Error::File`] with the first file that does not agree.
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

    /// Returns the photographs of an area that became views.
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

/// Checks the folder of an area before it is read as input. If the folder belongs to a data set of ours, its
/// meshes, points, poses and labels must be as they were written.
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

/// The files of a data set as they were written. All methods take whole paths, and refuse a path that the
/// list does not name.
pub(crate) struct Listed {
    root: PathBuf,
    records: BTreeMap<String, FileRecord>,
    /// The files inside bundles, which [`Listed::read_bytes`] and [`Listed::png_size`] find. None of a
    /// complete data set are.
    bundled: BTreeMap<String, BundledFile>,
}

impl Listed {
    /// Builds the list from records.
    pub(crate) fn of(root: &Path, records: impl IntoIterator<Item = FileRecord>) -> Self {
        let records = records
            .into_iter()
            .map(|record| (record.path.clone(), record))
            .collect();
        Self { root: root.to_owned(), records, bundled: BTreeMap::new() }
    }

    /// Opens the bundles in a folder. Their files count as files of the list.
    pub(crate) fn open_bundles(&mut self, folder: &Path) -> Result<(), FileError> {
        for path in self.below(folder) {
            let files = read_bundle(self.sized(&path)?)?;
            self.bundled
                .extend(files.into_iter().map(|file| (file.record().path.clone(), file)));
        }
        Ok(())
    }

    /// Reads the list of a data set, and checks it against the manifest.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest) -> Result<Self, FileError> {
        let path = layout.file_list();
        let Some(told) = &manifest.files else {
            return Err(FileError::format(&layout.manifest(), "tells of no files.csv"));
        };

        let records = read_file_list(&path)?;
        let sum = file_list_checksum(&records);
        if sum != told.xxh3_128 {
            let message = format!("its checksum is {sum}, and the manifest tells of {}", told.xxh3_128);
            return Err(FileError::format(&path, message));
        }

        let count = records.len() as u64;
        let total = records.iter().map(|r| r.bytes).sum::<u64>();
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

    /// Iterates over the records, sorted by path.
    pub(crate) fn records(&self) -> impl Iterator<Item = &FileRecord> {
        self.records.values()
    }

    /// Returns the name of a file or folder in the list.
    pub(crate) fn name(&self, path: &Path) -> String {
        let below = path.strip_prefix(&self.root).unwrap_or(path);
        let names: Vec<_> = below.iter().map(|name| name.to_string_lossy()).collect();
        names.join("/")
    }

    /// Returns the record of a file.
    pub(crate) fn record(&self, path: &Path) -> Result<&FileRecord, FileError> {
        let name = self.name(path);
        let bundled = || self.bundled.get(&name).map(BundledFile::record);
        let record = self.records.get(&name).or_else(bundled);
        record.ok_or_else(|| FileError::format(path, "files.csv does not name it"))
    }

    /// Returns the path if the file has the size that was written. For files that are not read, or only in
    /// part.
    pub(crate) fn sized<'p>(&self, path: &'p Path) -> Result<&'p Path, FileError> {
        self.record(path)?.check_size(&self.root)?;
        Ok(path)
    }

    /// Returns the path if the file has the content that was written.
    pub(crate) fn checked<'p>(&self, path: &'p Path) -> Result<&'p Path, FileError> {
        self.record(path)?.check(&self.root)?;
        Ok(path)
    }

    /// Returns the content of a file if it is as it was written.
    pub(crate) fn read_bytes(&self, path: &Path) -> Result<Vec<u8>, FileError> {
        match self.bundled.get(&self.name(path)) {
            Some(file) => file.read(),
            None => self.record(path)?.read(&self.root),
        }
    }

    /// Returns width and height of a PNG file, which may lie in a bundle. Only its head is read.
    pub(crate) fn png_size(&self, path: &Path) -> Result<(u32, u32), FileError> {
        match self.bundled.get(&self.name(path)) {
            Some(file) => read_png_size_from(file.open()?, path),
            None => read_png_size(path),
        }
    }

    /// Opens a file to be read piece by piece. The end of the file is an error if the content is not as
    /// written.
    pub(crate) fn open(&self, path: &Path) -> Result<CheckedFile, FileError> {
        self.record(path)?.open(&self.root)
    }

    /// Returns the size that was written, bytes.
    pub(crate) fn bytes(&self, path: &Path) -> Result<u64, FileError> {
        Ok(self.record(path)?.bytes)
    }

    /// Returns the files below a folder, sorted. Files in bundles come last.
    pub(crate) fn below(&self, folder: &Path) -> Vec<PathBuf> {
        let prefix = self.name(folder) + "/";
        let mut inside = paths_from(&self.records, &prefix, &self.root);
        inside.extend(paths_from(&self.bundled, &prefix, &self.root));
        inside
    }

    /// Returns the images of an area, sorted by scan location and room: views by number, then the panorama.
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

        found
            .into_iter()
            .map(|((uuid, room, frame), there)| {
                let domains = Domain::ALL.into_iter().filter(|d| there.contains(d)).collect();
                DatasetImage { area, uuid, room, frame, domains }
            })
            .collect()
    }

    /// Returns the faults of the `needed` files by path: the file is missing, or has another size.
    pub(crate) fn faults(
        &self,
        ctx: &Context,
        needed: impl Fn(&Path) -> bool,
    ) -> Result<BTreeMap<String, FileError>> {
        let records: Vec<&FileRecord> = self
            .records()
            .filter(|record| needed(&record.path_in(&self.root)))
            .collect();

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

    /// Refuses a data set in which a `needed` file is missing or has another size.
    pub(crate) fn require(&self, ctx: &Context, needed: impl Fn(&Path) -> bool) -> Result<()> {
        let faults = self.faults(ctx, needed)?;
        let Some(first) = faults.values().next() else { return Ok(()) };
        Err(InputError::Damaged { dataset: self.root.clone(), files: faults.len(), first: first.to_string() }
            .into())
    }
}

/// Returns the paths in `root` whose names begin with `prefix`, in their order.
fn paths_from<T>(files: &BTreeMap<String, T>, prefix: &str, root: &Path) -> Vec<PathBuf> {
    let names = files.range(prefix.to_owned()..).map(|(name, _)| name);
    names
        .take_while(|name| name.starts_with(prefix))
        .map(|name| root.join(name))
        .collect()
}
