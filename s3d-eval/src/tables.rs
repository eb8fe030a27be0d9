//! Makes tables of scores over rooms or images: one for each fold, one for all, and the mean over folds.

use crate::bootstrap::{draw, intervals};
use crate::evaluation::{Table, UnitScores, Units};
use crate::task::Task;

/// The rows of a table: a name and its scores each.
pub(crate) type Rows = Vec<(String, Vec<f64>)>;

/// A room or an image, and what was counted in it.
pub(crate) struct Unit<T> {
    /// The index of its fold.
    pub(crate) fold: usize,
    pub(crate) area: u32,
    /// Its name in the area.
    pub(crate) name: String,
    pub(crate) counted: T,
}

/// The scores of an evaluation.
pub(crate) struct Scores {
    pub(crate) tables: Vec<Table>,
    pub(crate) units: Units,
    /// The scores of all tables in each round of the bootstrap, if one was asked for.
    pub(crate) rounds: Vec<Vec<f64>>,
}

impl Scores {
    /// Adds other tables of the same units.
    pub(crate) fn extend(&mut self, others: Self) {
        self.tables.extend(others.tables);
        for (round, other) in self.rounds.iter_mut().zip(others.rounds) {
            round.extend(other);
        }
    }
}

/// Makes the tables of units. `score` returns the rows of any set of units, always with the same names.
/// Scores have intervals if the options ask for a bootstrap.
pub(crate) fn tables<T: Sync>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[Unit<T>],
    score: impl Fn(&[&T]) -> Rows + Sync,
) -> Scores {
    Scores { units: each(columns, units, &score), ..only_tables(task, columns, units, &score) }
}

/// Makes the tables of units, without the scores of each unit.
pub(crate) fn only_tables<T: Sync>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[Unit<T>],
    score: impl Fn(&[&T]) -> Rows + Sync,
) -> Scores {
    let all: Vec<&Unit<T>> = units.iter().collect();
    let mut tables = of_units(task, columns, &all, &score);

    let rounds = draw(units, task.rounds(), task.options.seed, |drawn| {
        of_units(task, columns, drawn, &score)
            .iter()
            .flat_map(Table::scores)
            .collect()
    });
    let mut intervals = intervals(&rounds).into_iter();
    for table in &mut tables {
        let count = table.scores().count();
        table.set_intervals(intervals.by_ref().take(count));
    }
    Scores { tables, units: Units::default(), rounds }
}

/// Returns the scores of each unit by itself.
fn each<T>(columns: &[&str], units: &[Unit<T>], score: impl Fn(&[&T]) -> Rows) -> Units {
    let mut rows = Vec::new();
    let units = units.iter().map(|unit| {
        let of_unit = score(&[&unit.counted]);
        if rows.is_empty() {
            rows = of_unit.iter().map(|(name, _)| name.clone()).collect();
        }
        let scores = of_unit.into_iter().map(|(_, values)| values).collect();
        UnitScores { area: unit.area, name: unit.name.clone(), scores }
    });
    let units = units.collect();
    Units { columns: columns.iter().map(|&column| column.to_owned()).collect(), rows, units }
}

fn of_units<T>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[&Unit<T>],
    score: impl Fn(&[&T]) -> Rows,
) -> Vec<Table> {
    let table = |title: &str, rows: Rows| {
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        let mut table = Table { title: title.to_owned(), columns, rows: Vec::new() };
        rows.into_iter().for_each(|(name, values)| table.push(name, values));
        table
    };

    let pooled = score(&units.iter().map(|unit| &unit.counted).collect::<Vec<_>>());
    if let [fold] = task.folds {
        return vec![table(&fold.name, pooled)];
    }

    let folds: Vec<Rows> = (0..task.folds.len())
        .map(|fold| {
            let of_fold = units.iter().filter(|unit| unit.fold == fold);
            let of_fold: Vec<&T> = of_fold.map(|unit| &unit.counted).collect();
            let mut rows = score(&of_fold);
            // A fold without drawn units has no scores.
            if of_fold.is_empty() {
                rows.iter_mut().for_each(|(_, values)| values.fill(f64::NAN));
            }
            rows
        })
        .collect();
    let mean = |row: usize, column: usize| {
        mean_of_defined(folds.iter().filter_map(|rows| rows.get(row)?.1.get(column).copied()))
    };
    let means = pooled.iter().enumerate().map(|(row, (name, values))| {
        (name.clone(), (0..values.len()).map(|column| mean(row, column)).collect())
    });
    let means = table("mean over folds", means.collect());
    let of_folds = task.folds.iter().zip(folds).map(|(fold, rows)| table(&fold.name, rows));
    of_folds.chain([table("all folds, pooled", pooled), means]).collect()
}

/// Returns the mean of the values that are not NaN; NaN if there are none.
pub(crate) fn mean_of_defined(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .filter(|value| !value.is_nan())
        .fold((0.0, 0u32), |(sum, n), value| (sum + value, n + 1));
    sum / f64::from(count)
}
