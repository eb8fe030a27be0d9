//! Segments of colours, and of surfaces.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use s3d_geom::{Camera, Raster, Rays, segment_graph};

/// The scale of segments: the larger, the larger the segments.
const SCALE: f64 = 300.0;
/// The fewest nodes of a segment, unless nothing is next to it.
const FEWEST: f64 = 50.0;
/// The largest difference of neighbours.
const MOST: u16 = 511;

/// Writes segments of similar colour into an existing image: their numbers from 1, in the order of their
/// first pixels. After 65,535 numbers start again. 0 where nothing is seen.
///
/// The method is Felzenszwalb and Huttenlocher's (see [`segment_graph`]) on the mean colours of 2 × 2
/// pixels, blurred by (1, 2, 1) / 4 in both directions. A node is next to four others, and the difference is
/// the Euclidean distance of their colours. The scale is 300, and a segment has at least 50 nodes if it can.
///
/// # Panics
/// If `colors` and the hits differ in size.
pub fn color_segment_image_into(colors: &Raster<[u8; 3]>, hits: &Hits, wraps: bool, out: &mut Raster<u16>) {
    let (width, height) = (hits.face.width(), hits.face.height());
    assert!((colors.width(), colors.height()) == (width, height), "colours and hits have one size");
    let grid = Grid::new(hits, wraps);
    let colors = blurred(&halved(colors), wraps);
    let colors = colors.pixels();
    let difference = |a: usize, b: usize| {
        let (from, to) = (&colors[a], &colors[b]);
        let [r, g, b] = [0, 1, 2].map(|k| i32::from(from[k]) - i32::from(to[k]));
        (((r * r + g * g + b * b) as f32).sqrt() + 0.5) as u16
    };
    grid.segment(difference, hits, out);
}

/// Writes segments of surfaces into an existing image, numbered like those of colours. 0 where nothing is
/// seen.
///
/// The method is the same as for [`color_segment_image_into`]. A node is what the first of 2 × 2 pixels sees
/// that sees something. The difference of two nodes is 128 · |n − n′| + 255 · g, at most 511: n and
/// n′ are their unit normals towards the camera, and g is the larger distance of a point from the plane of
/// the other, in twentieths of its depth. So neither the floor nor a ceiling falls apart with distance.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn surface_segment_image_into(scene: &Scene<'_>, hits: &Hits, camera: &Camera, out: &mut Raster<u16>) {
    assert_size(hits, camera);
    let grid = Grid::new(hits, camera.is_panorama());
    let mut surfaces =
        Surfaces { scene, hits, camera, rays: camera.rays(), planes: FaceCache::new(), grid: &grid };
    let difference = |a: usize, b: usize| surfaces.difference(a, b);
    grid.segment(difference, hits, out);
}

/// Returns the mean colours of 2 × 2 pixels, rounded. Blocks at the right and lower border may have fewer.
fn halved(colors: &Raster<[u8; 3]>) -> Raster<[u8; 3]> {
    let (width, height) = (colors.width(), colors.height());
    let mut out = Vec::with_capacity(colors.len() / 4 + 1);
    for y in (0..height).step_by(2) {
        let (top, bottom) = (colors.row(y), colors.row((y + 1).min(height - 1)));
        for (top, bottom) in top.chunks(2).zip(bottom.chunks(2)) {
            let (left, right) = (0, top.len() - 1);
            out.push(std::array::from_fn(|k| {
                let sum = u16::from(top[left][k])
                    + u16::from(top[right][k])
                    + u16::from(bottom[left][k])
                    + u16::from(bottom[right][k]);
                ((sum + 2) / 4) as u8
            }));
        }
    }
    Raster::from_vec(width.div_ceil(2), height.div_ceil(2), out)
}

/// Blurs colours by (1, 2, 1) / 4 along rows and columns.
fn blurred(colors: &Raster<[u8; 3]>, wraps: bool) -> Raster<[u8; 3]> {
    let (width, height) = (colors.width() as usize, colors.height() as usize);
    // Sums along rows, times 4.
    let mut across = Vec::with_capacity(colors.len());
    for row in colors.rows() {
        for x in 0..width {
            let (before, after) = if wraps {
                ((x + width - 1) % width, (x + 1) % width)
            } else {
                (x.saturating_sub(1), (x + 1).min(width - 1))
            };
            let (a, b, c) = (row[before], row[x], row[after]);
            across.push([0, 1, 2].map(|k| u16::from(a[k]) + 2 * u16::from(b[k]) + u16::from(c[k])));
        }
    }

    let mut out = Vec::with_capacity(colors.len());
    for y in 0..height {
        let row = |y: usize| &across[y * width..(y + 1) * width];
        let rows = row(y.saturating_sub(1))
            .iter()
            .zip(row(y))
            .zip(row((y + 1).min(height - 1)));
        out.extend(rows.map(|((a, b), c)| [0, 1, 2].map(|k| ((a[k] + 2 * b[k] + c[k] + 8) / 16) as u8)));
    }
    Raster::from_vec(colors.width(), colors.height(), out)
}

/// The nodes of an image: one for each 2 × 2 pixels.
struct Grid {
    width: usize,
    height: usize,
    wraps: bool,
    /// The first pixel of each node that sees something; `u32::MAX` if none does.
    pixel: Vec<u32>,
}

impl Grid {
    fn new(hits: &Hits, wraps: bool) -> Self {
        let (full, rows) = (hits.face.width() as usize, hits.face.height() as usize);
        let (width, height) = (full.div_ceil(2), rows.div_ceil(2));
        let faces = hits.face.pixels();
        let mut pixel = Vec::with_capacity(width * height);
        for y in (0..rows).step_by(2) {
            for x in (0..full).step_by(2) {
                let first = y * full + x;
                let right = first + usize::from(x + 1 < full);
                let below = if y + 1 < rows { full } else { 0 };
                let four = [first, right, first + below, right + below];
                let seen = four.into_iter().find(|at| faces[*at] != NO_FACE);
                pixel.push(seen.map_or(u32::MAX, |at| at as u32));
            }
        }
        Self { width, height, wraps, pixel }
    }

    /// Segments the nodes by the difference of neighbours, and writes the numbers of segments.
    fn segment(&self, mut difference: impl FnMut(usize, usize) -> u16, hits: &Hits, out: &mut Raster<u16>) {
        fit(out, &hits.face, 0);
        if hits.face.is_empty() {
            return;
        }

        let mut edges = Vec::with_capacity(2 * self.pixel.len());
        let mut add = |node: usize, other: usize| {
            if self.pixel[node] != u32::MAX && self.pixel[other] != u32::MAX {
                edges.push((node as u32, other as u32, difference(node, other).min(MOST)));
            }
        };
        for y in 0..self.height {
            let start = y * self.width;
            for node in start..start + self.width {
                if node + 1 < start + self.width {
                    add(node, node + 1);
                } else if self.wraps && self.width > 2 {
                    // Two columns are neighbours once.
                    add(node, start);
                }
                if y + 1 < self.height {
                    add(node, node + self.width);
                }
            }
        }

        let order = ascending(&edges);
        let mut sets = segment_graph(vec![1.0; self.pixel.len()], order.iter().copied(), SCALE, FEWEST);

        let mut number_of_root = vec![0u16; self.pixel.len()];
        let mut last = 0u16;
        let mut numbers = Vec::with_capacity(self.pixel.len());
        for node in 0..self.pixel.len() {
            if self.pixel[node] == u32::MAX {
                numbers.push(0);
                continue;
            }
            let number = &mut number_of_root[sets.root(node as u32) as usize];
            if *number == 0 {
                last = last.checked_add(1).unwrap_or(1);
                *number = last;
            }
            numbers.push(*number);
        }
        self.write(&numbers, hits, out);
    }

    /// Writes the numbers of nodes to the pixels that see something.
    fn write(&self, numbers: &[u16], hits: &Hits, out: &mut Raster<u16>) {
        let width = hits.face.width() as usize;
        let rows = hits.face.rows().zip(out.pixels_mut().chunks_exact_mut(width));
        for (y, (faces, out)) in rows.enumerate() {
            let numbers = &numbers[y / 2 * self.width..(y / 2 + 1) * self.width];
            for ((faces, out), number) in faces.chunks(2).zip(out.chunks_mut(2)).zip(numbers) {
                for (face, out) in faces.iter().zip(out) {
                    *out = if *face == NO_FACE { 0 } else { *number };
                }
            }
        }
    }
}

/// Returns edges from the smallest difference on; equal ones in their order. Differences are small numbers,
/// so counting sorts them.
fn ascending(edges: &[(u32, u32, u16)]) -> Vec<([u32; 2], f32)> {
    let mut starts = vec![0u32; usize::from(MOST) + 2];
    for (_, _, difference) in edges {
        starts[usize::from(*difference) + 1] += 1;
    }
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    let mut order = vec![([0; 2], 0.0); edges.len()];
    for (node, other, difference) in edges {
        let place = &mut starts[usize::from(*difference)];
        order[*place as usize] = ([*node, *other], f32::from(*difference));
        *place += 1;
    }
    order
}

/// The differences of surfaces.
struct Surfaces<'a> {
    scene: &'a Scene<'a>,
    hits: &'a Hits,
    camera: &'a Camera,
    rays: Rays,
    planes: FaceCache<Plane>,
    grid: &'a Grid,
}

impl Surfaces<'_> {
    fn difference(&mut self, a: usize, b: usize) -> u16 {
        let [a, b] = [a, b].map(|node| self.grid.pixel[node] as usize);
        let faces = [a, b].map(|pixel| self.hits.face.pixels()[pixel]);
        if faces[0] == faces[1] {
            return 0;
        }

        let width = self.hits.face.width() as usize;
        let eye = self.camera.pose.location;
        let rays = [a, b].map(|pixel| self.rays.at((pixel % width) as u32, (pixel / width) as u32));
        let depths = [a, b].map(|pixel| f64::from(self.hits.depth.pixels()[pixel]));
        let [from, to] =
            faces.map(|face| *self.planes.get(face, || Plane::new(self.scene.mesh(), face, eye)));
        let side = |plane: Plane| {
            if plane.offset > 0.0 {
                -plane.normal
            } else {
                plane.normal
            }
        };
        let turn = (side(from) - side(to)).length();
        let gap =
            |plane: Plane, ray: glam::DVec3, depth: f64| (plane.normal.dot(ray) * depth - plane.offset).abs();
        let gap = gap(from, rays[1], depths[1]).max(gap(to, rays[0], depths[0]));
        (128.0 * turn + 255.0 * 20.0 * gap / depths[0].min(depths[1]) + 0.5).min(f64::from(MOST)) as u16
    }
}
