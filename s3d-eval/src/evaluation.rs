//! The result of an evaluation.

use crate::bootstrap::intervals;
use crate::{EvalOptions, Protocol};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Scores with the definition that they follow. `s3d eval` writes its serialized form as JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// The protocol, serialized by its name.
    #[serde(serialize_with = "name")]
    pub protocol: Protocol,
    /// The version of its definition.
    pub version: u32,
    /// The variant of the protocol.
    pub variant: &'static str,
    /// The version of this crate.
    pub evaluator: &'static str,
    /// The data set that the predictions were compared with.
    pub truth: Truth,
    /// The options. Variant and areas are told by `variant` and `truth`.
    pub options: EvalOptions,
    /// The definition, in sentences.
    pub definition: Vec<String>,
    /// The number of rooms, images, points … that were counted, by noun.
    pub counted: BTreeMap<&'static str, u64>,
    /// The scores.
    pub tables: Vec<Table>,
    /// The pixels or points of each true class by predicted class, in all areas that were tested; `None` in
    /// protocols that do not compare classes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confusion: Option<ConfusionTable>,
    /// The differences to other predictions, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
    /// Notes on the scores, in sentences.
    pub notes: Vec<String>,
    /// The scores of each room or image by itself.
    pub units: Units,
    /// The scores of all tables in each round of the bootstrap.
    #[serde(skip)]
    pub(crate) rounds: Vec<Vec<f64>>,
}

/// Identifies the data set of an evaluation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Truth {
    /// The checksum of its list of files, as in `manifest.json`. Every file that was compared is as this list
    /// tells.
    pub files_xxh3_128: String,
    /// The areas that were tested, those of a fold together.
    pub areas: Vec<Vec<u32>>,
}

/// The scores of rooms or images, each by itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Units {
    /// The names of the columns.
    pub columns: Vec<String>,
    /// The names of the rows.
    pub rows: Vec<String>,
    /// The rooms or images, in the order of the data set.
    pub units: Vec<UnitScores>,
}

/// The scores of a room or an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnitScores {
    /// The number of its area.
    pub area: u32,
    /// The name of a room (`office_1`), or an image's file name without its domain
    /// (`camera_…_office_1_frame_3`).
    pub name: String,
    /// The scores by row and column. NaN where one is not defined, which is `null` in JSON.
    pub scores: Vec<Vec<f64>>,
}

/// The number of points or pixels of each true class by predicted class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ConfusionTable {
    /// The names of the classes.
    pub classes: Vec<String>,
    /// A row for each true class, with a count for each predicted class. A last count is of points that were
    /// predicted as no class.
    pub counts: Vec<Vec<u64>>,
}

/// The scores of other predictions of the same rooms or images, and the differences.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Against {
    /// The scores of the other predictions.
    pub tables: Vec<Table>,
    /// Each score minus the other predictions' score. Its interval is of the difference: each round of the
    /// bootstrap draws the same rooms or images for both (Efron and Tibshirani 1993, chapter 13).
    pub differences: Vec<Table>,
}

impl Against {
    /// Returns the differences between evaluations of the same units, with the same number of rounds.
    pub(crate) fn new(ours: &Evaluation, theirs: Evaluation) -> Self {
        let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        let rounds: Vec<Vec<f64>> = ours
            .rounds
            .iter()
            .zip(&theirs.rounds)
            .map(|(a, b)| minus(a, b))
            .collect();

        let mut differences = ours.tables.clone();
        let mut intervals = intervals(&rounds).into_iter();
        for (table, other) in differences.iter_mut().zip(&theirs.tables) {
            let scores = table.rows.iter_mut().flat_map(|row| &mut row.scores);
            for (score, other) in scores.zip(other.scores()) {
                *score = Score { value: score.value - other, interval: intervals.next() };
            }
        }
        Self { tables: theirs.tables, differences }
    }
}

/// Scores of classes and of all classes together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// The areas that it is for: `areas 2, 4`.
    pub title: String,
    /// The names of its columns: `IoU`, `accuracy`.
    pub columns: Vec<String>,
    /// Its rows, each as long as `columns`.
    pub rows: Vec<Row>,
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// A class, or `mean`, `overall` …
    pub name: String,
    /// A score for each column.
    pub scores: Vec<Score>,
}

/// A number of a table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// The value, in the unit of the protocol. NaN where it is not defined, which is `null` in JSON.
    pub value: f64,
    /// The 95 % interval of the bootstrap, if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
}

impl From<f64> for Score {
    fn from(value: f64) -> Self {
        Self { value, interval: None }
    }
}

fn name<S: Serializer>(protocol: &Protocol, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(protocol.name())
}

impl Table {
    /// Adds a row of scores without intervals.
    pub(crate) fn push(&mut self, name: impl Into<String>, values: impl IntoIterator<Item = f64>) {
        let scores = values.into_iter().map(Score::from).collect();
        self.rows.push(Row { name: name.into(), scores });
    }

    /// Returns all scores, row by row.
    pub fn scores(&self) -> impl Iterator<Item = f64> {
        self.rows
            .iter()
            .flat_map(|row| row.scores.iter().map(|score| score.value))
    }

    /// Adds the table in Markdown.
    fn write(&self, text: &mut String, title: &str) {
        let _ = write!(text, "\n## {title}\n\n| |");
        self.columns.iter().for_each(|column| {
            let _ = write!(text, " {column} |");
        });
        let _ = writeln!(text, "\n|---|{}", "---:|".repeat(self.columns.len()));
        for row in &self.rows {
            let _ = write!(text, "| {} |", row.name);
            row.scores.iter().for_each(|score| {
                let _ = write!(text, " {} |", shown(score));
            });
            text.push('\n');
        }
    }

    /// Sets the intervals of its scores, row by row.
    pub(crate) fn set_intervals(&mut self, intervals: impl IntoIterator<Item = [f64; 2]>) {
        let scores = self.rows.iter_mut().flat_map(|row| &mut row.scores);
        scores
            .zip(intervals)
            .for_each(|(score, interval)| score.interval = Some(interval));
    }
}

impl Evaluation {
    /// Returns a score by the names of its table, row and column.
    pub fn score(&self, table: &str, row: &str, column: &str) -> Option<f64> {
        let table = self.tables.iter().find(|t| t.title == table)?;
        let at = table.columns.iter().position(|c| c == column)?;
        let row = table.rows.iter().find(|r| r.name == row)?;
        row.scores.get(at).map(|score| score.value)
    }

    /// Writes the definition, the tables and the notes as Markdown.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}, version {}, as {}\n\n", self.protocol, self.version, self.variant);
        for sentence in &self.definition {
            let _ = writeln!(text, "- {sentence}");
        }

        let counted: Vec<String> = self
            .counted
            .iter()
            .map(|(noun, count)| format!("{noun} {count}"))
            .collect();
        let _ = writeln!(text, "\nCounted: {}.", counted.join(", "));

        for table in &self.tables {
            table.write(&mut text, &table.title);
        }
        for table in self.against.iter().flat_map(|against| &against.differences) {
            table.write(&mut text, &format!("{}: minus the scores of the other predictions", table.title));
        }

        for note in &self.notes {
            let _ = writeln!(text, "\n{note}");
        }
        text
    }
}

/// Writes a score with four digits after the point, or a dash where it is not defined.
fn shown(score: &Score) -> String {
    if score.value.is_nan() {
        return "–".to_owned();
    }
    match score.interval {
        None => format!("{:.4}", score.value),
        Some([low, high]) => format!("{:.4} [{low:.4}, {high:.4}]", score.value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BoxSource;

    #[test]
    fn scores_are_shown_and_stored() {
        let mut table =
            Table { title: "all".into(), columns: vec!["IoU".into(), "accuracy".into()], rows: Vec::new() };
        table.push("chair", [0.5, f64::NAN]);
        table.set_intervals([[0.25, 0.75], [f64::NAN; 2]]);
        let evaluation = Evaluation {
            protocol: Protocol::Sem3d,
            version: 1,
            variant: "pointcept",
            evaluator: "0.2.0",
            truth: Truth { files_xxh3_128: String::new(), areas: vec![vec![5]] },
            options: EvalOptions { boxes: Some(BoxSource::Points), ..EvalOptions::default() },
            definition: vec!["Counts are summed over rooms.".into()],
            counted: BTreeMap::from([("rooms", 3), ("points", 40)]),
            tables: vec![table],
            confusion: None,
            against: None,
            notes: Vec::new(),
            units: Units::default(),
            rounds: Vec::new(),
        };

        let text = evaluation.to_markdown();
        assert!(text.contains("| chair | 0.5000 [0.2500, 0.7500] | – |"), "{text}");
        assert!(text.contains("Counted: points 40, rooms 3."), "{text}");

        let json = serde_json::to_value(&evaluation).unwrap();
        assert_eq!((&json["protocol"], &json["options"]["boxes"]), (&"sem3d".into(), &"points".into()));
        assert_eq!(json["tables"][0]["rows"][0]["scores"][0]["interval"][1], 0.75);
        assert!(json["tables"][0]["rows"][0]["scores"][1]["value"].is_null());
        assert_eq!(evaluation.score("all", "chair", "IoU"), Some(0.5));
        assert_eq!(evaluation.score("all", "table", "IoU"), None);
    }
}
