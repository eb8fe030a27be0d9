//! A mesh as columns of samples over a grid of the plan.

use s3d_geom::TriMesh;
use s3d_geom::glam::{DVec2, DVec3, Vec3, dvec2};

/// The edge of the cells of the plan, metres. Larger scans have larger cells.
const STEP_M: f64 = 0.05;

/// The largest edge of cells that show doors, metres.
const LARGEST_STEP_M: f64 = 0.25;

/// The most cells of a plan: those of 200 × 200 m.
const MOST_CELLS: f64 = 16e6;

/// The most samples of a mesh.
const MOST_SAMPLES: f64 = 48e6;

/// How many cells the plan goes on beyond the mesh on each side.
const RIM: f64 = 10.0;

/// The smallest vertical part of the unit normal of a surface that counts as level: it slopes by 37° at most.
pub(super) const LEVEL: f64 = 0.8;

/// The smallest vertical part of the unit normal of a ceiling: a roof slopes by 66° at most.
pub(super) const OVERHEAD: f64 = 0.4;

/// The largest vertical part of the unit normal of a wall: it leans by 17° at most.
pub(super) const UPRIGHT: f64 = 0.3;

/// A square grid over the plan.
pub(super) struct Grid {
    pub(super) low: DVec2,
    pub(super) step_m: f64,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Grid {
    /// Returns the cell of a place; of a place outside, the one nearest along each axis.
    pub(super) fn cell(&self, place: DVec2) -> usize {
        let at = (place - self.low) / self.step_m;
        // Conversions of numbers out of range saturate.
        let x = (at.x as usize).min(self.width - 1);
        let y = (at.y as usize).min(self.height - 1);
        y * self.width + x
    }

    /// Returns the middle of a cell.
    pub(super) fn middle(&self, cell: usize) -> DVec2 {
        let [x, y] = self.place(cell);
        self.low + self.step_m * dvec2(x as f64 + 0.5, y as f64 + 0.5)
    }

    /// Returns the column and the row of a cell.
    pub(super) fn place(&self, cell: usize) -> [usize; 2] {
        [cell % self.width, cell / self.width]
    }

    pub(super) fn cells(&self) -> usize {
        self.width * self.height
    }

    /// The area of a cell, m².
    pub(super) fn cell_m2(&self) -> f64 {
        self.step_m * self.step_m
    }

    /// Returns the cells that share an edge with a cell.
    pub(super) fn beside(&self, cell: usize) -> impl Iterator<Item = usize> {
        let [x, y] = self.place(cell);
        let (width, height) = (self.width, self.height);
        let left = (x > 0).then(|| cell - 1);
        let right = (x + 1 < width).then(|| cell + 1);
        let down = (y > 0).then(|| cell - width);
        let up = (y + 1 < height).then(|| cell + width);
        [left, right, down, up].into_iter().flatten()
    }
}

/// A face as a piece of a plane.
#[derive(Clone, Copy)]
pub(super) struct Facet {
    /// The unit normal, on the side that the winding says.
    pub(super) normal: DVec3,
    pub(super) middle: DVec3,
    pub(super) area_m2: f64,
}

impl Facet {
    fn new(corners: [DVec3; 3], normal: DVec3) -> Self {
        let [a, b, c] = corners;
        let area_m2 = 0.5 * (b - a).cross(c - a).length();
        Self { normal, middle: (a + b + c) / 3.0, area_m2 }
    }

    /// Returns the height of its plane at a place, no farther than 10 cm from that of its middle, so that
    /// steep faces stay where they are.
    pub(super) fn height_at(&self, place: DVec2) -> f64 {
        let slope = self.normal.truncate().dot(place - self.middle.truncate()) / self.normal.z;
        self.middle.z - if slope.is_finite() { slope.clamp(-0.1, 0.1) } else { 0.0 }
    }

    pub(super) fn is_level(&self) -> bool {
        self.normal.z.abs() >= LEVEL
    }

    pub(super) fn is_upright(&self) -> bool {
        self.normal != DVec3::ZERO && self.normal.z.abs() <= UPRIGHT
    }
}

/// A point of a face.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) z: f32,
    pub(super) face: u32,
}

/// A mesh, sampled at least once a cell, with its samples sorted into the columns above the cells.
pub(super) struct Scan {
    pub(super) grid: Grid,
    pub(super) facets: Vec<Facet>,
    samples: Vec<Sample>,
    /// The first sample of each cell, and the number of samples.
    first: Vec<u32>,
}

impl Scan {
    /// Samples a mesh. `normals` are the unit normals of its faces, in which noise is smoothed. `None` if its
    /// size asks for cells so large that no door fits into them.
    pub(super) fn new(mesh: &TriMesh, normals: &[Vec3]) -> Option<Self> {
        let bounds = mesh.aabb();
        let [low, high] = [bounds.min, bounds.max].map(|corner| corner.as_dvec3().truncate());
        let size = high - low;
        let corners_of = |face: u32| mesh.triangle(face).map(|corner| corner.as_dvec3());
        let faces = 0..mesh.faces().len() as u32;

        let mut step_m = STEP_M;
        while {
            let cells = (size / step_m + 2.0 * RIM).element_product();
            let pieces = |face| pieces(corners_of(face), step_m) as f64;
            let samples: f64 = faces.clone().map(|face| pieces(face) * pieces(face)).sum();
            cells > MOST_CELLS || samples > MOST_SAMPLES
        } {
            step_m *= 1.5;
            if step_m > LARGEST_STEP_M {
                return None;
            }
        }

        let cells = (size / step_m + 2.0 * RIM).floor() + 1.0;
        let grid =
            Grid { low: low - RIM * step_m, step_m, width: cells.x as usize, height: cells.y as usize };
        let facets = faces.clone().zip(normals);
        let facets = facets
            .map(|(face, normal)| Facet::new(corners_of(face), normal.as_dvec3()))
            .collect();

        // Count the samples of each column, then put them there.
        let mut first = vec![0u32; grid.cells() + 1];
        for face in faces.clone() {
            for_samples(corners_of(face), step_m, |point| first[grid.cell(point.truncate()) + 1] += 1);
        }
        for cell in 1..first.len() {
            first[cell] += first[cell - 1];
        }
        let mut next = first.clone();
        let mut samples = vec![Sample { z: 0.0, face: 0 }; first.last().map_or(0, |all| *all as usize)];
        for face in faces {
            for_samples(corners_of(face), step_m, |point| {
                let place = &mut next[grid.cell(point.truncate())];
                samples[*place as usize] = Sample { z: point.z as f32, face };
                *place += 1;
            });
        }
        for cell in 0..grid.cells() {
            let column = &mut samples[first[cell] as usize..first[cell + 1] as usize];
            column.sort_unstable_by(|a, b| a.z.total_cmp(&b.z).then(a.face.cmp(&b.face)));
        }
        Some(Self { grid, facets, samples, first })
    }

    /// Returns the samples above a cell, from below.
    pub(super) fn column(&self, cell: usize) -> &[Sample] {
        &self.samples[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    pub(super) fn facet(&self, face: u32) -> &Facet {
        &self.facets[face as usize]
    }
}

/// The number of pieces that each edge of a face is cut into.
fn pieces(corners: [DVec3; 3], step_m: f64) -> usize {
    let [a, b, c] = corners;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    (longest / step_m).ceil().clamp(1.0, 4096.0) as usize
}

/// Calls `see` with the middles of equal triangles that a face is cut into, none larger than a cell.
pub(super) fn for_samples(corners: [DVec3; 3], step_m: f64, mut see: impl FnMut(DVec3)) {
    let n = pieces(corners, step_m);
    let [a, b, c] = corners;
    let [along, across] = [(b - a) / n as f64, (c - a) / n as f64];
    for i in 0..n {
        for j in 0..n - i {
            let corner = a + along * i as f64 + across * j as f64;
            see(corner + (along + across) / 3.0);
            if i + j + 1 < n {
                see(corner + (along + across) * (2.0 / 3.0));
            }
        }
    }
}
