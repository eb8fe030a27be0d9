//! Makes tables of scores over rooms or images: one for each fold, one for all, and the mean over folds.

use crate::task::Task;
use crate::{Table, bootstrap};

/// The rows of a table: a name and its scores each.
pub(crate) type Rows = Vec<(String, Vec<f64>)>;

/// Makes the tables of units (rooms, images). `units` has the fold of each. `score` returns the rows of any
/// set of units, always with the same names. Scores have intervals if the options ask for a bootstrap.
pub(crate) fn tables<T: Sync>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[(usize, T)],
    score: impl Fn(&[&T]) -> Rows + Sync,
) -> Vec<Table> {
    let all: Vec<&(usize, T)> = units.iter().collect();
    let mut tables = of_units(task, columns, &all, &score);

    if let Some(rounds) = task.options.bootstrap {
        let intervals = bootstrap(units, rounds, task.options.seed, |drawn| {
            of_units(task, columns, drawn, &score)
                .iter()
                .flat_map(Table::scores)
                .collect()
        });
        let mut intervals = intervals.into_iter();
        for table in &mut tables {
            let count = table.scores().count();
            table.set_intervals(intervals.by_ref().take(count));
        }
    }
    tables
}

fn of_units<T>(
    task: &Task<'_>,
    columns: &[&str],
    units: &[&(usize, T)],
    score: impl Fn(&[&T]) -> Rows,
) -> Vec<Table> {
    let table = |title: &str, rows: Rows| {
        let columns = columns.iter().map(|&column| column.to_owned()).collect();
        let mut table = Table { title: title.to_owned(), columns, rows: Vec::new() };
        rows.into_iter().for_each(|(name, values)| table.push(name, values));
        table
    };

    let pooled = score(&units.iter().map(|(_, unit)| unit).collect::<Vec<_>>());
    if let [fold] = task.folds {
        return vec![table(&fold.name, pooled)];
    }

    let folds: Vec<Rows> = (0..task.folds.len())
        .map(|fold| {
            let units: Vec<&T> = units.iter().filter(|(f, _)| *f == fold).map(|(_, unit)| unit).collect();
            let mut rows = score(&units);
            // A fold without drawn units has no scores.
            if units.is_empty() {
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
