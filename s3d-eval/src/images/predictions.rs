//! Finds the file that predicts each image.

use crate::error::{Error, Result};
use crate::options::ImageKind;
use crate::tables::Unit;
use crate::task::Task;
use s3d_dataset::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The images to evaluate, and the form of their predictions.
pub(super) struct Wanted<'a> {
    /// The image that is predicted.
    pub(super) domain: Domain,
    /// Other images that the truth needs.
    pub(super) besides: &'a [Domain],
    /// The kind of images. `None` is the kind that the predictions are named after.
    pub(super) kind: Option<ImageKind>,
    /// Which protocol evaluates the other kind, as a sentence, if this one does not.
    pub(super) other_kind: &'a str,
    /// The endings of the files of predictions.
    pub(super) endings: &'a [&'a str],
    /// The names of other files in the folder that are read.
    pub(super) known: &'a [&'a str],
}

impl Wanted<'_> {
    /// Returns the error for a file that is named after an image of the other kind.
    fn of_other(&self, file: &Path, found: &str, evaluated: &str) -> Error {
        let mut message = format!("is named after {found}, and {evaluated} are evaluated");
        if !self.other_kind.is_empty() {
            message = format!("{message}: {}", self.other_kind);
        }
        FileError::format(file, message).into()
    }
}

/// An image and its prediction.
pub(super) struct Predicted {
    /// The index of its fold.
    pub(super) fold: usize,
    pub(super) image: DatasetImage,
    pub(super) file: PathBuf,
}

impl Predicted {
    /// Returns the unit with what was counted in the image.
    pub(super) fn unit<T>(&self, counted: T) -> Unit<T> {
        Unit { fold: self.fold, area: self.image.area, name: self.image.stem(), counted }
    }
}

/// All images that are tested, by area, in the order of the data set.
pub(super) struct Matched {
    pub(super) images: Vec<Predicted>,
    pub(super) kind: ImageKind,
    pub(super) notes: Vec<String>,
}

impl Matched {
    /// Calls `count` with each image, on all threads, and returns the units in the order of the images.
    pub(super) fn count<T: Send + Sync>(
        &self,
        task: &Task<'_>,
        count: impl Fn(&Predicted) -> s3d_dataset::Result<T> + Sync,
    ) -> Result<Vec<Unit<T>>> {
        let progress = task
            .ctx
            .progress("evaluating", self.kind.noun(), self.images.len() as u64);
        let units = map_in_order(
            task.ctx,
            &self.images,
            || (),
            |(), predicted| {
                let counted = count(predicted)?;
                progress.add(1);
                Ok(predicted.unit(counted))
            },
        )?;
        Ok(units)
    }
}

/// The content of the folder of predictions.
#[derive(Default)]
struct Folder {
    /// The files with the endings of predictions, and the number of the area whose folder they are in.
    files: Vec<(PathBuf, Option<u32>)>,
    /// The names of all other entries.
    others: BTreeSet<String>,
}

impl Folder {
    fn read(root: &Path, wanted: &Wanted<'_>) -> Result<Self, FileError> {
        let mut found = Self::default();
        found.add(root, None, wanted)?;
        found.files.sort();
        Ok(found)
    }

    fn add(&mut self, folder: &Path, area: Option<u32>, wanted: &Wanted<'_>) -> Result<(), FileError> {
        let failed = |e| FileError::io(folder, "read", e);
        for entry in fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let of_area = name.strip_prefix("area_").and_then(|number| number.parse().ok());
            match of_area {
                Some(number) if area.is_none() && path.is_dir() => self.add(&path, Some(number), wanted)?,
                _ if wanted.endings.contains(&&*ending) && !path.is_dir() => self.files.push((path, area)),
                _ if wanted.known.contains(&&*name) => {}
                _ => drop(self.others.insert(name)),
            }
        }
        Ok(())
    }

    /// Returns a sentence on the entries that are not read.
    fn told(&self) -> Option<String> {
        let first: Vec<&str> = self.others.iter().take(5).map(String::as_str).collect();
        let more = if self.others.len() > first.len() { " …" } else { "" };
        (!first.is_empty())
            .then(|| format!("Not read of the predictions' folder: {}{more}.", first.join(", ")))
    }
}

/// Returns the images in the areas of the folds, each with the file that predicts it.
///
/// # Errors
/// If an image has no file or two, a file names no image, or files name images of both kinds.
pub(super) fn find(task: &Task<'_>, wanted: &Wanted<'_>) -> Result<Matched> {
    let folder = Folder::read(task.predictions, wanted)?;
    let mut images = Images::of(task, wanted);
    let mut of_kinds: [Option<PathBuf>; 2] = [None, None];
    let mut elsewhere = 0usize;
    for (path, area) in &folder.files {
        let Some(at) = images.named(path, *area, wanted)? else {
            elsewhere += 1;
            continue;
        };
        let (_, image, file) = &mut images.tested[at];
        if let Some(other) = file.replace(path.clone()) {
            let message = format!("predicts the same image as {}: remove one", other.display());
            return Err(FileError::format(path, message).into());
        }
        of_kinds[ImageKind::of(image.frame) as usize].get_or_insert_with(|| path.clone());
    }

    let kind = kind_of(wanted, &of_kinds)?;
    images.tested.retain(|(_, image, _)| ImageKind::of(image.frame) == kind);
    if images.tested.is_empty() {
        let domains = wanted.besides.iter().chain([&wanted.domain]).copied().collect();
        return Err(Error::NoImages { kind, domains });
    }

    let missing = images.tested.iter().filter(|(_, _, file)| file.is_none());
    if let Some((_, first, _)) = missing.clone().next() {
        let message = format!(
            "{} of {} {kind} have no prediction: the first is {}.{} of area {}. {}",
            missing.count(),
            images.tested.len(),
            first.stem(),
            wanted.endings.join(" or ."),
            first.area,
            folder.told().unwrap_or_default(),
        );
        return Err(FileError::format(task.predictions, message.trim_end()).into());
    }

    let mut notes: Vec<String> = folder.told().into_iter().collect();
    if elsewhere > 0 {
        notes.push(format!("Predictions of areas that are not tested, and not read: {elsewhere}."));
    }
    let with_file =
        |(fold, image, file): (usize, _, Option<_>)| file.map(|file| Predicted { fold, image, file });
    Ok(Matched { images: images.tested.into_iter().filter_map(with_file).collect(), kind, notes })
}

/// Returns the kind of images to evaluate. `files` has an example of a file for each kind.
fn kind_of(wanted: &Wanted<'_>, files: &[Option<PathBuf>; 2]) -> Result<ImageKind> {
    let [views, panoramas] = files;
    match (wanted.kind, views, panoramas) {
        (None, Some(view), Some(panorama)) => Err(FileError::format(
            view,
            format!(
                "is named after a view, and {} after a panorama: their axes differ, so that they are not \
                 evaluated together; take those of one kind away",
                panorama.display()
            ),
        )
        .into()),
        (Some(ImageKind::Panoramas), Some(file), _) => Err(wanted.of_other(file, "a view", "panoramas")),
        (Some(ImageKind::Views), _, Some(file)) => Err(wanted.of_other(file, "a panorama", "views")),
        (Some(kind), ..) => Ok(kind),
        (None, None, Some(_)) => Ok(ImageKind::Panoramas),
        (None, ..) => Ok(ImageKind::Views),
    }
}

/// The images of a data set by name.
struct Images {
    /// The images that are tested, with the index of their fold and the file that was found.
    tested: Vec<(usize, DatasetImage, Option<PathBuf>)>,
    /// The area and the index in `tested` of each name, which is unique in the data set; `None` if it is not
    /// tested.
    names: BTreeMap<String, (u32, Option<usize>)>,
}

impl Images {
    fn of(task: &Task<'_>, wanted: &Wanted<'_>) -> Self {
        let mut images = Self { tested: Vec::new(), names: BTreeMap::new() };
        for &area in task.data.areas() {
            let fold = task.folds.iter().position(|fold| fold.areas.contains(&area));
            for image in task.data.images(area) {
                if !wanted
                    .besides
                    .iter()
                    .chain([&wanted.domain])
                    .all(|domain| image.has(*domain))
                {
                    continue;
                }
                images
                    .names
                    .insert(image.stem(), (area, fold.map(|_| images.tested.len())));
                images.tested.extend(fold.map(|fold| (fold, image, None)));
            }
        }
        images
    }

    /// Returns the index of the image that a file predicts; `None` if its area is not tested.
    fn named(&self, path: &Path, area: Option<u32>, wanted: &Wanted<'_>) -> Result<Option<usize>> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let (stem, domain) = name
            .split_once("_domain_")
            .map_or((&*name, None), |(s, d)| (s, Some(d)));
        let wrong = |message: String| Err(FileError::format(path, message).into());
        let fitting = [wanted.domain.suffix(), wanted.domain.folder(), "rgb"];
        if let Some(other) = domain.filter(|domain| !fitting.contains(domain)) {
            return wrong(format!(
                "is named after {other}, and {} is evaluated: name it {stem} with its ending",
                wanted.domain
            ));
        }
        match self.names.get(stem) {
            Some((of, place)) if area.is_none_or(|area| area == *of) => Ok(*place),
            _ => {
                let of = area.map_or("the data set".to_owned(), |number| format!("area {number}"));
                wrong(format!(
                    "names no image of {of} that has {}: predictions are named as its files, \
                     camera_…_frame_…",
                    wanted.domain
                ))
            }
        }
    }
}
