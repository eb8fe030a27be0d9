//! The tables of statistics in LaTeX, in the layout of the paper.

use super::{AreaStatistics, LabelTally, Statistics};
use s3d_label::{Class, RoomType};
use std::fmt::Write as _;

/// The modalities that the paper counts: its total of images is four for each regular and panoramic image.
const MODALITIES: u64 = 4;

/// Classes of structural elements, in the order of the paper; then movable ones. It leaves clutter out.
const ELEMENTS: [Class; 12] = [
    Class::CEILING,
    Class::FLOOR,
    Class::WALL,
    Class::BEAM,
    Class::COLUMN,
    Class::WINDOW,
    Class::DOOR,
    Class::CHAIR,
    Class::TABLE,
    Class::BOOKCASE,
    Class::SOFA,
    Class::BOARD,
];
/// How many of them are structural.
const STRUCTURAL: usize = 7;

/// A table with a row for each area and one for the total.
struct Table<'a> {
    caption: &'a str,
    label: &'a str,
    /// How columns are set, with the rules between them.
    columns: String,
    /// Rows of the head.
    head: Vec<String>,
    /// The columns of an area.
    cells: &'a dyn Fn(&AreaStatistics) -> Vec<u64>,
}

impl Statistics {
    /// Returns the tables in LaTeX, in the layout of the paper: points and faces, images, instances of the
    /// classes, and rooms of each type, with a row for each area. They need the package `multirow`. Classes
    /// and types are S3DIS's: those of another taxonomy count as what they are there. Clutter is left out, as
    /// in the paper. Without labels there are the first two tables.
    pub fn to_latex(&self) -> String {
        let mut text = String::from("% \\usepackage{multirow}\n");
        self.latex_table(
            &mut text,
            &Table {
                caption: "Statistics of 3D Data",
                label: "tab:3DmodalStats",
                columns: "c|cc".into(),
                head: vec!["Area & Number of 3D Points & Number of Mesh Faces".into()],
                cells: &|area| vec![area.points, area.faces],
            },
        );
        self.latex_table(
            &mut text,
            &Table {
                caption: "Statistics of Images (\\textbf{I}: Regular, \\textbf{E}: Equirectangular Images)",
                label: "tab:2DmodalStats",
                columns: "c|cc|c".into(),
                head: vec![
                    "\\multirow{2}{*}{Area} & \
                 \\multicolumn{2}{c|}{\\textbf{\\# of Images per 2/2.5D Modality}} & \
                 \\multirow{2}{*}{\\textbf{Total}}"
                        .into(),
                    "& Image Type \\textbf{I} & Image Type \\textbf{E} &".into(),
                ],
                cells: &|area| {
                    let total = MODALITIES * (area.regular_images + area.panoramas);
                    vec![area.regular_images, area.panoramas, total]
                },
            },
        );
        if self.areas.iter().all(|area| area.labels.is_none()) {
            return text;
        }

        let movable = ELEMENTS.len() - STRUCTURAL;
        let names: Vec<&str> = ELEMENTS.iter().map(|class| class.name()).collect();
        self.latex_table(
            &mut text,
            &Table {
                caption: "Object Class Statistics",
                label: "tab:objectStats",
                columns: format!("c|{}|{}|c", "c".repeat(STRUCTURAL), "c".repeat(movable)),
                head: vec![
                    format!(
                        "\\multirow{{2}}{{*}}{{\\textbf{{Area}}}} & \
                     \\multicolumn{{{STRUCTURAL}}}{{c|}}{{\\textbf{{Structural Elements}}}} & \
                     \\multicolumn{{{movable}}}{{c|}}{{\\textbf{{Movable Elements}}}} & \
                     \\multirow{{2}}{{*}}{{\\textbf{{Total}}}}"
                    ),
                    format!("& {} &", names.join(" & ")),
                ],
                cells: &|area| {
                    let of_class =
                        |class: &Class| tally(area).map_or(0, |t| t.instances_per_class[class.name()]);
                    with_total(ELEMENTS.iter().map(of_class).collect())
                },
            },
        );

        let types: Vec<&str> = RoomType::S3DIS.iter().map(|of| words_of(of.name())).collect();
        self.latex_table(
            &mut text,
            &Table {
                caption: "Disjoint Space Statistics",
                label: "tab:sceneClassStats",
                columns: format!("c|{}|c", "c".repeat(types.len())),
                head: vec![format!("\\textbf{{Area}} & {} & \\textbf{{Total}}", types.join(" & "))],
                cells: &|area| {
                    let of_type =
                        |of: &RoomType| tally(area).map_or(0, |t| t.rooms_per_type[of.name()].rooms);
                    with_total(RoomType::S3DIS.iter().map(of_type).collect())
                },
            },
        );
        text
    }

    fn latex_table(&self, text: &mut String, table: &Table<'_>) {
        let Table { caption, label, columns, head, cells } = table;
        let _ = writeln!(text, "\n\\begin{{table*}}\n\t\\centering\n\t\\caption{{{caption}}}");
        let _ = writeln!(text, "\t\\begin{{tabular}}{{{columns}}}");
        head.iter().for_each(|row| text.push_str(&format!("\t\t{row} \\\\\n")));
        text.push_str("\t\t\\hline\n");

        let mut totals: Vec<u64> = Vec::new();
        for area in &self.areas {
            let cells = cells(area);
            totals.resize(cells.len(), 0);
            totals.iter_mut().zip(&cells).for_each(|(total, cell)| *total += cell);
            let cells: Vec<String> = cells.into_iter().map(grouped).collect();
            let _ = writeln!(text, "\t\t{} & {} \\\\", area.area, cells.join(" & "));
        }
        let totals: Vec<String> = totals
            .into_iter()
            .map(|n| format!("\\textbf{{{}}}", grouped(n)))
            .collect();
        let _ = writeln!(text, "\t\t\\hline\n\t\t\\textbf{{Total}} & {} \\\\", totals.join(" & "));
        let _ = writeln!(text, "\t\\end{{tabular}}\n\t\\label{{{label}}}\n\\end{{table*}}");
    }
}

/// The counts in S3DIS's classes and types.
fn tally(area: &AreaStatistics) -> Option<&LabelTally> {
    let labels = area.labels.as_ref()?;
    Some(labels.as_s3dis.as_ref().unwrap_or(&labels.tally))
}

fn with_total(mut cells: Vec<u64>) -> Vec<u64> {
    cells.push(cells.iter().sum());
    cells
}

/// The name of a room type as text says it.
fn words_of(name: &str) -> &str {
    match name {
        "conferenceRoom" => "conference room",
        "copyRoom" => "copy room",
        "openspace" => "open space",
        name => name,
    }
}

/// A number with a comma before every three digits.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::{LabelStatistics, RoomTypeStatistics};
    use s3d_label::Taxonomy;

    fn area(area: u32, chairs: u64, is_labelled: bool) -> AreaStatistics {
        let mut tally = LabelTally::of_none(&Class::S3DIS, &RoomType::S3DIS);
        tally.instances_per_class.insert("chair", chairs);
        tally.instances_per_class.insert("clutter", 999);
        tally
            .rooms_per_type
            .insert("copyRoom", RoomTypeStatistics { rooms: 2, floor_m2: 9.0 });
        let labels = is_labelled.then_some(LabelStatistics { floor_m2: 9.0, tally, as_s3dis: None });
        AreaStatistics {
            area,
            points: 43_956_907,
            faces: 158_500,
            regular_images: 10_327,
            panoramas: 190,
            labels,
        }
    }

    #[test]
    fn rows_are_those_of_the_paper() {
        let areas = vec![area(1, 156, true), area(2, 1_000, true)];
        let text = Statistics { areas, taxonomy: Taxonomy::default() }.to_latex();
        for row in [
            "1 & 43,956,907 & 158,500 \\\\",
            "\\textbf{Total} & \\textbf{87,913,814} & \\textbf{317,000} \\\\",
            "1 & 10,327 & 190 & 42,068 \\\\",
            "& ceiling & floor & wall & beam & column & window & door & chair & table &",
            "& bookcase & sofa & board & \\\\",
            "2 & 0 & 0 & 0 & 0 & 0 & 0 & 0 & 1,000 & 0 & 0 & 0 & 0 & 1,000 \\\\",
            "copy room",
        ] {
            assert!(text.contains(row), "{row}\n{text}");
        }
        assert_eq!(text.matches("\\begin{tabular}").count(), 4);
        assert!(!text.contains("999"));

        let bare = Statistics { areas: vec![area(1, 0, false)], taxonomy: Taxonomy::default() }.to_latex();
        assert_eq!(bare.matches("\\begin{tabular}").count(), 2);
    }
}
