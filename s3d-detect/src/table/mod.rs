//! The table of average precision, in the form of the paper.

pub mod cross_validation;
pub mod precision;

use crate::area::{CLASSES, STRUCTURAL};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// A row of one fold.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The name of the row.
    pub name: String,
    /// Its average precisions.
    pub ap: Precisions,
}

impl Row {
    /// Returns the mean over all classes that exist, at IoU .5, in per cent.
    pub fn overall(&self) -> Option<f64> {
        mean(self.ap[0].iter().flatten().map(|ap| 100.0 * ap))
    }
}

/// Average precision by threshold (IoU .5, then .25), then by class: 0 to 1. `None` for a class that the
/// areas do not have.
pub type Precisions = [Vec<Option<f64>>; 2];

/// The rows of all folds, for one seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// The seed.
    pub seed: u64,
    /// For each area the adjusted Rand index of its spaces.
    pub agreement: Vec<(u32, f64)>,
    /// For each row its name, and the precisions of each fold.
    pub rows: Vec<(String, Vec<Precisions>)>,
}

impl Table {
    /// Makes a table without rows.
    pub fn new(seed: u64) -> Self {
        Self { seed, agreement: Vec::new(), rows: Vec::new() }
    }

    /// Adds the rows of a fold.
    pub fn rows_of_fold(&mut self, rows: Vec<Row>) {
        for Row { name, ap } in rows {
            match self.rows.iter_mut().find(|(n, _)| *n == name) {
                Some((_, folds)) => folds.push(ap),
                None => self.rows.push((name, vec![ap])),
            }
        }
    }

    /// Returns the numbers of a row at a threshold (0 is IoU .5, 1 is .25), in per cent: for each class the
    /// mean over the folds that have it, then the means over structural, movable and all classes. `None` if
    /// there is no such row.
    pub fn numbers(&self, name: &str, threshold: usize) -> Option<Vec<Option<f64>>> {
        let (_, folds) = self.rows.iter().find(|(n, _)| n == name)?;
        let classes: Vec<Option<f64>> = (0..CLASSES.len())
            .map(|class| mean(folds.iter().filter_map(|f| f[threshold].get(class).copied().flatten())))
            .map(|ap| ap.map(|ap| 100.0 * ap))
            .collect();
        let (structural, movable) = classes.split_at(STRUCTURAL);
        let means = [structural, movable, &classes].map(|of| mean(of.iter().flatten().copied()));
        Some(classes.iter().copied().chain(means).collect())
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
    if n == 0 { None } else { Some(sum / f64::from(n)) }
}

/// Returns the mean and the standard deviation (n − 1) of numbers. The deviation of one number is 0.
fn spread(values: &[f64]) -> Option<[f64; 2]> {
    let mean = mean(values.iter().copied())?;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    Some([mean, (squares / (values.len().max(2) - 1) as f64).sqrt()])
}

/// The note below every table.
pub const NOTE: &str = "AP on generated areas tests the implementation and is not comparable with the \
                        published 49.93, for which the six licensed areas are needed.";

/// Writes tables of several seeds as JSON, with [`NOTE`]: the precisions of each fold, by row, threshold and
/// class.
pub fn json(tables: &[Table]) -> String {
    let classes = CLASSES.map(|c| c.name());
    format!("{:#}\n", serde_json::json!({ "classes": classes, "note": NOTE, "tables": tables }))
}

/// Writes tables of several seeds as Markdown: the columns of the paper, with means over seeds. The last
/// three means have ± the standard deviation between seeds.
pub fn markdown(tables: &[Table]) -> String {
    let mut out = String::new();
    for (threshold, name) in [".5", ".25"].into_iter().enumerate() {
        let _ = writeln!(out, "Average precision in % at IoU > {name}; {} seed(s)\n", tables.len());
        let classes = CLASSES.map(|c| c.name());
        let columns =
            [&classes[..STRUCTURAL], &["**mean**"], &classes[STRUCTURAL..], &["**mean**", "**overall**"]];
        let _ = writeln!(out, "| | {} |", columns.concat().join(" | "));
        let _ = writeln!(out, "|---|{}", "--:|".repeat(CLASSES.len() + 3));

        for (name, _) in tables.first().map_or(&[][..], |t| &t.rows[..]) {
            let cells = cells_of_row(tables, name, threshold);
            let _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
        }
        out.push('\n');
    }

    for (area, ari) in tables.first().map_or(&[][..], |t| &t.agreement) {
        let _ = writeln!(out, "Spaces of area {area}: adjusted Rand index {ari:.3}");
    }
    let _ = writeln!(out, "\n*{NOTE}*");
    out
}

/// Writes the table at IoU > .5 of several seeds as LaTeX, in the layout of the paper: the largest number of
/// each column is bold. It needs the package `graphicx`.
pub fn latex(tables: &[Table]) -> String {
    let rows: Vec<(&str, Vec<String>)> = tables
        .first()
        .map_or(&[][..], |t| &t.rows[..])
        .iter()
        .map(|(name, _)| (name.as_str(), cells_of_row(tables, name, 0)))
        .collect();
    let number = |cell: &str| cell.split(' ').next().and_then(|mean| mean.parse::<f64>().ok());
    let largest = |column: usize| {
        let numbers = rows.iter().filter_map(|(_, cells)| number(&cells[column]));
        numbers.fold(f64::NEG_INFINITY, f64::max)
    };

    let classes = CLASSES.map(|c| c.name());
    let (structural, movable) = (STRUCTURAL + 1, CLASSES.len() - STRUCTURAL + 1);
    let columns = [&classes[..STRUCTURAL], &["mean"], &classes[STRUCTURAL..], &["mean", "mean"]].concat();
    let mut out = String::from("% \\usepackage{graphicx}\n\\begin{table*}\n\t\\centering\n");
    let elements =
        |count: usize, of: &str| format!("\\multicolumn{{{count}}}{{|c|}}{{\\textbf{{{of} Elements}}}}");
    let _ = writeln!(
        out,
        "\t\\caption{{\\textbf{{Baseline 3D Object Detection Results}}. Class specific average precision \
         (AP) using different features.}}\n\t\\resizebox{{\\textwidth}}{{!}}{{%\n\t\
         \\begin{{tabular}}{{r|{}|{}|c}}",
        "c".repeat(structural),
        "c".repeat(movable)
    );
    let heads = [elements(structural, "Structural"), elements(movable, "Movable")];
    let _ = writeln!(out, "\t\t& {} & \\textbf{{overall}} \\\\", heads.join(" & "));
    let _ = writeln!(out, "\t\t& {} \\\\", columns.join(" & "));
    for (name, cells) in &rows {
        let cell = |(column, cell): (usize, &String)| {
            let text = cell.replace('±', "$\\pm$").replace('–', "--");
            match number(cell) {
                Some(mean) if mean == largest(column) => format!("\\textbf{{{text}}}"),
                _ => text,
            }
        };
        let cells: Vec<String> = cells.iter().enumerate().map(cell).collect();
        let _ = writeln!(out, "\t\t{name} & {} \\\\", cells.join(" & "));
    }
    let _ =
        writeln!(out, "\t\\end{{tabular}}}}\n\t\\label{{tab:CVPR16quantitative}}\n\\end{{table*}}\n% {NOTE}");
    out
}

/// Returns the cells of a row at a threshold, in the order of the columns.
fn cells_of_row(tables: &[Table], name: &str, threshold: usize) -> Vec<String> {
    let of_seeds: Vec<_> = tables.iter().filter_map(|t| t.numbers(name, threshold)).collect();

    // The mean over structural classes stands behind them, the other two means at the end.
    let n = CLASSES.len();
    let columns = (0..STRUCTURAL).chain(n..n + 1).chain(STRUCTURAL..n).chain(n + 1..n + 3);
    columns
        .map(|column| {
            let values: Vec<f64> = of_seeds.iter().filter_map(|n| n[column]).collect();
            match spread(&values) {
                Some([mean, deviation]) if column >= CLASSES.len() && tables.len() > 1 => {
                    format!("{mean:.2} ± {deviation:.2}")
                }
                Some([mean, _]) => format!("{mean:.2}"),
                None => "–".to_owned(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(first: Option<f64>, last: Option<f64>) -> Row {
        let mut ap = vec![Some(0.5); CLASSES.len()];
        (ap[0], ap[11]) = (first, last);
        Row { name: "Full model".to_owned(), ap: [ap.clone(), ap] }
    }

    #[test]
    fn means_leave_out_classes_that_do_not_exist() {
        let mut table = Table::new(1);
        table.rows_of_fold(vec![row(Some(0.2), None)]);
        table.rows_of_fold(vec![row(Some(0.4), None)]);
        let numbers = table.numbers("Full model", 0).unwrap();
        assert!((numbers[0].unwrap() - 30.0).abs() < 1e-9);
        assert_eq!(numbers[11], None);
        let near = |i: usize, expected: f64| (numbers[i].unwrap() - expected).abs() < 1e-9;
        assert!(
            near(12, (30.0 + 6.0 * 50.0) / 7.0) && near(13, 50.0) && near(14, (30.0 + 10.0 * 50.0) / 11.0)
        );
        assert_eq!(table.numbers("No global", 0), None);
    }

    fn table_of(ap: f64) -> Table {
        let mut table = Table::new(0);
        let ap = vec![Some(ap); CLASSES.len()];
        table.rows_of_fold(vec![Row { name: "No color".to_owned(), ap: [ap.clone(), ap] }]);
        table
    }

    #[test]
    fn several_seeds_have_a_spread() {
        let text = markdown(&[table_of(0.1), table_of(0.3)]);
        assert!(
            text.contains("| **mean** | table |")
                && text.contains("| bookcase | board | **mean** | **overall** |")
        );
        assert!(
            text.contains("| No color | 20.00 |") && text.contains("| 20.00 ± 14.14 | 20.00 ± 14.14 |\n")
        );
        assert!(text.contains(NOTE));
    }

    #[test]
    fn latex_has_the_layout_of_the_paper() {
        let mut better = table_of(0.1);
        better.rows_of_fold(vec![]);
        let mut row = row(Some(0.05), None);
        row.name = "Full model".to_owned();
        better.rows_of_fold(vec![row]);
        let text = latex(&[better]);
        assert!(text.contains("& ceiling & floor & wall & beam & column & window & door & mean & table &"));
        assert!(text.contains("\\multicolumn{8}{|c|}") && text.contains("\\multicolumn{6}{|c|}"));
        // The better of two is bold, and what does not exist is a dash.
        assert!(text.contains("No color & \\textbf{10.00} & 10.00"), "{text}");
        assert!(text.contains("Full model & 5.00 & \\textbf{50.00}") && text.contains("& -- &"), "{text}");
        let spread = latex(&[table_of(0.1), table_of(0.3)]);
        assert!(spread.contains("\\textbf{20.00 $\\pm$ 14.14} \\\\\n"), "{spread}");
    }
}
