//! The pictures of a report: an image of the data set in every modality that is shown, reduced, and what its
//! pixels show at full size.

use crate::faults::{Faults, name};
use crate::index::rounded;
use crate::packed::{jpeg_url, png_url};
use crate::reduce::{mean, nearest, pack, reduced_size};
use s3d_dataset::{DataSet, Result};
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::image::{Content, decode_gray16, decode_rgb8};
use s3d_label::{LabelId, LabelTable};
use s3d_render::{MISSING_DEPTH, MISSING_INDEX, MISSING_NORMAL};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The colour of a pixel that sees nothing; in a photograph also of one beside it.
const MISSING_COLOR: [u8; 3] = [0; 3];

/// The images of a picture as `data:` URLs.
#[derive(Serialize)]
pub(crate) struct Picture {
    /// Width and height of the data set's images.
    pub(crate) of: [u32; 2],
    /// Those of `depth` and `label`.
    pub(crate) size: [u32; 2],
    pub(crate) rgb: Option<String>,
    pub(crate) normal: Option<String>,
    pub(crate) depth: Option<String>,
    pub(crate) label: Option<String>,
    pub(crate) face: Option<String>,
}

/// What the pixels of an image show, as shares of all of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Shares {
    /// Those that see the mesh.
    pub(crate) coverage: Option<f64>,
    pub(crate) unlabelled: Option<f64>,
    /// How many instances.
    pub(crate) instances: Option<usize>,
    /// By class, of those that are there.
    pub(crate) classes: Vec<(usize, f64)>,
    #[serde(skip)]
    pub(crate) pixels_by_class: BTreeMap<usize, u64>,
    #[serde(skip)]
    pub(crate) pixels_unlabelled: u64,
}

/// How wide the images of a picture are at most.
#[derive(Clone, Copy)]
pub(crate) struct Widths {
    /// Depth, label and normals.
    pub(crate) lossless: u32,
    pub(crate) rgb: u32,
    /// A small image for a grid.
    pub(crate) thumb: Option<u32>,
}

/// The decoded images, those that are there and whole, and what they show.
pub(crate) struct Images {
    pub(crate) size: [u32; 2],
    pub(crate) seen: Shares,
    rgb: Option<Raster<[u8; 3]>>,
    normal: Option<Raster<[u8; 3]>>,
    label: Option<Raster<[u8; 3]>>,
    depth: Option<Raster<u16>>,
}

impl Images {
    /// Reads an image. Files that are wrong are told to `faults`; `None` if none is left.
    pub(crate) fn read(
        data: &DataSet,
        image: &DatasetImage,
        table: Option<&LabelTable>,
        faults: &mut Faults,
    ) -> Result<Option<Self>> {
        let Some(mut images) = decode(data, image, faults)? else { return Ok(None) };
        let path = image.path(data.layout(), Domain::Semantic);
        let mut counted = None;
        if let (Some(label), Some(table)) = (&images.label, table) {
            counted = faults.keep(data.layout().root(), count(label, table, &path))?;
            if counted.is_none() {
                images.label = None;
            }
        }
        images.seen = images.shares(counted);
        Ok(Some(images))
    }

    /// The images as they are shown, and a small one for a grid. `face` is what each pixel sees.
    pub(crate) fn picture(
        &self,
        widths: Widths,
        face: Option<&Raster<u32>>,
    ) -> image::ImageResult<(Picture, Option<String>)> {
        let reduced = |width| reduced_size(self.size, width);
        let size = reduced(widths.lossless);
        let small = |image: &Option<Raster<[u8; 3]>>, width, missing| {
            image.as_ref().map(|image| mean(image, reduced(width), Some(missing)))
        };
        let rgb = small(&self.rgb, widths.rgb, MISSING_COLOR);
        // Of the smaller image: means of means.
        let thumb = widths.thumb.and_then(|width| small(&rgb, width, MISSING_COLOR));
        let jpeg = |image: Option<Raster<[u8; 3]>>| image.as_ref().map(jpeg_url).transpose();
        let depth = |depth| png_url(&nearest(depth, size).map(|v| pack(u32::from(v))), Content::Photo);
        let picture = Picture {
            of: self.size,
            size,
            rgb: jpeg(rgb)?,
            normal: jpeg(small(&self.normal, widths.lossless, MISSING_NORMAL))?,
            depth: self.depth.as_ref().map(depth),
            label: self.label.as_ref().map(|label| png_url(&nearest(label, size), Content::Labels)),
            face: face.map(|face| png_url(&nearest(face, size).map(pack), Content::Labels)),
        };
        Ok((picture, jpeg(thumb)?))
    }
}

fn decode(data: &DataSet, image: &DatasetImage, faults: &mut Faults) -> Result<Option<Images>> {
    let root = data.layout().root();
    let mut size = None;
    let mut fits = |[w, h]: [u32; 2], path: &Path| -> Result<()> {
        let [sw, sh] = *size.get_or_insert([w, h]);
        if [w, h] == [sw, sh] {
            return Ok(());
        }
        let message = format!("{w} × {h} pixels, and other modalities of this image have {sw} × {sh}");
        Err(FileError::format(path, message).into())
    };
    let mut rgb8 = |domain, faults: &mut Faults| {
        if !image.has(domain) {
            return Ok(None);
        }
        let path = image.path(data.layout(), domain);
        let read = data.read(&path).and_then(|bytes| Ok(decode_rgb8(&bytes, &path)?));
        let read = read.and_then(|raster| fits([raster.width(), raster.height()], &path).map(|()| raster));
        faults.keep(root, read)
    };
    let rgb = rgb8(Domain::Rgb, faults)?;
    let normal = rgb8(Domain::Normal, faults)?;
    let label = rgb8(Domain::Semantic, faults)?;
    let mut depth = None;
    if image.has(Domain::Depth) {
        let path = image.path(data.layout(), Domain::Depth);
        let read = data.read(&path).and_then(|bytes| Ok(decode_gray16(&bytes, &path)?));
        let read = read.and_then(|raster| fits([raster.width(), raster.height()], &path).map(|()| raster));
        depth = faults.keep(root, read)?;
    }
    let all_gone = rgb.is_none() && normal.is_none() && label.is_none() && depth.is_none();
    let seen = Shares::default();
    Ok(size.filter(|_| !all_gone).map(|size| Images { size, seen, rgb, normal, label, depth }))
}

/// What the pixels of an image of labels show.
struct Counted {
    missing: u64,
    unlabelled: u64,
    instances: usize,
    by_class: BTreeMap<usize, u64>,
}

fn count(label: &Raster<[u8; 3]>, table: &LabelTable, path: &Path) -> Result<Counted> {
    let mut by_label: BTreeMap<u32, u64> = BTreeMap::new();
    let mut missing = 0;
    for run in label.pixels().chunk_by(|a, b| a == b) {
        match run.first() {
            Some(&[r, g, b]) if [r, g, b] != MISSING_INDEX => {
                *by_label.entry(u32::from_be_bytes([0, r, g, b])).or_default() += run.len() as u64;
            }
            _ => missing += run.len() as u64,
        }
    }
    let mut counted = Counted { missing, unlabelled: 0, instances: 0, by_class: BTreeMap::new() };
    for (index, pixels) in by_label {
        if index as usize >= table.len() {
            let message = format!("a pixel has label {index}, and the data set has {} labels", table.len());
            return Err(FileError::format(path, message).into());
        }
        match table.class_of(LabelId(index)) {
            Some(class) => {
                *counted.by_class.entry(class.index()).or_default() += pixels;
                counted.instances += 1;
            }
            None => counted.unlabelled += pixels,
        }
    }
    Ok(counted)
}

impl Images {
    fn shares(&self, counted: Option<Counted>) -> Shares {
        let pixels = (u64::from(self.size[0]) * u64::from(self.size[1])) as f64;
        let share = |count: u64| rounded(count as f64 / pixels, 4);
        // Depth misses what is beyond its range; labels do not.
        let missing = match (&counted, &self.depth, &self.rgb) {
            (Some(counted), ..) => Some(counted.missing),
            (_, Some(depth), _) => {
                Some(depth.pixels().iter().filter(|v| **v == MISSING_DEPTH).count() as u64)
            }
            (.., Some(rgb)) => Some(rgb.pixels().iter().filter(|v| **v == MISSING_COLOR).count() as u64),
            _ => None,
        };
        let classes = counted.iter().flat_map(|c| &c.by_class).map(|(class, n)| (*class, share(*n)));
        Shares {
            coverage: missing.map(|missing| rounded(1.0 - missing as f64 / pixels, 4)),
            unlabelled: counted.as_ref().map(|c| share(c.unlabelled)),
            instances: counted.as_ref().map(|c| c.instances),
            classes: classes.collect(),
            pixels_unlabelled: counted.as_ref().map_or(0, |c| c.unlabelled),
            pixels_by_class: counted.map(|c| c.by_class).unwrap_or_default(),
        }
    }
}

/// A fault of an image of which nothing is left to be shown.
pub(crate) fn nothing_left(data: &DataSet, image: &DatasetImage, faults: &mut Faults) {
    if let Some(domain) = image.domains.first() {
        let path = name(data.layout().root(), &image.path(data.layout(), *domain));
        faults.add(path, "the image has no file that can be shown");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_of_labels_are_counted() {
        let names = ["<UNK>_0_<UNK>_0_0", "chair_1_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1"];
        let table = LabelTable::from_names(&names.map(String::from)).unwrap();
        let [n, a, b, w] = [[0; 3], [0, 0, 1], [0, 0, 2], [0, 0, 3]];
        let label = Raster::from_vec(4, 2, vec![MISSING_INDEX, n, a, a, b, w, w, a]);
        let counted = count(&label, &table, Path::new("a.png")).unwrap();
        let seen = Shares::default();
        let images = Images { size: [4, 2], seen, rgb: None, normal: None, label: None, depth: None };
        let seen = images.shares(Some(counted));
        assert_eq!((seen.coverage, seen.unlabelled, seen.instances), (Some(0.875), Some(0.125), Some(3)));
        assert_eq!(seen.classes, [(2, 0.25), (8, 0.5)]);
        let label = Raster::from_vec(2, 1, vec![a, [0, 1, 0]]);
        let e = count(&label, &table, Path::new("a.png")).err().unwrap().to_string();
        assert!(e.contains("a.png: a pixel has label 256"), "{e}");
    }
}
