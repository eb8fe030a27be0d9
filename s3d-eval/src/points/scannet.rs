//! Reads the predicted instances of a room in the form that ScanNet's benchmark takes: a text with a line an
//! instance, and a text with a number a point for each of its masks.
//!
//! Source: ScanNet 3830fce, `BenchmarkScripts/3d_evaluation/evaluate_semantic_instance.py` and `util_3d.py`.

use super::CLASSES;
use super::find::wrong;
use super::instances::Instances;
use super::labels::Runs;
use super::matching::{PredictedInstance, count};
use super::truth::{Points, Room, rows_expected};
use s3d_dataset::{Context, Result, s3d_io};
use s3d_io::Error as FileError;
use s3d_io::fs::read_file;
use std::collections::BTreeSet;
use std::path::{Component, Path};

/// A line of the list.
struct Entry<'a> {
    mask: &'a Path,
    class: usize,
    score: f64,
}

/// Reads the instances that a list names. Its masks lie below its folder, and may overlap.
pub(super) fn listed(list: &Path, room: &Room, points: &Points, ctx: &Context) -> Result<Instances> {
    let text = text_of(list)?;
    let mut truth = None;
    let mut predicted = Vec::new();
    let mut masks = BTreeSet::new();
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        ctx.check()?;
        let at_line = |message: String| FileError::line(list, number, message);
        let Entry { mask, class, score } = Entry::parse(line).map_err(at_line)?;
        if !masks.insert(mask) {
            return Err(at_line(format!("the mask {} is in a line above", mask.display())).into());
        }

        let path = list.with_file_name(mask);
        if !path.exists() {
            return Err(at_line(format!("there is no file {} for its mask", path.display())).into());
        }
        let inside = mask_of(&path)?;
        let of_rows = points.of_rows(inside.len() as u64);
        let Some(instances) = of_rows.filter(|rows| truth.as_ref().is_none_or(|truth| truth == rows)) else {
            let message =
                format!("has {} lines, a line a point: {}", inside.len(), rows_expected(room, points));
            return Err(wrong(&path, message));
        };

        let mut overlaps = Vec::new();
        Runs::new(&instances).split(&inside, |at, part| {
            let shared = part.iter().filter(|inside| **inside).count() as u64;
            if shared > 0 {
                count(&mut overlaps, at, shared);
            }
        });
        let size = overlaps.iter().map(|(_, shared)| shared).sum();
        predicted.push(PredictedInstance { class, score, points: size, void: 0, overlaps });
        truth = Some(instances);
    }
    Ok((truth.unwrap_or_else(|| points.instances().to_vec()), predicted))
}

impl<'a> Entry<'a> {
    /// Reads a line: mask, label and confidence.
    fn parse(line: &'a str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [mask, label, score] = words[..] else {
            return Err(format!(
                "has {} words, and a line is `MASK LABEL CONFIDENCE`; names of masks have no spaces",
                words.len()
            ));
        };

        let mask = Path::new(mask);
        let is_below = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        if !mask.components().all(is_below) {
            let mask = mask.display();
            return Err(format!("the mask {mask} must be named from the list's folder, and lie below it"));
        }

        let class = label
            .parse()
            .ok()
            .and_then(|number: f64| (0..CLASSES).find(|class| *class as f64 == number));
        let Some(class) = class else {
            return Err(format!("the label {label} is no class: 0 to 12 are, as in `s3d profile`"));
        };
        match score.parse::<f64>() {
            // Adding 0 turns -0 into 0, so that both are equal when scores are sorted.
            Ok(score) if score.is_finite() => Ok(Self { mask, class, score: score + 0.0 }),
            _ => Err(format!("the confidence {score} is no number")),
        }
    }
}

/// Reads a mask: an integer a line, where 0 means that the point is not in the instance.
fn mask_of(path: &Path) -> Result<Vec<bool>> {
    let text = text_of(path)?;
    let lines = (1..).zip(text.lines()).map(|(number, line)| {
        let value = line.trim().parse::<i64>();
        value.map(|value| value != 0).map_err(|_| {
            FileError::line(path, number, format!("{line:?} is no integer, and a mask has one a line"))
        })
    });
    Ok(lines.collect::<Result<_, FileError>>()?)
}

fn text_of(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read_file(path)?).map_err(|_| FileError::format(path, "is no text"))
}
