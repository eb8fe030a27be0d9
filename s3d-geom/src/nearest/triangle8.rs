//! Lower bounds of the distances of eight triangles at once, so that few exact distances are needed.
//!
//! **The bound.** Take the point as the origin, and let a, b and c be the corners of a triangle T. For every
//! direction q, all of T lies at least min(q·a, q·b, q·c)/|q| along q, so T is no nearer than that. If q
//! is the nearest point of T, the bound is the distance itself. A good q is found region by region in plain
//! `f32` arithmetic. The bound holds for any q, so only the rounding of the bound itself counts:
//! - Corners relative to the point are rounded by 2⁻²⁴ of their length, dot products of three terms by
//!   3·2⁻²⁴ |q||v|. With R ≥ |v| for all corners v, this changes the distance by less than 3e-7 R.
//!   The code subtracts 1e-6 R.
//! - The reference is not the distance but [`SortedTriangle::closest`], in `f64`. It may take a foot of the
//!   perpendicular outside of a thin triangle for one inside. Its weights are the areas of three small
//!   triangles times the area of the triangle. They are off by at most 32·2⁻⁵³ L²R², where L is the
//!   longest edge, and their sum n² is small for a thin triangle. An error of η in barycentric coordinates
//!   moves the foot by up to 4 η L, so the reference may be below the distance by 128·2⁻⁵³ L³R²/n².
//!   The code subtracts that too: `thinness` is 2⁻⁴⁵ L³/n².
//! - Other roundings of the reference are below 1e-7 R. (Triangles thinner than 1e-8 are measured by their
//!   edges: see [`SortedTriangle`].)
//!
//! If numbers are so large or small that they overflow or lose digits, the bound is 0.

use super::triangle::SortedTriangle;
use crate::wide::{max, min};
use glam::Vec3A;

/// Edges shorter than this give no bound, because their squares have few digits left.
const SMALLEST: f64 = 1e-12;

/// Up to eight triangles, lane by lane.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Triangles8 {
    /// The corners a, b and c, each as x, y and z. The last triangle fills the unused lanes.
    corners: [[[f32; 8]; 3]; 3],
    /// Twice the longest edge.
    reach: [f32; 8],
    /// 2⁻⁴⁵ L³/n²: see the module.
    thinness: [f32; 8],
    faces: [u32; 8],
    count: u32,
}

/// Lower and upper bounds of the squared distances, each rounded by up to 1e-6 of itself.
pub(crate) struct Bounds {
    pub(crate) least: [f32; 8],
    /// Infinite if nothing is known.
    pub(crate) most: [f32; 8],
}

impl Triangles8 {
    /// Packs one to eight triangles with their face indices.
    pub(crate) fn new(triangles: &[(u32, SortedTriangle)]) -> Self {
        let mut out = Self {
            corners: [[[0.0; 8]; 3]; 3],
            reach: [0.0; 8],
            thinness: [0.0; 8],
            faces: [0; 8],
            count: triangles.len() as u32,
        };

        for lane in 0..8 {
            let (face, triangle) = triangles[lane.min(triangles.len() - 1)];
            for (rows, corner) in out.corners.iter_mut().zip(triangle.corners()) {
                for (row, value) in rows.iter_mut().zip(corner.to_array()) {
                    row[lane] = value;
                }
            }

            let (longest, normal_squared) = triangle.longest_and_normal_squared();
            out.reach[lane] = (2.0001 * longest) as f32;
            let thinness = (longest.powi(3) / normal_squared * 2f64.powi(-45)) as f32;
            out.thinness[lane] = if longest < SMALLEST { f32::INFINITY } else { thinness };
            out.faces[lane] = face;
        }
        out
    }

    /// Returns the lanes that hold a triangle of their own, as bits.
    #[inline(always)]
    pub(crate) fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// Returns the face index of a lane.
    #[inline(always)]
    pub(crate) fn face(&self, lane: usize) -> u32 {
        self.faces[lane]
    }

    /// Returns the triangle of a lane.
    #[inline(always)]
    pub(crate) fn triangle(&self, lane: usize) -> SortedTriangle {
        SortedTriangle::from_sorted(
            self.corners
                .each_ref()
                .map(|[x, y, z]| Vec3A::new(x[lane], y[lane], z[lane])),
        )
    }

    /// Returns bounds of the squared distances that [`SortedTriangle::closest`] would return.
    #[inline(always)]
    pub(crate) fn bounds(&self, [px, py, pz]: [f32; 3]) -> Bounds {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &self.corners;
        let mut bounds = Bounds { least: [0.0; 8], most: [0.0; 8] };
        for i in 0..8 {
            let a = [ax[i] - px, ay[i] - py, az[i] - pz];
            let b = [bx[i] - px, by[i] - py, bz[i] - pz];
            let c = [cx[i] - px, cy[i] - py, cz[i] - pz];
            let ab = sub(b, a);
            let ac = sub(c, a);
            let a_ab = dot(a, ab);
            let a_ac = dot(a, ac);
            let ab_ab = dot(ab, ab);
            let ab_ac = dot(ab, ac);
            let ac_ac = dot(ac, ac);

            // The nearest point of the edges, as a + s ab + t ac. `least` leaves out the constant a·a.
            let on_ab = clamp01(-a_ab / ab_ab);
            let mut least = on_ab * (2.0 * a_ab + on_ab * ab_ab);
            let mut s = on_ab;
            let mut t = 0.0;

            let on_ac = clamp01(-a_ac / ac_ac);
            let to_ac = on_ac * (2.0 * a_ac + on_ac * ac_ac);
            let nearer = to_ac < least;
            least = if nearer { to_ac } else { least };
            s = if nearer { 0.0 } else { s };
            t = if nearer { on_ac } else { t };

            let bc_bc = ab_ab + ac_ac - 2.0 * ab_ac;
            let b_bc = a_ac - a_ab + ab_ac - ab_ab;
            let on_bc = clamp01(-b_bc / bc_bc);
            let to_bc = 2.0 * a_ab + ab_ab + on_bc * (2.0 * b_bc + on_bc * bc_bc);
            let nearer = to_bc < least;
            s = if nearer { 1.0 - on_bc } else { s };
            t = if nearer { on_bc } else { t };

            // The foot of the perpendicular on the plane, if it is inside.
            let area = ab_ab * ac_ac - ab_ac * ab_ac;
            let foot_s = ab_ac * a_ac - ac_ac * a_ab;
            let foot_t = ab_ac * a_ab - ab_ab * a_ac;
            let inside = (foot_s > 0.0) & (foot_t > 0.0) & (foot_s + foot_t < area);
            let inverse = 1.0 / area;
            s = if inside { foot_s * inverse } else { s };
            t = if inside { foot_t * inverse } else { t };

            let q =
                [a[0] + s * ab[0] + t * ac[0], a[1] + s * ab[1] + t * ac[1], a[2] + s * ab[2] + t * ac[2]];
            let q_q = dot(q, q);
            let along = min(dot(q, a), min(dot(q, b), dot(q, c)));

            // q is on the triangle or within half an edge of it, so no corner is farther than `radius`.
            let length = q[0].abs() + q[1].abs() + q[2].abs();
            let radius = length + self.reach[i];
            let off = radius * (1e-6 + self.thinness[i] * radius);

            let safe = along - length * off;
            let bound = safe * (safe / q_q);
            let trusted = (safe > 0.0) & (q_q > 1e-30) & (radius < 1e15);
            bounds.least[i] = if trusted { bound } else { 0.0 };
            let most = q_q.sqrt() + 2.0 * off;
            bounds.most[i] = if radius < 1e15 { most * most } else { f32::INFINITY };
        }
        bounds
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Limits a number to 0 to 1. NaN becomes 0.
#[inline(always)]
fn clamp01(x: f32) -> f32 {
    min(max(x, 0.0), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};
    use proptest::prelude::*;

    /// Returns the lower bound, the exact squared distance, and the upper bound of one triangle.
    fn of(corners: [Vec3; 3], point: Vec3) -> (f32, f64, f32) {
        let triangle = SortedTriangle::new(corners);
        let bounds = Triangles8::new(&[(0, triangle)]).bounds(point.to_array());
        assert!(bounds.least.iter().all(|b| *b == bounds.least[0]) && bounds.most[7] == bounds.most[0]);
        (bounds.least[0], triangle.closest(point.as_dvec3()).0, bounds.most[0])
    }

    fn check(corners: [Vec3; 3], point: Vec3) -> Result<(), TestCaseError> {
        let (least, exact, most) = of(corners, point);
        prop_assert!(f64::from(least) <= exact * (1.0 + 1e-6), "{least} > {exact}: {corners:?} {point}");
        prop_assert!(f64::from(most) >= exact * (1.0 - 1e-6), "{most} < {exact}: {corners:?} {point}");
        Ok(())
    }

    fn anywhere() -> impl Strategy<Value = Vec3> {
        (-1.0..1.0f32, -1.0..1.0f32, -1.0..1.0f32).prop_map(|(x, y, z)| vec3(x, y, z))
    }

    #[test]
    fn bounds_are_close() {
        let corners = [Vec3::ZERO, vec3(0.1, 0.0, 0.0), vec3(0.0, 0.1, 0.02)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        // Points above the inside, beside an edge and beside a corner; 5 mm and 1 m away.
        let edge_off = vec3(0.0, -1.0, 0.0);
        for (foot, off) in [
            ((corners[0] + corners[1] + corners[2]) / 3.0, normal),
            (vec3(0.05, 0.0, 0.0), edge_off),
            (corners[1], vec3(1.0, -1.0, 0.0).normalize()),
        ] {
            for (distance, share) in [(0.005, 1e-3), (1.0, 1e-4)] {
                let (least, exact, most) = of(corners, foot + off * distance);
                assert!(f64::from(least) > exact * (1.0 - share), "{least} {exact}");
                assert!(f64::from(most) < exact * (1.0 + share), "{most} {exact}");
            }
        }
    }

    fn triangle_at(x: f32) -> SortedTriangle {
        SortedTriangle::new([vec3(x, 0.0, 0.0), vec3(x, 1.0, 0.0), vec3(x, 0.0, 1.0)])
    }

    #[test]
    fn lanes_hold_their_own_triangles() {
        let three = Triangles8::new(&[(7, triangle_at(1.0)), (5, triangle_at(2.0)), (9, triangle_at(4.0))]);
        assert_eq!((three.lanes(), three.face(0), three.face(1), three.face(2)), (0b111, 7, 5, 9));
        let bounds = three.bounds([0.0, 0.2, 0.2]);
        for (lane, square) in [(0, 1.0), (1, 4.0), (2, 16.0)] {
            assert!((bounds.least[lane] - square).abs() < 1e-3 * square && bounds.most[lane] >= square);
            assert_eq!(three.triangle(lane).closest(glam::dvec3(0.0, 0.2, 0.2)).0, f64::from(square));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn bounds_hold(
            corners in [anywhere(), anywhere(), anywhere()],
            point in anywhere(),
            scale in -24..24i32,
        ) {
            let scale = 10f32.powi(scale);
            check(corners.map(|c| c * scale), point * scale)?;
            check(corners.map(|c| c * 0.01), point)?;
            check(corners, point * 1e4)?;
        }

        #[test]
        fn bounds_hold_far_from_the_origin(
            corners in [anywhere(), anywhere(), anywhere()],
            point in anywhere(),
            away in anywhere(),
        ) {
            let away = away * 2000.0;
            check(corners.map(|c| c * 0.1 + away), point * 0.1 + away)?;
        }

        #[test]
        fn bounds_hold_for_slivers(
            a in anywhere(),
            b in anywhere(),
            (along, aside, thinness) in (-0.2..1.2f32, anywhere(), -10..-1i32),
            (near, off, distance) in (-0.5..1.5f32, anywhere(), -9..1i32),
        ) {
            let corners = [a, b, a.lerp(b, along) + aside * 10f32.powi(thinness)];
            prop_assume!(
                corners[0] != corners[1] && SortedTriangle::new(corners).longest_and_normal_squared().1 > 0.0
            );
            check(corners, a.lerp(b, near) + off * 10f32.powi(distance))?;
        }

        #[test]
        fn bounds_hold_on_the_triangle(
            corners in [anywhere(), anywhere(), anywhere()],
            s in 0.0..1.0f32,
            t in 0.0..1.0f32,
        ) {
            let [a, b, c] = corners;
            for point in [a, a.lerp(b, s), c.lerp(a, t), a.lerp(b, s).lerp(c, t)] {
                check(corners, point)?;
            }
        }
    }
}
