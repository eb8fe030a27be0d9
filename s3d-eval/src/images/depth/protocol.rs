//! Protocol `depth`: depth of views, and distances of panoramas.

use crate::error::{Error, Result};
use crate::images::depth::files::{Both, Form, both};
use crate::images::depth::marigold::{
    Alignment, MARIGOLD_COLUMNS, is_evaluated as marigold_evaluates, marigold_depth_twice,
};
use crate::images::depth::metrics::{DEPTH_COLUMNS, hohonet_depth_twice, unifuse_depth_twice};
use crate::images::latitude::{BY_LATITUDE, tables_by_latitude, weights_of_pixels};
use crate::images::predictions::{Matched, Predicted, Wanted, find};
use crate::images::read::Places;
use crate::images::resample::{opencv_nearest, pillow_nearest};
use crate::options::ImageKind;
use crate::tables::{Unit, tables};
use crate::task::Task;
use crate::{Evaluation, hints};
use s3d_io::dataset::Domain;

const HOHONET: [&str; 5] = [
    "Panoramas are evaluated at 1024 × 512 pixels. Each takes the panorama's pixel at its centre, as in \
     scikit-image and Pillow. A prediction of the panorama's own size is sampled at the same pixels.",
    "Pixels whose true distance exists and is above 0 are evaluated. Truth and prediction are first clamped \
     to 0.01 m to 10 m.",
    "Scores are computed for each panorama; the table has their mean over panoramas.",
    "δ is the larger of prediction ÷ truth and truth ÷ prediction. Logarithms are decimal.",
    "As in HoHoNet's test_depth.py (commit 2bbc0866), which has no SqRel and computes in 32 bits; here it is \
     64.",
];

const UNIFUSE: [&str; 6] = [
    "Panoramas are evaluated at 1024 × 512 pixels. Each takes the panorama's pixel at its upper left \
     corner, as in OpenCV. A prediction of the panorama's own size is sampled at the same pixels.",
    "Pixels whose true distance is above 0 and at most 10 m are evaluated. Truth and prediction are raised \
     to at least 0.1 m.",
    "A fault of the script is kept: where a prediction is beyond 10 m, the truth becomes 10 m and the \
     prediction stays.",
    "Scores are computed for each panorama; the table has their mean over panoramas.",
    "δ is the larger of prediction ÷ truth and truth ÷ prediction. Logarithms are decimal.",
    "As in UniFuse's metrics.py (commit 5da3a4e6).",
];

const MEDIAN_SCALE: &str = "The predictions of each panorama are scaled so that the median of its evaluated \
     pixels is the truth's median. Of two middle values the lower is the median.";

const MARIGOLD: [&str; 4] = [
    "Images are evaluated at their own size. Pixels whose true depth is more than 0.001 m and less than 10 m \
     are evaluated: the script's limits for NYUv2 and ScanNet. Predictions are clamped to the same limits.",
    "Scores are computed for each image; the table has their mean over images.",
    "δ is the larger of prediction ÷ truth and truth ÷ prediction. RMSE ln is of natural logarithms, \
     log10 the mean error of decimal ones. iRMSE is of 1 ÷ depth. SILog is the standard deviation of \
     errors of natural logarithms.",
    "As in Marigold's script/depth/eval.py (commit b1dffaaa), which computes in 32 bits; here it is 64.",
];

/// The part of Marigold's definition on the alignment.
fn of_alignment(alignment: Alignment) -> &'static str {
    match alignment {
        Alignment::Metric => "Predictions are metres, and are not aligned.",
        Alignment::Depth => {
            "Predictions are depths in any unit. In each image the scale and the shift are found by which \
             they come nearest to the truth of the evaluated pixels, by least squares of depth."
        }
        Alignment::Disparity => {
            "Predictions are disparities in any unit: large is near. In each image the scale and the shift \
             are found by which those above 0 come nearest to 1 ÷ truth of the evaluated pixels, by least \
             squares. Aligned disparities below 0.001 per metre become 0.001; 1 ÷ disparity is the depth."
        }
    }
}

/// The script that a variant follows.
#[derive(Clone, Copy, PartialEq)]
enum Script {
    Hohonet,
    Unifuse,
    Marigold(Alignment),
}

impl Script {
    fn of(variant: &str) -> Self {
        match variant {
            "unifuse" => Self::Unifuse,
            "marigold" => Self::Marigold(Alignment::Depth),
            "marigold-disparity" => Self::Marigold(Alignment::Disparity),
            "marigold-metric" => Self::Marigold(Alignment::Metric),
            _ => Self::Hohonet,
        }
    }

    fn form(self) -> Form {
        match self {
            Self::Hohonet => Form {
                places: |size| Places::new(size, pillow_nearest),
                is_metric: true,
                is_evaluated: |truth| truth > 0.0,
            },
            Self::Unifuse => Form {
                places: |size| Places::new(size, opencv_nearest),
                is_metric: true,
                is_evaluated: |truth| truth > 0.0 && truth <= 10.0,
            },
            Self::Marigold(alignment) => Form {
                places: Places::all,
                is_metric: alignment == Alignment::Metric,
                is_evaluated: marigold_evaluates,
            },
        }
    }

    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Hohonet | Self::Unifuse => &DEPTH_COLUMNS,
            Self::Marigold(_) => &MARIGOLD_COLUMNS,
        }
    }

    fn definition(self, median_scale: bool) -> Vec<&'static str> {
        let mut definition = match self {
            Self::Hohonet => HOHONET.to_vec(),
            Self::Unifuse => UNIFUSE.to_vec(),
            Self::Marigold(_) => MARIGOLD.to_vec(),
        };
        match self {
            Self::Marigold(alignment) => definition.insert(1, of_alignment(alignment)),
            _ if median_scale => definition.insert(3, MEDIAN_SCALE),
            _ => {}
        }
        definition
    }
}

pub(crate) fn depth(task: &Task<'_>) -> Result<Evaluation> {
    let script = Script::of(task.variant);
    let median_scale = task.options.median_scale;
    if median_scale && script != Script::Unifuse {
        return Err(Error::NoMedianScale { variant: task.variant });
    }
    let of_both = matches!(script, Script::Marigold(_));
    if !of_both && task.options.images == Some(ImageKind::Views) {
        return Err(Error::DepthOfPanoramas { variant: task.variant });
    }

    let wanted = Wanted {
        domain: Domain::Depth,
        besides: &[],
        kind: if of_both {
            task.options.images
        } else {
            Some(ImageKind::Panoramas)
        },
        other_kind: if of_both {
            ""
        } else {
            "depth as marigold, marigold-disparity and marigold-metric evaluates views"
        },
        endings: &["png", "npy", "npz"],
        known: &[],
    };
    let matched = find(task, &wanted)?;

    let units = matched.count(task, |predicted| Scored::of(task, predicted, script))?;
    let Matched { images, kind, mut notes } = matched;

    let noun = kind.noun();
    notes.extend(notes_on(&units, noun));
    notes.extend(hints::of_depth(units.iter().filter_map(|unit| unit.counted.ratio).collect()));
    let score = |units: &[&Scored], by: usize| {
        let values = units
            .iter()
            .filter(|scored| scored.pixels > 0)
            .map(|scored| &scored.values[by][..]);
        vec![("mean".to_owned(), mean(values, script.columns().len()))]
    };
    let mut made = tables(task, script.columns(), &units, |units| score(units, 0));
    let mut definition = script.definition(median_scale);
    if kind == ImageKind::Panoramas {
        made.extend(tables_by_latitude(task, script.columns(), &units, |units| score(units, 1)));
        definition.push(BY_LATITUDE);
        if median_scale || !script.form().is_metric {
            definition.push("What predictions are scaled and shifted by is the same in these tables.");
        }
    }
    let pixels = units.iter().map(|unit| unit.counted.pixels).sum();
    let counted = [(noun, images.len() as u64), ("pixels", pixels)];
    Ok(Evaluation { notes, ..task.evaluation(&definition, counted, made) })
}

/// An image with its scores, plain and weighted by latitude.
struct Scored {
    pixels: u64,
    /// The median of truth ÷ prediction over some pixels, if predictions are in metres.
    ratio: Option<f64>,
    replaced: u64,
    is_aligned: bool,
    values: [Vec<f64>; 2],
}

impl Scored {
    fn of(task: &Task<'_>, predicted: &Predicted, script: Script) -> s3d_dataset::Result<Self> {
        let Both { size, truth, prediction } = both(task, predicted, &script.form())?;
        let ratio = if script.form().is_metric {
            hints::depth_ratio(&truth, &prediction)
        } else {
            None
        };
        let weights = weights_of_pixels(size);
        let scores = match script {
            Script::Hohonet => hohonet_depth_twice(&truth, &prediction, weights),
            Script::Unifuse => unifuse_depth_twice(&truth, &prediction, task.options.median_scale, weights),
            Script::Marigold(alignment) => {
                let scores = marigold_depth_twice(&truth, &prediction, alignment, weights);
                return Ok(Self {
                    pixels: scores[0].pixels,
                    ratio,
                    replaced: 0,
                    is_aligned: scores[0].is_aligned,
                    values: scores.map(|scores| scores.values.to_vec()),
                });
            }
        };
        Ok(Self {
            pixels: scores[0].pixels,
            ratio,
            replaced: scores[0].replaced,
            is_aligned: true,
            values: scores.map(|scores| scores.values.to_vec()),
        })
    }
}

/// Returns notes on images that a script treats in a way of its own.
fn notes_on(units: &[Unit<Scored>], noun: &str) -> Vec<String> {
    let mut notes = Vec::new();
    let empty = units.iter().filter(|unit| unit.counted.pixels == 0).count();
    if empty > 0 {
        notes.push(format!(
            "{empty} {noun} without a pixel to evaluate were left out; in the script they make all scores \
             NaN."
        ));
    }
    let replaced: u64 = units.iter().map(|unit| unit.counted.replaced).sum();
    if replaced > 0 {
        notes.push(format!(
            "{replaced} pixels were predicted beyond 10 m and compared with 10 m instead of their truth."
        ));
    }
    let flat = units
        .iter()
        .filter(|unit| unit.counted.pixels > 0 && !unit.counted.is_aligned)
        .count();
    if flat > 0 {
        notes.push(format!(
            "{flat} {noun} have a single value to align. It becomes the mean of the truth, as in the script; \
             without a disparity above 0, all depths become 10 m."
        ));
    }
    notes
}

/// Returns the mean of each of `columns` values over images.
pub(super) fn mean<'a>(images: impl Iterator<Item = &'a [f64]>, columns: usize) -> Vec<f64> {
    let mut sums = vec![0.0; columns];
    let mut count = 0.0;
    for values in images {
        sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
        count += 1.0;
    }
    sums.into_iter().map(|sum| sum / count).collect()
}
