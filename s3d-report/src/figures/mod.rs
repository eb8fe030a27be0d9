//! Figures of a data set for print: what the paper shows of its own.
//!
//! A figure is a page of shapes (`sheet`), which is written as PDF (`pdf`) and as PNG (`png`). Words are
//! outlines (`font`). Each other module draws one figure.

mod areas;
mod classes;
mod detections;
mod distributions;
mod examples;
mod font;
mod images;
mod modalities;
mod pdf;
mod png;
mod samples;
mod sheet;

use crate::error::{Error, Result};
use crate::options::DPI;
use images::Images;
use s3d_dataset::store::{FolderKind, NewFolder};
use s3d_dataset::{Context, DataSet};
use s3d_geom::Camera;
use s3d_io::dataset::{DatasetImage, Frame, ViewRecord};
use s3d_io::fs::{write_bytes, write_json};
use s3d_io::image::{Compression, Content, write_rgb8};
use serde::Serialize;
use sheet::Sheet;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A folder with figures.
const FIGURES: FolderKind =
    FolderKind { about: "figures.json", generator: "s3d figures", noun: "the figures", action: "draw" };

/// Pixels of an inch that journals ask for.
const DEFAULT_DPI: u32 = 300;

/// How figures are drawn.
///
/// With the feature `clap` it is a group of arguments of a command line: comments of fields are help texts.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct FiguresOptions {
    /// The pixels of an inch, 30 to 1200: of the PNG files, and the most of the pictures in PDF files.
    #[cfg_attr(feature = "clap", arg(long, value_name = "PIXELS", default_value_t = DEFAULT_DPI,
        value_parser = clap::value_parser!(u32).range(30..=1200)))]
    pub dpi: u32,
    /// Also draw the detections in this list, which s3d detect run wrote, beside the true boxes.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FOUND.json"))]
    pub detections: Option<PathBuf>,
    /// Replace earlier figures.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

impl Default for FiguresOptions {
    fn default() -> Self {
        Self { dpi: DEFAULT_DPI, detections: None, overwrite: false }
    }
}

/// A figure, before it is written.
struct Drawn {
    name: String,
    caption: String,
    sheet: Sheet,
}

/// What figures are drawn from.
struct Book<'a> {
    data: &'a DataSet,
    dpi: u32,
    images: Images<'a>,
    /// The panoramas.
    panoramas: Vec<DatasetImage>,
    /// The views that were kept, with what is known of them.
    views: Vec<(DatasetImage, ViewRecord)>,
    /// All views that were thought of.
    candidates: Vec<ViewRecord>,
}

impl<'a> Book<'a> {
    fn read(data: &'a DataSet, dpi: u32) -> Result<Self> {
        let (mut panoramas, mut views, mut candidates) = (Vec::new(), Vec::new(), Vec::new());
        for &area in data.areas() {
            let records = data.views(area)?;
            let kept: BTreeMap<(&str, u32), &ViewRecord> = records
                .iter()
                .filter_map(|view| Some(((view.camera_uuid.as_str(), view.frame_num?), view)))
                .collect();
            for image in data.images(area) {
                match image.frame {
                    Frame::Panorama => panoramas.push(image),
                    Frame::View(number) => {
                        if let Some(record) = kept.get(&(image.uuid.as_str(), number)).copied().cloned() {
                            views.push((image, record));
                        }
                    }
                }
            }
            candidates.extend(records);
        }
        Ok(Self { data, dpi, images: Images::new(data, dpi)?, panoramas, views, candidates })
    }

    /// The view of the highest entropy.
    fn richest_view(&self) -> Option<&DatasetImage> {
        let richest = self
            .views
            .iter()
            .max_by(|(_, a), (_, b)| a.entropy.total_cmp(&b.entropy));
        richest.map(|(view, _)| view)
    }

    /// The panorama of the location whose candidates have the highest entropy in the mean.
    fn richest_panorama(&self) -> Option<&DatasetImage> {
        let mut sums: BTreeMap<&str, (f64, u32)> = BTreeMap::new();
        for view in &self.candidates {
            let (sum, count) = sums.entry(&view.camera_uuid).or_default();
            (*sum, *count) = (*sum + view.entropy, *count + 1);
        }
        let mean = |image: &DatasetImage| {
            sums.get(image.uuid.as_str())
                .map_or(0.0, |(sum, count)| sum / f64::from(*count))
        };
        self.panoramas.iter().max_by(|a, b| mean(a).total_cmp(&mean(b)))
    }

    /// The camera of an image of this width.
    fn camera(&self, image: &DatasetImage, width: u32) -> Result<Camera> {
        let height = if image.frame == Frame::Panorama {
            width / 2
        } else {
            width
        };
        Ok(self.data.camera(image, &self.data.pose(image)?, [width, height])?)
    }
}

/// What a folder of figures tells of itself.
#[derive(Serialize)]
struct About {
    generator: &'static str,
    version: &'static str,
    /// The checksum of the data set's list of files.
    dataset: String,
    /// Names and captions.
    figures: BTreeMap<String, String>,
}

/// Draws figures of the data set in the folder `out` for print, and writes them to the folder `to`, whole or
/// not at all: each as PDF, and as PNG, 7 inches wide. `figures.tex` sets them in
/// LaTeX, and `figures.json` has their captions.
///
/// | figure | what it shows |
/// |---|---|
/// | `modalities` | the panorama of the richest location in each modality |
/// | `area_N` | the mesh of an area from above, opened below its ceilings: textured, and by class |
/// | `samples` | that panorama with the frames of its views |
/// | `distributions` | yaw, pitch and field of view of the views, with the paper's curves |
/// | `examples` | the richest view of each type of room in four modalities |
/// | `classes` | a view of each class, with all else pale |
/// | `detections_N` | on request: true boxes of an area, and the best detections |
///
/// Figures of what the data set does not have are left out and told. The richest is what has the highest
/// entropy of classes. The same data set gives the same bytes.
///
/// # Errors
/// [`Error::Resolution`] for [`FiguresOptions::dpi`]. [`Error::NoFigure`] if there is nothing to draw.
/// [`Error::Dataset`] if there is no finished data set in `out`, a file of it or the list of detections is
/// damaged, or `to` cannot be written, or is there and not to be replaced.
pub fn figures(out: &Path, to: &Path, options: &FiguresOptions, ctx: &Context) -> Result<()> {
    let FiguresOptions { dpi, detections, overwrite } = options;
    if !DPI.contains(dpi) {
        return Err(Error::Resolution(*dpi));
    }
    let data = DataSet::open(out)?;
    let found = detections.as_deref().map(detections::read).transpose()?;
    let folder = NewFolder::begin(ctx, to, out, FIGURES, *overwrite)?;
    let book = Book::read(&data, *dpi)?;
    let areas = data.areas().to_vec();
    let task = ctx.progress("drawing", "figures", 5 + areas.len() as u64);

    let mut captions = BTreeMap::new();
    let mut tex = String::from("% \\usepackage{graphicx}\n");
    let mut place = |name: &str, drawn: Option<Drawn>| -> Result<()> {
        ctx.check()?;
        task.add(1);
        let Some(Drawn { name, caption, sheet }) = drawn else {
            ctx.warn(format_args!("{}: nothing to draw the figure {name} of", out.display()));
            return Ok(());
        };
        let file = |ending: &str| folder.path().join(format!("{name}.{ending}"));
        let pdf = pdf::pdf(&sheet).map_err(|e| s3d_io::Error::io(&file("pdf"), "make", e))?;
        write_bytes(&file("pdf"), &pdf)?;
        write_rgb8(&file("png"), &png::pixels(&sheet, *dpi), Content::Photo, Compression::default())?;
        tex.push_str(&format!(
            "\n\\begin{{figure*}}\n\t\\centering\n\t\\includegraphics[width=\\textwidth]{{{name}.pdf}}\n\
             \t\\caption{{{caption}}}\n\t\\label{{fig:{name}}}\n\\end{{figure*}}\n"
        ));
        captions.insert(name, caption);
        Ok(())
    };
    place("modalities", modalities::modalities(&book)?)?;
    for &area in &areas {
        place(&format!("area_{area}"), areas::area(&book, area)?)?;
    }
    place("samples", samples::samples(&book)?)?;
    place("distributions", distributions::distributions(&book))?;
    place("examples", examples::examples(&book)?)?;
    place("classes", classes::classes(&book)?)?;
    if let Some(found) = &found {
        let there = |area: &&u32| found.iter().any(|d| d.area == **area);
        for &area in areas.iter().filter(there) {
            place(&format!("detections_{area}"), detections::detections(&book, area, found)?)?;
        }
    }

    if captions.is_empty() {
        return Err(Error::NoFigure(out.to_owned()));
    }
    write_bytes(&folder.path().join("figures.tex"), tex.as_bytes())?;
    let about = About {
        generator: FIGURES.generator,
        version: env!("CARGO_PKG_VERSION"),
        dataset: data.checksum(),
        figures: captions,
    };
    write_json(&folder.path().join(FIGURES.about), &about)?;
    Ok(folder.finish()?)
}

/// The words of a room, or of a type of rooms: "conference room 1" of `conferenceRoom_1`.
fn words_of(room: &str) -> String {
    let mut words = String::new();
    let mut was_small = false;
    for c in room.chars() {
        if c == '_' {
            words.push(' ');
        } else if c.is_uppercase() && was_small {
            words.push(' ');
            words.extend(c.to_lowercase());
        } else {
            words.push(c);
        }
        was_small = c.is_lowercase();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::words_of;

    #[test]
    fn names_of_rooms_become_words() {
        assert_eq!(words_of("conferenceRoom_12"), "conference room 12");
        assert_eq!(words_of("copyRoom"), "copy room");
        assert_eq!(words_of("WC_1"), "WC 1");
        assert_eq!(words_of("openspace_1"), "openspace 1");
    }
}
