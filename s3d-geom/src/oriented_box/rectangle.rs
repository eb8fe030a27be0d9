//! The smallest rectangle around points of a plane.

use glam::{DVec2, dvec2};

/// A rectangle around points, without its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    /// The unit direction of its first side.
    pub(super) along: DVec2,
    /// The lengths of the side along that direction and of the other.
    pub(super) size: DVec2,
}

impl Default for Rectangle {
    fn default() -> Self {
        Self { along: DVec2::X, size: DVec2::ZERO }
    }
}

impl Rectangle {
    /// Returns the rectangle of the least area; among those without area, the shortest. Returns `None`
    /// without a point.
    ///
    /// One of its sides lies along a side of the convex hull (Freeman and Shapira 1975).
    pub(super) fn smallest(points: Vec<DVec2>) -> Option<Self> {
        let hull = convex_hull(points);
        let first = *hull.first()?;
        let next = hull.iter().skip(1).chain([&first]);

        let rectangles = hull.iter().zip(next).filter_map(|(from, to)| {
            let along = (*to - *from).try_normalize()?;
            let across = along.perp();
            let mut low = DVec2::INFINITY;
            let mut high = DVec2::NEG_INFINITY;
            for corner in &hull {
                let at = dvec2(corner.dot(along), corner.dot(across));
                low = low.min(at);
                high = high.max(at);
            }
            Some(Self { along, size: high - low })
        });
        let smallest = rectangles.min_by(|a, b| a.area().total_cmp(&b.area()));
        // A single point has no side.
        Some(smallest.unwrap_or_default())
    }

    fn area(&self) -> f64 {
        self.size.x * self.size.y
    }
}

/// Returns the corners of the convex hull, counter-clockwise, without points on its sides: Andrew's monotone
/// chain. Points on a line have two corners.
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }

    let mut hull = chain(points.iter().copied());
    hull.extend(chain(points.iter().rev().copied()));
    hull
}

/// Returns one side of the hull, without its last corner.
fn chain(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut side: Vec<DVec2> = Vec::new();
    for point in points {
        while let [.., before, last] = side[..]
            && (last - before).perp_dot(point - before) <= 0.0
        {
            side.pop();
        }
        side.push(point);
    }
    side.pop();
    side
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_hull_of_a_square_has_its_corners_alone() {
        let grid = (0..9).map(|k| dvec2((k % 3) as f64, (k / 3) as f64)).collect();
        let corners = [dvec2(0.0, 0.0), dvec2(2.0, 0.0), dvec2(2.0, 2.0), dvec2(0.0, 2.0)];
        assert_eq!(convex_hull(grid), corners);
    }

    proptest! {
        #[test]
        fn no_other_direction_is_better(
            points in prop::collection::vec((-3f64..3.0, -3f64..3.0), 3..30),
            angle in 0f64..3.2,
        ) {
            let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
            let found = Rectangle::smallest(points.clone()).unwrap();
            let turn = DVec2::from_angle(angle);
            let turned: Vec<DVec2> = points.iter().map(|p| turn.rotate(*p)).collect();
            let low = turned.iter().copied().fold(DVec2::INFINITY, DVec2::min);
            let high = turned.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
            prop_assert!(found.area() <= (high - low).element_product() + 1e-9);
        }
    }
}
