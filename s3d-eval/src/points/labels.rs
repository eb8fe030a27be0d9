//! Reads the predicted classes of the points of a room, piece by piece.

use super::CLASSES;
use super::find::wrong;
use super::matching::TrueInstance;
use super::truth::{Points, Room, rows_expected};
use s3d_dataset::{Context, Result, s3d_io};
use s3d_io::cloud::{NpyArray, NpzArchive};
use std::io::Read;
use std::path::Path;

/// The names that the array of classes may have.
pub(super) const SEMANTIC: [&str; 2] = ["semantic", "pts_semantic_mask"];

/// The predicted classes of points: 0 to 12, or -1 for none.
pub(super) struct Labels<R> {
    array: NpyArray<R>,
    /// How many numbers a point has: one is a class, more are the scores of classes.
    columns: usize,
    /// The least valid class: 0, or -1 if it stands for none.
    least: i64,
    /// The classes of the current piece.
    labels: Vec<i64>,
    /// Scores that were read and not used yet.
    scores: Vec<f64>,
    /// The number of points before the current piece.
    done: u64,
}

impl<R: Read> Labels<R> {
    /// Opens the array of a room, and returns the true instances of its points as well. The array holds
    /// classes as whole numbers, N or N × 1, or the scores of classes, N × 13. The class with the largest
    /// score counts; the first wins a tie.
    pub(super) fn new(
        array: NpyArray<R>,
        room: &Room,
        points: &Points,
        least: i64,
    ) -> Result<(Self, Vec<TrueInstance>)> {
        let refused = || {
            let shape = array.shape();
            let expected = rows_expected(room, points);
            let message = format!("has the shape {shape:?}, where N or N × {CLASSES} is due: {expected}");
            wrong(array.name(), message)
        };
        let (rows, columns) = match *array.shape() {
            [rows] | [rows, 1] => (rows, 1),
            [rows, columns] if columns == CLASSES as u64 => (rows, CLASSES),
            _ => return Err(refused()),
        };

        let instances = points.of_rows(rows).ok_or_else(refused)?;
        if columns > 1 && array.is_column_major() {
            let message = "is stored column by column: save numpy.ascontiguousarray(array)";
            return Err(wrong(array.name(), message));
        }
        Ok((Self { array, columns, least, labels: Vec::new(), scores: Vec::new(), done: 0 }, instances))
    }

    /// Returns the classes of the next points; none at the end.
    pub(super) fn next(&mut self) -> Result<&[i64]> {
        self.labels.clear();

        if self.columns == 1 {
            self.array.read_integers(&mut self.labels)?;
            let valid = self.least..CLASSES as i64;
            if let Some(at) = self.labels.iter().position(|label| !valid.contains(label)) {
                let label = self.labels.get(at).copied().unwrap_or_default();
                let none = if self.least < 0 { ", or -1 for none" } else { "" };
                let point = self.done + at as u64;
                let message =
                    format!("{label} at point {point} is no class: 0 to 12 are, as in `s3d profile`{none}");
                return Err(wrong(self.array.name(), message));
            }
        } else {
            while self.scores.len() < self.columns && self.array.read_floats(&mut self.scores)? > 0 {}
            let rows = self.scores.chunks_exact(self.columns);
            let rest = rows.remainder().len();
            for row in rows {
                let Some(class) = largest(row) else {
                    let point = self.done + self.labels.len() as u64;
                    return Err(wrong(self.array.name(), format!("NaN at point {point}")));
                };
                self.labels.push(class);
            }
            self.scores.drain(..self.scores.len() - rest);
        }

        self.done += self.labels.len() as u64;
        Ok(&self.labels)
    }
}

/// Returns the index of the largest number; the first wins a tie. `None` if one is NaN.
fn largest(row: &[f64]) -> Option<i64> {
    let mut at = 0;
    let mut most = f64::NEG_INFINITY;
    let mut has_nan = false;
    for (i, value) in (0..).zip(row) {
        has_nan |= value.is_nan();
        if *value > most {
            at = i;
            most = *value;
        }
    }
    (!has_nan).then_some(at)
}

/// Calls `each` with a true instance and the predicted classes of some of its points, for all points of a
/// room.
pub(super) fn for_each_run(
    path: &Path,
    room: &Room,
    points: &Points,
    ctx: &Context,
    each: impl FnMut(&TrueInstance, &[i64]),
) -> Result<()> {
    if path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("npz"))
    {
        let mut archive = NpzArchive::open(path)?;
        let name = match archive.names() {
            [only] => only.clone(),
            names => named(path, names, &SEMANTIC)?,
        };
        walk(Labels::new(archive.array(&name)?, room, points, -1)?, ctx, each)
    } else {
        walk(Labels::new(NpyArray::open(path)?, room, points, -1)?, ctx, each)
    }
}

fn walk(
    (mut labels, instances): (Labels<impl Read>, Vec<TrueInstance>),
    ctx: &Context,
    mut each: impl FnMut(&TrueInstance, &[i64]),
) -> Result<()> {
    let mut runs = Runs::new(&instances);
    loop {
        ctx.check()?;
        let labels = labels.next()?;
        if labels.is_empty() {
            return Ok(());
        }
        runs.split(labels, |at, part| {
            if let Some(instance) = instances.get(at) {
                each(instance, part);
            }
        });
    }
}

/// Assigns points to their instances. The points come in their order, some at a time.
pub(super) struct Runs<'a> {
    instances: &'a [TrueInstance],
    /// The instance of the next point.
    at: usize,
    /// How many points of this instance came before.
    used: u64,
}

impl<'a> Runs<'a> {
    pub(super) fn new(instances: &'a [TrueInstance]) -> Self {
        Self { instances, at: 0, used: 0 }
    }

    /// Calls `each` with the index of an instance and the next points of it, until all `points` are handed
    /// on.
    pub(super) fn split<T>(&mut self, mut points: &[T], mut each: impl FnMut(usize, &[T])) {
        while let Some(instance) = self.instances.get(self.at).filter(|_| !points.is_empty()) {
            let left = instance.points.saturating_sub(self.used);
            let n = usize::try_from(left).map_or(points.len(), |left| left.min(points.len()));
            let (part, rest) = points.split_at(n);
            if !part.is_empty() {
                each(self.at, part);
            }
            points = rest;
            self.used += n as u64;
            if self.used >= instance.points {
                self.at += 1;
                self.used = 0;
            }
        }
    }
}

/// Returns the one of the wanted names that an archive has.
pub(super) fn named(path: &Path, names: &[String], wanted: &[&str]) -> Result<String> {
    maybe_named(path, names, wanted)?.ok_or_else(|| {
        let message = format!("has no array {}: it has {}", wanted.join(" or "), names.join(", "));
        wrong(path, message)
    })
}

/// Returns the one of the wanted names that an archive has, or `None`.
pub(super) fn maybe_named(path: &Path, names: &[String], wanted: &[&str]) -> Result<Option<String>> {
    let mut found = names.iter().filter(|name| wanted.contains(&&***name));
    let name = found.next();
    match (name, found.next()) {
        (Some(one), Some(other)) => {
            Err(wrong(path, format!("has both {one} and {other}: leave one of them")))
        }
        _ => Ok(name.cloned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_wins_a_tie() {
        assert_eq!(largest(&[0.1, 0.7, 0.7]), Some(1));
        assert_eq!(largest(&[f64::NEG_INFINITY; 2]), Some(0));
        assert_eq!(largest(&[0.1, f64::NAN]), None);
    }

    #[test]
    fn points_belong_to_one_instance_after_another() {
        let instances = [2, 0, 3, 1].map(|points| TrueInstance { class: 0, points });
        let mut runs = Runs::new(&instances);
        let mut seen = Vec::new();
        for piece in [&[1, 2, 3][..], &[4], &[5, 6]] {
            runs.split(piece, |at, part| seen.push((at, part.to_vec())));
        }
        assert_eq!(seen, [(0, vec![1, 2]), (2, vec![3]), (2, vec![4]), (2, vec![5]), (3, vec![6])]);
    }
}
