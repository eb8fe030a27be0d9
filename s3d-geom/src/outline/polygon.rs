//! Polygons with holes.

use super::triangulation::{PolygonError, edges, signed_area, triangulate_rings};
use glam::DVec2;

/// A polygon with holes, in a plane. Holes lie within the outer ring and outside of each other; rings may
/// touch in corners. An edge from the last corner to the first closes each ring.
///
/// ```
/// use s3d_geom::{Polygon, PolygonError, glam::{DVec2, dvec2}};
///
/// let square =
///     |min: f64, max: f64| vec![dvec2(min, min), dvec2(max, min), dvec2(max, max), dvec2(min, max)];
/// let ring = Polygon { outer: square(0.0, 3.0), holes: vec![square(1.0, 2.0)] };
/// assert_eq!((ring.area(), ring.triangulate()?.len()), (8.0, 8));
/// assert!(ring.contains(dvec2(0.5, 0.5)) && !ring.contains(dvec2(1.5, 1.5)));
/// assert_eq!(ring.distance(dvec2(4.0, 1.5)), 1.0);
/// # Ok::<(), PolygonError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Polygon {
    /// The outer ring, in either direction.
    pub outer: Vec<DVec2>,
    /// The rings of the holes, in either direction.
    pub holes: Vec<Vec<DVec2>>,
}

impl Polygon {
    /// Returns the area within the outer ring and outside of the holes, in square units.
    pub fn area(&self) -> f64 {
        signed_area(&self.outer).abs() - self.holes.iter().map(|h| signed_area(h).abs()).sum::<f64>()
    }

    /// Returns true if `point` is inside or, as far as `f64` can tell, on the outline.
    pub fn contains(&self, point: DVec2) -> bool {
        let mut inside = false;
        for (a, b) in self.rings().flat_map(edges) {
            let side = (b - a).perp_dot(point - a);
            if side == 0.0 && (point - a).dot(point - b) <= 0.0 {
                return true;
            }
            // A ray to the right crosses an edge with one end above the ray and the other at its height or
            // below.
            if (a.y > point.y) != (b.y > point.y) && (side > 0.0) == (b.y > a.y) {
                inside = !inside;
            }
        }
        inside
    }

    /// Returns the distance of `point` from the polygon: 0 inside, infinite if the polygon has no corners.
    pub fn distance(&self, point: DVec2) -> f64 {
        if self.contains(point) {
            return 0.0;
        }
        self.rings()
            .flat_map(edges)
            .map(|(a, b)| squared_distance_to_edge(point, a, b))
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }

    /// Cuts the polygon into counter-clockwise triangles of its own corners, by a constrained Delaunay
    /// triangulation. Returns three indices per triangle: the corners of the outer ring count first, then the
    /// corners of the holes in order. Of corners at the same place, triangles use the first.
    ///
    /// # Errors
    /// [`PolygonError`] for a ring of fewer than three corners, a corner that is not finite or too far away,
    /// no area, rings that cross themselves or each other, or a hole that is not inside.
    pub fn triangulate(&self) -> Result<Vec<[u32; 3]>, PolygonError> {
        let points: Vec<DVec2> = self.rings().flatten().copied().collect();
        let mut rings = Vec::with_capacity(1 + self.holes.len());
        let mut start = 0;
        for ring in self.rings() {
            rings.push(start..start + ring.len());
            start += ring.len();
        }
        triangulate_rings(&points, &rings, self.area())
    }

    fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        std::iter::once(&self.outer).chain(&self.holes).map(Vec::as_slice)
    }
}

fn squared_distance_to_edge(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let edge = b - a;
    let t = (edge.dot(point - a) / edge.length_squared()).clamp(0.0, 1.0);
    // t is NaN for an edge without length. Its end is the nearest point.
    (point - a - if t.is_nan() { DVec2::ZERO } else { edge * t }).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec2;

    fn square(x: f64, y: f64, side: f64) -> Vec<DVec2> {
        vec![dvec2(x, y), dvec2(x + side, y), dvec2(x + side, y + side), dvec2(x, y + side)]
    }

    #[test]
    fn a_polygon_with_holes() {
        let reversed = square(4.0, 4.0, 2.0).into_iter().rev().collect();
        let p = Polygon { outer: square(0.0, 0.0, 10.0), holes: vec![square(1.0, 1.0, 2.0), reversed] };
        assert_eq!(p.area(), 92.0);
        for (x, y, inside, distance) in [
            (5.0, 1.0, true, 0.0),
            (2.0, 2.5, false, 0.5),
            (5.0, 5.0, false, 1.0),
            (3.0, 3.0, true, 0.0),
            (10.0, 5.0, true, 0.0),
            (13.0, 14.0, false, 5.0),
            (-2.0, 10.0, false, 2.0),
        ] {
            assert_eq!((p.contains(dvec2(x, y)), p.distance(dvec2(x, y))), (inside, distance), "at {x}, {y}");
        }

        let corners: Vec<DVec2> = p.outer.iter().chain(p.holes.iter().flatten()).copied().collect();
        let triangles = p.triangulate().unwrap();
        let mut area = 0.0;
        for t in &triangles {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            assert!((b - a).perp_dot(c - a) > 0.0);
            assert!(p.contains((a + b + c) / 3.0));
            area += (b - a).perp_dot(c - a) / 2.0;
        }
        assert!((area - 92.0).abs() < 1e-9);
        // n + 2h − 2.
        assert_eq!(triangles.len(), 12 + 4 - 2);
    }

    #[test]
    fn holes_that_are_not_inside() {
        let with = |holes| Polygon { outer: square(0.0, 0.0, 4.0), holes }.triangulate();
        assert_eq!(with(vec![square(5.0, 5.0, 1.0)]), Err(PolygonError::Overlap));
        assert_eq!(with(vec![square(1.0, 1.0, 2.0), square(1.5, 1.5, 0.5)]), Err(PolygonError::Overlap));
        assert!(matches!(with(vec![square(3.0, 3.0, 2.0)]), Err(PolygonError::SelfIntersection { .. })));
        assert_eq!(with(vec![square(0.0, 0.0, 4.0)]), Err(PolygonError::ZeroArea));
        assert_eq!(with(vec![vec![]]), Err(PolygonError::TooFewCorners { corners: 0 }));
        let outer = vec![dvec2(0.0, 0.0), dvec2(1e100, 0.0), dvec2(0.0, 1.0)];
        let far = Polygon { outer, holes: vec![] }.triangulate();
        assert_eq!(far, Err(PolygonError::OutOfRange { corner: 1 }));
    }

    #[test]
    fn no_polygon() {
        let none = Polygon::default();
        assert_eq!((none.area(), none.contains(DVec2::ZERO)), (0.0, false));
        assert_eq!(none.distance(DVec2::ZERO), f64::INFINITY);
        let dot = Polygon { outer: vec![DVec2::ONE; 3], holes: vec![] };
        assert_eq!(dot.distance(dvec2(1.0, 3.0)), 2.0);
    }
}
