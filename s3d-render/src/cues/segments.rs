//! Segments of colours, and of surfaces.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use s3d_geom::{Camera, DisjointSets, Raster, Rays, segment_graph};
use s3d_simd::{dispatch, level};

/// The scale of segments: the larger, the larger the segments.
const SCALE: f64 = 300.0;
/// The fewest nodes of a segment, unless nothing is next to it.
const FEWEST: f64 = 50.0;
/// The largest difference of neighbours.
const MOST: u16 = 511;
/// The difference from a neighbour that is not there, or sees nothing.
const NONE: u16 = u16::MAX;

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
    let differences = dispatch!(level(), _simd => {
        let channels = halved(colors).map(|channel| blurred(&channel, grid.width, wraps));
        Differences::new(&grid, |a, b, out| color_differences(&channels, a, b, out))
    });
    grid.segment(&differences, hits, out);
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
    let differences = Differences::new(&grid, |a, b, out| {
        let faces = grid.face[a..].iter().zip(&grid.face[b..]);
        for (i, (out, (face, other))) in out.iter_mut().zip(faces).enumerate() {
            *out = if face == other {
                0
            } else {
                surfaces.difference(a + i, b + i)
            };
        }
    });
    grid.segment(&differences, hits, out);
}

/// Returns the mean red, green and blue of 2 × 2 pixels, rounded. Blocks at the right and lower border may
/// have fewer.
#[inline(always)]
fn halved(colors: &Raster<[u8; 3]>) -> [Vec<u8>; 3] {
    let mut channels = [0; 3].map(|_| Vec::with_capacity(colors.len() / 4 + 1));
    let mut sums = vec![[0u16; 3]; colors.width() as usize];
    for y in (0..colors.height()).step_by(2) {
        let (top, bottom) = (colors.row(y), colors.row((y + 1).min(colors.height() - 1)));
        let levels = top.as_flattened().iter().zip(bottom.as_flattened());
        for (sum, (top, bottom)) in sums.as_flattened_mut().iter_mut().zip(levels) {
            *sum = u16::from(*top) + u16::from(*bottom);
        }
        for (k, channel) in channels.iter_mut().enumerate() {
            channel.extend(sums.chunks(2).map(|pair| {
                let (left, right) = (pair[0][k], pair[pair.len() - 1][k]);
                ((left + right + 2) / 4) as u8
            }));
        }
    }
    channels
}

/// Blurs levels by (1, 2, 1) / 4 along rows and columns.
#[inline(always)]
fn blurred(levels: &[u8], width: usize, wraps: bool) -> Vec<u8> {
    // Sums along rows, times 4. A row has a copy of a neighbour at each end.
    let mut across = vec![0u16; levels.len()];
    let mut line = vec![0u8; width + 2];
    for (levels, out) in levels
        .chunks_exact(width.max(1))
        .zip(across.chunks_exact_mut(width.max(1)))
    {
        line[1..=width].copy_from_slice(levels);
        let ends = if wraps { (width - 1, 0) } else { (0, width - 1) };
        (line[0], line[width + 1]) = (levels[ends.0], levels[ends.1]);
        let neighbours = line[..width].iter().zip(&line[2..]);
        for ((out, level), (before, after)) in out.iter_mut().zip(levels).zip(neighbours) {
            *out = u16::from(*before) + 2 * u16::from(*level) + u16::from(*after);
        }
    }

    let mut out = vec![0u8; levels.len()];
    for start in (0..levels.len()).step_by(width.max(1)) {
        let row = &across[start..start + width];
        let above = &across[start.saturating_sub(width)..][..width];
        let below = across.get(start + width..start + 2 * width).unwrap_or(row);
        let sums = above.iter().zip(row).zip(below);
        for (out, ((above, level), below)) in out[start..start + width].iter_mut().zip(sums) {
            *out = ((above + 2 * level + below + 8) / 16) as u8;
        }
    }
    out
}

/// Writes the differences of the colours of nodes from `a` on and from `b` on.
#[inline(always)]
fn color_differences(channels: &[Vec<u8>; 3], a: usize, b: usize, out: &mut [u16]) {
    let count = out.len();
    let [red, green, blue] = channels;
    let (red, other_red) = (&red[a..a + count], &red[b..b + count]);
    let (green, other_green) = (&green[a..a + count], &green[b..b + count]);
    let (blue, other_blue) = (&blue[a..a + count], &blue[b..b + count]);
    for (i, out) in out.iter_mut().enumerate() {
        let r = i32::from(red[i]) - i32::from(other_red[i]);
        let g = i32::from(green[i]) - i32::from(other_green[i]);
        let b = i32::from(blue[i]) - i32::from(other_blue[i]);
        *out = (((r * r + g * g + b * b) as f32).sqrt() + 0.5) as u16;
    }
}

/// The difference of each node from the next one in its row, and from the one below; [`NONE`] without one.
struct Differences {
    right: Vec<u16>,
    below: Vec<u16>,
}

impl Differences {
    /// `differ` writes those of nodes from one on and from another on.
    #[inline(always)]
    fn new(grid: &Grid, mut differ: impl FnMut(usize, usize, &mut [u16])) -> Self {
        let width = grid.width;
        let mut right = vec![NONE; grid.face.len()];
        let mut below = vec![NONE; grid.face.len()];
        for start in (0..grid.face.len()).step_by(width.max(1)) {
            let (last, end) = (start + width - 1, start + width);
            differ(start, start + 1, &mut right[start..last]);
            hide_unseen(&grid.face[start..], &grid.face[start + 1..], &mut right[start..last]);
            if grid.wraps && width > 2 {
                // Two columns are neighbours once.
                differ(last, start, &mut right[last..end]);
                hide_unseen(&grid.face[last..], &grid.face[start..], &mut right[last..end]);
            }
            if end < grid.face.len() {
                differ(start, end, &mut below[start..end]);
                hide_unseen(&grid.face[start..], &grid.face[end..], &mut below[start..end]);
            }
        }
        Self { right, below }
    }
}

/// Writes [`NONE`] where one of two nodes sees nothing.
#[inline(always)]
fn hide_unseen(faces: &[u32], others: &[u32], out: &mut [u16]) {
    for (out, (face, other)) in out.iter_mut().zip(faces.iter().zip(others)) {
        *out = if (*face == NO_FACE) | (*other == NO_FACE) {
            NONE
        } else {
            *out
        };
    }
}

/// The nodes of an image: one for each 2 × 2 pixels.
struct Grid {
    width: usize,
    wraps: bool,
    /// The face that the first pixel of each node sees that sees something, or [`NO_FACE`].
    face: Vec<u32>,
}

impl Grid {
    fn new(hits: &Hits, wraps: bool) -> Self {
        let width = hits.face.width().div_ceil(2) as usize;
        let mut face = Vec::with_capacity(width * hits.face.height().div_ceil(2) as usize);
        for y in (0..hits.face.height()).step_by(2) {
            let (top, bottom) = (hits.face.row(y), hits.face.row((y + 1).min(hits.face.height() - 1)));
            for (top, bottom) in top.chunks(2).zip(bottom.chunks(2)) {
                let seen = top.iter().chain(bottom).find(|face| **face != NO_FACE);
                face.push(seen.copied().unwrap_or(NO_FACE));
            }
        }
        Self { width, wraps, face }
    }

    /// Returns the first pixel of a node that sees something: its column, row and place.
    fn pixel(&self, node: usize, hits: &Hits) -> (u32, u32, usize) {
        let (full, rows) = (hits.face.width() as usize, hits.face.height() as usize);
        let (x, y) = (node % self.width * 2, node / self.width * 2);
        let (right, below) = ((x + 1).min(full - 1), (y + 1).min(rows - 1));
        let four = [(x, y), (right, y), (x, below), (right, below)].map(|(x, y)| (x, y, y * full + x));
        let seen = four.iter().find(|(.., at)| hits.face.pixels()[*at] != NO_FACE);
        let (x, y, at) = *seen.unwrap_or(&four[0]);
        (x as u32, y as u32, at)
    }

    /// Segments the nodes by the difference of neighbours, and writes the numbers of segments.
    fn segment(&self, differences: &Differences, hits: &Hits, out: &mut Raster<u16>) {
        fit(out, &hits.face, 0);
        if hits.face.is_empty() {
            return;
        }

        // What does not differ is joined first in any case, so a graph of these sets is enough.
        let (set_of_node, count) = self.alike(differences);
        let mut sizes = vec![0.0; count];
        set_of_node.iter().for_each(|set| sizes[*set as usize] += 1.0);

        let order = Ascending::new(|then| self.for_each_edge(differences, &set_of_node, then));
        let mut sets = segment_graph(sizes, order.edges(), SCALE, FEWEST);

        let mut number_of_root = vec![0u16; count];
        let mut last = 0u16;
        let mut numbers = Vec::with_capacity(self.face.len());
        for (set, face) in set_of_node.iter().zip(&self.face) {
            if *face == NO_FACE {
                numbers.push(0);
                continue;
            }
            let number = &mut number_of_root[sets.root(*set) as usize];
            if *number == 0 {
                last = last.checked_add(1).unwrap_or(1);
                *number = last;
            }
            numbers.push(*number);
        }
        self.write(&numbers, hits, out);
    }

    /// Calls `then` with the two sets of each edge between sets, and their difference.
    fn for_each_edge(
        &self,
        differences: &Differences,
        set_of_node: &[u32],
        then: &mut dyn FnMut([u32; 2], u16),
    ) {
        let between = differences.right.iter().zip(&differences.below);
        for ((node, set), (right, below)) in set_of_node.iter().enumerate().zip(between) {
            if (1..NONE).contains(right) {
                let other = set_of_node[self.next(node)];
                if *set != other {
                    then([*set, other], *right);
                }
            }
            if (1..NONE).contains(below) {
                let other = set_of_node[node + self.width];
                if *set != other {
                    then([*set, other], *below);
                }
            }
        }
    }

    /// Returns the next node in the row of a node.
    fn next(&self, node: usize) -> usize {
        if (node + 1).is_multiple_of(self.width) {
            node + 1 - self.width
        } else {
            node + 1
        }
    }

    /// Returns the set of each node, and how many there are: neighbours without a difference are in one.
    fn alike(&self, differences: &Differences) -> (Vec<u32>, usize) {
        let Differences { right, below } = differences;
        let width = self.width;
        // Nodes of a row that are alike are one run.
        let mut runs = DisjointSets::default();
        let mut of_node = vec![0; self.face.len()];
        for start in (0..of_node.len()).step_by(width) {
            let mut run = 0;
            for node in start..start + width {
                let is_like_left = node > start && right[node - 1] == 0;
                if !is_like_left {
                    run = runs.add();
                }
                of_node[node] = run;
                if node >= width && below[node - width] == 0 {
                    // The left one and those above both of them make a ring.
                    let above = node - width;
                    if !(is_like_left && below[above - 1] == 0 && right[above - 1] == 0) {
                        runs.unite(run, of_node[above]);
                    }
                }
            }
            if right[start + width - 1] == 0 {
                runs.unite(of_node[start], run);
            }
        }

        let (set_of_run, count) = runs.numbered();
        of_node.iter_mut().for_each(|run| *run = set_of_run[*run as usize]);
        (of_node, count)
    }

    /// Writes the numbers of nodes to the pixels that see something.
    fn write(&self, numbers: &[u16], hits: &Hits, out: &mut Raster<u16>) {
        let width = hits.face.width() as usize;
        let mut twice = vec![[0; 2]; self.width];
        let rows = hits.face.rows().zip(out.pixels_mut().chunks_exact_mut(width));
        for (y, (faces, out)) in rows.enumerate() {
            let numbers = &numbers[y / 2 * self.width..(y / 2 + 1) * self.width];
            dispatch!(level(), _simd => {
                for (twice, number) in twice.iter_mut().zip(numbers) {
                    *twice = [*number; 2];
                }
                for ((face, out), number) in faces.iter().zip(out).zip(twice.as_flattened()) {
                    *out = if *face == NO_FACE { 0 } else { *number };
                }
            });
        }
    }
}

/// Edges by their difference; equal ones in their order. Differences are small numbers, so counting sorts
/// them.
struct Ascending {
    /// Where the edges of each difference end.
    ends: Vec<u32>,
    nodes: Vec<[u32; 2]>,
}

impl Ascending {
    /// `for_each` calls a function with each edge; it is asked twice.
    fn new(for_each: impl Fn(&mut dyn FnMut([u32; 2], u16))) -> Self {
        let mut ends = vec![0u32; usize::from(MOST) + 2];
        for_each(&mut |_, difference| ends[usize::from(difference) + 1] += 1);
        for k in 1..ends.len() {
            ends[k] += ends[k - 1];
        }
        let mut nodes = vec![[0; 2]; ends.last().map_or(0, |count| *count as usize)];
        for_each(&mut |edge, difference| {
            let place = &mut ends[usize::from(difference)];
            nodes[*place as usize] = edge;
            *place += 1;
        });
        Self { ends, nodes }
    }

    fn edges(&self) -> impl Iterator<Item = ([u32; 2], f32)> {
        let mut start = 0;
        self.ends.iter().enumerate().flat_map(move |(difference, end)| {
            let nodes = &self.nodes[start..*end as usize];
            start = *end as usize;
            nodes.iter().map(move |nodes| (*nodes, difference as f32))
        })
    }
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
        let faces = [a, b].map(|node| self.grid.face[node]);
        if faces.contains(&NO_FACE) {
            return NONE;
        }

        let eye = self.camera.pose.location;
        let pixels = [a, b].map(|node| self.grid.pixel(node, self.hits));
        let rays = pixels.map(|(x, y, _)| self.rays.at(x, y));
        let depths = pixels.map(|(.., at)| f64::from(self.hits.depth.pixels()[at]));
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
