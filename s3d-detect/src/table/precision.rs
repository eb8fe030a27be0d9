//! Average precision of boxes.

use s3d_eval::boxes::{Detection, GroundTruth, Rule};
use s3d_geom::Aabb;
use s3d_label::Class;
use std::collections::BTreeMap;

/// A box with a score, in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// The scene: an area and a room. Boxes of different scenes never meet.
    pub scene: (u32, u32),
    /// The box.
    pub bbox: Aabb,
    /// The higher the surer.
    pub score: f64,
}

/// Returns the average precision of one class by the rule of mmdetection3d, which is the default of `s3d eval
/// det`: 0 to 1. `None` if there are no boxes to find.
pub fn average_precision(detections: &[Scored], truth: &[((u32, u32), Aabb)], threshold: f64) -> Option<f64> {
    let mut rooms = BTreeMap::new();
    let mut room = |scene| {
        let next = rooms.len() as u32;
        *rooms.entry(scene).or_insert(next)
    };

    // Any class will do, since truth and detections have the same.
    let class = Class::CHAIR;
    let truth: Vec<GroundTruth> = truth
        .iter()
        .map(|(scene, bbox)| GroundTruth { room: room(*scene), class, bbox: corners(bbox) })
        .collect();
    let detections: Vec<Detection> = detections
        .iter()
        .map(|d| Detection { room: room(d.scene), class, score: d.score, bbox: corners(&d.bbox) })
        .collect();

    let rule = Rule::Mmdetection3d;
    let scores = s3d_eval::boxes::average_precision(&truth, &detections, &[class], threshold, rule);
    scores.first().map(|score| score.ap).filter(|ap| !ap.is_nan())
}

fn corners(b: &Aabb) -> [f64; 6] {
    [b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z].map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn cube(x: f32) -> Aabb {
        Aabb { min: vec3(x, 0.0, 0.0), max: vec3(x + 1.0, 1.0, 1.0) }
    }

    fn scored(room: u32, x: f32, score: f64) -> Scored {
        Scored { scene: (1, room), bbox: cube(x), score }
    }

    #[test]
    fn hand_made_curves() {
        let truth = [(1, 0.0), (1, 5.0), (2, 0.0), (2, 9.0)].map(|(room, x)| ((1, room), cube(x)));
        // True, false (found before), false (another scene), true: precision 1 at recall ¼, ½ at ½.
        let found = [scored(1, 0.0, 4.0), scored(1, 0.1, 3.0), scored(3, 0.0, 2.0), scored(2, 9.2, 1.0)];
        assert_eq!(average_precision(&found, &truth, 0.5), Some(0.25 + 0.25 * 0.5));
        assert_eq!(average_precision(&[], &truth, 0.5), Some(0.0));
        assert_eq!(average_precision(&found, &[], 0.5), None);
        // An overlap of exactly the threshold is too small.
        assert_eq!(average_precision(&[scored(1, 0.0, 1.0)], &truth[..1], 1.0), Some(0.0));
    }
}
