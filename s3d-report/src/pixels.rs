//! The pictures of a report: an image of the data set in each shown modality, reduced, and the shares of its
//! pixels at full size.

use crate::faults::{Faults, name};
use crate::index::rounded;
use crate::raster::look::{Sample, first_look};
use crate::raster::reduce::{Mean, Nearest, mean, pack, shown_size, squared_loss, unpack};
use crate::script::packed::{jpeg_url, png_url};
use jpeg_encoder::EncodingError;
use s3d_dataset::{DataSet, Result};
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::image::{Content, PngLines, PngReader};
use s3d_label::{LabelId, LabelTable};
use s3d_render::{MISSING_DEPTH, MISSING_INDEX, MISSING_NORMAL};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The colour of a pixel that sees nothing, or that is outside of its photograph.
const MISSING_COLOR: [u8; 3] = [0; 3];

/// Colours have a file at a greater width if the mean loss of the smaller picture is more than this, in
/// levels of 255: if its PSNR against the larger one is below 40 dB.
const LOSS: f64 = 2.55;

/// The images of a picture as `data:` URLs.
#[derive(Serialize)]
pub(crate) struct Picture {
    /// The width and the height in the data set.
    pub(crate) of: [u32; 2],
    /// The width and the height of `depth` and `label`.
    pub(crate) size: [u32; 2],
    pub(crate) rgb: Option<String>,
    pub(crate) normal: Option<String>,
    pub(crate) depth: Option<String>,
    pub(crate) label: Option<String>,
    pub(crate) face: Option<String>,
    /// The width and the height of the colours in a file of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) sharp: Option<[u32; 2]>,
}

/// The pictures of an image as texts for the files.
pub(crate) struct Made {
    pub(crate) picture: Picture,
    /// The small image of its colours.
    pub(crate) thumb: Option<String>,
    /// Its colours at a greater width.
    pub(crate) sharp: Option<String>,
}

/// What the pixels of an image show, as shares of all its pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Shares {
    /// The share that sees the mesh.
    pub(crate) coverage: Option<f64>,
    pub(crate) unlabelled: Option<f64>,
    /// The number of instances.
    pub(crate) instances: Option<usize>,
    /// The share of each class that occurs.
    pub(crate) classes: Vec<(usize, f64)>,
    /// The median depth around the horizon: of the shown pixels in the middle half of the rows, in metres.
    pub(crate) depth_m: Option<f64>,
    #[serde(skip)]
    pub(crate) pixels_by_class: BTreeMap<usize, u64>,
    #[serde(skip)]
    pub(crate) pixels_unlabelled: u64,
}

/// The greatest widths of the images of a picture.
#[derive(Clone, Copy)]
pub(crate) struct Widths {
    /// The width of depth, label and normals.
    pub(crate) lossless: u32,
    pub(crate) rgb: u32,
    /// The width of a small image, which is shown first.
    pub(crate) thumb: Option<u32>,
    /// The width of the colours in a file of their own, if they are wider and show more than `rgb`.
    pub(crate) sharp: Option<u32>,
}

/// The colours of a picture, reduced.
struct Colors {
    image: Raster<[u8; 3]>,
    /// The same at a greater width, if that shows more.
    sharp: Option<Raster<[u8; 3]>>,
    /// The number of missing pixels of the file.
    missing: u64,
}

/// The images of a picture that exist and are whole, reduced, and what they show.
pub(crate) struct Images {
    pub(crate) size: [u32; 2],
    pub(crate) seen: Shares,
    widths: Widths,
    rgb: Option<Raster<[u8; 3]>>,
    sharp: Option<Raster<[u8; 3]>>,
    normal: Option<Raster<[u8; 3]>>,
    label: Option<Raster<[u8; 3]>>,
    /// Every pixel of the labels, for a view with objects.
    pub(crate) whole_label: Option<Raster<[u8; 3]>>,
    depth: Option<Raster<u16>>,
}

impl Images {
    /// Reads an image. Wrong files become faults. `None` if no file is left.
    pub(crate) fn read(
        data: &DataSet,
        image: &DatasetImage,
        table: Option<&LabelTable>,
        widths: Widths,
        (reader, faults): (&mut PngReader, &mut Faults),
    ) -> Result<Option<Self>> {
        let mut files = Files { data, image, size: None, reader, faults };
        let colors = files.colors(Domain::Rgb, (widths.rgb, widths.sharp), MISSING_COLOR)?;
        let no_color = colors.as_ref().map(|colors| colors.missing);
        let (rgb, sharp) = colors.map_or((None, None), |colors| (Some(colors.image), colors.sharp));
        let normal = files
            .colors(Domain::Normal, (widths.lossless, None), MISSING_NORMAL)?
            .map(|colors| colors.image);

        let mut label = None;
        let mut whole_label = None;
        let mut counted = None;
        let is_whole = image.has(Domain::Objects) && image.frame != Frame::Panorama;
        if let Some(Labels { image, whole, counts, path }) = files.labels(widths.lossless, is_whole, table)? {
            label = Some(image);
            whole_label = whole;
            if let (Some(table), Some(counts)) = (table, counts) {
                let root = data.layout().root();
                counted = files.faults.keep(root, counts.by_class(table, &path))?;
                label = label.filter(|_| counted.is_some());
                whole_label = whole_label.filter(|_| counted.is_some());
            }
        }

        let mut no_depth = None;
        let depth = files
            .depth(widths.lossless, counted.is_none())?
            .map(|(depth, missing)| {
                no_depth = missing;
                depth
            });

        let all_gone = rgb.is_none() && normal.is_none() && label.is_none() && depth.is_none();
        let Some(size) = files.size.filter(|_| !all_gone) else { return Ok(None) };
        // Labels come first, since depth is missing beyond its range, too.
        let missing = counted
            .as_ref()
            .map(|counted| counted.missing)
            .or(no_depth)
            .or(no_color);
        let depth_m = depth
            .as_ref()
            .and_then(|depth| median_depth(depth, data.options().depth_units.per_m()));
        let seen = Shares { depth_m, ..shares(size, counted, missing) };
        Ok(Some(Self { size, seen, widths, rgb, sharp, normal, label, whole_label, depth }))
    }

    /// Returns the shown images, and a small one for a grid. `face` returns the face of each pixel of an
    /// image of this size.
    pub(crate) fn picture(
        &self,
        face: impl FnOnce([u32; 2]) -> Option<Raster<u32>>,
    ) -> Result<Made, EncodingError> {
        let size = shown_size(self.size, self.widths.lossless);
        // Reduces the smaller image again: means of means.
        let small = |width: u32, rgb: &Raster<_>| {
            let size = shown_size(self.size, width.min(rgb.width()));
            mean(rgb, size, Some(MISSING_COLOR))
        };
        let thumb = self
            .widths
            .thumb
            .zip(self.rgb.as_ref())
            .map(|(width, rgb)| small(width, rgb));
        let jpeg = |image: Option<&Raster<[u8; 3]>>| image.map(jpeg_url).transpose();
        let depth = |depth: &Raster<u16>| png_url(&depth.map(|v| pack(u32::from(v))), Content::Photo);
        let picture = Picture {
            of: self.size,
            size,
            rgb: jpeg(self.rgb.as_ref())?,
            normal: jpeg(self.normal.as_ref())?,
            depth: self.depth.as_ref().map(depth),
            label: self.label.as_ref().map(|label| png_url(label, Content::Labels)),
            face: face(size).map(|face| png_url(&face.map(pack), Content::Labels)),
            sharp: self.sharp.as_ref().map(|sharp| [sharp.width(), sharp.height()]),
        };
        Ok(Made { picture, thumb: jpeg(thumb.as_ref())?, sharp: jpeg(self.sharp.as_ref())? })
    }

    /// Returns the direction in which the panorama is looked at first, in degrees to the right of its centre
    /// column. `None` without depth.
    pub(crate) fn first_look(&self, table: Option<&LabelTable>, units_per_m: f64) -> Option<f64> {
        let depth = self.depth.as_ref()?;
        let place = |share: f64, side: u32| ((share * f64::from(side)) as u32).min(side.saturating_sub(1));
        let class = |label: &[u8; 3]| table?.class_of(LabelId(unpack(*label)));
        Some(first_look(|u, v| {
            let [x, y] = [place(u, depth.width()), place(v, depth.height())];
            let units = depth.at(x, y);
            Sample {
                depth_m: (units != MISSING_DEPTH).then(|| f64::from(units) / units_per_m),
                class: self
                    .label
                    .as_ref()
                    .and_then(|label| class(&label.at(x, y)))
                    .map(|class| class.index()),
            }
        }))
    }
}

/// The files of an image. Each is read once, line by line.
struct Files<'a> {
    data: &'a DataSet,
    image: &'a DatasetImage,
    /// The size of the first file that could be read. All others must have it.
    size: Option<[u32; 2]>,
    reader: &'a mut PngReader,
    faults: &'a mut Faults,
}

impl Files<'_> {
    /// Reads the lines of a modality. `None` if it has no file, or if the file is wrong, which becomes a
    /// fault.
    fn take<const N: usize, T>(
        &mut self,
        domain: Domain,
        open: impl for<'r> FnOnce(&'r mut PngReader, &[u8], &Path) -> Result<PngLines<'r, N>, FileError>,
        lines: impl FnOnce([u32; 2], PngLines<'_, N>) -> T,
    ) -> Result<Option<(T, PathBuf)>> {
        if !self.image.has(domain) {
            return Ok(None);
        }
        let layout = self.data.layout();
        let path = self.image.path(layout, domain);
        let read = self.data.read(&path).and_then(|bytes| {
            let read = open(self.reader, &bytes, &path)?;
            let [w, h] = [read.width(), read.height()];
            let [sw, sh] = *self.size.get_or_insert([w, h]);
            if [w, h] != [sw, sh] {
                let message =
                    format!("{w} × {h} pixels, and other modalities of this image have {sw} × {sh}");
                return Err(FileError::format(&path, message).into());
            }
            Ok(lines([w, h], read))
        });
        Ok(self.faults.keep(layout.root(), read)?.map(|taken| (taken, path)))
    }

    /// Reads means of colours at a width, and at a greater one if that shows more.
    fn colors(
        &mut self,
        domain: Domain,
        (width, sharp): (u32, Option<u32>),
        missing: [u8; 3],
    ) -> Result<Option<Colors>> {
        let taken = self.take(domain, PngReader::rgb8, |size, lines| {
            let small = shown_size(size, width);
            let mut mean = Mean::new(size, small, Some(missing));
            let mut sharp = sharp
                .map(|width| shown_size(size, width))
                .filter(|sharp| sharp.iter().zip(small).all(|(sharp, small)| *sharp > small))
                .map(|sharp| Mean::new(size, sharp, Some(missing)));
            lines.for_each(|line| {
                mean.line(line);
                sharp.iter_mut().for_each(|sharp| sharp.line(line));
            });

            let found = mean.missing();
            let image = mean.finish();
            let sharp = sharp
                .map(Mean::finish)
                .filter(|sharp| squared_loss(sharp, &image, missing) > LOSS * LOSS);
            Colors { image, sharp, missing: found }
        })?;
        Ok(taken.map(|(colors, _)| colors))
    }

    /// Reads labels, and counts their pixels. All pixels are kept, too, if `is_whole`.
    fn labels(&mut self, width: u32, is_whole: bool, table: Option<&LabelTable>) -> Result<Option<Labels>> {
        let taken = self.take(Domain::Semantic, PngReader::rgb8, |size, lines| {
            let mut nearest = Nearest::new(size, shown_size(size, width));
            let mut whole = is_whole.then(|| Nearest::new(size, size));
            let mut counts = table.map(|table| LabelCounts::new(table.len()));
            lines.for_each(|line| {
                nearest.line(line, |pixel| pixel);
                whole.iter_mut().for_each(|whole| whole.line(line, |pixel| pixel));
                counts.iter_mut().for_each(|counts| counts.add(line));
            });
            (nearest.finish(), whole.map(Nearest::finish), counts)
        })?;
        Ok(taken.map(|((image, whole, counts), path)| Labels { image, whole, counts, path }))
    }

    /// Reads depth, and the number of missing pixels of the file if `counts`.
    fn depth(&mut self, width: u32, counts: bool) -> Result<Option<(Raster<u16>, Option<u64>)>> {
        let taken = self.take(Domain::Depth, PngReader::gray16, |size, lines| {
            let mut nearest = Nearest::new(size, shown_size(size, width));
            let mut missing = counts.then_some(0);
            lines.for_each(|line| {
                nearest.line(line, u16::from_be_bytes);
                missing.iter_mut().for_each(|n| {
                    *n += line
                        .iter()
                        .filter(|sample| u16::from_be_bytes(**sample) == MISSING_DEPTH)
                        .count() as u64
                });
            });
            (nearest.finish(), missing)
        })?;
        Ok(taken.map(|(taken, _)| taken))
    }
}

/// Labels, the counts of their pixels, and their file.
struct Labels {
    image: Raster<[u8; 3]>,
    whole: Option<Raster<[u8; 3]>>,
    counts: Option<LabelCounts>,
    path: PathBuf,
}

/// Pixels by label.
struct LabelCounts {
    missing: u64,
    by_label: Vec<u64>,
    /// The least label that the data set does not have.
    unknown: Option<u32>,
}

/// The number of pixels that are compared at once to find the end of a run of equal ones.
const RUN: usize = 16;

/// Whether pixels are equal, compared as words of 64 bits: a comparison of the arrays would call `memcmp`.
fn are(pixels: &[[u8; 3]; RUN], expected: &[[u8; 3]; RUN]) -> bool {
    let words = pixels.as_flattened().as_chunks().0;
    let expected = expected.as_flattened().as_chunks().0;
    words
        .iter()
        .zip(expected)
        .map(|(a, b)| u64::from_ne_bytes(*a) ^ u64::from_ne_bytes(*b))
        .fold(0, |all, bits| all | bits)
        == 0
}

impl LabelCounts {
    fn new(labels: usize) -> Self {
        Self { missing: 0, by_label: vec![0; labels], unknown: None }
    }

    fn add(&mut self, mut line: &[[u8; 3]]) {
        while let Some((&[r, g, b], others)) = line.split_first() {
            let mut rest = others;
            let run = [[r, g, b]; RUN];
            while let Some((these, others)) = rest.split_first_chunk()
                && are(these, &run)
            {
                rest = others;
            }
            while let Some((next, others)) = rest.split_first()
                && *next == [r, g, b]
            {
                rest = others;
            }

            let pixels = (line.len() - rest.len()) as u64;
            line = rest;
            let label = u32::from_be_bytes([0, r, g, b]);
            match self.by_label.get_mut(label as usize) {
                _ if [r, g, b] == MISSING_INDEX => self.missing += pixels,
                Some(count) => *count += pixels,
                None => self.unknown = Some(self.unknown.map_or(label, |least| least.min(label))),
            }
        }
    }

    fn by_class(&self, table: &LabelTable, path: &Path) -> Result<Counted> {
        if let Some(label) = self.unknown {
            let message = format!("a pixel has label {label}, and the data set has {} labels", table.len());
            return Err(FileError::format(path, message).into());
        }
        let missing = self.missing;
        let mut counted = Counted { missing, unlabelled: 0, instances: 0, by_class: BTreeMap::new() };
        for (label, pixels) in (0..).zip(&self.by_label).filter(|(_, pixels)| **pixels > 0) {
            match table.class_of(LabelId(label)) {
                Some(class) => {
                    *counted.by_class.entry(class.index()).or_default() += pixels;
                    counted.instances += 1;
                }
                None => counted.unlabelled += pixels,
            }
        }
        Ok(counted)
    }
}

/// What the pixels of an image of labels show.
struct Counted {
    missing: u64,
    unlabelled: u64,
    instances: usize,
    by_class: BTreeMap<usize, u64>,
}

fn shares([width, height]: [u32; 2], counted: Option<Counted>, missing: Option<u64>) -> Shares {
    let pixels = (u64::from(width) * u64::from(height)) as f64;
    let share = |count: u64| rounded(count as f64 / pixels, 4);
    let classes = counted
        .iter()
        .flat_map(|c| &c.by_class)
        .map(|(class, n)| (*class, share(*n)));
    Shares {
        coverage: missing.map(|missing| rounded(1.0 - missing as f64 / pixels, 4)),
        unlabelled: counted.as_ref().map(|c| share(c.unlabelled)),
        instances: counted.as_ref().map(|c| c.instances),
        classes: classes.collect(),
        depth_m: None,
        pixels_unlabelled: counted.as_ref().map_or(0, |c| c.unlabelled),
        pixels_by_class: counted.map(|c| c.by_class).unwrap_or_default(),
    }
}

/// Returns the median of the middle half of the rows, in metres. `None` if nothing is seen there.
fn median_depth(depth: &Raster<u16>, units_per_m: f64) -> Option<f64> {
    let rows = depth.height() / 4..depth.height() - depth.height() / 4;
    let mut seen: Vec<u16> = rows
        .flat_map(|y| depth.row(y))
        .copied()
        .filter(|units| *units != MISSING_DEPTH)
        .collect();
    if seen.is_empty() {
        return None;
    }
    let middle = seen.len() / 2;
    Some(rounded(f64::from(*seen.select_nth_unstable(middle).1) / units_per_m, 3))
}

/// Adds the fault of an image without any file that can be shown.
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
    fn the_median_depth_is_of_the_middle_rows() {
        let rows = [[9; 4], [512, 1024, 2048, MISSING_DEPTH], [1024, 512, 2048, 1024], [9; 4]];
        let depth = Raster::from_vec(4, 4, rows.concat());
        assert_eq!(median_depth(&depth, 512.0), Some(2.0));
        assert_eq!(median_depth(&Raster::from_vec(1, 1, vec![MISSING_DEPTH]), 512.0), None);
    }

    #[test]
    fn pixels_of_labels_are_counted() {
        let names = ["<UNK>_0_<UNK>_0_0", "chair_1_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1"];
        let table = LabelTable::from_names(&names.map(String::from)).unwrap();
        let [n, a, b, w] = [[0; 3], [0, 0, 1], [0, 0, 2], [0, 0, 3]];
        let counted = |lines: &[&[[u8; 3]]]| {
            let mut counts = LabelCounts::new(table.len());
            lines.iter().for_each(|line| counts.add(line));
            counts.by_class(&table, Path::new("a.png"))
        };

        let counts = counted(&[&[MISSING_INDEX, n, a, a], &[b, w, w, a]]).unwrap();
        let missing = Some(counts.missing);
        let seen = shares([4, 2], Some(counts), missing);
        assert_eq!((seen.coverage, seen.unlabelled, seen.instances), (Some(0.875), Some(0.125), Some(3)));
        assert_eq!(seen.classes, [(2, 0.25), (8, 0.5)]);
        let e = counted(&[&[a, [0, 1, 0], [0, 2, 0]]]).err().unwrap().to_string();
        assert!(e.contains("a.png: a pixel has label 256"), "{e}");

        // Long runs.
        for (before, long) in [(0, 1), (1, 15), (3, 16), (2, 17), (7, 64), (0, 100)] {
            let line = [vec![a; before], vec![w; long], vec![b; 5]].concat();
            let counts = counted(&[&line]).unwrap();
            assert_eq!(counts.by_class[&8], (before + 5) as u64, "{before}, {long}");
            assert_eq!(counts.by_class[&2], long as u64, "{before}, {long}");
        }
    }
}
