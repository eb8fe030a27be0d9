//! Collapses edges of a piece of a mesh, the cheapest first, as long as the old surface stays near.

use super::distance::{Frame, to_segment, to_triangle};
use super::patch::{Freedom, NONE, Patch};
use s3d_geom::glam::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The limits of what collapses may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// The largest distance of a sample, metres.
    pub(super) distance_m: f32,
    /// The largest root of the mean squared difference of colours in a face, in steps of 1/255.
    pub(super) color: f32,
    /// The number of faces at which to stop.
    pub(super) faces: usize,
}

/// The least cosine between the normals of a face before and after a collapse.
const LEAST_COSINE: f32 = 0.3;

/// How the cost of an edge grows with its length: where all is flat, short edges go first.
const LENGTH_COST: f64 = 1e-6;

/// Collapses edges until none is left that may go, or the number of faces is reached.
pub(super) fn collapse_edges(patch: &mut Patch, limits: &Limits) {
    let mut collapser = Collapser {
        stamps: vec![0; patch.positions.len()],
        heap: BinaryHeap::new(),
        star: Star::default(),
        patch,
        limits: *limits,
    };
    collapser.run();
}

/// An edge that may go. The largest of the heap goes first.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    cost: f64,
    edge: [u32; 2],
    stamps: [u32; 2],
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then_with(|| other.edge.cmp(&self.edge))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// An edge on its way to one vertex.
#[derive(Clone, Copy, Debug)]
struct Merge {
    /// The vertex that stays, and the one that goes.
    keep: u32,
    gone: u32,
    /// Where the vertex that stays will be.
    place: Vec3,
    color: Vec3,
    cost: f64,
}

/// What is around an edge. Kept from edge to edge for its memory.
#[derive(Debug, Default)]
struct Star {
    /// The faces that stay: their corner at the edge, and the two vertices that follow it.
    kept: Vec<(u32, u32, u32)>,
    /// The places that the corners of `kept` will have.
    triangles: Vec<[Vec3; 3]>,
    /// The same, to find quickly what lies above or below them.
    frames: Vec<Frame>,
    /// The faces on both sides of the edge, which go.
    shared: Vec<u32>,
    opposite: Vec<u32>,
    around_keep: Vec<u32>,
    /// The samples of all faces, each with the place in `kept` of the face that it will belong to.
    moved: Vec<(u32, u32)>,
    /// For each of `kept`, the sum of squared differences of colours, and their number.
    color_errors: Vec<(f32, u32)>,
    /// The vertex before the edge on the border, if the edge is on one.
    border: Option<u32>,
    /// The points of the border, and whether they are behind the place.
    moved_border: Vec<(u32, bool)>,
}

struct Collapser<'a> {
    patch: &'a mut Patch,
    limits: Limits,
    stamps: Vec<u32>,
    heap: BinaryHeap<Candidate>,
    star: Star,
}

impl Collapser<'_> {
    fn run(&mut self) {
        let mut candidates = Vec::with_capacity(3 * self.patch.faces.len() / 2);
        for face in 0..self.patch.faces.len() as u32 {
            let corners = self.patch.faces[face as usize];
            for i in 0..3 {
                let (from, to) = (corners[i], corners[(i + 1) % 3]);
                // An edge is met twice, unless it is a border.
                let has_twin = || self.patch.fan(to).any(|(_, next, _)| next == from);
                if from < to || !has_twin() {
                    candidates.extend(self.candidate(from, to));
                }
            }
        }
        self.heap = BinaryHeap::from(candidates);

        while self.patch.alive > self.limits.faces {
            let Some(candidate) = self.heap.pop() else {
                return;
            };
            let [a, b] = candidate.edge;
            if candidate.stamps == [self.stamps[a as usize], self.stamps[b as usize]] {
                self.try_collapse(a, b);
            }
        }
    }

    fn candidate(&self, a: u32, b: u32) -> Option<Candidate> {
        let edge = [a.min(b), a.max(b)];
        let merge = self.merge(edge)?;
        Some(Candidate { cost: merge.cost, edge, stamps: edge.map(|v| self.stamps[v as usize]) })
    }

    /// Where an edge would go; `None` if it may not.
    fn merge(&self, [a, b]: [u32; 2]) -> Option<Merge> {
        let patch = &*self.patch;
        let (free_a, free_b) = (patch.freedom[a as usize], patch.freedom[b as usize]);
        let (border_a, border_b) = (patch.on_border[a as usize], patch.on_border[b as usize]);
        let are_free = (free_a == Freedom::Free, free_b == Freedom::Free);
        if free_a == Freedom::Frozen || free_b == Freedom::Frozen {
            return None;
        }

        // A vertex on the border, or one that is fixed, keeps its place against one that is not.
        let (keep, gone, stays) = match are_free {
            (false, false) => return None,
            (false, true) if border_b && !border_a => return None,
            (true, false) if border_a && !border_b => return None,
            (false, true) => (a, b, true),
            (true, false) => (b, a, true),
            (true, true) if border_a != border_b && border_a => (a, b, true),
            (true, true) if border_a != border_b => (b, a, true),
            (true, true) => (a, b, false),
        };

        let mut quadric = patch.quadrics[keep as usize];
        quadric += &patch.quadrics[gone as usize];
        let [p, q] = [keep, gone].map(|v| patch.local(patch.positions[v as usize]));
        let length_squared = p.distance_squared(q);

        let (place, error) = match stays {
            true => (p, quadric.error(p)),
            false => {
                let middle = 0.5 * (p + q);
                let (place, error) = quadric.best_place(middle);
                if place.distance_squared(middle) <= 4.0 * length_squared {
                    (place, error)
                } else {
                    (middle, quadric.error(middle))
                }
            }
        };
        let color = match quadric.area > 0.0 && patch.color_scale_m > 0.0 {
            true => (quadric.color(place) / patch.color_scale_m).as_vec3(),
            false => patch.colors[keep as usize].midpoint(patch.colors[gone as usize]),
        };
        let at = if stays {
            patch.positions[keep as usize]
        } else {
            (place + patch.origin).as_vec3()
        };
        Some(Merge {
            keep,
            gone,
            place: at,
            color: color.clamp(Vec3::ZERO, Vec3::splat(255.0)),
            cost: error + LENGTH_COST * quadric.area * length_squared,
        })
    }

    fn try_collapse(&mut self, a: u32, b: u32) {
        let Some(merge) = self.merge([a, b]) else {
            return;
        };
        let mut star = std::mem::take(&mut self.star);
        if self.keeps_manifold(&merge, &mut star)
            && self.keeps_sides(&merge, &mut star)
            && self.keeps_border(&merge, &mut star)
            && self.keeps_samples(&merge, &mut star)
        {
            self.apply(&merge, &star);
        }
        self.star = star;
    }

    /// Collects what is around the edge. Returns whether the surface stays a manifold: the vertices next to
    /// both ends must be those opposite to the edge, and no face may meet another one's back.
    fn keeps_manifold(&self, merge: &Merge, star: &mut Star) -> bool {
        let Merge { keep, gone, .. } = *merge;
        star.kept.clear();
        star.shared.clear();
        star.opposite.clear();
        star.around_keep.clear();

        for (corner, a, b) in self.patch.fan(keep) {
            star.around_keep.extend([a, b]);
            if a == gone || b == gone {
                star.shared.push(corner / 3);
                star.opposite.push(if a == gone { b } else { a });
            } else {
                star.kept.push((corner, a, b));
            }
        }
        let of_keep = star.kept.len();
        for (corner, a, b) in self.patch.fan(gone).filter(|f| f.1 != keep && f.2 != keep) {
            if [a, b]
                .iter()
                .any(|v| star.around_keep.contains(v) && !star.opposite.contains(v))
            {
                return false;
            }
            star.kept.push((corner, a, b));
        }

        // Two borders that an inner edge joins would meet in a point.
        let both_on_border = [keep, gone].iter().all(|&v| self.patch.on_border[v as usize]);
        let sides = if both_on_border { 1 } else { 2 };
        if star.kept.is_empty() || star.shared.len() != sides {
            return false;
        }
        let spans = |f: &(u32, u32, u32)| star.opposite.contains(&f.1) && star.opposite.contains(&f.2);
        !(star.kept[..of_keep].iter().any(spans) && star.kept[of_keep..].iter().any(spans))
    }

    /// Whether no face turns over or becomes a line, and the place is near the surface as it is.
    fn keeps_sides(&self, merge: &Merge, star: &mut Star) -> bool {
        star.triangles.clear();
        star.frames.clear();
        for &(corner, a, b) in &star.kept {
            let [a, b] = [a, b].map(|v| self.patch.positions[v as usize]);
            let [p, q, r] = self.patch.triangle(corner / 3);
            let before = (q - p).cross(r - p);
            let after = (a - merge.place).cross(b - merge.place);
            let longest = a.distance_squared(b).max(a.distance_squared(merge.place));
            let longest = longest.max(b.distance_squared(merge.place));

            let lengths = before.length() * after.length();
            if after.length() <= 1e-3 * longest || before.dot(after) < LEAST_COSINE * lengths {
                return false;
            }
            star.triangles.push([merge.place, a, b]);
            star.frames.push(Frame::new([merge.place, a, b]));
        }

        let limit = self.limits.distance_m * self.limits.distance_m;
        let kept = star.kept.iter().map(|(corner, ..)| corner / 3);
        let mut faces = star.shared.iter().copied().chain(kept);
        faces
            .by_ref()
            .map(|face| to_triangle(merge.place, self.patch.triangle(face)).0)
            .any(|squared| squared <= limit)
    }

    /// Whether the points of the old border stay near the border.
    fn keeps_border(&self, merge: &Merge, star: &mut Star) -> bool {
        star.border = None;
        star.moved_border.clear();
        if star.shared.len() != 1 {
            return true;
        }

        // The border runs from `before` to the edge's start, to its end, and on to `behind`.
        let patch = &*self.patch;
        let next = patch.along_border(merge.keep).map(|(_, next)| next);
        let (start, end) = match next == Some(merge.gone) {
            true => (merge.keep, merge.gone),
            false => (merge.gone, merge.keep),
        };
        let (Some((before, _)), Some((_, behind))) = (patch.along_border(start), patch.along_border(end))
        else {
            return false;
        };

        let place = |v: u32| patch.positions[v as usize];
        let limit = self.limits.distance_m * self.limits.distance_m;
        for list in [before, start, end] {
            for point in patch.border_points_of.of(list) {
                let at = patch.border_points[point as usize];
                let first = to_segment(at, [place(before), merge.place]);
                let second = to_segment(at, [merge.place, place(behind)]);
                if first.min(second) > limit {
                    return false;
                }
                star.moved_border.push((point, second < first));
            }
        }
        star.border = Some(before);
        true
    }

    /// Finds a face for each sample of the faces around the edge. Returns whether all of them are near, in
    /// place and colour.
    fn keeps_samples(&self, merge: &Merge, star: &mut Star) -> bool {
        let patch = &*self.patch;
        let limit = self.limits.distance_m * self.limits.distance_m;
        let with_colors = patch.color_scale_m > 0.0;
        star.moved.clear();
        star.color_errors.clear();
        star.color_errors.resize(star.kept.len(), (0.0, 0));

        let own = (0..).zip(&star.kept).map(|(i, (corner, ..))| (i, corner / 3));
        let lost = star.shared.iter().map(|&face| (NONE, face));
        for (own, face) in lost.chain(own) {
            for number in patch.samples_of.of(face) {
                let sample = patch.samples[number as usize];

                // A face above or below which it lies: its own if that is near enough, or else the nearest.
                // If there is none, it lies at an edge.
                let mut best = (f32::INFINITY, [0.0; 3], own);
                if let Some(frame) = star.frames.get(own as usize) {
                    best = frame
                        .above(sample.at)
                        .map_or(best, |(squared, weights)| (squared, weights, own));
                }
                if best.0 > limit {
                    for (i, frame) in (0..).zip(&star.frames) {
                        if let Some((squared, weights)) =
                            frame.above(sample.at).filter(|(squared, _)| *squared < best.0)
                        {
                            best = (squared, weights, i);
                        }
                    }
                }
                if best.0 > limit {
                    for (i, triangle) in (0..).zip(&star.triangles) {
                        let (squared, weights) = to_triangle(sample.at, *triangle);
                        if squared < best.0 {
                            best = (squared, weights, i);
                        }
                    }
                }
                if best.0 > limit {
                    return false;
                }
                star.moved.push((number, best.2));

                if with_colors {
                    let (_, a, b) = star.kept[best.2 as usize];
                    let corners = [merge.color, patch.colors[a as usize], patch.colors[b as usize]];
                    let color: Vec3 = corners.iter().zip(best.1).map(|(c, w)| *c * w).sum();
                    let seen = Vec3::from(sample.color.map(f32::from));
                    let sum = &mut star.color_errors[best.2 as usize];
                    *sum = (sum.0 + color.distance_squared(seen), sum.1 + 3);
                }
            }
        }
        let color_limit = self.limits.color * self.limits.color;
        star.color_errors
            .iter()
            .all(|&(sum, count)| sum <= color_limit * count as f32)
    }

    fn apply(&mut self, merge: &Merge, star: &Star) {
        let Merge { keep, gone, .. } = *merge;
        let patch = &mut *self.patch;
        let stays = patch.positions[keep as usize].distance_squared(merge.place);
        if patch.positions[gone as usize].distance_squared(merge.place) < stays {
            patch.nearest_vertex[keep as usize] = patch.nearest_vertex[gone as usize];
        }
        patch.positions[keep as usize] = merge.place;
        patch.colors[keep as usize] = merge.color;
        let quadric = patch.quadrics[gone as usize];
        patch.quadrics[keep as usize] += &quadric;

        // The opposite vertices lose a corner, and the vertex that stays gets the corners of both.
        for &face in &star.shared {
            patch.is_alive[face as usize] = false;
            patch.samples_of.clear(face);
        }
        patch.alive -= star.shared.len();
        for &vertex in &star.opposite {
            patch
                .corners
                .retain(vertex, |corner| patch.is_alive[(corner / 3) as usize]);
        }
        patch.corners.clear(keep);
        patch.corners.clear(gone);
        for &(corner, ..) in &star.kept {
            patch.faces[(corner / 3) as usize][(corner % 3) as usize] = keep;
            patch.corners.push(keep, corner);
            patch.samples_of.clear(corner / 3);
        }

        for &(number, place) in &star.moved {
            patch.samples_of.push(star.kept[place as usize].0 / 3, number);
        }
        if let Some(before) = star.border {
            for list in [before, keep, gone] {
                patch.border_points_of.clear(list);
            }
            for &(point, is_behind) in &star.moved_border {
                patch
                    .border_points_of
                    .push(if is_behind { keep } else { before }, point);
            }
        }

        self.stamps[keep as usize] += 1;
        self.stamps[gone as usize] += 1;
        self.push_around(keep);
    }

    /// Puts the edges around a vertex into the heap.
    fn push_around(&mut self, vertex: u32) {
        self.star.around_keep.clear();
        let mut around = std::mem::take(&mut self.star.around_keep);
        for (_, a, b) in self.patch.fan(vertex) {
            around.extend([a, b]);
        }
        around.sort_unstable();
        around.dedup();
        for &other in &around {
            let candidate = self.candidate(vertex, other);
            self.heap.extend(candidate);
        }
        self.star.around_keep = around;
    }
}
