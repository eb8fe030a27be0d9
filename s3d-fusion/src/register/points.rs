//! The points of a scan, thinned by a grid, and the nearest of them.

use s3d_geom::glam::{DVec3, Vec3};

/// The points of a scan in the scan's own frame (metres), with unit normals that look towards the scanner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanPoints {
    /// The points.
    pub positions: Vec<Vec3>,
    /// One unit normal per point.
    pub normals: Vec<Vec3>,
}

impl ScanPoints {
    /// Thins a scan: at most one point and normal per cube of the edge `cell_m`. It is the mean of those
    /// points of the cube whose normals are within 37° of the first one's. Points and normals that are not
    /// finite are left out. If the columns have different lengths, the longer one is cut.
    pub fn sampled(positions: &[Vec3], normals: &[Vec3], cell_m: f64) -> Self {
        let mut keys: Vec<([i32; 3], u32)> = (0..)
            .zip(positions.iter().zip(normals))
            .filter(|(_, (p, n))| p.is_finite() && n.is_finite())
            .map(|(i, (p, _))| (cell(*p, cell_m), i))
            .collect();
        keys.sort_unstable();

        let mut thin = Self::default();
        for group in keys.chunk_by(|a, b| a.0 == b.0) {
            let first = normals[group[0].1 as usize].as_dvec3().normalize_or_zero();
            let (mut position, mut normal, mut count) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for &(_, i) in group {
                let n = normals[i as usize].as_dvec3().normalize_or_zero();
                if n.dot(first) > 0.8 {
                    position += positions[i as usize].as_dvec3();
                    normal += n;
                    count += 1.0;
                }
            }
            if count > 0.0 {
                thin.positions.push((position / count).as_vec3());
                thin.normals.push(normal.normalize_or_zero().as_vec3());
            }
        }
        thin
    }

    /// The mean of the points; zero if there is none.
    pub(super) fn middle(&self) -> DVec3 {
        let sum: DVec3 = self.positions.iter().map(|p| p.as_dvec3()).sum();
        sum / self.positions.len().max(1) as f64
    }
}

/// The cube that a point lies in.
pub(crate) fn cell(p: Vec3, cell_m: f64) -> [i32; 3] {
    (p.as_dvec3() / cell_m).floor().as_ivec3().to_array()
}

/// Finds points that are near, by cubes.
pub(crate) struct Grid<'a> {
    points: &'a ScanPoints,
    cell_m: f64,
    /// The cube of each point, ascending, with the point.
    cells: Vec<([i32; 3], u32)>,
}

/// How far a point may be from its partner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Along the normal, metres.
    pub(crate) along_m: f64,
    /// Across the normal, metres.
    pub(crate) across_m: f64,
    /// The least cosine between the normals.
    pub(crate) cosine: f64,
    /// Whether a normal and its opposite are the same.
    pub(crate) is_two_sided: bool,
}

impl<'a> Grid<'a> {
    pub(crate) fn new(points: &'a ScanPoints, cell_m: f64) -> Self {
        let all = (0..).zip(&points.positions);
        let mut cells: Vec<([i32; 3], u32)> = all.map(|(i, p)| (cell(*p, cell_m), i)).collect();
        cells.sort_unstable();
        Self { points, cell_m, cells }
    }

    /// The nearest point within reach whose normal fits; the smaller number wins a tie. The reach must not
    /// exceed the edge of the cubes.
    pub(crate) fn nearest(&self, p: DVec3, normal: DVec3, reach: &Reach) -> Option<u32> {
        let [x, y, z] = cell(p.as_vec3(), self.cell_m);
        // No point beyond both reaches fits.
        let most = reach.along_m * reach.along_m + reach.across_m * reach.across_m;
        let mut best = (1.001 * most, None);
        for x in x.saturating_sub(1)..=x.saturating_add(1) {
            for y in y.saturating_sub(1)..=y.saturating_add(1) {
                let begin = self.cells.partition_point(|c| c.0 < [x, y, z.saturating_sub(1)]);
                let last = [x, y, z.saturating_add(1)];
                for &(_, i) in self.cells[begin..].iter().take_while(|c| c.0 <= last) {
                    let q = self.points.positions[i as usize].as_dvec3();
                    let (between, squared) = (p - q, p.distance_squared(q));
                    if squared >= best.0 {
                        continue;
                    }
                    let n = self.points.normals[i as usize].as_dvec3();
                    let along = n.dot(between);
                    let cosine = n.dot(normal);
                    let cosine = if reach.is_two_sided { cosine.abs() } else { cosine };
                    let fits = along.abs() <= reach.along_m
                        && squared - along * along <= reach.across_m * reach.across_m
                        && cosine >= reach.cosine;
                    if fits {
                        best = (squared, Some(i));
                    }
                }
            }
        }
        best.1
    }
}
