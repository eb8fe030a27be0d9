//! The whole mesh while it is decimated, and its pieces.

use super::distance::to_triangle;
use super::patch::{Freedom, Lists, Patch, Sample};
use super::quadric::Quadric;
use crate::columns::MeshColumns;
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};

/// The whole mesh. Faces and vertices keep their numbers and are dropped at the end.
pub(super) struct Whole {
    pub(super) positions: Vec<Vec3>,
    pub(super) colors: Vec<Vec3>,
    pub(super) nearest_vertex: Vec<u32>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) is_alive: Vec<bool>,
    pub(super) samples: Vec<Sample>,
    /// The face that each sample is near to.
    pub(super) face_of_sample: Vec<u32>,
    border_points: Vec<Vec3>,
    /// The vertex that the border edge of a point starts at.
    start_of_border_point: Vec<u32>,
    color_scale_m: f64,
}

impl Whole {
    /// Takes the samples of a mesh: its vertices, the middles of its edges and of its faces, and more within
    /// faces that are large beside the bound.
    pub(super) fn new(mesh: &MeshColumns<'_>, max_error_m: f32, color_scale_m: f64) -> Self {
        let has_colors = !mesh.colors.is_empty();
        let color_scale_m = if has_colors { color_scale_m } else { 0.0 };
        let is_face = |f: &[u32; 3]| f[0] != f[1] && f[1] != f[2] && f[2] != f[0];
        let color = |v: u32| if has_colors { mesh.colors[v as usize] } else { [0; 3] };
        let mut samples = Vec::new();
        let mut face_of_sample = Vec::new();
        let mut take = |corners: [u32; 3], weights: [u32; 3], face: u32| {
            let sum = weights.iter().sum::<u32>();
            let of_sum = corners.into_iter().zip(weights);
            let at = of_sum
                .clone()
                .map(|(v, w)| mesh.positions[v as usize] * (w as f32 / sum as f32))
                .sum();
            let channel =
                |i: usize| of_sum.clone().map(|(v, w)| u32::from(color(v)[i]) * w).sum::<u32>() / sum;
            samples.push(Sample { at, color: [0, 1, 2].map(|i| channel(i) as u8) });
            face_of_sample.push(face);
        };

        let step_m = step_m(mesh, max_error_m);
        let mut is_taken = vec![false; mesh.positions.len()];
        for (face, &corners) in (0..).zip(mesh.faces).filter(|(_, f)| is_face(f)) {
            for (i, &v) in corners.iter().enumerate() {
                if !std::mem::replace(&mut is_taken[v as usize], true) {
                    take(corners, [0, 1, 2].map(|at| u32::from(at == i)), face);
                }
            }
            let steps = steps(mesh, &corners, step_m);
            if steps <= 2 {
                take(corners, [1; 3], face);
                continue;
            }
            for i in 0..steps {
                for j in 0..=steps - i {
                    let weights = [i, j, steps - i - j];
                    if weights.iter().all(|&w| w < steps) {
                        take(corners, weights, face);
                    }
                }
            }
        }
        let (mut border_points, mut start_of_border_point) = (Vec::new(), Vec::new());
        let sides = sides_by_vertex(mesh.positions.len(), mesh.faces, is_face);
        for low in 0..mesh.positions.len() as u32 {
            for sides in sides.of(low).chunk_by(|a, b| a.0 == b.0) {
                let (high, face) = sides[0];
                take([low, high, low], [1, 1, 0], face);
                if sides.len() > 1 {
                    continue;
                }
                let corners = mesh.faces[face as usize];
                let ascends = (0..3).any(|i| [corners[i], corners[(i + 1) % 3]] == [low, high]);
                let (start, end) = if ascends { (low, high) } else { (high, low) };
                let [p, q] = [start, end].map(|v| mesh.positions[v as usize]);
                let steps = steps(mesh, &[start, end, end], step_m).max(2);
                border_points.extend((0..steps).map(|i| p.lerp(q, i as f32 / steps as f32)));
                start_of_border_point.extend((0..steps).map(|_| start));
            }
        }
        drop(sides);

        Self {
            positions: mesh.positions.to_vec(),
            colors: (0..mesh.positions.len() as u32)
                .map(|v| Vec3::from(color(v).map(f32::from)))
                .collect(),
            nearest_vertex: (0..mesh.positions.len() as u32).collect(),
            faces: mesh.faces.to_vec(),
            is_alive: mesh.faces.iter().map(is_face).collect(),
            samples,
            face_of_sample,
            border_points,
            start_of_border_point,
            color_scale_m,
        }
    }

    pub(super) fn alive(&self) -> usize {
        self.is_alive.iter().filter(|&&alive| alive).count()
    }

    /// The area of the surface, m².
    pub(super) fn area(&self) -> f64 {
        let areas = self
            .faces
            .iter()
            .zip(&self.is_alive)
            .filter(|(_, alive)| **alive)
            .map(|(f, _)| {
                let [a, b, c] = f.map(|v| self.positions[v as usize].as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            });
        areas.sum()
    }

    /// Distances of the samples from the surface: the largest, and the root of the mean square. Metres.
    pub(super) fn errors_m(&self) -> [f64; 2] {
        let squared = |(sample, &face): (&Sample, &u32)| {
            let triangle = self.faces[face as usize].map(|v| self.positions[v as usize]);
            f64::from(to_triangle(sample.at, triangle).0)
        };
        let worse = |(worst, sum): (f64, f64), (d, more): (f64, f64)| (worst.max(d), sum + more);
        let some = self
            .samples
            .par_chunks(AT_ONCE)
            .zip(self.face_of_sample.par_chunks(AT_ONCE));
        let parts: Vec<(f64, f64)> = some
            .map(|(samples, faces)| {
                let each = samples.iter().zip(faces).map(squared);
                each.fold((0.0, 0.0), |all, d| worse(all, (d, d)))
            })
            .collect();
        let (worst, sum) = parts.into_iter().fold((0.0, 0.0), worse);
        [worst.sqrt(), (sum / self.samples.len().max(1) as f64).sqrt()]
    }

    /// Cuts the mesh into pieces: the vertices in a cube of the edge `cell_m` are one. All cubes are moved by
    /// the share `shift` of an edge along each axis. `work` changes each piece, in parallel, and what it did
    /// is taken over. Pieces share no face that may change.
    pub(super) fn by_cubes(
        &mut self,
        cell_m: f64,
        shift: f64,
        work: impl Fn(&mut Patch) + Sync,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Option<()> {
        let cell = |p: &Vec3| (p.as_dvec3() / cell_m + shift).floor().as_ivec3().to_array();
        let mut numbers: Vec<[i32; 3]> = self.positions.par_iter().map(cell).collect();
        numbers.dedup();
        numbers.par_sort_unstable();
        numbers.dedup();
        let number = |p: &Vec3| {
            let cell = cell(p);
            numbers.partition_point(|n| *n < cell) as u32
        };
        let cell_of: Vec<u32> = self.positions.par_iter().map(number).collect();
        self.by_cells(&cell_of, numbers.len(), work, go_on)
    }

    /// `work` changes the whole mesh as one piece.
    pub(super) fn at_once(&mut self, work: impl Fn(&mut Patch) + Sync) {
        self.by_cells(&vec![0; self.positions.len()], 1, work, &mut |_| true);
    }

    /// Tells `go_on` the share that is done; `None` if it says no.
    fn by_cells(
        &mut self,
        cell_of: &[u32],
        cells: usize,
        work: impl Fn(&mut Patch) + Sync,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Option<()> {
        // A face is known to the cell of each of its corners; a cell owns it if all are there.
        let alive = || (0..).zip(&self.faces).filter(|(i, _)| self.is_alive[*i as usize]);
        let cells_of = |corners: &[u32; 3]| corners.map(|v| cell_of[v as usize]);
        let faces = Grouped::new(
            cells,
            alive().flat_map(|(face, corners)| {
                let [a, b, c] = cells_of(corners);
                let each = [Some(a), Some(b).filter(|b| *b != a), Some(c).filter(|c| *c != a && *c != b)];
                each.into_iter().flatten().map(move |cell| (cell, face))
            }),
        );
        let mut freedom = vec![Freedom::Free; self.positions.len()];
        for (_, corners) in alive() {
            let [a, b, c] = cells_of(corners);
            if a != b || b != c {
                corners.iter().for_each(|&v| freedom[v as usize] = Freedom::Fixed);
            }
        }

        let samples = Grouped::new(self.faces.len(), (0..).zip(&self.face_of_sample).map(|(i, &f)| (f, i)));
        let starts = (0..).zip(&self.start_of_border_point);
        let mut border: Vec<(u32, u32)> = starts.map(|(i, &v)| (cell_of[v as usize], i)).collect();
        border.par_sort_unstable();

        // What other pieces see of a piece keeps its place. Its colours change when all pieces are done.
        let mut seen_colors = Vec::new();
        let cells: Vec<u32> = (0..cells as u32).filter(|cell| !faces.of(*cell).is_empty()).collect();
        let a_batch = PIECES_A_THREAD * rayon::current_num_threads();
        for (i, some) in cells.chunks(a_batch).enumerate() {
            if !go_on((i * a_batch) as f64 / cells.len() as f64) {
                return None;
            }
            let done: Vec<Piece> = some
                .par_iter()
                .map(|&cell| {
                    let samples_of = |face: u32| {
                        let is_own = cells_of(&self.faces[face as usize]) == [cell; 3];
                        if is_own { samples.of(face) } else { &[] }
                    };
                    let faces = faces.of(cell).to_vec();
                    let mut piece = self.piece(faces, samples_of, of_cell(&border, cell), |v| {
                        if cell_of[v as usize] == cell {
                            freedom[v as usize]
                        } else {
                            Freedom::Frozen
                        }
                    });
                    piece.patch.prepare();
                    work(&mut piece.patch);
                    piece.patch.quadrics = Vec::new();
                    piece
                })
                .collect();
            for piece in &done {
                self.take_over(piece, &mut seen_colors);
            }
        }
        for (vertex, color) in seen_colors {
            self.colors[vertex as usize] = color;
        }
        Some(())
    }

    /// The piece of some faces, with their samples, and points of the border: pairs of a cell and a number.
    fn piece<'a>(
        &self,
        faces: Vec<u32>,
        samples_of: impl Fn(u32) -> &'a [u32],
        border: &[(u32, u32)],
        freedom: impl Fn(u32) -> Freedom,
    ) -> Piece {
        let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| self.faces[f as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();

        // A border that no living face uses has gone already, and its points with it.
        let vertex = |v: u32| vertices.partition_point(|&u| u < v) as u32;
        let is_used = |v: u32| vertices.binary_search(&v).is_ok();
        let border = border.iter().map(|b| b.1);
        let border: Vec<u32> = border
            .filter(|&b| is_used(self.start_of_border_point[b as usize]))
            .collect();

        // The samples of a face lie side by side in memory.
        let samples: Vec<u32> = faces.iter().flat_map(|&f| samples_of(f)).copied().collect();
        let mut samples_of_face = Lists::new(faces.len(), samples.len());
        let mut numbers = 0..;
        for (i, &face) in (0..).zip(&faces) {
            for (_, number) in samples_of(face).iter().zip(&mut numbers) {
                samples_of_face.push(i, number);
            }
        }
        let mut border_points_of = Lists::new(vertices.len(), border.len());
        for (i, &point) in (0..).zip(&border) {
            border_points_of.push(vertex(self.start_of_border_point[point as usize]), i);
        }

        let of_vertices = || vertices.iter().map(|&v| v as usize);
        let middle = of_vertices().map(|v| self.positions[v].as_dvec3()).sum::<DVec3>();
        let patch = Patch {
            positions: of_vertices().map(|v| self.positions[v]).collect(),
            colors: of_vertices().map(|v| self.colors[v]).collect(),
            freedom: vertices.iter().map(|&v| freedom(v)).collect(),
            on_border: vec![false; vertices.len()],
            nearest_vertex: of_vertices().map(|v| self.nearest_vertex[v]).collect(),
            faces: faces.iter().map(|&f| self.faces[f as usize].map(vertex)).collect(),
            is_alive: vec![true; faces.len()],
            alive: faces.len(),
            corners: Lists::new(vertices.len(), 3 * faces.len()),
            quadrics: vec![Quadric::default(); vertices.len()],
            samples: samples.iter().map(|&s| self.samples[s as usize]).collect(),
            samples_of: samples_of_face,
            border_points: border.iter().map(|&b| self.border_points[b as usize]).collect(),
            border_points_of,
            origin: middle / vertices.len().max(1) as f64,
            color_scale_m: self.color_scale_m,
        };
        Piece { faces, vertices, samples, border, patch }
    }

    /// Takes a piece over, but for the colours of vertices that other pieces may see.
    fn take_over(&mut self, piece: &Piece, seen_colors: &mut Vec<(u32, Vec3)>) {
        let patch = &piece.patch;
        for (i, &v) in piece.vertices.iter().enumerate() {
            match patch.freedom[i] {
                Freedom::Free => self.colors[v as usize] = patch.colors[i],
                Freedom::Fixed => seen_colors.push((v, patch.colors[i])),
                Freedom::Frozen => (),
            }
            if patch.freedom[i] != Freedom::Frozen {
                self.positions[v as usize] = patch.positions[i];
                self.nearest_vertex[v as usize] = patch.nearest_vertex[i];
            }
            for point in patch.border_points_of.of(i as u32) {
                self.start_of_border_point[piece.border[point as usize] as usize] = v;
            }
        }
        for (i, &f) in piece.faces.iter().enumerate() {
            self.is_alive[f as usize] &= patch.is_alive[i];
            // Only the owner of a face changes it.
            self.faces[f as usize] = patch.faces[i].map(|v| piece.vertices[v as usize]);
            for sample in patch.samples_of.of(i as u32) {
                self.face_of_sample[piece.samples[sample as usize] as usize] = f;
            }
        }
    }
}

/// Samples that a thread measures at a time.
const AT_ONCE: usize = 1 << 16;

/// How many pieces a thread takes before all of them are taken over. It decides how much memory they take.
const PIECES_A_THREAD: usize = 8;

/// The sides of faces by their lower vertex: the higher vertex and the face, sorted.
fn sides_by_vertex(
    vertices: usize,
    faces: &[[u32; 3]],
    is_face: impl Fn(&[u32; 3]) -> bool,
) -> Grouped<(u32, u32)> {
    let sides = (0..).zip(faces).filter(|(_, f)| is_face(f)).flat_map(|(face, f)| {
        [0, 1, 2].map(|i| {
            let (from, to) = (f[i], f[(i + 1) % 3]);
            (from.min(to), (from.max(to), face))
        })
    });
    let mut sides = Grouped::new(vertices, sides);
    for group in sides.starts.windows(2) {
        sides.members[group[0] as usize..group[1] as usize].sort_unstable();
    }
    sides
}

/// Members by the group that they belong to, in their order.
struct Grouped<T> {
    /// Where each group begins, and the end.
    starts: Vec<u32>,
    members: Vec<T>,
}

impl<T: Copy + Default> Grouped<T> {
    fn new(groups: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        // Each start moves to the end of its group, which is the start of the next, while members come in.
        let mut starts = vec![0; groups + 2];
        pairs.clone().for_each(|(group, _)| starts[group as usize + 2] += 1);
        (2..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut members = vec![T::default(); starts[groups + 1] as usize];
        for (group, member) in pairs {
            let at = &mut starts[group as usize + 1];
            members[*at as usize] = member;
            *at += 1;
        }
        starts.pop();
        Self { starts, members }
    }

    fn of(&self, group: u32) -> &[T] {
        let [start, end] = [0, 1].map(|next| self.starts[group as usize + next] as usize);
        &self.members[start..end]
    }
}

/// The largest distance between samples, in bounds of the error.
const BOUNDS_A_STEP: f32 = 6.0;

/// The largest number of samples that large faces have, on the mean of all faces.
const MOST_SAMPLES: usize = 12;

/// The largest number of parts of an edge.
const MOST_STEPS: f32 = 64.0;

/// The distance between samples: so large that their number is bounded by the number of faces.
fn step_m(mesh: &MeshColumns<'_>, max_error_m: f32) -> f32 {
    let mut step_m = (BOUNDS_A_STEP * max_error_m).max(1e-6);
    let count = |step_m| -> usize {
        let squares = mesh.faces.iter().map(|f| steps(mesh, f, step_m) as usize);
        squares.filter(|&n| n > 2).map(|n| n * n / 2).sum()
    };
    while count(step_m) > MOST_SAMPLES * mesh.faces.len() + 1_000_000 {
        step_m *= 1.5;
    }
    step_m
}

/// The number of parts that the longest edge of a face is cut into.
fn steps(mesh: &MeshColumns<'_>, corners: &[u32; 3], step_m: f32) -> u32 {
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
    let longest = a
        .distance_squared(b)
        .max(b.distance_squared(c))
        .max(c.distance_squared(a));
    (longest.sqrt() / step_m).min(MOST_STEPS).ceil() as u32
}

/// The part of a list, sorted by cell, that belongs to one.
fn of_cell(pairs: &[(u32, u32)], cell: u32) -> &[(u32, u32)] {
    let begin = pairs.partition_point(|p| p.0 < cell);
    let end = pairs.partition_point(|p| p.0 <= cell);
    &pairs[begin..end]
}

/// A piece of the mesh with the numbers that its parts have in the whole.
struct Piece {
    faces: Vec<u32>,
    vertices: Vec<u32>,
    samples: Vec<u32>,
    border: Vec<u32>,
    patch: Patch,
}
