//! The faces of a mesh in small clusters that lie together, and a tree over the clusters.
//!
//! The visibility pass prepares one cluster at a time. A corner is projected once, however many faces of the
//! cluster meet in it. The box of a cluster tells at once whether any of its faces can be seen.

use crate::scene::tree::{Content, FaceTree, Node, Top};
use s3d_geom::TriMesh;
use s3d_simd::prefetch;

/// The most faces of a cluster, so that the place of a corner in its cluster fits in a byte.
pub(crate) const MAX_FACES: usize = 64;

/// The number of corners that are handled together.
pub(crate) const PACKET: usize = 8;

/// The most corners of a cluster, padding included.
pub(crate) const MAX_CORNERS: usize = 3 * MAX_FACES;

/// The starts of a cluster's faces and corners in the lists of all clusters.
#[derive(Clone, Copy, Debug)]
struct ClusterStart {
    first_face: u32,
    first_packet: u32,
}

/// All clusters of a mesh.
#[derive(Debug)]
pub(crate) struct Clusters {
    /// The root comes first. The entry of a leaf is a cluster.
    nodes: Vec<Node>,
    /// One entry more than there are clusters: each cluster ends where the next one begins.
    starts: Vec<ClusterStart>,
    corners: Vec<[[f32; PACKET]; 3]>,
    /// The places of each face's corners in its cluster; the fourth byte is unused.
    faces: Vec<[u8; 4]>,
    ids: Vec<u32>,
}

/// One cluster.
#[derive(Clone, Copy)]
pub(crate) struct Cluster<'a> {
    /// x, y and z of the corners, by packet. The last packet is filled up with the last corner.
    pub(crate) corners: &'a [[[f32; PACKET]; 3]],
    pub(crate) faces: &'a [[u8; 4]],
    /// The index of each face in the mesh.
    pub(crate) ids: &'a [u32],
}

impl Clusters {
    /// Cuts the tree at each branch that has few enough faces.
    pub(crate) fn new(mesh: &TriMesh, tree: &FaceTree) -> Self {
        let counts = face_counts(&tree.nodes);
        let n = tree.faces.len();
        let mut clusters = Self {
            nodes: vec![tree.nodes[0]],
            starts: Vec::new(),
            corners: Vec::new(),
            faces: Vec::with_capacity(n),
            ids: Vec::with_capacity(n),
        };

        let mut gather = Gather::new(mesh);
        let mut stack = vec![(0, 0)];

        while let Some((from, to)) = stack.pop() {
            clusters.nodes[to].content = match tree.nodes[from as usize].content {
                Content::Children(first) if counts[from as usize] > MAX_FACES as u32 => {
                    let child = clusters.nodes.len();
                    clusters
                        .nodes
                        .extend_from_slice(&tree.nodes[first as usize..first as usize + 2]);
                    stack.extend([(first + 1, child + 1), (first, child)]);
                    Content::Children(child as u32)
                }
                _ => Content::Leaf { first: clusters.add(tree, from, &mut gather), count: 1 },
            };
        }

        clusters.end();
        clusters
    }

    /// Joins the clusters of several blocks.
    pub(crate) fn join(top: &Top, parts: Vec<Self>) -> Self {
        let nodes: Vec<_> = parts
            .iter()
            .map(|part| (&part.nodes[..], part.starts.len() - 1))
            .collect();

        let mut joined = Self {
            nodes: top.join(&nodes),
            starts: Vec::with_capacity(parts.iter().map(|part| part.starts.len()).sum()),
            corners: Vec::with_capacity(parts.iter().map(|part| part.corners.len()).sum()),
            faces: Vec::with_capacity(parts.iter().map(|part| part.faces.len()).sum()),
            ids: Vec::with_capacity(parts.iter().map(|part| part.ids.len()).sum()),
        };

        for part in &parts {
            let faces = joined.faces.len() as u32;
            let packets = joined.corners.len() as u32;
            joined
                .starts
                .extend(part.starts[..part.starts.len() - 1].iter().map(|start| ClusterStart {
                    first_face: start.first_face + faces,
                    first_packet: start.first_packet + packets,
                }));
            joined.corners.extend_from_slice(&part.corners);
            joined.faces.extend_from_slice(&part.faces);
            joined.ids.extend_from_slice(&part.ids);
        }

        joined.end();
        joined
    }

    /// Notes where the last cluster ends and the next one begins.
    fn end(&mut self) {
        self.starts.push(ClusterStart {
            first_face: self.faces.len() as u32,
            first_packet: self.corners.len() as u32,
        });
    }

    /// Adds the faces below a node of the tree as a cluster, and returns its index.
    fn add(&mut self, tree: &FaceTree, branch: u32, gather: &mut Gather<'_>) -> u32 {
        self.end();
        gather.begin();
        let mut stack = vec![branch];
        while let Some(index) = stack.pop() {
            match tree.nodes[index as usize].content {
                Content::Children(first) => stack.extend([first + 1, first]),
                Content::Leaf { first, count } => {
                    for &face in &tree.faces[first as usize..first as usize + count as usize] {
                        self.ids.push(face);
                        self.faces.push(gather.face(face));
                    }
                }
            }
        }

        gather.finish(&mut self.corners);
        self.starts.len() as u32 - 1
    }

    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Prefetches whatever a node refers to: its children, or the start of its cluster.
    #[inline(always)]
    pub(crate) fn prefetch_below(&self, node: u32) {
        match self.nodes[node as usize].content {
            Content::Children(first) => {
                prefetch(&self.nodes[first as usize]);
                prefetch(&self.nodes[first as usize + 1]);
            }
            Content::Leaf { first: index, .. } => prefetch(&self.starts[index as usize]),
        }
    }

    /// Prefetches the cluster of a node, if it has one.
    #[inline(always)]
    pub(crate) fn prefetch(&self, node: u32) {
        if let Content::Leaf { first: index, .. } = self.nodes[node as usize].content {
            let Cluster { corners, faces, ids } = self.cluster(index);
            for packet in corners {
                prefetch(&packet[0]);
                prefetch(&packet[2]);
            }
            for line in (0..faces.len()).step_by(64 / size_of::<u32>()) {
                prefetch(&faces[line]);
                prefetch(&ids[line]);
            }
        }
    }

    #[inline(always)]
    pub(crate) fn cluster(&self, index: u32) -> Cluster<'_> {
        let at = self.starts[index as usize];
        let end = self.starts[index as usize + 1];
        let faces = at.first_face as usize..end.first_face as usize;
        Cluster {
            corners: &self.corners[at.first_packet as usize..end.first_packet as usize],
            faces: &self.faces[faces.clone()],
            ids: &self.ids[faces],
        }
    }
}

/// Counts the faces below each node.
fn face_counts(nodes: &[Node]) -> Vec<u32> {
    // Every node comes after its parent.
    let mut order = vec![0u32];
    let mut next = 0;
    while let Some(&index) = order.get(next) {
        if let Content::Children(first) = nodes[index as usize].content {
            order.extend([first, first + 1]);
        }
        next += 1;
    }

    // Children are counted before their parents.
    let mut counts = vec![0; nodes.len()];
    for &index in order.iter().rev() {
        counts[index as usize] = match nodes[index as usize].content {
            Content::Children(first) => counts[first as usize] + counts[first as usize + 1],
            Content::Leaf { count, .. } => count.into(),
        };
    }
    counts
}

/// Collects the corners of one cluster after another.
struct Gather<'m> {
    mesh: &'m TriMesh,
    /// The corners of the cluster, in a hash table by vertex. If a slot is taken, the next free one is used.
    slots: [Slot; 1 << SLOT_BITS],
    cluster: u32,
    positions: Vec<[f32; 3]>,
}

/// The table has room for more than twice the corners of a cluster.
const SLOT_BITS: u32 = 9;

#[derive(Clone, Copy)]
struct Slot {
    /// The cluster that filled the slot, counted from 1. The slot is free for all other clusters.
    cluster: u32,
    vertex: u32,
    place: u8,
}

impl<'m> Gather<'m> {
    fn new(mesh: &'m TriMesh) -> Self {
        let free = Slot { cluster: 0, vertex: 0, place: 0 };
        Self { mesh, slots: [free; 1 << SLOT_BITS], cluster: 0, positions: Vec::new() }
    }

    fn begin(&mut self) {
        self.cluster += 1;
        self.positions.clear();
    }

    fn face(&mut self, face: u32) -> [u8; 4] {
        let [a, b, c] = self.mesh.faces()[face as usize].map(|vertex| self.place(vertex));
        [a, b, c, 0]
    }

    /// Returns the place of a vertex among the corners of the cluster.
    fn place(&mut self, vertex: u32) -> u8 {
        // Fibonacci hashing: the factor is 2^32 divided by the golden ratio.
        let mut k = (vertex.wrapping_mul(0x9E37_79B9) >> (32 - SLOT_BITS)) as usize;
        while self.slots[k].cluster == self.cluster {
            if self.slots[k].vertex == vertex {
                return self.slots[k].place;
            }
            k = (k + 1) % self.slots.len();
        }

        let place = self.positions.len() as u8;
        self.slots[k] = Slot { cluster: self.cluster, vertex, place };
        self.positions.push(self.mesh.positions()[vertex as usize].to_array());
        place
    }

    fn finish(&mut self, packets: &mut Vec<[[f32; PACKET]; 3]>) {
        for packet in self.positions.chunks(PACKET) {
            let at = |k: usize| packet[k.min(packet.len() - 1)];
            packets.push([0, 1, 2].map(|axis| std::array::from_fn(|k| at(k)[axis])));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_face_is_in_one_cluster_inside_its_box() {
        // The mesh is large enough for several blocks.
        let mesh = s3d_synth::scenes::scan_like(40_000, 3);
        let scene = Scene::new(&mesh);
        let clusters = scene.clusters();

        let mut met = vec![false; mesh.faces().len()];
        let mut count = 0;

        for node in clusters.nodes() {
            let Content::Leaf { first: index, .. } = node.content else { continue };
            count += 1;
            let cluster = clusters.cluster(index);
            assert!(cluster.faces.len() <= MAX_FACES && cluster.faces.len() == cluster.ids.len());
            for (&id, corners) in cluster.ids.iter().zip(cluster.faces) {
                assert!(!std::mem::replace(&mut met[id as usize], true));
                for (&corner, p) in corners.iter().zip(mesh.triangle(id)) {
                    let packet = &cluster.corners[corner as usize / PACKET];
                    let q = [0, 1, 2].map(|axis| packet[axis][corner as usize % PACKET]);
                    assert_eq!(q, p.to_array());
                    assert!((0..3).all(|k| node.min[k] <= q[k] && q[k] <= node.max[k]));
                }
            }
        }
        assert!(met.iter().all(|&m| m));
        assert!(count < 40_000 / 20, "clusters of {} faces", 40_000 / count);
    }
}
