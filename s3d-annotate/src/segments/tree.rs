//! The tree of merges: which segments belong together first.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Stands for a missing node.
const NONE: u32 = u32::MAX;

/// The tree by which segments are joined two by two, until none of those left touch.
///
/// Nodes are numbered. The first are the leaves: node `i` is segment `i`. Each later node joins two earlier
/// ones. A mesh whose pieces do not touch has several roots.
///
/// ```
/// use s3d_annotate::segments::{SegmentOptions, segment_faces};
/// use s3d_geom::{TriMesh, glam::vec3, primitives::cuboid};
///
/// // The six sides of a box are six segments, which make one tree.
/// let mesh = TriMesh::new(cuboid(vec3(0.0, 0.0, 0.0), vec3(1.0, 2.0, 0.5)))?;
/// let tree = segment_faces(&mesh, &SegmentOptions::default()).tree;
/// assert_eq!((tree.leaf_count(), tree.node_count()), (6, 11));
///
/// let root = tree.node_count() - 1;
/// assert_eq!(tree.parent(root), None);
/// assert_eq!(tree.segments_of(root).len(), 6);
/// let [one, other] = tree.children(root).expect("it is no leaf");
/// assert_eq!(tree.segments_of(one).len() + tree.segments_of(other).len(), 6);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MergeTree {
    leaves: u32,
    /// One entry a node that is no leaf.
    children: Vec<[u32; 2]>,
    /// One entry a node that is no leaf, ascending along each way to a root.
    cost: Vec<f32>,
    parent: Vec<u32>,
    /// The segments in an order in which those of each node follow one another.
    order: Vec<u32>,
    /// The places of a node's segments in `order`.
    range: Vec<[u32; 2]>,
}

impl MergeTree {
    /// Returns the number of segments.
    pub fn leaf_count(&self) -> u32 {
        self.leaves
    }

    /// Returns the number of segments and merges.
    pub fn node_count(&self) -> u32 {
        self.parent.len() as u32
    }

    /// Returns the node that joins `node` to another, or `None` for a root.
    ///
    /// # Panics
    /// If there is no such node. The other methods that take a node panic likewise.
    pub fn parent(&self, node: u32) -> Option<u32> {
        Some(self.parent[node as usize]).filter(|parent| *parent != NONE)
    }

    /// Returns the two nodes that `node` joins, the smaller number first, or `None` for a segment.
    pub fn children(&self, node: u32) -> Option<[u32; 2]> {
        assert!(node < self.node_count(), "there is no node {node}");
        let merge = node.checked_sub(self.leaves)?;
        Some(self.children[merge as usize])
    }

    /// Returns how much the two parts of a node differ: 0 for a segment, and no less than in any node below.
    /// It has no unit.
    pub fn cost(&self, node: u32) -> f32 {
        assert!(node < self.node_count(), "there is no node {node}");
        node.checked_sub(self.leaves)
            .map_or(0.0, |merge| self.cost[merge as usize])
    }

    /// Returns the segments of a node, in no particular order.
    pub fn segments_of(&self, node: u32) -> &[u32] {
        let [begin, end] = self.range[node as usize];
        &self.order[begin as usize..end as usize]
    }

    /// Returns whether a segment is one of a node's; false if one of them does not exist.
    pub fn has(&self, node: u32, segment: u32) -> bool {
        let range = self.range.get(node as usize).zip(self.range.get(segment as usize));
        // The places of a segment are one place.
        segment < self.leaves && range.is_some_and(|(node, leaf)| node[0] <= leaf[0] && leaf[1] <= node[1])
    }

    /// Returns the largest node of each segment whose cost is at most `cost`, as one entry a segment.
    pub fn nodes_at(&self, cost: f32) -> Vec<u32> {
        // From the roots down: a node whose parent is within the cost has the parent's.
        let mut node_of: Vec<u32> = (0..self.node_count()).collect();
        for node in (0..self.node_count()).rev() {
            if let Some(parent) = self.parent(node).filter(|parent| self.cost(*parent) <= cost) {
                node_of[node as usize] = node_of[parent as usize];
            }
        }
        node_of.truncate(self.leaves as usize);
        node_of
    }

    /// Makes a tree of its merges, which name earlier nodes alone.
    fn new(leaves: usize, children: Vec<[u32; 2]>, cost: Vec<f32>) -> Self {
        let nodes = leaves + children.len();
        let mut parent = vec![NONE; nodes];
        for (node, pair) in (leaves as u32..).zip(&children) {
            pair.iter().for_each(|child| parent[*child as usize] = node);
        }

        let mut sizes = vec![1u32; nodes];
        for (node, [a, b]) in (leaves..).zip(&children) {
            sizes[node] = sizes[*a as usize] + sizes[*b as usize];
        }
        // From the roots down: each child has a part of its parent's places.
        let mut range = vec![[0; 2]; nodes];
        let mut end = 0;
        for node in (0..nodes).rev() {
            if parent[node] == NONE {
                range[node] = [end, end + sizes[node]];
                end += sizes[node];
            }
            if let Some([a, b]) = node.checked_sub(leaves).map(|merge| children[merge]) {
                let [begin, end] = range[node];
                let middle = begin + sizes[a as usize];
                range[a as usize] = [begin, middle];
                range[b as usize] = [middle, end];
            }
        }
        let mut order = vec![0; leaves];
        (0..leaves).for_each(|leaf| order[range[leaf][0] as usize] = leaf as u32);
        Self { leaves: leaves as u32, children, cost, parent, order, range }
    }
}

/// What is known of a set of segments.
#[derive(Clone, Copy, Default)]
pub(super) struct Region {
    pub(super) area_m2: f64,
    /// The mean colour times the area.
    pub(super) color: s3d_geom::glam::DVec3,
    /// The length of its borders to other sets, metres.
    pub(super) perimeter_m: f64,
}

impl Region {
    pub(super) fn add(&mut self, other: &Self) {
        self.area_m2 += other.area_m2;
        self.color += other.color;
        self.perimeter_m += other.perimeter_m;
    }

    fn mean_color(&self) -> s3d_geom::glam::DVec3 {
        self.color / self.area_m2
    }
}

/// The border between two sets: its length in metres, and the differences along it times the length.
#[derive(Clone, Copy, Default)]
pub(super) struct Seam {
    pub(super) length_m: f64,
    pub(super) difference: f64,
}

impl Seam {
    pub(super) fn add(&mut self, other: Self) {
        self.length_m += other.length_m;
        self.difference += other.difference;
    }
}

/// Returns how little two sets belong together.
///
/// That is the mean difference along their border, and the distance of their mean colours. It counts less
/// where the border is a large part of the smaller one's outline, and more where both sets are large.
fn cost(a: &Region, b: &Region, seam: &Seam, color: f64) -> f64 {
    let differs = seam.difference / seam.length_m + color * a.mean_color().distance(b.mean_color());
    let share = (seam.length_m / a.perimeter_m.min(b.perimeter_m)).min(1.0);
    let size_m2 = a.area_m2 * b.area_m2 / (a.area_m2 + b.area_m2);
    let fourth_root = |x: f64| x.sqrt().sqrt();
    (differs + LEAST_DIFFERENCE) * size_m2.sqrt() / fourth_root(share)
}

/// Pieces of one plain surface are joined by their sizes and borders alone.
const LEAST_DIFFERENCE: f64 = 0.01;

/// Joins the two sets that belong together most, again and again. `seams` has the borders of pairs of
/// segments, the smaller number first.
pub(super) fn merge(regions: Vec<Region>, seams: &BTreeMap<[u32; 2], Seam>, color: f64) -> MergeTree {
    let leaves = regions.len();
    let mut sets = Sets::new(regions, seams, color);
    let mut children: Vec<[u32; 2]> = Vec::new();
    let mut costs: Vec<f32> = Vec::new();
    while let Some((pair, cost)) = sets.join_next((leaves + children.len()) as u32) {
        let below = pair.map(|node| (node as usize).checked_sub(leaves).map_or(0.0, |merge| costs[merge]));
        costs.push((cost as f32).max(below[0]).max(below[1]));
        children.push(pair);
    }
    MergeTree::new(leaves, children, costs)
}

/// The sets while they are joined. A set is kept under the number of one of its segments.
struct Sets {
    /// The node of each set, or [`NONE`] for one that was joined to another.
    node_of: Vec<u32>,
    regions: Vec<Region>,
    /// The neighbours of each set.
    seams_of: Vec<BTreeMap<u32, Seam>>,
    queue: BinaryHeap<Reverse<Candidate>>,
    color: f64,
}

/// A pair that may be joined: its cost as bits, whose order is that of numbers that are not negative, its
/// nodes when it was queued, and its sets.
type Candidate = (u64, [u32; 2], [u32; 2]);

impl Sets {
    fn new(regions: Vec<Region>, seams: &BTreeMap<[u32; 2], Seam>, color: f64) -> Self {
        let mut seams_of = vec![BTreeMap::new(); regions.len()];
        for (&[a, b], seam) in seams {
            seams_of[a as usize].insert(b, *seam);
            seams_of[b as usize].insert(a, *seam);
        }

        let node_of = (0..regions.len() as u32).collect();
        let mut sets = Self { node_of, regions, seams_of, queue: BinaryHeap::new(), color };
        for (&[a, b], seam) in seams {
            sets.queue(a, b, seam);
        }
        sets
    }

    fn queue(&mut self, a: u32, b: u32, seam: &Seam) {
        let cost = cost(&self.regions[a as usize], &self.regions[b as usize], seam, self.color);
        let [one, other] = [a, b].map(|set| (self.node_of[set as usize], set));
        let (first, second) = (one.min(other), one.max(other));
        self.queue
            .push(Reverse((cost.to_bits(), [first.0, second.0], [first.1, second.1])));
    }

    /// Joins the two sets whose cost is least, as node `node`. Returns their nodes and the cost, or `None` if
    /// no sets touch.
    fn join_next(&mut self, node: u32) -> Option<([u32; 2], f64)> {
        // Pairs of which one has changed since they were queued are left out.
        let (cost, pair, [a, b]) = loop {
            let Reverse(next) = self.queue.pop()?;
            if next.1 == next.2.map(|set| self.node_of[set as usize]) {
                break next;
            }
        };

        // The set with fewer neighbours moves.
        let neighbours = |set: u32| self.seams_of[set as usize].len();
        let [kept, gone] = if neighbours(a) >= neighbours(b) { [a, b] } else { [b, a] };
        self.node_of[kept as usize] = node;
        self.node_of[gone as usize] = NONE;

        let inside = self.seams_of[kept as usize].remove(&gone).unwrap_or_default();
        let other = self.regions[gone as usize];
        let region = &mut self.regions[kept as usize];
        region.add(&other);
        region.perimeter_m -= 2.0 * inside.length_m;

        for (neighbour, seam) in std::mem::take(&mut self.seams_of[gone as usize]) {
            let around = &mut self.seams_of[neighbour as usize];
            around.remove(&gone);
            if neighbour != kept {
                around.entry(kept).or_default().add(seam);
                self.seams_of[kept as usize].entry(neighbour).or_default().add(seam);
            }
        }
        let around: Vec<(u32, Seam)> = self.seams_of[kept as usize].iter().map(|(k, v)| (*k, *v)).collect();
        for (neighbour, seam) in around {
            self.queue(kept, neighbour, &seam);
        }
        Some((pair, f64::from_bits(cost)))
    }
}
