//! Reads the predicted instances of a room from an NPZ archive, piece by piece.

use super::CLASSES;
use super::find::wrong;
use super::labels::{Labels, Runs, SEMANTIC, maybe_named, named};
use super::matching::{Overlaps, PredictedInstance, Segments, TrueInstance, count};
use super::scannet::listed;
use super::truth::{Points, Room, rows_expected};
use s3d_dataset::{Context, Error, Result, s3d_io};
use s3d_io::cloud::{NpyArray, NpzArchive};
use std::io::Read;
use std::path::Path;

const MASKS: [&str; 2] = ["masks", "pred_masks"];
const IDS: [&str; 2] = ["instance", "pts_instance_mask"];
const INSTANCE_CLASSES: [&str; 3] = ["classes", "pred_classes", "instance_labels"];
const SCORES: [&str; 3] = ["scores", "pred_scores", "instance_scores"];

/// The true and the predicted instances of a room.
pub(super) type Instances = (Vec<TrueInstance>, Vec<PredictedInstance>);

/// The true instances of a room, and the points that each prediction shares with them.
type Shared = (Vec<TrueInstance>, Vec<Overlaps>);

/// The archive of the predictions of a room.
struct Prediction<'a> {
    path: &'a Path,
    archive: NpzArchive,
    names: Vec<String>,
    room: &'a Room,
    points: &'a Points,
    ctx: &'a Context,
}

/// Reads predictions for average precision. Each instance has a mask, which may overlap others, or each point
/// has an instance. Each instance has a class and a score. Instances of class -1 are left out.
pub(super) fn scored(path: &Path, room: &Room, points: &Points, ctx: &Context) -> Result<Instances> {
    if path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("txt"))
    {
        return listed(path, room, points, ctx);
    }
    let mut file = Prediction::open(path, room, points, ctx)?;
    let classes = file.classes()?;
    let scores = file.scores(classes.len())?;

    let ids = maybe_named(path, &file.names, &IDS)?;
    let (truth, shared) = match (maybe_named(path, &file.names, &MASKS)?, ids) {
        (Some(masks), Some(ids)) => {
            return Err(wrong(path, format!("has both {masks} and {ids}: leave one of them")));
        }
        (Some(masks), None) => file.of_masks(&masks, classes.len())?,
        (None, _) => file.of_ids(&named(path, &file.names, &[IDS, MASKS].concat())?, classes.len())?,
    };

    let predicted = classes
        .into_iter()
        .zip(scores)
        .zip(shared)
        .filter_map(|((class, score), overlaps)| {
            let points = overlaps.iter().map(|(_, common)| common).sum();
            let class = usize::try_from(class).ok()?;
            Some(PredictedInstance { class, score, points, void: 0, overlaps })
        })
        .collect();
    Ok((truth, predicted))
}

/// The class and the instance of each point, -1 for none.
pub(super) type Labelled = Vec<(i64, i64)>;

/// Reads predictions for panoptic quality, and returns the true instances as well. Each point has an
/// instance, -1 for none. Each point or each instance has a class, -1 for none.
pub(super) fn labelled(
    path: &Path,
    room: &Room,
    points: &Points,
    ctx: &Context,
) -> Result<(Vec<TrueInstance>, Labelled)> {
    let mut file = Prediction::open(path, room, points, ctx)?;
    let name = file.ids_without_masks("panoptic quality")?;
    if maybe_named(path, &file.names, &SEMANTIC)?.is_some() {
        return file.classes_and_ids(&name, -1);
    }

    let classes = file.classes()?;
    let (truth, ids) = file.ids(&name)?;
    let class_of = |id: i64| match usize::try_from(id) {
        Err(_) => Ok(-1),
        Ok(at) => classes
            .get(at)
            .copied()
            .ok_or_else(|| file.without_class(&name, id, classes.len())),
    };
    let points = ids.iter().map(|id| Ok((class_of(*id)?, *id)));
    let points = points.collect::<Result<_>>()?;
    Ok((truth, points))
}

/// Reads predictions for coverage. Each point has an instance, -1 for none. Each point or each instance has a
/// class. An instance has the class of most of its points; the lowest class wins a tie.
pub(super) fn segments(path: &Path, room: &Room, points: &Points, ctx: &Context) -> Result<Instances> {
    let mut file = Prediction::open(path, room, points, ctx)?;
    let name = file.ids_without_masks("coverage")?;
    if maybe_named(path, &file.names, &SEMANTIC)?.is_none() {
        let classes = file.classes()?;
        let (truth, shared) = file.of_ids(&name, classes.len())?;
        let predicted = classes.into_iter().zip(shared).filter_map(|(class, overlaps)| {
            let points = overlaps.iter().map(|(_, common)| common).sum();
            let class = usize::try_from(class).ok().filter(|_| points > 0)?;
            Some(PredictedInstance { class, score: 0.0, points, void: 0, overlaps })
        });
        return Ok((truth, predicted.collect()));
    }

    let (truth, points) = file.classes_and_ids(&name, 0)?;
    let mut segments = Segments::default();
    Runs::new(&truth).split(&points, |at, part| {
        part.iter()
            .for_each(|(class, instance)| segments.add(Some(at), *class, *instance));
    });
    Ok((truth, segments.finish()))
}

impl<'a> Prediction<'a> {
    fn open(path: &'a Path, room: &'a Room, points: &'a Points, ctx: &'a Context) -> Result<Self> {
        let archive = NpzArchive::open(path)?;
        let names = archive.names().to_vec();
        Ok(Self { path, archive, names, room, points, ctx })
    }

    /// Reads the classes of its instances: 0 to 12, or -1.
    fn classes(&mut self) -> Result<Vec<i64>> {
        let name = named(self.path, &self.names, &INSTANCE_CLASSES)?;
        let mut array = self.archive.array(&name)?;
        let mut classes = Vec::new();
        while array.read_integers(&mut classes)? > 0 {}
        match classes.iter().find(|class| !(-1..CLASSES as i64).contains(*class)) {
            Some(class) => {
                Err(wrong(array.name(), format!("{class} is no class: 0 to 12 are, as in `s3d profile`")))
            }
            None => Ok(classes),
        }
    }

    /// Reads a score for each of `instances` instances.
    fn scores(&mut self, instances: usize) -> Result<Vec<f64>> {
        let name = named(self.path, &self.names, &SCORES)?;
        let mut array = self.archive.array(&name)?;
        let mut scores = Vec::new();
        while array.read_floats(&mut scores)? > 0 {}
        if scores.len() != instances {
            let message = format!(
                "has {} scores for {instances} classes: there is one of each an instance",
                scores.len()
            );
            return Err(wrong(array.name(), message));
        }
        match scores.iter().find(|score| !score.is_finite()) {
            Some(score) => Err(wrong(array.name(), format!("{score} is no score"))),
            // Adding 0 turns -0 into 0, so that both are equal when scores are sorted.
            None => Ok(scores.into_iter().map(|score| score + 0.0).collect()),
        }
    }

    /// Reads the points that each mask shares with the true instances.
    fn of_masks(&mut self, name: &str, instances: usize) -> Result<Shared> {
        let array = self.archive.array(name)?;
        let k = instances as u64;
        let (is_by_point, rows) = match *array.shape() {
            [rows, columns] if columns == k && !(rows == k && name == "pred_masks") => (true, Some(rows)),
            [rows, columns] if rows == k => (false, Some(columns)),
            _ => (false, None),
        };
        let Some(truth) = rows.and_then(|rows| self.points.of_rows(rows)) else {
            let due = format!("N × {instances} or {instances} × N");
            return Err(shape_error(array.name(), array.shape(), &due, self.room, self.points));
        };

        // The last index runs fastest, unless the array is column-major.
        let shared = if is_by_point != array.is_column_major() {
            masks_by_point(array, &truth, instances, self.ctx)?
        } else {
            masks_one_by_one(array, &truth, instances, self.ctx)?
        };
        Ok((truth, shared))
    }

    /// Reads the points that each of `instances` instances shares with the true ones.
    fn of_ids(&mut self, name: &str, instances: usize) -> Result<Shared> {
        let (truth, ids) = self.ids(name)?;
        let mut shared = vec![Vec::new(); instances];
        let mut failure = None;
        Runs::new(&truth).split(&ids, |at, part| {
            for id in part.iter().filter(|id| **id != -1) {
                match usize::try_from(*id).ok().and_then(|id| shared.get_mut(id)) {
                    Some(overlaps) => count(overlaps, at, 1),
                    None => drop(failure.get_or_insert(*id)),
                }
            }
        });
        match failure {
            Some(id) => Err(self.without_class(name, id, instances)),
            None => Ok((truth, shared)),
        }
    }

    /// Reads a class, at least `least`, and an instance for each point.
    fn classes_and_ids(&mut self, name: &str, least: i64) -> Result<(Vec<TrueInstance>, Labelled)> {
        let (truth, ids) = self.ids(name)?;
        let semantic = named(self.path, &self.names, &SEMANTIC)?;
        let array = self.archive.array(&semantic)?;
        let (mut labels, of_labels) = Labels::new(array, self.room, self.points, least)?;
        if of_labels != truth {
            return Err(wrong(self.path, format!("{semantic} and {name} are not of as many points")));
        }

        let mut points = Vec::with_capacity(ids.len());
        loop {
            self.ctx.check()?;
            let labels = labels.next()?;
            if labels.is_empty() {
                return Ok((truth, points));
            }
            let rest = ids.get(points.len()..).unwrap_or_default();
            points.extend(labels.iter().copied().zip(rest.iter().copied()));
        }
    }

    /// Returns the name of the array with an instance for each point. Masks are refused.
    fn ids_without_masks(&self, wanted_by: &str) -> Result<String> {
        if let Some(masks) = maybe_named(self.path, &self.names, &MASKS)? {
            let message =
                format!("has {masks}, which may overlap: {wanted_by} takes `instance`, one a point");
            return Err(wrong(self.path, message));
        }
        named(self.path, &self.names, &IDS)
    }

    /// Returns the error for an instance without a class.
    fn without_class(&self, name: &str, id: i64, instances: usize) -> Error {
        let message = format!(
            "{name} has the instance {id}: 0 to {instances} - 1 have classes, and -1 stands for none"
        );
        wrong(self.path, message)
    }

    /// Reads the instance of each point.
    fn ids(&mut self, name: &str) -> Result<(Vec<TrueInstance>, Vec<i64>)> {
        let mut array = self.archive.array(name)?;
        let mut ids = Vec::new();
        let rows = match *array.shape() {
            [rows] | [rows, 1] => self.points.of_rows(rows),
            _ => None,
        };
        let Some(truth) = rows else {
            return Err(shape_error(array.name(), array.shape(), "N", self.room, self.points));
        };
        while array.read_integers(&mut ids)? > 0 {
            self.ctx.check()?;
        }
        match ids.iter().position(|id| *id < -1) {
            Some(at) => {
                Err(wrong(array.name(), format!("{} at point {at}: -1 stands for no instance", ids[at])))
            }
            None => Ok((truth, ids)),
        }
    }
}

/// Returns the error for an array of another shape than `due`.
fn shape_error(name: &Path, shape: &[u64], due: &str, room: &Room, points: &Points) -> Error {
    let expected = rows_expected(room, points);
    wrong(name, format!("has the shape {shape:?}, where {due} is due: {expected}"))
}

/// Reads masks whose numbers come point by point.
fn masks_by_point(
    mut array: NpyArray<impl Read>,
    truth: &[TrueInstance],
    instances: usize,
    ctx: &Context,
) -> Result<Vec<Overlaps>> {
    let mut shared = vec![Vec::new(); instances];
    let mut runs = Runs::new(truth);
    let mut numbers = Vec::new();
    while array.read_floats(&mut numbers)? > 0 {
        ctx.check()?;
        let rows: Vec<&[f64]> = numbers.chunks_exact(instances.max(1)).collect();
        let used = rows.len() * instances;

        runs.split(&rows, |at, part| {
            let mut counts = vec![0u64; instances];
            for row in part {
                counts
                    .iter_mut()
                    .zip(*row)
                    .for_each(|(count, inside)| *count += u64::from(*inside != 0.0));
            }
            for (overlaps, points) in shared.iter_mut().zip(counts).filter(|(_, points)| *points > 0) {
                count(overlaps, at, points);
            }
        });
        numbers.drain(..used);
    }
    Ok(shared)
}

/// Reads masks that come one after another.
fn masks_one_by_one(
    mut array: NpyArray<impl Read>,
    truth: &[TrueInstance],
    instances: usize,
    ctx: &Context,
) -> Result<Vec<Overlaps>> {
    let rows: u64 = truth.iter().map(|instance| instance.points).sum();
    let mut shared = vec![Vec::new(); instances];
    let mut masks = shared.iter_mut();
    let mut mask = masks.next();
    let mut runs = Runs::new(truth);
    let mut left = rows;
    let mut numbers = Vec::new();

    while array.read_floats(&mut numbers)? > 0 {
        ctx.check()?;
        let mut rest = &numbers[..];
        while !rest.is_empty() {
            let n = usize::try_from(left).map_or(rest.len(), |left| left.min(rest.len()));
            let (part, later) = rest.split_at(n);
            runs.split(part, |at, part| {
                let points = part.iter().filter(|inside| **inside != 0.0).count() as u64;
                if let Some(overlaps) = mask.as_mut().filter(|_| points > 0) {
                    count(overlaps, at, points);
                }
            });

            rest = later;
            left -= n as u64;
            if left == 0 {
                mask = masks.next();
                runs = Runs::new(truth);
                left = rows;
            }
        }
        numbers.clear();
    }
    Ok(shared)
}
