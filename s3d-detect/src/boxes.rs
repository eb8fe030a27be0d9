//! Boxes along the axes.

use s3d_geom::Aabb;

/// Returns the intersection over union of two boxes, 0 if both are flat.
///
/// mmdetection3d defines it so in `axis_aligned_bbox_overlaps_3d`, but with a floor of 1e-6 m³ for the
/// union.
pub fn iou(a: &Aabb, b: &Aabb) -> f64 {
    let shared = Aabb { min: a.min.max(b.min), max: a.max.min(b.max) };
    let shared = if shared.is_empty() { 0.0 } else { volume(&shared) };
    let union = volume(a) + volume(b) - shared;
    if union > 0.0 { shared / union } else { 0.0 }
}

fn volume(b: &Aabb) -> f64 {
    b.size().as_dvec3().element_product()
}

/// Returns the intersection over union of two intervals on one axis, 1 if both are the same point.
pub(crate) fn iou_1d(a: [f32; 2], b: [f32; 2]) -> f32 {
    let shared = (a[1].min(b[1]) - a[0].max(b[0])).max(0.0);
    let union = (a[1] - a[0]) + (b[1] - b[0]) - shared;
    if union > 0.0 {
        shared / union
    } else {
        f32::from(u8::from(a == b))
    }
}

/// Greedy non-maximum suppression: returns the indices of the boxes that stay, the highest score first. The
/// lower index wins a tie. A box goes if its IoU with a box that stays is larger than `limit`.
pub fn suppress(boxes: &[Aabb], scores: &[f64], limit: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
    let mut stay: Vec<usize> = Vec::new();
    for i in order {
        if stay.iter().all(|&s| iou(&boxes[s], &boxes[i]) <= limit) {
            stay.push(i);
        }
    }
    stay
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};

    fn cube(x: f32) -> Aabb {
        Aabb { min: vec3(x, 0.0, 0.0), max: vec3(x + 1.0, 1.0, 1.0) }
    }

    #[test]
    fn overlap_of_shifted_cubes() {
        assert_eq!(iou(&cube(0.0), &cube(0.0)), 1.0);
        assert!((iou(&cube(0.0), &cube(0.5)) - 1.0 / 3.0).abs() < 1e-9);
        assert_eq!(iou(&cube(0.0), &cube(1.0)), 0.0);
        let flat = Aabb { min: Vec3::ZERO, max: vec3(1.0, 1.0, 0.0) };
        assert_eq!((iou(&flat, &flat), iou(&flat, &cube(0.0))), (0.0, 0.0));
        assert_eq!(iou_1d([0.0, 2.0], [1.0, 3.0]), 1.0 / 3.0);
        assert_eq!((iou_1d([1.0, 1.0], [1.0, 1.0]), iou_1d([1.0, 1.0], [2.0, 2.0])), (1.0, 0.0));
    }

    #[test]
    fn the_highest_of_overlapping_boxes_stays() {
        let boxes = [cube(0.0), cube(0.1), cube(0.2), cube(5.0)];
        assert_eq!(suppress(&boxes, &[1.0, 3.0, 3.0, 2.0], 0.5), [1, 3]);
        assert_eq!(suppress(&boxes, &[1.0, 3.0, 3.0, 2.0], 0.9), [1, 2, 3, 0]);
    }
}
