//! The tables of statistics in LaTeX, in the layout of the paper.

use super::comparison::{comparison, grouped};
use super::{AreaStatistics, LabelTally, Statistics};
use s3d_label::Class;
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

/// Types of rooms in the order of the paper, and as text says them.
const TYPES: [[&str; 2]; 11] = [
    ["office", "Office"],
    ["conferenceRoom", "Conference Room"],
    ["auditorium", "Auditorium"],
    ["lobby", "Lobby"],
    ["lounge", "Lounge"],
    ["hallway", "Hallway"],
    ["copyRoom", "Copy Room"],
    ["pantry", "Pantry"],
    ["openspace", "Open Space"],
    ["storage", "Storage"],
    ["WC", "WC"],
];

/// A table with a row for each area and one for the total.
struct Table<'a> {
    caption: &'a str,
    label: &'a str,
    /// The share of the page's width that a wide table is set in; `None`: as wide as it comes.
    width: Option<f64>,
    /// How columns are set, with the rules between them.
    columns: String,
    /// Rows of the head.
    head: Vec<String>,
    /// How 0 is set.
    zero: &'a str,
    /// Whether the last column is bold.
    is_total_bold: bool,
    /// The columns of an area.
    cells: &'a dyn Fn(&AreaStatistics) -> Vec<u64>,
}

impl Statistics {
    /// Returns the tables in LaTeX, in the layout of the paper: this data set's column of the comparison of
    /// data sets; then, with a row for each area, points and faces, images, instances of the classes, and
    /// rooms of each type. They need the packages `amssymb`,
    /// `graphicx` and `multirow`.
    ///
    /// Classes and types are S3DIS's: those of another taxonomy count as what they are there, but in the
    /// comparison, which has the data set's own. Instances of clutter are left out, as in the paper. Without
    /// labels the tables of instances and rooms are left out. The comparison is left out of statistics that
    /// were counted without the data set's options.
    pub fn to_latex(&self) -> String {
        let mut text = String::from("% \\usepackage{amssymb,graphicx,multirow}\n");
        if let Some(images) = &self.images {
            comparison(&mut text, images, &self.areas);
        }
        self.latex_table(
            &mut text,
            &Table {
                caption: "Statistics of 3D Data",
                label: "tab:3DmodalStats",
                width: None,
                columns: "c|cc".into(),
                head: vec!["Area & Number of 3D Points & Number of Mesh Faces".into()],
                zero: "0",
                is_total_bold: false,
                cells: &|area| vec![area.points, area.faces],
            },
        );
        self.latex_table(
            &mut text,
            &Table {
                caption: "Statistics of Images (\\textbf{I}: Regular, \\textbf{E}: Equirectangular Images)",
                label: "tab:2DmodalStats",
                width: None,
                columns: "c|cc|c".into(),
                head: vec![
                    "\\multirow{2}{*}{Area} & \
                 \\multicolumn{2}{c|}{\\textbf{\\# of Images per 2/2.5D Modality}} & \
                 \\multirow{2}{*}{\\textbf{Total}}"
                        .into(),
                    "& Image Type \\textbf{I} & Image Type \\textbf{E} &".into(),
                ],
                zero: "0",
                is_total_bold: false,
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
                width: Some(0.85),
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
                zero: "0",
                is_total_bold: true,
                cells: &|area| {
                    let of_class =
                        |class: &Class| tally(area).map_or(0, |t| t.instances_per_class[class.name()]);
                    with_total(ELEMENTS.iter().map(of_class).collect())
                },
            },
        );

        let types = TYPES.map(|[_, words]| words);
        self.latex_table(
            &mut text,
            &Table {
                caption: "Scene and Space Statistics",
                label: "tab:sceneClassStats",
                width: Some(0.9),
                columns: format!("c|c|{}|c", "c".repeat(types.len())),
                head: vec![
                    format!(
                        "\\multirow{{2}}{{*}}{{\\textbf{{Area}}}} & \\textbf{{Sq.}} & \
                     \\multicolumn{{{}}}{{c|}}{{\\textbf{{Number of Instances Per Scene Category}}}} & \
                     \\multirow{{2}}{{*}}{{\\textbf{{Total}}}}",
                        types.len()
                    ),
                    format!("& \\textbf{{meters}} & {} &", types.join(" & ")),
                ],
                zero: "-",
                is_total_bold: true,
                cells: &|area| {
                    let of_type =
                        |[name, _]: &[&str; 2]| tally(area).map_or(0, |t| t.rooms_per_type[name].rooms);
                    let floor_m2 = area.labels.as_ref().map_or(0.0, |labels| labels.floor_m2);
                    let mut cells = with_total(TYPES.iter().map(of_type).collect());
                    cells.insert(0, floor_m2.round() as u64);
                    cells
                },
            },
        );
        text
    }

    fn latex_table(&self, text: &mut String, table: &Table<'_>) {
        let Table { caption, label, width, columns, head, zero, is_total_bold, cells } = table;
        let _ = writeln!(text, "\n\\begin{{table*}}\n\t\\centering\n\t\\caption{{{caption}}}");
        let [fit, fitted] = width.map_or_else(Default::default, |share| {
            [format!("\\resizebox{{{share}\\textwidth}}{{!}}{{%\n\t"), "}".to_owned()]
        });
        let _ = writeln!(text, "\t{fit}\\begin{{tabular}}{{{columns}}}");
        head.iter().for_each(|row| text.push_str(&format!("\t\t{row} \\\\\n")));
        text.push_str("\t\t\\hline\n");

        let mut totals: Vec<u64> = Vec::new();
        for area in &self.areas {
            let cells = cells(area);
            totals.resize(cells.len(), 0);
            totals.iter_mut().zip(&cells).for_each(|(total, cell)| *total += cell);
            let set = |n: u64| if n == 0 { (*zero).to_owned() } else { grouped(n) };
            let mut cells: Vec<String> = cells.into_iter().map(set).collect();
            if let Some(total) = cells.last_mut().filter(|_| *is_total_bold) {
                *total = format!("\\textbf{{{total}}}");
            }
            let _ = writeln!(text, "\t\t{} & {} \\\\", area.area, cells.join(" & "));
        }
        let totals: Vec<String> = totals
            .into_iter()
            .map(|n| format!("\\textbf{{{}}}", grouped(n)))
            .collect();
        let _ = writeln!(text, "\t\t\\hline\n\t\t\\textbf{{Total}} & {} \\\\", totals.join(" & "));
        let _ = writeln!(text, "\t\\end{{tabular}}{fitted}\n\t\\label{{{label}}}\n\\end{{table*}}");
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::{LabelStatistics, RoomTypeStatistics};
    use s3d_label::{RoomType, Taxonomy};

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
        let text = Statistics { areas, taxonomy: Taxonomy::default(), images: None }.to_latex();
        for row in [
            "1 & 43,956,907 & 158,500 \\\\",
            "\\textbf{Total} & \\textbf{87,913,814} & \\textbf{317,000} \\\\",
            "1 & 10,327 & 190 & 42,068 \\\\",
            "& ceiling & floor & wall & beam & column & window & door & chair & table &",
            "& bookcase & sofa & board & \\\\",
            "2 & 0 & 0 & 0 & 0 & 0 & 0 & 0 & 1,000 & 0 & 0 & 0 & 0 & \\textbf{1,000} \\\\",
            "& Lounge & Hallway & Copy Room & Pantry &",
            "1 & 9 & - & - & - & - & - & - & 2 & - & - & - & - & \\textbf{2} \\\\",
            "\\textbf{Total} & \\textbf{18} & \\textbf{0} &",
        ] {
            assert!(text.contains(row), "{row}\n{text}");
        }
        assert_eq!(text.matches("\\begin{tabular}").count(), 4);
        assert!(!text.contains("999"));

        let bare = Statistics { areas: vec![area(1, 0, false)], taxonomy: Taxonomy::default(), images: None };
        let bare = bare.to_latex();
        assert_eq!(bare.matches("\\begin{tabular}").count(), 2);
    }
}
