//! Notes on scores that look like a mistake in the files of the predictions: another unit, another origin, a
//! single class. They say what is seen and what may be the cause, and change no score.

use crate::Table;
use s3d_dataset::s3d_label::Class;

/// A box along the axes: `[xmin, ymin, zmin, xmax, ymax, zmax]`.
type Bbox = [f64; 6];

/// Notes that nothing, or a single class, is predicted. `totals` has how many of `noun` each of S3DIS's
/// classes has, in the truth and predicted.
pub(crate) fn of_classes(noun: &str, totals: &[[u64; 2]]) -> Option<String> {
    let predicted: u64 = totals.iter().map(|[_, predicted]| predicted).sum();
    if predicted == 0 {
        return Some(format!("Doubtful: no {noun} are predicted, in any room."));
    }
    let of_truth = totals.iter().filter(|[truth, _]| *truth > 0).count();
    let mut there = Class::S3DIS
        .iter()
        .zip(totals)
        .filter(|(_, [_, predicted])| *predicted > 0);
    let (Some((class, _)), None) = (there.next(), there.next()) else { return None };
    (of_truth > 1).then(|| {
        format!(
            "Doubtful: all {predicted} predicted {noun} are of the class {}, and the truth has {of_truth} \
             classes: are classes numbered 0 to 12?",
            class.name()
        )
    })
}

/// Notes that boxes are in another unit or from another origin. A room has its true and its detected boxes.
pub(crate) fn of_boxes(rooms: &[(Vec<Bbox>, Vec<Bbox>)]) -> Option<String> {
    let side = |b: &Bbox| (0..3).map(|k| b[k + 3] - b[k]).fold(0.0, f64::max);
    let truth = median(rooms.iter().flat_map(|(truth, _)| truth).map(side).collect())?;
    let found = median(rooms.iter().flat_map(|(_, found)| found).map(side).collect())?;
    let ratio = found / truth;
    if ratio.is_finite() && !(0.01..=100.0).contains(&ratio) {
        return Some(format!(
            "Doubtful: the longest side of a detected box is {found:.4} m and of a true box {truth:.4} m \
             (the medians): boxes are expected in metres."
        ));
    }

    let touch = |a: &Bbox, b: &Bbox| (0..3).all(|k| a[k] <= b[k + 3] && b[k] <= a[k + 3]);
    let met =
        |(truth, found): &(Vec<Bbox>, Vec<Bbox>)| found.iter().any(|b| truth.iter().any(|t| touch(b, t)));
    (!rooms.iter().any(met)).then(|| {
        "Doubtful: no detected box touches a true one, in any room: boxes are expected in the data set's \
         world, in metres, and those in mmdetection3d's files from the least corner of the room's points."
            .to_owned()
    })
}

/// Returns the median of truth ÷ prediction over some pixels of an image. `None` if nothing is predicted.
pub(crate) fn depth_ratio(truth: &[f64], prediction: &[f64]) -> Option<f64> {
    /// Every so many pixels are looked at.
    const STEP: usize = 16;
    let pairs = truth.iter().zip(prediction).step_by(STEP);
    let there = pairs.filter(|(truth, prediction)| **truth > 0.0 && **prediction > 0.0);
    median(there.map(|(truth, prediction)| truth / prediction).collect())
}

/// Notes that distances are in another unit. An image has the median of truth ÷ prediction.
pub(crate) fn of_depth(ratios: Vec<f64>) -> Option<String> {
    let ratio = median(ratios)?;
    let units = [
        (1e-3, "in millimetres"),
        (1.0 / 512.0, "in units of 1/512 m"),
        (1e3, "divided by 1000 once too often"),
        (512.0, "divided by 512 once too often"),
    ];
    let (_, unit) = units.into_iter().find(|(of, _)| (0.8..1.25).contains(&(ratio / of)))?;
    Some(format!(
        "Doubtful: true distances are {ratio:.3e} times the predicted ones (the median): are predictions \
         {unit}? Arrays are expected in metres."
    ))
}

/// Notes that normals point the other way, or are in other axes.
pub(crate) fn of_angles(tables: &[Table]) -> Option<String> {
    let mean = tables
        .iter()
        .filter_map(|table| Some(table.rows.first()?.scores.first()?.value));
    let largest = mean.fold(f64::NAN, f64::max);
    (largest > 90.0).then(|| {
        format!(
            "Doubtful: the mean angle is {largest:.1}°, more than by chance: do predictions point \
             away from the camera, or are they in other axes than the data set's?"
        )
    })
}

/// Returns the middle value, or of two the upper; `None` without values.
fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_and_a_single_class_are_noted() {
        let note = |totals: &[[u64; 2]]| of_classes("points", totals);
        assert!(note(&[[5, 0], [3, 0]]).unwrap().starts_with("Doubtful: no points"));
        let told = note(&[[5, 0], [3, 0], [0, 8]]).unwrap();
        assert!(
            told.contains("all 8 predicted points are of the class wall") && told.contains("has 2"),
            "{told}"
        );
        assert_eq!(note(&[[5, 0], [3, 1], [0, 7]]), None);
        assert_eq!(note(&[[5, 5], [0, 0]]), None);
    }

    #[test]
    fn depth_in_other_units_is_noted() {
        let truth = vec![2.0; 64];
        let of = |scale: f64| depth_ratio(&truth, &vec![2.0 * scale; 64]).into_iter().collect();
        for (scale, words) in [(1000.0, "in millimetres"), (512.0, "1/512 m"), (0.002, "divided by 512")] {
            let told = of_depth(of(scale)).unwrap();
            assert!(told.contains(words), "{told}");
        }
        assert_eq!(of_depth(of(1.0)), None);
        assert_eq!(of_depth(of(4.0)), None);
        assert_eq!(depth_ratio(&truth, &[0.0; 64]), None);
    }

    #[test]
    fn boxes_of_other_units_and_origins_are_noted() {
        let boxed = |scale: f64, offset: f64| {
            (0..5)
                .map(|i| [0.0, 0.0, 0.0, 1.0, 1.0, 2.0].map(|c| scale * (c + f64::from(i)) + offset))
                .collect::<Vec<Bbox>>()
        };
        let note = |found: Vec<Bbox>| of_boxes(&[(boxed(1.0, 0.0), found), (boxed(1.0, 0.0), Vec::new())]);
        assert_eq!(note(boxed(1.0, 3.0)), None);
        assert_eq!(note(Vec::new()), None);
        let far = note(boxed(1.0, 40.0)).unwrap();
        assert!(far.contains("no detected box touches a true one"), "{far}");
        for scale in [1000.0, 0.001] {
            let unit = note(boxed(scale, 0.0)).unwrap();
            assert!(unit.contains("expected in metres") && unit.contains("true box 2.0000 m"), "{unit}");
        }
        // Flat true boxes have no size to compare with.
        let flat = vec![[0.0; 6]];
        assert_eq!(of_boxes(&[(flat.clone(), flat)]), None);
    }
}
