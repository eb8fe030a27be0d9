//! Panoptic quality of points: a room is one image of [`PanopticCounts`](crate::panoptic::PanopticCounts).

use crate::panoptic::{PanopticCounts, Segment, SegmentFault};
use std::collections::{BTreeMap, HashMap};

/// The segment of each point, 0 for none, and the segments.
type Partition = (Vec<u32>, Vec<Segment>);

/// Counts the segments of a room, by class.
///
/// Both sides have the class (from 0, negative for none) and the instance (negative for none) of each point.
/// Points of a class in `stuff` are one segment, whatever their instance. All other points of an instance are
/// a segment, which has the class of most of them; the lowest class wins a tie. A point is in no segment if
/// it has no class, or neither a class of stuff nor an instance.
///
/// # Errors
/// [`SegmentFault::Size`] if the sides are of different numbers of points.
pub fn panoptic_counts(
    truth: impl IntoIterator<Item = (i64, i64)>,
    predicted: impl IntoIterator<Item = (i64, i64)>,
    stuff: &[usize],
    classes: usize,
) -> Result<PanopticCounts, SegmentFault> {
    let (truth, segments) = partition(truth, stuff, classes);
    let (predicted, found) = partition(predicted, stuff, classes);
    let mut counts = PanopticCounts::new(classes);
    counts.add(&truth, &segments, &predicted, &found)?;
    Ok(counts)
}

/// What makes points a segment.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Key {
    Stuff(usize),
    Instance(i64),
}

fn partition(points: impl IntoIterator<Item = (i64, i64)>, stuff: &[usize], classes: usize) -> Partition {
    let mut numbers: HashMap<Key, usize> = HashMap::new();
    // The points of each class, segment by segment.
    let mut segments: Vec<BTreeMap<usize, u64>> = Vec::new();
    let mut of_point = |(class, instance): (i64, i64)| {
        let class = usize::try_from(class).ok().filter(|class| *class < classes)?;
        let key = match stuff.contains(&class) {
            true => Key::Stuff(class),
            false if instance >= 0 => Key::Instance(instance),
            false => return None,
        };
        let number = *numbers.entry(key).or_insert_with(|| {
            segments.push(BTreeMap::new());
            segments.len()
        });
        *segments.get_mut(number - 1)?.entry(class).or_default() += 1;
        u32::try_from(number).ok()
    };
    let of_points = points.into_iter().map(|point| of_point(point).unwrap_or(0)).collect();

    let segments = (1..).zip(segments).filter_map(|(id, classes)| {
        let most = classes.values().max().copied();
        let class = classes.iter().find(|(_, points)| Some(**points) == most)?;
        Some(Segment { id, class: *class.0 })
    });
    (of_points, segments.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stuff_is_one_segment_and_an_instance_has_the_class_of_most_of_its_points() {
        let points = [(0, 7), (0, -1), (2, 7), (3, 7), (3, -1), (-1, 7), (9, 7), (2, 8)];
        let (of_points, segments) = partition(points, &[0, 1], 4);
        assert_eq!(of_points, [1, 1, 2, 2, 0, 0, 0, 3]);
        let expected = [(1, 0), (2, 2), (3, 2)].map(|(id, class)| Segment { id, class });
        assert_eq!(segments, expected);

        let fault = panoptic_counts([(0, 0)], [], &[], 4).unwrap_err();
        assert_eq!(fault, SegmentFault::Size { truth: 1, predicted: 0 });
        let counts = panoptic_counts([(2, 0), (2, 0), (0, 1)], [(2, 5), (2, 5), (2, -1)], &[0], 4).unwrap();
        assert_eq!((counts.classes()[2].matched, counts.classes()[0].missed), (1, 1));
        assert_eq!(counts.classes()[2].invented, 0);
    }
}
