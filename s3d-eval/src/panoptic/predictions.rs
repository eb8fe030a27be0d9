//! Reads COCO's panoptic files: a list of the segments of each image, and a folder of images with their
//! numbers.

use crate::error::Result;
use s3d_dataset::s3d_io::Error as FileError;
use s3d_dataset::s3d_io::dataset::{DatasetImage, ImageName};
use s3d_dataset::s3d_io::fs::read_json;
use s3d_dataset::s3d_label::{Class, Taxonomy};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    images: Vec<ImageEntry>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct ImageEntry {
    id: u64,
    file_name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    file_name: String,
    segments_info: Vec<SegmentInfo>,
}

/// A segment of an image.
#[derive(Clone, Copy, Deserialize)]
pub(super) struct SegmentInfo {
    pub(super) id: u32,
    pub(super) category_id: u32,
}

#[derive(Deserialize)]
struct Category {
    id: u32,
    name: String,
    isthing: Option<u8>,
}

/// Identifies an image: its location, its room and its frame.
type Key = (String, String, String);

pub(super) fn key(image: &DatasetImage) -> Key {
    (image.uuid.clone(), image.room.clone(), image.frame.to_string())
}

/// The prediction of an image.
pub(super) struct Predicted {
    pub(super) png: PathBuf,
    pub(super) segments: Vec<SegmentInfo>,
}

/// The predictions of all images.
pub(super) struct Predictions {
    /// The file that lists them.
    pub(super) json: PathBuf,
    pub(super) of_images: BTreeMap<Key, Predicted>,
    /// The first image in the folder that the file does not list, and the number of such images.
    pub(super) unlisted: Option<(String, usize)>,
}

const FORM: &str = "predictions are COCO's panoptic file NAME.json with its images in the folder NAME \
                    beside it";

impl Predictions {
    /// Reads the file at `path`, or the only one in the folder at `path`.
    pub(super) fn read(path: &Path, taxonomy: &Taxonomy, stuff: &[Class]) -> Result<Self> {
        let json = find(path)?;
        let wrong = |message: String| FileError::format(&json, message);
        let file: File = read_json(&json).map_err(|e| wrong(format!("{e}; {FORM}")))?;
        check_categories(&file.categories, taxonomy, stuff).map_err(wrong)?;
        let folder = json.with_extension("");
        if !folder.is_dir() {
            return Err(FileError::format(&folder, format!("missing: {FORM}")).into());
        }

        let names: BTreeMap<u64, String> = file.images.into_iter().map(|i| (i.id, i.file_name)).collect();
        let mut of_images: BTreeMap<Key, Predicted> = BTreeMap::new();
        let mut listed = BTreeSet::new();
        for annotation in file.annotations {
            let Annotation { image_id, file_name, segments_info: segments } = annotation;
            let image = names.get(&image_id).unwrap_or(&file_name);
            let name = image.rsplit(['/', '\\']).next().and_then(ImageName::parse).ok_or_else(|| {
                wrong(format!(
                    "image {image_id}: {image:?} is no name of an image of the data set; images are listed \
                     by the names of their colours, as in its COCO package"
                ))
            })?;
            let png = folder.join(&file_name);
            listed.insert(png.clone());
            let key = (name.uuid, name.room, name.frame.to_string());
            if of_images.insert(key, Predicted { png, segments }).is_some() {
                return Err(wrong(format!("image {image_id}: {image:?} is annotated twice")).into());
            }
        }

        let mut others = Vec::new();
        unlisted(&folder, &listed, &mut others)?;
        others.sort();
        let count = others.len();
        let first = others.first().map(|path| (path.display().to_string(), count));
        Ok(Self { json, of_images, unlisted: first })
    }
}

/// Returns the panoptic file at or in `path`.
fn find(path: &Path) -> Result<PathBuf> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let io = |e| FileError::io(path, "read the folder", e);
    let mut found = Vec::new();
    for entry in fs::read_dir(path).map_err(io)? {
        let file = entry.map_err(io)?.path();
        if file.extension().is_some_and(|e| e == "json") && file.with_extension("").is_dir() {
            found.push(file);
        }
    }
    found.sort();
    match &found[..] {
        [file] => Ok(file.clone()),
        [] => Err(FileError::format(path, format!("has no such file: {FORM}")).into()),
        [first, second, ..] => {
            let message = format!("has more than one: name {} or {}", first.display(), second.display());
            Err(FileError::format(path, message).into())
        }
    }
}

/// Refuses categories whose numbers mean other classes in the data set.
fn check_categories(categories: &[Category], taxonomy: &Taxonomy, stuff: &[Class]) -> Result<(), String> {
    for Category { id, name, isthing } in categories {
        let Some(class) = taxonomy.classes().iter().find(|class| taxonomy.id(**class) == *id) else {
            return Err(format!("category {id} ({name}) is none of the data set's"));
        };
        if class.name() != name {
            return Err(format!(
                "category {id} is {name:?}, and of the data set {class}: number them as its COCO package does"
            ));
        }
        if isthing.is_some_and(|is| (is == 0) != stuff.contains(class)) {
            let [here, there] = if stuff.contains(class) {
                ["a thing", "stuff"]
            } else {
                ["stuff", "a thing"]
            };
            return Err(format!(
                "{name} is {here}, and by the taxonomy of the data set {there}, unless the option `stuff` \
                 says otherwise"
            ));
        }
    }
    Ok(())
}

/// Adds the PNG files below a folder that are not `listed` to `others`.
fn unlisted(folder: &Path, listed: &BTreeSet<PathBuf>, others: &mut Vec<PathBuf>) -> Result<(), FileError> {
    let io = |e| FileError::io(folder, "read the folder", e);
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        if path.is_dir() {
            unlisted(&path, listed, others)?;
        } else if path.extension().is_some_and(|e| e == "png") && !listed.contains(&path) {
            others.push(path);
        }
    }
    Ok(())
}
