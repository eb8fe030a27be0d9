//! Intersection over union of boxes.

use super::Rule;

/// The least width and depth of a box in the overlap on the ground plane, in metres, and the least divisor of
/// the IoU, in cubic metres. Source: mmdetection3d at fe25f7a, `BaseInstance3DBoxes.overlaps`.
const LEAST: (f64, f64) = (1e-4, 1e-8);

/// Returns the intersection over union of two boxes along the axes, `[xmin, ymin, zmin, xmax, ymax, zmax]`.
///
/// The IoU of flat boxes is as odd as in the program that the rule follows:
///
/// - By [`Rule::Mmdetection3d`], widths in x and y of less than 0.1 mm count as 0.1 mm in the shared volume,
///   but not in the volume of each box. The divisor is at least 1e-8 m³. The IoU may therefore be more than
///   1. Boxes without height share nothing.
/// - By [`Rule::Open3dMl`], the IoU of two boxes with heights but no volume is NaN.
pub fn iou(a: &[f64; 6], b: &[f64; 6], rule: Rule) -> f64 {
    let height = (a[5].min(b[5]) - a[2].max(b[2])).max(0.0);
    let (least, least_divisor) = match rule {
        Rule::Mmdetection3d => LEAST,
        Rule::Open3dMl => (0.0, f64::NEG_INFINITY),
    };
    if rule == Rule::Open3dMl && height == 0.0 {
        return 0.0;
    }
    let shared = shared(a, b, 0, least) * shared(a, b, 1, least) * height;
    shared / (volume(a) + volume(b) - shared).max(least_divisor)
}

fn volume(v: &[f64; 6]) -> f64 {
    (v[3] - v[0]) * (v[4] - v[1]) * (v[5] - v[2])
}

/// Returns the length that two boxes share along an axis. Boxes shorter than `least` are grown about their
/// middle.
fn shared(a: &[f64; 6], b: &[f64; 6], axis: usize, least: f64) -> f64 {
    let [a_low, a_high] = ends(a, axis, least);
    let [b_low, b_high] = ends(b, axis, least);
    (a_high.min(b_high) - a_low.max(b_low)).max(0.0)
}

fn ends(v: &[f64; 6], axis: usize, least: f64) -> [f64; 2] {
    let [low, high] = [v[axis], v[axis + 3]];
    let missing = (least - (high - low)).max(0.0) / 2.0;
    [low - missing, high + missing]
}

#[cfg(test)]
mod tests {
    use super::*;
    use Rule::{Mmdetection3d as Mm, Open3dMl as O3d};

    #[test]
    fn boxes_with_volume() {
        let a = [0.0, 0.0, 0.0, 2.0, 1.0, 1.0];
        for rule in [Mm, O3d] {
            assert_eq!(iou(&a, &a, rule), 1.0);
            assert_eq!(iou(&a, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], rule), 0.5);
            assert_eq!(iou(&a, &[1.0, 0.5, 0.5, 3.0, 1.5, 1.5], rule), 0.25 / 3.75);
            // Two that touch, and two that are apart along one axis only.
            assert_eq!(iou(&a, &[2.0, 0.0, 0.0, 3.0, 1.0, 1.0], rule), 0.0);
            assert_eq!(iou(&a, &[0.0, 0.0, 5.0, 2.0, 1.0, 6.0], rule), 0.0);
        }
    }

    #[test]
    fn flat_boxes() {
        let wall = [1.0, 0.0, 0.0, 1.0, 2.0, 3.0];
        // 1e-4 · 2 · 3 m³ are shared, and neither has a volume, so that the divisor is 1e-8 m³.
        assert!((iou(&wall, &wall, Mm) - 6e4).abs() < 1e-6);
        assert!(iou(&wall, &wall, O3d).is_nan());
        let floor = [0.0, 0.0, 1.0, 2.0, 2.0, 1.0];
        assert_eq!((iou(&floor, &floor, Mm), iou(&floor, &floor, O3d)), (0.0, 0.0));
    }
}
