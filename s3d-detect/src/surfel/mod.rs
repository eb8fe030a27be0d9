//! Surfels: points, thinned to one for each cell. All later steps work on them.

pub mod index;
pub mod volume;

use glam::{DMat3, DVec3, Vec3};
use s3d_geom::{Aabb, PointCloud, symmetric_eigen};

/// The width of a cell in metres: chosen here, half a step of the sliding windows.
pub const CELL_M: f32 = 0.05;

/// The surface in a cell, as its points show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
    /// The mean of the points.
    pub position: Vec3,
    /// The box around the points.
    pub extent: Aabb,
    /// The direction in which the points in this cell and the 26 around it vary least. Its sign means
    /// nothing.
    pub normal: Vec3,
    /// The share of this direction in their whole variance, 0 (a plane) to ⅓: the surface variation of
    /// Pauly, Gross and Kobbelt (2002).
    pub curvature: f32,
    /// Mean R G B, 0 to 1.
    pub color: Vec3,
    /// The room of the points: an index of [`Area::rooms`](crate::Area::rooms). Detections are named by it,
    /// and do not depend on it.
    pub room: u32,
}

/// Sums over the points of a cell, about the cell's corner.
#[derive(Clone, Copy, Debug)]
struct Sums {
    key: [i32; 3],
    count: f64,
    sum: DVec3,
    /// xx, xy, xz, yy, yz, zz.
    squares: [f64; 6],
    color: DVec3,
    extent: Aabb,
    /// The room with the most of its points, and how many these are.
    room: (u32, f64),
}

/// Thins the points of the room with this number; [`surfels_of_parts`] thins several rooms.
///
/// # Panics
/// If the cloud has no colours.
pub fn surfels_of(points: &PointCloud, room: u32) -> Vec<Surfel> {
    surfels_of_parts([Part::of(points, room)])
}

/// Some points of an area, summed up by cell.
#[derive(Clone, Debug)]
pub struct Part(Vec<Sums>);

impl Part {
    /// Sums up the points of the room with this number.
    ///
    /// # Panics
    /// If the cloud has no colours.
    pub fn of(points: &PointCloud, room: u32) -> Self {
        Self(cells_of(points, room))
    }
}

/// Thins the points of all parts together. A cell with points of several rooms has one surfel, and the room
/// of most of its points; the first part wins a tie. Surfels are ordered by cell: z, then y, then x. The
/// division into parts and the order of the points change the last bits of sums at most.
pub fn surfels_of_parts(parts: impl IntoIterator<Item = Part>) -> Vec<Surfel> {
    let mut pieces: Vec<Sums> = parts.into_iter().flat_map(|part| part.0).collect();
    pieces.sort_by_key(|piece| order(piece.key));

    let mut cells: Vec<Sums> = Vec::new();
    for piece in pieces {
        match cells.last_mut().filter(|cell| cell.key == piece.key) {
            Some(cell) => cell.add(&piece),
            None => cells.push(piece),
        }
    }
    with_normals(&cells)
}

impl Sums {
    /// Adds further points of the same cell.
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares.iter_mut().zip(other.squares).for_each(|(s, o)| *s += o);
        self.color += other.color;
        self.extent = self.extent.union(other.extent);
        if other.room.1 > self.room.1 {
            self.room = other.room;
        }
    }
}

/// Sums up the points of a room by cell, in the order of cells.
fn cells_of(points: &PointCloud, room: u32) -> Vec<Sums> {
    assert_eq!(points.colors.len(), points.len(), "a colour a point");
    let mut order: Vec<([i32; 3], u32)> = Vec::with_capacity(points.len());
    order.extend(points.positions.iter().zip(0..).map(|(&p, i)| {
        let [x, y, z] = (p / CELL_M).floor().as_ivec3().to_array();
        ([z, y, x], i)
    }));
    order.sort_unstable();

    let mut cells: Vec<Sums> = Vec::new();
    for &([z, y, x], i) in &order {
        if cells.last().is_none_or(|c| c.key != [x, y, z]) {
            cells.push(Sums {
                key: [x, y, z],
                count: 0.0,
                sum: DVec3::ZERO,
                squares: [0.0; 6],
                color: DVec3::ZERO,
                extent: Aabb::EMPTY,
                room: (room, 0.0),
            });
        }
        let Some(cell) = cells.last_mut() else { continue };

        let point = points.positions[i as usize];
        let color = points.colors[i as usize];
        let p = point.as_dvec3() - corner(cell.key);
        cell.count += 1.0;
        cell.room.1 += 1.0;
        cell.sum += p;
        let products = [p.x * p.x, p.x * p.y, p.x * p.z, p.y * p.y, p.y * p.z, p.z * p.z];
        cell.squares.iter_mut().zip(products).for_each(|(s, p)| *s += p);
        cell.color += DVec3::from(color.map(f64::from)) / 255.0;
        cell.extent = cell.extent.with(point);
    }
    cells
}

/// Returns the least corner of a cell.
fn corner(key: [i32; 3]) -> DVec3 {
    DVec3::from(key.map(|k| f64::from(k) * f64::from(CELL_M)))
}

/// The components of a symmetric matrix, in the order of [`Sums::squares`].
const COMPONENTS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Returns the surfels of cells, which are in order. The 27 cells around a cell are 9 runs of neighbours
/// along x. From one cell to the next, the start of each run only moves on.
fn with_normals(cells: &[Sums]) -> Vec<Surfel> {
    let mut starts = [0usize; 9];
    let mut surfels = Vec::with_capacity(cells.len());
    for cell in cells {
        // The moments of all 27 cells, about the corner of this one.
        let here = corner(cell.key);
        let mut count = 0.0;
        let mut sum = DVec3::ZERO;
        let mut squares = [0.0; 6];
        for (run, start) in starts.iter_mut().enumerate() {
            let [x, y, z] = cell.key;
            let y = y + run as i32 % 3 - 1;
            let z = z + run as i32 / 3 - 1;
            while cells.get(*start).is_some_and(|c| order(c.key) < [z, y, x - 1]) {
                *start += 1;
            }
            for near in cells[*start..].iter().take_while(|c| order(c.key) <= [z, y, x + 1]) {
                let n = near.count;
                let s = near.sum;
                let d = corner(near.key) - here;
                for (i, (a, b)) in COMPONENTS.into_iter().enumerate() {
                    squares[i] += near.squares[i] + s[a] * d[b] + d[a] * s[b] + n * d[a] * d[b];
                }
                count += n;
                sum += s + n * d;
            }
        }

        let mean = sum / count;
        let mut covariance = [0.0; 6];
        for (i, (a, b)) in COMPONENTS.into_iter().enumerate() {
            covariance[i] = squares[i] / count - mean[a] * mean[b];
        }
        let (normal, curvature) = least_direction(covariance);
        surfels.push(Surfel {
            position: (here + cell.sum / cell.count).as_vec3(),
            extent: cell.extent,
            normal: normal.as_vec3(),
            curvature: curvature as f32,
            color: (cell.color / cell.count).as_vec3(),
            room: cell.room.0,
        });
    }
    surfels
}

fn order(k: [i32; 3]) -> [i32; 3] {
    [k[2], k[1], k[0]]
}

/// Returns the eigenvector of the least eigenvalue of a covariance (xx, xy, xz, yy, yz, zz), and the share of
/// this eigenvalue in the sum of all three.
fn least_direction([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> (DVec3, f64) {
    let (values, axes) = symmetric_eigen(&DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]));
    let trace = xx + yy + zz;
    let share = if trace > 0.0 {
        (values.x / trace).clamp(0.0, 1.0 / 3.0)
    } else {
        0.0
    };
    (axes.x_axis, share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn cloud(positions: Vec<Vec3>) -> PointCloud {
        let colors = vec![[255, 0, 51]; positions.len()];
        PointCloud { positions, colors, faces: Vec::new() }
    }

    #[test]
    fn a_slanted_plane_has_its_normal_and_no_curvature() {
        let points = (0..40_000).map(|i| {
            let u = (i % 200) as f32 * 0.01;
            let v = (i / 200) as f32 * 0.01;
            vec3(u, v, 3.0 + 0.5 * u)
        });
        let surfels = surfels_of(&cloud(points.collect()), 0);
        let normal = vec3(-0.5, 0.0, 1.0).normalize();
        assert!(surfels.len() > 1600);
        for s in &surfels {
            assert!(s.normal.dot(normal).abs() > 0.999 && s.curvature < 1e-4, "{s:?}");
            assert!((s.position.z - 3.0 - 0.5 * s.position.x).abs() < 1e-3 && s.extent.contains(s.position));
            assert!((s.color - vec3(1.0, 0.0, 0.2)).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn an_edge_is_curved_and_lone_points_are_a_surfel_each() {
        let edge = (0..10_000).flat_map(|i| {
            let u = (i % 100) as f32 * 0.01;
            let v = (i / 100) as f32 * 0.01;
            [vec3(u, v, 0.0), vec3(0.0, v, u)]
        });
        let surfels = surfels_of(&cloud(edge.collect()), 0);
        assert!(
            surfels
                .iter()
                .filter(|s| s.position.x + s.position.z < 0.06)
                .all(|s| s.curvature > 0.05)
        );
        assert!(
            surfels
                .iter()
                .filter(|s| s.position.x > 0.2)
                .all(|s| s.normal.z.abs() > 0.999)
        );
        let two = surfels_of(&cloud(vec![vec3(-3.0, 0.0, 0.0), vec3(7.0, 1.0, 2.0)]), 5);
        assert_eq!((two.len(), two[1].room), (2, 5));
        assert!(surfels_of(&PointCloud::default(), 0).is_empty());
    }

    #[test]
    fn rooms_do_not_change_the_surfels() {
        let points: Vec<Vec3> = (0..3000u32)
            .map(|i| vec3((i % 60) as f32 * 0.011, (i / 60) as f32 * 0.013, 0.2))
            .collect();
        let whole = surfels_of(&cloud(points.clone()), 0);
        // The border between the rooms goes through cells.
        let of_room = |room: u32| {
            let of_room = points.iter().filter(|p| u32::from(p.x > 0.28) == room);
            Part::of(&cloud(of_room.copied().collect()), room)
        };
        let rooms = surfels_of_parts([of_room(0), of_room(1)]);
        assert_eq!(rooms.len(), whole.len());
        for (a, b) in rooms.iter().zip(&whole) {
            assert_eq!(a.extent, b.extent);
            assert!((a.position - b.position).length() < 1e-6 && a.normal.dot(b.normal).abs() > 0.9999);
            assert_eq!(a.room, u32::from(a.position.x > 0.28), "{a:?}");
        }
    }

    #[test]
    fn runs_find_the_same_neighbours_as_a_search() {
        let points: Vec<Vec3> = (0..3000u32)
            .map(|i| {
                let r = |k: u32| (i.wrapping_mul(k) % 1009) as f32 / 1009.0;
                vec3(r(7919), r(104_729), 0.4 * r(1_299_709))
            })
            .collect();
        let cloud = cloud(points.clone());
        for s in surfels_of(&cloud, 0).iter().step_by(97) {
            let cell = (s.position / CELL_M).floor();
            let near: Vec<DVec3> = points
                .iter()
                .filter(|&&p| ((p / CELL_M).floor() - cell).abs().max_element() < 1.5)
                .map(|p| p.as_dvec3())
                .collect();
            let n = near.len() as f64;
            let mean = near.iter().sum::<DVec3>() / n;
            let of = |a: usize, b: usize| near.iter().map(|p| (p - mean)[a] * (p - mean)[b]).sum::<f64>() / n;
            let expected = least_direction([of(0, 0), of(0, 1), of(0, 2), of(1, 1), of(1, 2), of(2, 2)]);
            assert!((f64::from(s.curvature) - expected.1).abs() < 1e-6);
            assert!(s.normal.as_dvec3().dot(expected.0).abs() > 1.0 - 1e-6);
        }
    }
}
