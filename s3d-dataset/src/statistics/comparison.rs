//! The data set's column of the paper's comparison of data sets, in LaTeX.

use super::{AreaStatistics, ImageKinds};
use s3d_io::dataset::Domain;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Writes the table. What the files do not tell is a question mark.
pub(super) fn comparison(text: &mut String, images: &ImageKinds, areas: &[AreaStatistics]) {
    let mark = |is_there: bool| if is_there { "\\checkmark" } else { "$\\times$" }.to_owned();
    let has = |domain: Domain| images.domains.contains(&domain);
    let sum = |of: fn(&AreaStatistics) -> u64| areas.iter().map(of).sum::<u64>();
    let has_labels = areas.iter().any(|area| area.labels.is_some());

    // In the data set's own taxonomy. A class of several areas is one class.
    let tallies = || areas.iter().filter_map(|area| Some(&area.labels.as_ref()?.tally));
    let classes = tallies()
        .flat_map(|tally| &tally.instances_per_class)
        .filter(|(_, n)| **n > 0);
    let classes: BTreeSet<&str> = classes.map(|(name, _)| *name).collect();
    let types = || tallies().flat_map(|tally| &tally.rooms_per_type);
    let rooms = types().map(|(_, of)| of.rooms).sum();
    let types: BTreeSet<&str> = types().filter(|(_, of)| of.rooms > 0).map(|(name, _)| *name).collect();
    let counted = |is_known: bool, n: u64| if is_known { grouped(n) } else { "-".to_owned() };

    let is_semantic = has_labels && images.domains.iter().any(|domain| domain.is_semantic());
    let rows = [
        ("Type of Data", "?".to_owned()),
        ("RGB", counted(has(Domain::Rgb), sum(|area| area.regular_images))),
        ("Depth", mark(has(Domain::Depth))),
        ("Collection Method", "?".to_owned()),
        ("Surf. Normals", mark(has(Domain::Normal))),
        ("2D Semantics", mark(is_semantic)),
        ("Resolution", format!("${0}\\times{0}$", images.size)),
        ("3D Point Cloud (PC)", mark(sum(|area| area.points) > 0)),
        ("3D Mesh/CAD", mark(sum(|area| area.faces) > 0)),
        ("3D Semantic Mesh/CAD", mark(has_labels)),
        ("\\# Object Class", counted(has_labels, classes.len() as u64)),
        ("\\# Scene Categories", counted(has_labels, types.len() as u64)),
        ("\\# Scene Layouts", counted(has_labels, rooms)),
    ];

    text.push_str("\n% What the files do not tell is a question mark.\n\\begin{table}\n\t\\centering\n");
    text.push_str("\t\\caption{Comparison of existing 2.5D and 3D Datasets.}\n\t\\begin{tabular}{c|c}\n");
    text.push_str("\t\t\\textbf{Dataset} & \\textbf{Ours} \\\\\n");
    for (name, cell) in rows {
        // The paper has a rule above what there is in 2D, in 3D, and of classes.
        if ["RGB", "3D Point Cloud (PC)", "\\# Object Class"].contains(&name) {
            text.push_str("\t\t\\hline\n");
        }
        let _ = writeln!(text, "\t\t{name} & {cell} \\\\");
    }
    text.push_str("\t\\end{tabular}\n\t\\label{tab:comparison}\n\\end{table}\n");
}

/// A number with a comma before every three digits.
pub(super) fn grouped(number: u64) -> String {
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
    use crate::statistics::{LabelStatistics, LabelTally, RoomTypeStatistics};
    use s3d_label::{Class, RoomType};

    fn area(area: u32, is_labelled: bool) -> AreaStatistics {
        let mut tally = LabelTally::of_none(&Class::S3DIS, &RoomType::S3DIS);
        tally.instances_per_class.insert("chair", 156);
        tally.instances_per_class.insert("clutter", u64::from(area));
        tally
            .rooms_per_type
            .insert("office", RoomTypeStatistics { rooms: 600, floor_m2: 9.0 });
        let labels = is_labelled.then_some(LabelStatistics { floor_m2: 9.0, tally, as_s3dis: None });
        AreaStatistics { area, points: 7, faces: 0, regular_images: 10_327, panoramas: 190, labels }
    }

    #[test]
    fn the_column_tells_what_is_there() {
        let images = ImageKinds { size: 1080, domains: vec![Domain::Rgb, Domain::Depth, Domain::Semantic] };
        let mut text = String::new();
        comparison(&mut text, &images, &[area(1, true), area(2, true)]);
        for row in [
            "RGB & 20,654 \\\\",
            "Depth & \\checkmark \\\\",
            "Surf. Normals & $\\times$ \\\\",
            "2D Semantics & \\checkmark \\\\",
            "Resolution & $1080\\times1080$ \\\\",
            "3D Point Cloud (PC) & \\checkmark \\\\",
            "3D Mesh/CAD & $\\times$ \\\\",
            "\\# Object Class & 2 \\\\",
            "\\# Scene Categories & 1 \\\\",
            "\\# Scene Layouts & 1,200 \\\\",
        ] {
            assert!(text.contains(row), "{row}\n{text}");
        }

        let mut bare = String::new();
        comparison(&mut bare, &images, &[area(1, false)]);
        for row in ["2D Semantics & $\\times$ \\\\", "\\# Scene Layouts & - \\\\"] {
            assert!(bare.contains(row), "{row}\n{bare}");
        }
    }
}
