//! The smallest distance between two surfaces.

use s3d_geom::TriMesh;
use s3d_geom::glam::DVec3;

/// Faces in a row that share a box. Faces of a file lie beside each other.
const CLUSTER: usize = 16;

/// The lowest and the highest coordinates of something.
type Bounds = [DVec3; 2];

/// The faces of an object.
pub(super) struct Surface {
    triangles: Vec<[DVec3; 3]>,
    clusters: Vec<Bounds>,
}

impl Surface {
    pub(super) fn new(mesh: &TriMesh, faces: &[u32]) -> Self {
        let corners = |face: &u32| mesh.triangle(*face).map(|corner| corner.as_dvec3());
        let triangles: Vec<[DVec3; 3]> = faces.iter().map(corners).collect();
        let clusters = triangles.chunks(CLUSTER).map(|of| bounds(of.as_flattened()));
        Self { clusters: clusters.collect(), triangles }
    }

    fn cluster(&self, number: usize) -> &[[DVec3; 3]] {
        let begin = number * CLUSTER;
        &self.triangles[begin..self.triangles.len().min(begin + CLUSTER)]
    }

    /// Returns the smallest distance to another surface, metres; 0 if they touch or meet.
    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        // The nearest boxes first, until those that are left are farther than what was found.
        let mut pairs = Vec::with_capacity(self.clusters.len() * other.clusters.len());
        for (i, a) in self.clusters.iter().enumerate() {
            for (j, b) in other.clusters.iter().enumerate() {
                pairs.push((between_boxes(a, b), i, j));
            }
        }
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));

        let mut best = f64::INFINITY;
        for (least, i, j) in pairs {
            if least >= best {
                break;
            }
            for a in self.cluster(i) {
                for b in other.cluster(j) {
                    if between_boxes(&bounds(a), &bounds(b)) < best {
                        best = best.min(between_triangles(a, b));
                    }
                }
            }
        }
        best
    }
}

fn bounds(points: &[DVec3]) -> Bounds {
    let low = points.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
    let high = points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
    [low, high]
}

fn between_boxes(a: &Bounds, b: &Bounds) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(DVec3::ZERO).length()
}

/// The distance of two triangles: that of two edges, or of a corner and a triangle, unless they meet.
fn between_triangles(a: &[DVec3; 3], b: &[DVec3; 3]) -> f64 {
    let edges = |t: &[DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    if edges(a).iter().any(|edge| pierces(*edge, b)) || edges(b).iter().any(|edge| pierces(*edge, a)) {
        return 0.0;
    }
    let of_corners = |points: &[DVec3; 3], triangle: &[DVec3; 3]| {
        let distances = points.map(|point| to_triangle(point, triangle));
        distances.into_iter().fold(f64::INFINITY, f64::min)
    };
    let mut best = of_corners(a, b).min(of_corners(b, a));
    for p in edges(a) {
        for q in edges(b) {
            best = best.min(between_segments(p, q));
        }
    }
    best
}

/// Whether a segment goes through a triangle.
fn pierces([p, q]: [DVec3; 2], [a, b, c]: &[DVec3; 3]) -> bool {
    let side = |u: DVec3, v: DVec3| (u - p).cross(v - p).dot(q - p);
    let sides = [side(*a, *b), side(*b, *c), side(*c, *a)];
    let is_within = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
    let normal = (*b - *a).cross(*c - *a);
    is_within && (p - *a).dot(normal) * (q - *a).dot(normal) <= 0.0
}

/// The distance of a point from a triangle.
fn to_triangle(p: DVec3, [a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (*b - *a).cross(*c - *a);
    let edges = [[*a, *b], [*b, *c], [*c, *a]];
    let is_above = edges.iter().all(|[u, v]| (*v - *u).cross(p - *u).dot(normal) >= 0.0);
    if is_above && normal != DVec3::ZERO {
        return ((p - *a).dot(normal) / normal.length()).abs();
    }
    let distances = edges.map(|[u, v]| {
        let along = v - u;
        let share = ((p - u).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(u + along * share)
    });
    distances.into_iter().fold(f64::INFINITY, f64::min)
}

/// The distance of two segments. Source: C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.9.
fn between_segments([p, p2]: [DVec3; 2], [q, q2]: [DVec3; 2]) -> f64 {
    let (d, e, r) = (p2 - p, q2 - q, p - q);
    let (dd, ee, de) = (d.length_squared(), e.length_squared(), d.dot(e));
    let (dr, er) = (d.dot(r), e.dot(r));
    let across = dd * ee - de * de;
    let mut s = if across > 0.0 {
        ((de * er - dr * ee) / across).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (de * s + er) / ee;
    if t < 0.0 {
        (s, t) = ((-dr / dd).clamp(0.0, 1.0), 0.0);
    } else if t > 1.0 {
        (s, t) = (((de - dr) / dd).clamp(0.0, 1.0), 1.0);
    }
    (p + d * s).distance(q + e * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::Vec3;
    use s3d_geom::primitives::grid;
    use s3d_geom::{MeshParts, NearestFaces};

    fn surface(mesh: &TriMesh) -> Surface {
        Surface::new(mesh, &(0..mesh.faces().len() as u32).collect::<Vec<_>>())
    }

    fn mesh(positions: Vec<Vec3>) -> TriMesh {
        let faces = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        TriMesh::new(MeshParts { faces: faces.collect(), positions, ..MeshParts::default() }).unwrap()
    }

    #[test]
    fn edges_corners_and_what_goes_through() {
        let floor = TriMesh::new(grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [9, 9])).unwrap();
        let above =
            |z: f32| mesh(vec![Vec3::new(1.0, 1.0, z), Vec3::new(2.0, 1.0, z), Vec3::new(1.0, 2.0, z + 1.0)]);
        assert!((surface(&floor).distance_m(&surface(&above(0.7))) - 0.7).abs() < 1e-6);
        // A pole through the floor, far from all edges of a single large face.
        let large = mesh(vec![Vec3::ZERO, Vec3::X * 90.0, Vec3::Y * 90.0]);
        let pole =
            mesh(vec![Vec3::new(20.0, 20.0, -9.0), Vec3::new(20.1, 20.0, -9.0), Vec3::new(20.0, 20.0, 9.0)]);
        assert_eq!(surface(&large).distance_m(&surface(&pole)), 0.0);
        // Two edges across each other.
        let a = mesh(vec![Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 0.0, -1.0)]);
        let b = mesh(vec![Vec3::new(0.0, -1.0, 0.5), Vec3::new(0.0, 1.0, 0.5), Vec3::new(0.0, 0.0, 2.0)]);
        assert!((surface(&a).distance_m(&surface(&b)) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_distance_is_that_of_many_points() {
        let number = |n: u32| {
            let mixed = (u64::from(n) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed >> 40) as f32 / (1 << 24) as f32
        };
        let soup = |seed: u32, at: Vec3| {
            let point =
                |i: u32| Vec3::new(number(seed + 3 * i), number(seed + 3 * i + 1), number(seed + 3 * i + 2));
            mesh(
                (0..120)
                    .map(|i| at + 0.3 * point(i / 3) + 0.15 * point(900 + i))
                    .collect(),
            )
        };
        for round in 0..20 {
            let a = soup(10_000 * round, Vec3::ZERO);
            let b = soup(10_000 * round + 5000, Vec3::new(0.6, 0.2, 0.1 * round as f32));
            let found = surface(&a).distance_m(&surface(&b));
            // Points all over the faces of one, against the other.
            let nearest = NearestFaces::new(&b);
            let points: Vec<Vec3> = (0..a.faces().len() as u32)
                .flat_map(|face| {
                    let [p, q, r] = a.triangle(face);
                    (0..=20).flat_map(move |i| {
                        (0..=20 - i)
                            .map(move |j| p + (q - p) * (i as f32 / 20.0) + (r - p) * (j as f32 / 20.0))
                    })
                })
                .collect();
            let mut distances = Vec::new();
            nearest.nearest_many(&points, &mut distances);
            let least = distances.iter().map(|n| n.distance_m).fold(f32::INFINITY, f32::min);
            let least = f64::from(least);
            assert!(found <= least + 1e-6 && least < found + 0.015, "{found} {least}");
        }
    }
}
