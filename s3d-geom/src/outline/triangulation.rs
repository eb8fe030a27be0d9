//! The triangulation of faces, and of regions between rings.

use glam::{DVec2, DVec3, Vec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, handles::FixedVertexHandle};
use std::ops::Range;
use thiserror::Error;

/// The largest coordinate. Products of larger ones would overflow.
const LARGEST_COORDINATE: f64 = 1e60;

/// The largest number of corners of a face. If corners are in no order, the time for a triangulation grows
/// faster than their number; it is half a second for this many.
const MOST_CORNERS: usize = 1 << 14;

/// The reason why an outline cannot be cut into triangles.
///
/// Corners count from 0. In a [`Polygon`](crate::Polygon), the corners of the holes follow the corners of the
/// outer ring.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PolygonError {
    /// An outline has fewer than three corners.
    #[error("an outline of {corners} corners encloses nothing")]
    TooFewCorners {
        /// The number of corners.
        corners: usize,
    },
    /// A face has more than 16,384 corners.
    #[error("an outline of {corners} corners; faces have up to 16,384")]
    TooManyCorners {
        /// The number of corners.
        corners: usize,
    },
    /// A corner is NaN, infinite or astronomically far away.
    #[error("corner {corner} is not finite or too far away")]
    OutOfRange {
        /// The corner.
        corner: usize,
    },
    /// All corners are on a line or in a point, or the outline runs back over itself.
    #[error("the outline encloses no area")]
    ZeroArea,
    /// Two edges cross.
    #[error("the outline crosses itself at the edge from corner {from} to corner {to}")]
    SelfIntersection {
        /// The corner at one end of one of the edges.
        from: usize,
        /// The corner at the other end of this edge.
        to: usize,
    },
    /// No edges cross, but the outline turns over where it touches itself, or a hole is outside of the outer
    /// ring or inside another hole.
    #[error("parts of the outline overlap, or a hole is not inside")]
    Overlap,
}

/// Cuts a face into triangles of the same corners and winding. Returns three indices into `corners` per
/// triangle.
///
/// The face is projected along its mean normal (Newell's), so it may be concave and somewhat bent. Corners on
/// a straight line and repeated corners are allowed. So is an outline that runs to a hole and back over the
/// same edge.
///
/// # Errors
/// [`PolygonError`] for fewer than three corners or more than 16,384, a corner that is not finite or too far
/// away, no area, or an outline that crosses itself as seen along the normal.
pub fn triangulate_face(corners: &[Vec3]) -> Result<Vec<[u32; 3]>, PolygonError> {
    if corners.len() < 3 {
        return Err(PolygonError::TooFewCorners { corners: corners.len() });
    }
    if corners.len() > MOST_CORNERS {
        return Err(PolygonError::TooManyCorners { corners: corners.len() });
    }
    if let Some(corner) = corners.iter().position(|p| !p.is_finite()) {
        return Err(PolygonError::OutOfRange { corner });
    }

    // Relative to the first corner, digits are as good far from the origin as near it.
    let origin = corners[0].as_dvec3();
    let local: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() - origin).collect();
    let normal = edges(&local).map(|(a, b)| a.cross(b)).sum::<DVec3>();
    let Some(normal) = normal.try_normalize() else {
        return Err(PolygonError::ZeroArea);
    };
    if corners.len() == 3 {
        return Ok(vec![[0, 1, 2]]);
    }

    let (right, up) = normal.any_orthonormal_pair();
    let up = if right.cross(up).dot(normal) < 0.0 { -up } else { up };
    let flat: Vec<DVec2> = local.iter().map(|p| DVec2::new(p.dot(right), p.dot(up))).collect();

    // A convex quad is cut along its shorter diagonal.
    if let &[a, b, c, d] = flat.as_slice()
        && [(a, b, c), (b, c, d), (c, d, a), (d, a, b)]
            .iter()
            .all(|(p, q, r)| (q - p).perp_dot(r - q) > 0.0)
    {
        let short = local[0].distance_squared(local[2]) <= local[1].distance_squared(local[3]);
        return Ok(if short {
            vec![[0, 1, 2], [0, 2, 3]]
        } else {
            vec![[0, 1, 3], [1, 2, 3]]
        });
    }

    triangulate_rings(&flat, std::slice::from_ref(&(0..flat.len())), signed_area(&flat))
}

/// Returns the area of a ring, positive if it runs counter-clockwise.
pub(super) fn signed_area(ring: &[DVec2]) -> f64 {
    let origin = ring.first().copied().unwrap_or_default();
    edges(ring).map(|(a, b)| (a - origin).perp_dot(b - origin)).sum::<f64>() * 0.5
}

/// Iterates over the edges of a closed ring.
pub(super) fn edges<T: Copy>(ring: &[T]) -> impl Iterator<Item = (T, T)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// Triangulates the region that lies within an odd number of rings, and checks that it has the area `area`.
/// The triangles run counter-clockwise, start with their smallest index, and are sorted.
pub(super) fn triangulate_rings(
    points: &[DVec2],
    rings: &[Range<usize>],
    area: f64,
) -> Result<Vec<[u32; 3]>, PolygonError> {
    if let Some(ring) = rings.iter().find(|ring| ring.len() < 3) {
        return Err(PolygonError::TooFewCorners { corners: ring.len() });
    }

    // Corners at the same place are one vertex: vertex → its first corner, and corner → vertex.
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut first_corner: Vec<usize> = Vec::with_capacity(points.len());
    let mut vertices = Vec::with_capacity(points.len());
    for (corner, p) in points.iter().enumerate() {
        if !p.is_finite() || p.abs().max_element() > LARGEST_COORDINATE {
            return Err(PolygonError::OutOfRange { corner });
        }
        let vertex = cdt
            .insert(spade::mitigate_underflow(Point2::new(p.x, p.y)))
            .map_err(|_| PolygonError::OutOfRange { corner })?;
        if vertex.index() == first_corner.len() {
            first_corner.push(corner);
        }
        vertices.push(vertex);
    }

    // An edge that rings take an even number of times, such as there and back to a hole, is no border between
    // inside and outside.
    let mut borders: Vec<[usize; 2]> = Vec::with_capacity(points.len());
    for ring in rings {
        for (from, to) in edges(&vertices[ring.clone()]).filter(|(from, to)| from != to) {
            // The edge has several parts if it passes through corners, and none if it crosses another border.
            let parts = cdt.try_add_constraint(from, to);
            if parts.is_empty() {
                return Err(PolygonError::SelfIntersection {
                    from: first_corner[from.index()],
                    to: first_corner[to.index()],
                });
            }
            borders.extend(parts.iter().map(|&part| {
                let part = cdt.directed_edge(part);
                ends(part.from().fix(), part.to().fix())
            }));
        }
    }
    borders.sort_unstable();
    let borders: Vec<[usize; 2]> = borders
        .chunk_by(|a, b| a == b)
        .filter(|same| same.len() % 2 == 1)
        .map(|same| same[0])
        .collect();

    // Walk from the outer face inwards. Every border crossed changes between outside and inside.
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    inside[cdt.outer_face().index()] = Some(false);
    let hull = cdt.convex_hull().map(|edge| (edge.rev().face(), edge, false));
    let mut todo: Vec<_> = hull.collect();
    while let Some((face, edge, other_side)) = todo.pop() {
        if inside[face.index()].is_some() {
            continue;
        }
        let here = other_side != borders.binary_search(&ends(edge.from().fix(), edge.to().fix())).is_ok();
        inside[face.index()] = Some(here);
        if let Some(face) = face.as_inner() {
            todo.extend(face.adjacent_edges().map(|edge| (edge.rev().face(), edge, here)));
        }
    }

    let mut covered = 0.0;
    let mut triangles = Vec::with_capacity(points.len());
    for face in cdt.inner_faces().filter(|face| inside[face.index()] == Some(true)) {
        covered += face.area();
        let [a, b, c] = face.vertices().map(|v| first_corner[v.index()] as u32);
        triangles.push(if a < b && a < c {
            [a, b, c]
        } else if b < c {
            [b, c, a]
        } else {
            [c, a, b]
        });
    }
    if triangles.is_empty() {
        return Err(PolygonError::ZeroArea);
    }

    // Rings that turn over and holes that are not inside cover another area than `area`.
    let extent = points
        .iter()
        .fold(0.0, |e: f64, p| e.max((p - points[0]).abs().max_element()));
    if (covered - area).abs() > 1e-9 * extent * extent {
        return Err(PolygonError::Overlap);
    }

    triangles.sort_unstable();
    Ok(triangles)
}

fn ends(from: FixedVertexHandle, to: FixedVertexHandle) -> [usize; 2] {
    let from = from.index();
    let to = to.index();
    [from.min(to), from.max(to)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::polygon::Polygon;
    use glam::{DMat3, DQuat, dvec2, dvec3, vec3};
    use proptest::prelude::*;

    fn ring(corners: &[[f64; 2]]) -> Vec<DVec2> {
        corners.iter().map(|&[x, y]| dvec2(x, y)).collect()
    }

    fn lifted(ring: &[DVec2], world_from_plane: DMat3) -> Vec<Vec3> {
        ring.iter()
            .map(|p| (world_from_plane * dvec3(p.x, p.y, 0.4)).as_vec3())
            .collect()
    }

    fn triangle_area(corners: &[Vec3], [a, b, c]: [u32; 3]) -> DVec3 {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize].as_dvec3());
        (b - a).cross(c - a) / 2.0
    }

    /// Tilts the ring several ways, and checks that its triangles have its winding, area and corners.
    fn check_face(ring: &[DVec2]) {
        let tilts = [
            DMat3::IDENTITY,
            DMat3::from_quat(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2)),
            DMat3::from_quat(DQuat::from_axis_angle(dvec3(0.6, 0.0, 0.8), 2.1)),
            DMat3::from_quat(DQuat::from_axis_angle(dvec3(-0.48, 0.6, 0.64), -1.0)),
        ];
        let reversed: Vec<DVec2> = ring.iter().rev().copied().collect();
        for tilt in tilts {
            for ring in [ring, &reversed] {
                let corners = lifted(ring, tilt);
                let triangles = triangulate_face(&corners).unwrap();
                assert_eq!(triangles.len(), corners.len() - 2);
                let normal = tilt.z_axis * signed_area(ring).signum();
                let areas = triangles.iter().map(|&t| triangle_area(&corners, t).dot(normal));
                assert!(areas.clone().all(|a| a > -1e-6), "{triangles:?} of {corners:?}");
                assert!((areas.sum::<f64>() - signed_area(ring).abs()).abs() < 1e-5);
                assert!((0..corners.len() as u32).all(|i| triangles.iter().flatten().any(|&c| c == i)));
            }
        }
    }

    const L: [[f64; 2]; 6] = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];

    #[test]
    fn convex_and_concave_faces() {
        check_face(&ring(&[[0.0, 0.0], [2.0, 0.0], [0.5, 1.0]]));
        check_face(&ring(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]));
        // A dart: the diagonal must be the inner one.
        check_face(&ring(&[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.7, 1.0]]));
        check_face(&ring(&L));
        check_face(&ring(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ]));
    }

    fn circle(n: usize) -> Vec<Vec3> {
        let angle = |i: usize| i as f32 / n as f32 * std::f32::consts::TAU;
        (0..n)
            .map(|i| vec3(9.0 * angle(i).cos(), 9.0 * angle(i).sin(), 1.0))
            .collect()
    }

    #[test]
    fn a_face_has_so_many_corners_at_most() {
        assert_eq!(triangulate_face(&circle(MOST_CORNERS)).unwrap().len(), MOST_CORNERS - 2);
        let corners = MOST_CORNERS + 1;
        assert_eq!(triangulate_face(&circle(corners)), Err(PolygonError::TooManyCorners { corners }));
    }

    #[test]
    fn a_comb() {
        let mut comb = vec![dvec2(20.0, -1.0), dvec2(20.0, 0.0)];
        for tooth in (0..10).rev() {
            let x = 2.0 * f64::from(tooth);
            comb.extend([dvec2(x + 1.5, 0.1), dvec2(x + 1.25, 5.0), dvec2(x + 1.0, 0.0)]);
        }
        comb.push(dvec2(0.0, -1.0));
        check_face(&comb);
    }

    #[test]
    fn corners_on_a_straight_line_are_kept() {
        check_face(&ring(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0]]));
        check_face(&ring(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [0.0, 2.0]]));
    }

    #[test]
    fn repeated_corners_are_one() {
        let corners = lifted(
            &ring(&[[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.0, 2.0], [0.0, 2.0]]),
            DMat3::IDENTITY,
        );
        let triangles = triangulate_face(&corners).unwrap();
        assert_eq!(triangles.len(), 2);
        assert!(triangles.iter().flatten().all(|&c| [0, 2, 3, 5].contains(&c)));
    }

    #[test]
    fn a_hole_reached_over_a_double_edge_stays_open() {
        let keyhole = ring(&[
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [3.0, 3.0],
            [3.0, 1.0],
            [1.0, 1.0],
        ]);
        let corners = lifted(&keyhole, DMat3::IDENTITY);
        let triangles = triangulate_face(&corners).unwrap();
        let area: f64 = triangles.iter().map(|&t| triangle_area(&corners, t).z).sum();
        assert!((area - 12.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn a_bent_face_keeps_its_corners() {
        let corners = [
            vec3(0.0, 0.0, 0.0),
            vec3(1.0, 0.0, 0.2),
            vec3(1.0, 1.0, -0.1),
            vec3(0.4, 0.4, 0.1),
            vec3(0.0, 1.0, 0.0),
        ];
        let triangles = triangulate_face(&corners).unwrap();
        assert_eq!(triangles.len(), 3);
        assert!(triangles.iter().all(|&t| triangle_area(&corners, t).z > 0.0));
    }

    fn flat_face(corners: &[[f64; 2]]) -> Result<Vec<[u32; 3]>, PolygonError> {
        triangulate_face(&lifted(&ring(corners), DMat3::IDENTITY))
    }

    #[test]
    fn outlines_without_triangles() {
        assert_eq!(flat_face(&[[0.0, 0.0], [1.0, 0.0]]), Err(PolygonError::TooFewCorners { corners: 2 }));
        assert_eq!(flat_face(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]), Err(PolygonError::ZeroArea));
        assert_eq!(flat_face(&[[1.0, 1.0]; 5]), Err(PolygonError::ZeroArea));
        assert_eq!(flat_face(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), Err(PolygonError::ZeroArea));

        // There and back, with a bend.
        assert_eq!(flat_face(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.0]]), Err(PolygonError::ZeroArea));
        assert_eq!(
            flat_face(&[[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]]),
            Err(PolygonError::OutOfRange { corner: 1 })
        );

        // A bow tie whose halves differ, so that their areas do not cancel.
        assert!(matches!(
            flat_face(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]),
            Err(PolygonError::SelfIntersection { .. })
        ));
        // A bow tie that touches itself in a corner.
        assert_eq!(
            flat_face(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0], [3.0, 0.0], [1.0, 1.0], [0.0, 2.0]]),
            Err(PolygonError::Overlap)
        );

        // A pentagram goes around its middle twice.
        let star: Vec<[f64; 2]> = (0..5)
            .map(|i| {
                let (s, c) = libm::sincos(f64::from(i) * 0.8 * std::f64::consts::PI);
                [c, s]
            })
            .collect();
        assert!(matches!(flat_face(&star), Err(PolygonError::SelfIntersection { .. })));
    }

    /// Makes corners at ascending angles: a simple outline, usually concave.
    fn star() -> impl Strategy<Value = Vec<DVec2>> {
        prop::collection::vec(0.2..3.0f64, 3..40).prop_map(|radii| {
            let n = radii.len() as f64;
            radii
                .into_iter()
                .enumerate()
                .map(|(i, r)| {
                    let (s, c) = libm::sincos(i as f64 / n * std::f64::consts::TAU);
                    dvec2(r * c, r * s)
                })
                .collect()
        })
    }

    proptest! {
        #[test]
        fn stars(ring in star()) {
            check_face(&ring);
        }

        #[test]
        fn stars_with_a_hole(ring in star(), point in (-3.0..3.0f64, -3.0..3.0f64)) {
            let hole: Vec<DVec2> = ring.iter().map(|&p| p * 0.4).collect();
            let p = Polygon { outer: ring.clone(), holes: vec![hole.clone()] };
            let corners: Vec<DVec2> = ring.iter().chain(&hole).copied().collect();
            let triangles = p.triangulate().unwrap();
            let area: f64 = triangles
                .iter()
                .map(|t| signed_area(&t.map(|i| corners[i as usize])))
                .sum();
            prop_assert!((area - p.area()).abs() < 1e-9);
            // A point is in the polygon if and only if it is in a triangle.
            let point = dvec2(point.0, point.1);
            let covered = triangles.iter().any(|t| {
                Polygon { outer: t.map(|i| corners[i as usize]).to_vec(), holes: vec![] }.contains(point)
            });
            prop_assert_eq!(p.contains(point), covered);
            prop_assert_eq!(p.distance(point) == 0.0, covered);
        }

        /// The corners are anywhere on a lattice, so that edges meet, overlap and cross.
        #[test]
        fn wild_outlines_never_panic(corners in prop::collection::vec((0..5i8, 0..5i8, 0..2i8), 0..14)) {
            let corners: Vec<Vec3> =
                corners
                    .iter()
                    .map(|&(x, y, z)| vec3(f32::from(x), f32::from(y), f32::from(z) * 0.25))
                    .collect();
            if let Ok(triangles) = triangulate_face(&corners) {
                // Seen along the normal, the triangles cover the area that the outline encloses.
                let normal =
                    edges(&corners).map(|(a, b)| a.as_dvec3().cross(b.as_dvec3())).sum::<DVec3>() / 2.0;
                let covered: DVec3 = triangles.iter().map(|&t| triangle_area(&corners, t)).sum();
                prop_assert!((covered.dot(normal.normalize()) - normal.length()).abs() < 1e-6);
            }
            let outer = corners.iter().map(|p| dvec2(p.x.into(), p.y.into())).collect::<Vec<_>>();
            let half = outer.len() / 2;
            let p = Polygon { holes: vec![outer[half..].to_vec()], outer: outer[..half].to_vec() };
            if let Ok(triangles) = p.triangulate() {
                let area: f64 = triangles.iter().map(|t| signed_area(&t.map(|i| outer[i as usize]))).sum();
                prop_assert!((area - p.area()).abs() < 1e-6);
            }
        }
    }
}
