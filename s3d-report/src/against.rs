//! Writes another data set beside the shown one: the differences, and its pictures where they differ.

use crate::areas;
use crate::content::Content;
use crate::faults::{Fault, Faults};
use crate::index::{ClassEntry, LabelEntry, Shown, folder_name};
use crate::options::ReportOptions;
use crate::pixels::{Images, Widths};
use crate::script::Scripts;
use crate::script::packed::packed;
use s3d_dataset::compare::{
    ChangedPatch, ClassPixels, CompareOptions, Comparison, ImageChange, PixelChanges,
};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, DataSet, Result, compare};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, ImageName};
use s3d_io::image::PngReader;
use s3d_label::LabelTable;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The modalities that pictures have.
const SHOWN: [Domain; 4] = [Domain::Rgb, Domain::Depth, Domain::Normal, Domain::Semantic];

/// `data/compare.js`.
#[derive(Serialize)]
struct Compared<'a> {
    /// The comparison without its images, which are in `pictures`.
    comparison: &'a Comparison,
    /// `classes` and `labels` of the other data set, like in the index.
    classes: Vec<ClassEntry>,
    labels: Vec<LabelEntry>,
    /// For each of these labels, the index in the index of the label of the same instance.
    partners: &'a [Option<u32>],
    depth_units_per_m: f64,
    /// The areas with a file `changed_A.js`: they have faces that changed.
    changed_faces: Vec<u32>,
    /// The images that differ; the Kth is in `other_K.js`.
    pictures: Vec<PictureEntry>,
    /// The faults of their files in the other data set.
    faults: Vec<Fault>,
}

/// An image that differs.
#[derive(Serialize)]
struct PictureEntry {
    /// The number of the picture of a view in this report.
    picture: Option<usize>,
    /// The location of a panorama in this report.
    pano: Option<usize>,
    /// Whether the other image has any file.
    is_there: bool,
    /// The changes by modality.
    pixels: BTreeMap<&'static str, PixelChanges>,
    /// Indices of the matrix of classes of the comparison, and numbers of pixels.
    classes: Vec<(usize, u64)>,
}

/// `data/changed_A.js`: the faces that changed, packed, and their largest patches.
#[derive(Serialize)]
struct ChangedFaces<'a> {
    faces: usize,
    face: String,
    a: String,
    b: String,
    patches: &'a [ChangedPatch],
}

/// Two images that differ.
struct Pair {
    shown: Shown,
    other: DatasetImage,
    pixels: BTreeMap<&'static str, PixelChanges>,
    classes: Vec<ClassPixels>,
}

/// Compares the shown data set with another, and writes the data for the page. Returns the bytes written.
pub(crate) fn write(
    ctx: &Context,
    (out, content): (&Path, &Content<'_>),
    against: &Path,
    options: &ReportOptions,
    scripts: &Scripts,
) -> Result<u64> {
    let mut comparison = compare(out, against, &CompareOptions::default(), ctx)?;
    // The report names no folders of the machine.
    comparison.a.folder = folder_name(out);
    comparison.b.folder = folder_name(against);
    let other = DataSet::open(against)?;
    let mut faults = Faults::default();
    let table = faults.keep(other.layout().root(), other.labels())?.flatten();
    let pairs = pairs(&other, content, &std::mem::take(&mut comparison.images));
    let progress = ctx.progress("comparing", "pictures", pairs.len() as u64);
    let jobs: Vec<(usize, &Pair)> = pairs.iter().enumerate().collect();
    let made = map_in_order(ctx, &jobs, PngReader::default, |reader, (number, pair)| {
        let mut faults = Faults::default();
        let bytes =
            write_picture(&other, table.as_ref(), (*number, pair), options, scripts, (reader, &mut faults))?;
        progress.add(1);
        Ok((bytes, faults.into_vec()))
    })?;
    drop(progress);

    let matrix = comparison.labels.iter().flat_map(|labels| &labels.matrix);
    let place_of: BTreeMap<_, usize> = matrix.map(|pair| (pair.a, pair.b)).zip(0..).collect();
    let mut bytes = 0;
    let mut pictures = Vec::with_capacity(pairs.len());
    for (pair, (written, found)) in pairs.into_iter().zip(made) {
        faults.extend(found);
        bytes += written.unwrap_or(0);
        let (picture, pano) = match pair.shown {
            Shown::Picture(number) => (Some(number), None),
            Shown::Panorama(location) => (None, Some(location)),
        };
        let classes = pair
            .classes
            .iter()
            .filter_map(|of| Some((*place_of.get(&(of.a, of.b))?, of.pixels)))
            .collect();
        let is_there = written.is_some();
        pictures.push(PictureEntry { picture, pano, is_there, pixels: pair.pixels, classes });
    }

    let mut changed_faces = Vec::new();
    for area in comparison.areas.iter().filter(|area| !area.faces.is_empty()) {
        let number = |of: fn(&s3d_dataset::compare::FaceChange) -> u32| {
            packed(area.faces.iter().map(of), u32::to_le_bytes)
        };
        let faces = ChangedFaces {
            faces: area.faces.len(),
            face: number(|change| change.face),
            a: number(|change| change.a),
            b: number(|change| change.b),
            patches: &area.patches,
        };
        bytes += scripts.write(&format!("changed_{}", area.area), &faces)?;
        changed_faces.push(area.area);
    }

    let compared = Compared {
        comparison: &comparison,
        classes: areas::classes(&other),
        labels: table.as_ref().map(areas::labels).unwrap_or_default(),
        partners: comparison.labels.as_ref().map_or(&[], |labels| &labels.partners_of_b),
        depth_units_per_m: other.options().depth_units.per_m(),
        changed_faces,
        pictures,
        faults: faults.into_vec(),
    };
    Ok(bytes + scripts.write_list("compare", &compared)?)
}

/// Returns the images that differ in a shown modality, in the order of the pictures.
fn pairs(other: &DataSet, content: &Content<'_>, changes: &[ImageChange]) -> Vec<Pair> {
    let images = other.areas().iter().flat_map(|area| other.images(*area).into_iter());
    let images: BTreeMap<_, DatasetImage> = images
        .map(|image| ((image.area, image.uuid.clone(), image.room.clone(), image.frame), image))
        .collect();

    let shown = content.shown();
    let mut pairs: BTreeMap<Shown, Pair> = BTreeMap::new();
    for change in changes {
        let place = image_key(change.area, &change.a).and_then(|key| shown.get(&key));
        let image = image_key(change.area, &change.b).and_then(|key| images.get(&key));
        let (Some(place), Some(image)) = (place, image) else { continue };
        let pair = pairs.entry(*place).or_insert_with(|| Pair {
            shown: *place,
            other: image.clone(),
            pixels: BTreeMap::new(),
            classes: Vec::new(),
        });
        pair.pixels.insert(change.modality, change.pixels);
        pair.classes.extend_from_slice(&change.classes);
    }

    // The page does not show other modalities.
    pairs
        .into_values()
        .filter(|pair| SHOWN.iter().any(|domain| pair.pixels.contains_key(domain.folder())))
        .collect()
}

fn image_key(area: u32, path: &str) -> Option<(u32, String, String, Frame)> {
    let name = path.rsplit('/').next().and_then(ImageName::parse)?;
    Some((area, name.uuid, name.room, name.frame))
}

/// Writes the picture of the other data set. Returns the bytes written; `None` if the image has no file left.
fn write_picture(
    data: &DataSet,
    table: Option<&LabelTable>,
    (number, pair): (usize, &Pair),
    options: &ReportOptions,
    scripts: &Scripts,
    (reader, faults): (&mut PngReader, &mut Faults),
) -> Result<Option<u64>> {
    let widths = match pair.shown {
        Shown::Picture(_) => options.of_views(),
        // Both are shown at the same width.
        Shown::Panorama(_) => Widths { sharp: None, ..options.of_panoramas() },
    };
    let read = Images::read(data, &pair.other, table, widths, (reader, faults))?;
    let Some(images) = read else { return Ok(None) };
    let path = pair.other.path(data.layout(), Domain::Rgb);
    let made = images
        .picture(|_| None)
        .map_err(|e| FileError::format(&path, e.to_string()))?;
    Ok(Some(scripts.write(&format!("other_{number}"), &made.picture)?))
}
