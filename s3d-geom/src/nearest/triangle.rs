//! The point of a triangle nearest to a given point. Triangles that share an edge or a corner agree on it.

use glam::{DVec3, Vec3, Vec3A};

/// Triangles thinner than this, relative to their longest edge, have no reliable normal. They are measured by
/// their edges; the error is below the rounding of `f32` coordinates.
const THINNEST: f64 = 1e-8;

/// A triangle with its corners in ascending order of (x, y, z).
///
/// The same positions give the same arithmetic, whatever the winding and the first corner of a face. An edge
/// runs in the same direction in all its triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SortedTriangle([Vec3A; 3]);

impl SortedTriangle {
    /// Sorts finite corners.
    pub(crate) fn new(corners: [Vec3; 3]) -> Self {
        // Adding 0 turns −0 into 0, so that equal positions have equal bits.
        let mut corners = corners.map(|p| p + Vec3::ZERO);
        corners
            .sort_unstable_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)));
        Self(corners.map(Vec3A::from))
    }

    /// Makes a triangle from the corners that [`SortedTriangle::corners`] returned.
    #[inline(always)]
    pub(crate) fn from_sorted(corners: [Vec3A; 3]) -> Self {
        Self(corners)
    }

    /// Returns the corners in ascending order.
    pub(crate) fn corners(&self) -> [Vec3A; 3] {
        self.0
    }

    /// Returns the length of the longest edge, and the squared length of the normal, which is twice the area.
    pub(crate) fn longest_and_normal_squared(&self) -> (f64, f64) {
        let [a, b, c] = self.0.map(|p| p.as_dvec3());
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (longest, (b - a).cross(c - a).length_squared())
    }

    /// Returns the squared distance to `point`, and the nearest point of the triangle. The distance is never
    /// below the distance to the bounding box.
    pub(crate) fn closest(&self, point: DVec3) -> (f64, DVec3) {
        let [a, b, c] = self.0.map(|p| p.as_dvec3());
        let ab = b - a;
        let ac = c - a;
        let bc = c - b;
        let normal = ab.cross(ac);
        let normal_squared = normal.length_squared();
        let longest = ab.length_squared().max(ac.length_squared()).max(bc.length_squared());
        let thin = normal_squared <= THINNEST * THINNEST * longest * longest;

        // The barycentric coordinates of the foot of the perpendicular on the plane, times the square of the
        // normal. The signs tell on which side of each edge the foot is. (C. Ericson, "Real-Time Collision
        // Detection", 5.1.5, has the derivation.)
        let ap = point - a;
        let bp = point - b;
        let cp = point - c;
        let ab_a = ab.dot(ap);
        let ac_a = ac.dot(ap);
        let ab_b = ab.dot(bp);
        let ac_b = ac.dot(bp);
        let ab_c = ab.dot(cp);
        let ac_c = ac.dot(cp);
        let weight_a = difference_of_products(ab_b, ac_c, ab_c, ac_b);
        let weight_b = difference_of_products(ab_c, ac_a, ab_a, ac_c);
        let weight_c = difference_of_products(ab_a, ac_b, ab_b, ac_a);

        if !thin && weight_a > 0.0 && weight_b > 0.0 && weight_c > 0.0 {
            let height = normal.dot(ap);
            let low = a.min(b).min(c);
            let high = a.max(b).max(c);
            let distance_squared = (height * height / normal_squared).max(to_box(point, low, high));
            let foot = (a * weight_a + b * weight_b + c * weight_c) / (weight_a + weight_b + weight_c);
            return (distance_squared, foot);
        }

        // Outside, the nearest point is on an edge that has the foot on its outer side.
        let mut best = (f64::INFINITY, point);
        for (weight, from, to) in [(weight_c, a, b), (weight_b, a, c), (weight_a, b, c)] {
            if thin || weight <= 0.0 {
                let candidate = closest_on_edge(point, from, to);
                if candidate.0 < best.0 {
                    best = candidate;
                }
            }
        }
        best
    }
}

/// Returns the squared distance from `point` to an edge, and the nearest point. The ends of the edge are in
/// ascending order.
fn closest_on_edge(point: DVec3, from: DVec3, to: DVec3) -> (f64, DVec3) {
    let edge = to - from;
    let along = edge.dot(point - from);
    // At an end, the distance to the corner is the same for every edge that ends there.
    if along <= 0.0 {
        return ((point - from).length_squared(), from);
    }
    let length_squared = edge.length_squared();
    if along >= length_squared {
        return ((point - to).length_squared(), to);
    }
    let t = along / length_squared;
    let aside = (point - from) - edge * t;
    (aside.length_squared().max(to_box(point, from.min(to), from.max(to))), from + edge * t)
}

/// Returns the squared distance from `point` to a box.
pub(crate) fn to_box(point: DVec3, low: DVec3, high: DVec3) -> f64 {
    (low - point).max(point - high).max(DVec3::ZERO).length_squared()
}

/// Returns a·b − c·d with the right sign. It is zero if and only if the products are equal.
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let ab = a * b;
    let cd = c * d;
    let difference = ab - cd;
    if difference.abs() > 1e-15 * (ab.abs() + cd.abs()) {
        difference
    } else {
        difference + (rounding_of_product(a, b, ab) - rounding_of_product(c, d, cd))
    }
}

/// Returns a·b − `product` exactly, where `product` is the rounded a·b (Dekker's product).
fn rounding_of_product(a: f64, b: f64, product: f64) -> f64 {
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    ((ah * bh - product) + ah * bl + al * bh) + al * bl
}

/// Splits a number into two halves of its digits (Veltkamp's split).
fn split(x: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{dvec3, vec3};
    use proptest::prelude::*;

    #[test]
    fn the_rounding_of_a_product_is_exact() {
        let a = 1.0 + f64::EPSILON;
        let b = 1.0 - f64::EPSILON;
        // (1 + ε)(1 − ε) = 1 − ε².
        assert_eq!(rounding_of_product(a, b, a * b), -f64::EPSILON * f64::EPSILON);
        assert_eq!(difference_of_products(a, b, 1.0, 1.0), -f64::EPSILON * f64::EPSILON);
        assert_eq!(difference_of_products(3.0, 0.1, 0.1, 3.0), 0.0);
    }

    #[test]
    fn every_region_of_a_triangle() {
        let t = SortedTriangle::new([Vec3::ZERO, vec3(4.0, 0.0, 0.0), vec3(0.0, 4.0, 0.0)]);
        for (point, distance_squared, nearest) in [
            (dvec3(1.0, 1.0, 3.0), 9.0, dvec3(1.0, 1.0, 0.0)),
            (dvec3(1.0, 1.0, 0.0), 0.0, dvec3(1.0, 1.0, 0.0)),
            (dvec3(-1.0, -2.0, 2.0), 9.0, dvec3(0.0, 0.0, 0.0)),
            (dvec3(6.0, -1.0, 0.0), 5.0, dvec3(4.0, 0.0, 0.0)),
            (dvec3(0.0, 5.0, 1.0), 2.0, dvec3(0.0, 4.0, 0.0)),
            (dvec3(1.0, -3.0, 4.0), 25.0, dvec3(1.0, 0.0, 0.0)),
            (dvec3(-3.0, 2.0, 4.0), 25.0, dvec3(0.0, 2.0, 0.0)),
            (dvec3(4.0, 4.0, 0.0), 8.0, dvec3(2.0, 2.0, 0.0)),
        ] {
            assert_eq!(t.closest(point), (distance_squared, nearest));
        }
    }

    /// Returns the smallest distance to a fine grid of points on the triangle, a close upper bound.
    fn by_grid([a, b, c]: [Vec3; 3], point: DVec3) -> f64 {
        let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
        let n = 60;
        let points = (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j)));
        points
            .map(|(i, j)| {
                (a + ((b - a) * f64::from(i) + (c - a) * f64::from(j)) / f64::from(n)).distance(point)
            })
            .fold(f64::INFINITY, f64::min)
    }

    fn corner() -> impl Strategy<Value = Vec3> {
        (-4.0..4.0f32, -4.0..4.0f32, -4.0..4.0f32).prop_map(|(x, y, z)| vec3(x, y, z))
    }

    fn away_from(p: DVec3, ad: DVec3, bd: DVec3) -> DVec3 {
        (p - ad).reject_from(bd - ad).normalize()
    }

    proptest! {
        #[test]
        fn nothing_on_the_triangle_is_nearer(corners in [corner(), corner(), corner()], point in corner()) {
            let point = point.as_dvec3();
            let (d2, q) = SortedTriangle::new(corners).closest(point);
            let grid = by_grid(corners, point);
            prop_assert!(d2.sqrt() <= grid + 1e-9 && d2.sqrt() > grid - 0.3, "{} or {}", d2.sqrt(), grid);
            prop_assert!((point.distance(q) - d2.sqrt()).abs() < 1e-7);
        }

        #[test]
        fn the_order_of_corners_does_not_matter(
            [a, b, c] in [corner(), corner(), corner()],
            point in corner(),
        ) {
            let point = point.as_dvec3();
            let d2 = SortedTriangle::new([a, b, c]).closest(point);
            for turned in [[b, c, a], [c, a, b], [c, b, a]] {
                prop_assert_eq!(SortedTriangle::new(turned).closest(point), d2);
            }
        }

        #[test]
        fn triangles_agree_on_a_shared_edge(
            [a, b, c, d] in [corner(), corner(), corner(), corner()],
            t in 0.0..1.0f64,
        ) {
            // The point is opposite to the inner bisector of the two triangles, so the edge or one of its
            // ends is nearest in both.
            let [ad, bd, cd, dd] = [a, b, c, d].map(|p| p.as_dvec3());
            prop_assume!(away_from(cd, ad, bd).is_finite() && away_from(dd, ad, bd).is_finite());
            let away = away_from(cd, ad, bd) + away_from(dd, ad, bd);
            let point = (ad + (bd - ad) * t - away).as_vec3().as_dvec3();
            let on = SortedTriangle::new([a, b, c]).closest(point);
            let edge = SortedTriangle::new([b, a, d]).closest(point);
            prop_assume!(away_from(cd, ad, bd).dot(away_from(dd, ad, bd)) > -0.99);
            prop_assert_eq!(on, edge);
        }
    }
}
