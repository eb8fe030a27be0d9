//! A bounding volume hierarchy over the faces of a mesh, with eight boxes per node and eight triangles per
//! leaf.

use super::surroundings::Surroundings;
use super::triangle::{SortedTriangle, to_box};
use super::triangle8::Triangles8;
use crate::wide::{at_most, least, max, min};
use crate::{Aabb, NO_INDEX, TriMesh};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris, node::Bvh2Node};
use obvhs::{BvhBuildParams, triangle::Triangle};
use rayon::prelude::*;
use std::time::Duration;

/// The hierarchy.
pub(crate) struct FaceTree {
    /// The nodes; the root is the first.
    nodes: Vec<Node8>,
    leaves: Vec<Triangles8>,
    pub(crate) surroundings: Surroundings,
}

/// Up to eight boxes and their children.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Node8 {
    low: [[f32; 8]; 3],
    high: [[f32; 8]; 3],
    /// The index of a node, or [`LEAF`] plus the index of a leaf.
    children: [u32; 8],
    count: u32,
}

const LEAF: u32 = 1 << 31;

/// The largest number of triangles in a leaf.
const LEAF_SIZE: usize = 8;

/// The smallest number of leaves that one task makes.
const LEAVES_OF_TASK: usize = 256;

/// The nearest triangle.
#[derive(Clone, Copy)]
pub(crate) struct Best {
    /// The leaf with the triangle: a good guess for a nearby point.
    pub(crate) leaf: u32,
    pub(crate) face: u32,
    pub(crate) distance_squared: f64,
    pub(crate) point: DVec3,
}

/// A search, with reusable memory.
pub(crate) struct Search<'t> {
    tree: &'t FaceTree,
    near: [f32; 3],
    exact: DVec3,
    best: Best,
    /// A squared distance. A triangle whose bound is larger is not the nearest: the value includes the
    /// rounding of the bounds, which is below 1e-6 of them, or 1e-44 for numbers as small.
    prune_beyond: f32,
    /// The boxes to open, with their squared distances.
    open: Vec<(f32, u32)>,
    /// The triangles that may be the nearest: lower bound of the squared distance, leaf, lane.
    candidates: Vec<(f32, u32, u32)>,
    /// The boxes to open in a search for a far point.
    open_far: Vec<(f64, u32)>,
    /// The number of triangles whose exact distance was computed.
    #[cfg(test)]
    pub(crate) measured: usize,
}

impl FaceTree {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let bvh = build_bvh(mesh);
        let sizes = faces_below(&bvh);
        let surroundings = Surroundings::new(mesh.aabb());
        let mut tree = Self { nodes: vec![Node8::new()], leaves: Vec::new(), surroundings };

        // Pairs of a node of this tree and the node of `bvh` that it opens.
        let mut open = vec![(0, 0)];
        let mut leaves = Vec::new();
        while let Some((own, theirs)) = open.pop() {
            for child in eight_below(&bvh, &sizes, theirs) {
                let id = if sizes[child] <= LEAF_SIZE {
                    leaves.push(child);
                    LEAF + (leaves.len() - 1) as u32
                } else {
                    tree.nodes.push(Node8::new());
                    open.push((tree.nodes.len() - 1, child));
                    (tree.nodes.len() - 1) as u32
                };
                tree.nodes[own].push(bvh.nodes[child].aabb(), id);
            }
        }

        tree.leaves = leaves
            .par_iter()
            .with_min_len(LEAVES_OF_TASK)
            .map(|&node| {
                let triangles: Vec<_> = faces_of(&bvh, node)
                    .map(|face| (face, SortedTriangle::new(mesh.triangle(face))))
                    .collect();
                Triangles8::new(&triangles)
            })
            .collect();
        tree
    }

    /// Collects in `starts` where to start the search for points in `around`, if no triangle farther than the
    /// root of `reach_squared` is asked for. The starts are leaves, or nodes above them if there are many.
    #[inline(always)]
    pub(crate) fn starts_near(&self, around: Aabb, reach_squared: f32, starts: &mut Starts) {
        let low = around.min.to_array();
        let high = around.max.to_array();
        starts.nodes.clear();
        starts.open.clear();
        starts.open.push(0);

        let mut next = 0;
        while next < starts.open.len() {
            let node = &self.nodes[starts.open[next] as usize];
            next += 1;

            let squares = node.distances_squared(low, high);
            let mut within = at_most(&squares, reach_squared * ENOUGH) & node.lanes();
            while within != 0 {
                let lane = within.trailing_zeros() as usize;
                within &= within - 1;
                let child = node.children[lane];
                if child < LEAF && starts.open.len() < MOST_OPENED {
                    starts.open.push(child);
                } else {
                    if starts.nodes.last().is_none_or(|last| last.count == 8) {
                        starts.nodes.push(Node8::new());
                    }
                    if let Some(last) = starts.nodes.last_mut() {
                        last.copy(node, lane);
                    }
                }
            }
        }
    }
}

/// A factor that makes up for the rounding of a squared distance.
const ENOUGH: f32 = 1.00001;

/// The largest number of nodes that are opened for a group of points.
const MOST_OPENED: usize = 24;

/// The starts of searches, from [`FaceTree::starts_near`].
#[derive(Default)]
pub(crate) struct Starts {
    nodes: Vec<Node8>,
    open: Vec<u32>,
}

impl<'t> Search<'t> {
    pub(crate) fn new(tree: &'t FaceTree) -> Self {
        let best = Best { leaf: 0, face: NO_INDEX, distance_squared: f64::INFINITY, point: DVec3::ZERO };
        Self {
            tree,
            near: [0.0; 3],
            exact: DVec3::ZERO,
            best,
            prune_beyond: f32::INFINITY,
            open: Vec::with_capacity(64),
            candidates: Vec::with_capacity(64),
            open_far: Vec::new(),
            #[cfg(test)]
            measured: 0,
        }
    }

    /// Finds the triangle nearest to `point`. The smallest face wins a tie.
    ///
    /// The search begins in the leaf `guess`. The guess changes the time only, since a triangle as far as the
    /// best is never pruned.
    #[inline(always)]
    pub(crate) fn nearest(&mut self, point: Vec3, guess: u32) -> Best {
        self.nearest_below(&self.tree.nodes[..1], point, guess);
        self.best
    }

    /// Finds the triangle nearest to `point`, which must be in the box of [`FaceTree::starts_near`]. Returns
    /// `None` if it may be farther than the reach of `starts`.
    #[inline(always)]
    pub(crate) fn nearest_from(
        &mut self,
        starts: &Starts,
        reach_squared: f32,
        point: Vec3,
        guess: u32,
    ) -> Option<Best> {
        self.nearest_below(&starts.nodes, point, guess);
        (self.prune_beyond <= reach_squared).then_some(self.best)
    }

    /// Finds the triangle nearest to a point far from the mesh, with bounds in `f64`. They need no tolerance:
    /// the distance of a triangle is never below the distance of its box ([`SortedTriangle::closest`]).
    pub(crate) fn nearest_far(&mut self, point: DVec3, guess: u32) -> Best {
        self.exact = point;
        self.best.distance_squared = f64::INFINITY;
        self.best.face = NO_INDEX;
        self.open_far.clear();
        self.open_far.extend([(0.0, 0), (0.0, LEAF + guess)]);

        while let Some((bound, child)) = self.open_far.pop() {
            if bound > self.best.distance_squared {
                continue;
            }
            if child >= LEAF {
                self.visit_far(child - LEAF);
            } else {
                self.enter_far(child as usize);
            }
        }
        self.best
    }

    /// Puts the boxes of a node that are within reach on the stack, the nearest on top.
    fn enter_far(&mut self, node: usize) {
        let node = &self.tree.nodes[node];
        let bottom = self.open_far.len();
        for lane in 0..node.count as usize {
            let [low, high] = [&node.low, &node.high].map(|[x, y, z]| Vec3::new(x[lane], y[lane], z[lane]));
            let bound = to_box(self.exact, low.as_dvec3(), high.as_dvec3());
            if bound <= self.best.distance_squared {
                self.open_far.push((bound, node.children[lane]));
            }
        }
        self.open_far[bottom..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    }

    fn visit_far(&mut self, leaf: u32) {
        let triangles = &self.tree.leaves[leaf as usize];
        for lane in (0..8).filter(|lane| triangles.lanes() >> lane & 1 == 1) {
            let [a, b, c] = triangles.triangle(lane).corners().map(|p| p.as_dvec3());
            if to_box(self.exact, a.min(b).min(c), a.max(b).max(c)) <= self.best.distance_squared {
                self.measure(leaf, lane);
            }
        }
    }

    /// Searches from `guess` and `starts`; the result is in `best`.
    #[inline(always)]
    fn nearest_below(&mut self, starts: &[Node8], point: Vec3, guess: u32) {
        self.near = point.to_array();
        self.exact = point.as_dvec3();
        self.best.distance_squared = f64::INFINITY;
        self.best.face = NO_INDEX;
        self.prune_beyond = f32::INFINITY;
        self.open.clear();
        self.candidates.clear();

        self.visit(guess);
        for start in starts {
            self.enter(start);
        }
        while let Some((bound, child)) = self.open.pop() {
            if bound > self.prune_beyond || child == LEAF + guess {
                continue;
            }
            if child >= LEAF {
                self.visit(child - LEAF);
            } else {
                self.enter(&self.tree.nodes[child as usize]);
            }
        }

        // `prune_beyond` is smallest now, so few candidates are left to measure.
        for i in 0..self.candidates.len() {
            let (bound, leaf, lane) = self.candidates[i];
            if bound <= self.prune_beyond {
                self.measure(leaf, lane as usize);
            }
        }
    }

    /// Puts the boxes of a node that are within reach on the stack, the nearest on top.
    #[inline(always)]
    fn enter(&mut self, node: &Node8) {
        let squares = node.distances_squared(self.near, self.near);
        let mut within = at_most(&squares, self.prune_beyond) & node.lanes();
        let bottom = self.open.len();
        while within != 0 {
            let lane = within.trailing_zeros() as usize;
            within &= within - 1;
            self.open.push((squares[lane], node.children[lane]));
            let mut at = self.open.len() - 1;
            while at > bottom && self.open[at - 1].0 < self.open[at].0 {
                self.open.swap(at - 1, at);
                at -= 1;
            }
        }
    }

    /// Bounds the triangles of a leaf, and keeps those within reach as candidates.
    #[inline(always)]
    fn visit(&mut self, leaf: u32) {
        let triangles = &self.tree.leaves[leaf as usize];
        let bounds = triangles.bounds(self.near);
        let most = least(&bounds.most);
        self.prune_beyond = min(most, self.prune_beyond);
        let mut within = at_most(&bounds.least, self.prune_beyond) & triangles.lanes();
        while within != 0 {
            let lane = within.trailing_zeros();
            within &= within - 1;
            if most < f32::INFINITY {
                self.candidates.push((bounds.least[lane as usize], leaf, lane));
            } else {
                // Without an upper bound, the exact distance has to give one.
                self.measure(leaf, lane as usize);
            }
        }
    }

    /// Computes the exact distance of a triangle, and keeps it if it is the best.
    #[inline(always)]
    fn measure(&mut self, leaf: u32, lane: usize) {
        #[cfg(test)]
        {
            self.measured += 1;
        }
        let triangles = &self.tree.leaves[leaf as usize];
        let (distance_squared, point) = triangles.triangle(lane).closest(self.exact);
        let face = triangles.face(lane);
        let best = &self.best;
        if distance_squared < best.distance_squared
            || distance_squared == best.distance_squared && face < best.face
        {
            self.best = Best { leaf, face, distance_squared, point };
            self.prune_beyond = min((distance_squared * (1.0 + 2e-6) + 1e-37) as f32, self.prune_beyond);
        }
    }
}

impl Node8 {
    fn new() -> Self {
        Self { low: [[0.0; 8]; 3], high: [[0.0; 8]; 3], children: [0; 8], count: 0 }
    }

    fn push(&mut self, aabb: &obvhs::aabb::Aabb, child: u32) {
        let lane = self.count as usize;
        for axis in 0..3 {
            self.low[axis][lane] = aabb.min[axis];
            self.high[axis][lane] = aabb.max[axis];
        }
        self.children[lane] = child;
        self.count += 1;
    }

    /// Returns the lanes that hold a box, as bits.
    #[inline(always)]
    fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// Adds a child of another node.
    #[inline(always)]
    fn copy(&mut self, node: &Node8, lane: usize) {
        let own = self.count as usize;
        for axis in 0..3 {
            self.low[axis][own] = node.low[axis][lane];
            self.high[axis][own] = node.high[axis][lane];
        }
        self.children[own] = node.children[lane];
        self.count += 1;
    }

    /// Returns the squared distances from the boxes to the box from `low` to `high`, up to rounding.
    #[inline(always)]
    fn distances_squared(&self, low: [f32; 3], high: [f32; 3]) -> [f32; 8] {
        let mut squares = [0.0; 8];
        for (lane, square) in squares.iter_mut().enumerate() {
            let outside = |axis: usize| {
                max(max(self.low[axis][lane] - high[axis], low[axis] - self.high[axis][lane]), 0.0)
            };
            let x = outside(0);
            let y = outside(1);
            let z = outside(2);
            *square = x * x + y * y + z * z;
        }
        squares
    }
}

/// Returns up to eight nodes below `node`, or `node` itself if it becomes a leaf. Starting from `node`, the
/// node with the largest surface is replaced by its two children until there are eight.
fn eight_below(bvh: &Bvh2, sizes: &[usize], node: usize) -> Vec<usize> {
    let mut below = vec![node];
    while below.len() < 8 {
        let area = |&at: &usize| bvh.nodes[below[at]].aabb().half_area();
        let inner = (0..below.len()).filter(|&at| sizes[below[at]] > LEAF_SIZE);
        let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let first = bvh.nodes[below[largest]].first_index as usize;
        below[largest] = first;
        below.push(first + 1);
    }
    below
}

/// Iterates over `node` and the nodes below it, parents first.
fn nodes_from(bvh: &Bvh2, node: usize) -> impl Iterator<Item = (usize, &Bvh2Node)> {
    let mut open = vec![node];
    std::iter::from_fn(move || {
        let at = open.pop()?;
        let node = &bvh.nodes[at];
        if !node.is_leaf() {
            open.extend([node.first_index as usize + 1, node.first_index as usize]);
        }
        Some((at, node))
    })
}

fn faces_of(bvh: &Bvh2, node: usize) -> impl Iterator<Item = u32> {
    nodes_from(bvh, node)
        .filter(|(_, node)| node.is_leaf())
        .flat_map(|(_, leaf)| {
            let first = leaf.first_index as usize;
            bvh.primitive_indices[first..first + leaf.prim_count as usize]
                .iter()
                .copied()
        })
}

/// Returns the number of faces below each node.
fn faces_below(bvh: &Bvh2) -> Vec<usize> {
    let mut sizes = vec![0; bvh.nodes.len()];
    let order: Vec<usize> = nodes_from(bvh, 0).map(|(at, _)| at).collect();
    for at in order.into_iter().rev() {
        let node = &bvh.nodes[at];
        let first = node.first_index as usize;
        sizes[at] = if node.is_leaf() {
            node.prim_count as usize
        } else {
            sizes[first] + sizes[first + 1]
        };
    }
    sizes
}

/// The largest coordinate whose surface areas do not overflow in the builder.
const LARGEST_COORDINATE: f32 = 1e15;

/// Builds the binary hierarchy from which [`FaceTree`] is made. Each of its leaves holds one face.
fn build_bvh(mesh: &TriMesh) -> Bvh2 {
    let bounds = mesh.aabb();
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let scale = if largest > LARGEST_COORDINATE {
        LARGEST_COORDINATE / largest
    } else {
        1.0
    };

    let triangles: Vec<Triangle> = (0..mesh.faces().len() as u32)
        .map(|face| {
            let [v0, v1, v2] = mesh.triangle(face).map(|p| Vec3A::from(p * scale));
            Triangle { v0, v1, v2 }
        })
        .collect();

    // `FaceTree` forms the leaves itself, so the builder need not.
    let params = BvhBuildParams {
        max_prims_per_leaf: 1,
        post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
        ..BvhBuildParams::medium_build()
    };
    let mut bvh = build_bvh2_from_tris(&triangles, params, &mut Duration::default());

    // Boxes of scaled triangles are replaced by the exact ones.
    if scale != 1.0 {
        for node in bvh.nodes.iter_mut().filter(|node| node.is_leaf()) {
            let members = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let corners = bvh.primitive_indices[members]
                .iter()
                .flat_map(|&face| mesh.triangle(face));
            let bounds = Aabb::from_points(corners);
            node.set_aabb(obvhs::aabb::Aabb::new(bounds.min.into(), bounds.max.into()));
        }
        bvh.refit_all();
    }
    bvh
}
