//! The faces of a mesh in small groups that lie together, and a tree over the groups.
//!
//! The visibility pass prepares a group at a time: its corners are projected once however many of its faces
//! meet in them, and its box says at once whether any of it can be seen.

use obvhs::bvh2::Bvh2;
use s3d_geom::TriMesh;

/// No group has more faces; so a corner's place in its group fits a byte.
pub(crate) const MAX_FACES: usize = 64;

/// Corners are handled in packets of so many.
pub(crate) const PACKET: usize = 8;

/// No group has more corners, padding included.
pub(crate) const MAX_CORNERS: usize = 3 * MAX_FACES;

/// A node of the tree: a box, and what is in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    pub(crate) content: Content,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Content {
    /// The first of two nodes that follow each other.
    Children(u32),
    Cluster(u32),
}

/// Where a group's faces and corners are in the lists of all groups.
#[derive(Clone, Copy, Debug)]
struct ClusterStart {
    first_face: u32,
    first_packet: u32,
}

/// All groups of a mesh.
#[derive(Debug)]
pub(crate) struct Clusters {
    /// The root is the first.
    nodes: Vec<Node>,
    /// One more than there are groups: each ends where the next begins.
    starts: Vec<ClusterStart>,
    corners: Vec<[[f32; PACKET]; 3]>,
    /// The corners of a face, as starts in its group; the fourth is nothing.
    faces: Vec<[u8; 4]>,
    ids: Vec<u32>,
}

/// One group.
#[derive(Clone, Copy)]
pub(crate) struct Cluster<'a> {
    /// x, y and z of the corners, by packet; the last packet repeats its last corner.
    pub(crate) corners: &'a [[[f32; PACKET]; 3]],
    pub(crate) faces: &'a [[u8; 4]],
    /// The index of each face in the mesh.
    pub(crate) ids: &'a [u32],
}

impl Clusters {
    /// Cuts the tree where a branch has few enough faces.
    pub(crate) fn new(mesh: &TriMesh, bvh: &Bvh2) -> Self {
        let counts = face_counts(bvh);
        let n = mesh.faces().len();
        let mut clusters = Self {
            nodes: Vec::new(),
            starts: Vec::new(),
            corners: Vec::new(),
            faces: Vec::with_capacity(n),
            ids: Vec::with_capacity(n),
        };
        let mut gather = Gather::new(mesh);
        let node = |index: u32| {
            let aabb = bvh.nodes[index as usize].aabb();
            Node { min: aabb.min.to_array(), max: aabb.max.to_array(), content: Content::Cluster(0) }
        };
        clusters.nodes.push(node(0));
        let mut stack = vec![(0, 0)];
        while let Some((from, to)) = stack.pop() {
            let branch = &bvh.nodes[from as usize];
            clusters.nodes[to].content = if counts[from as usize] <= MAX_FACES as u32 || branch.is_leaf() {
                Content::Cluster(clusters.add(bvh, from, &mut gather))
            } else {
                let first = clusters.nodes.len();
                clusters.nodes.extend([node(branch.first_index), node(branch.first_index + 1)]);
                stack.extend([(branch.first_index + 1, first + 1), (branch.first_index, first)]);
                Content::Children(first as u32)
            };
        }
        clusters.end();
        clusters
    }

    fn end(&mut self) {
        self.starts.push(ClusterStart {
            first_face: self.faces.len() as u32,
            first_packet: self.corners.len() as u32,
        });
    }

    /// Adds the faces below a node of the tree as a group.
    fn add(&mut self, bvh: &Bvh2, branch: u32, gather: &mut Gather<'_>) -> u32 {
        self.end();
        let index = self.starts.len() as u32 - 1;
        gather.begin(index);
        let mut stack = vec![branch];
        while let Some(index) = stack.pop() {
            let node = &bvh.nodes[index as usize];
            let first = node.first_index;
            if !node.is_leaf() {
                stack.extend([first + 1, first]);
                continue;
            }
            for place in first..first + node.prim_count {
                let face = bvh.primitive_indices[place as usize];
                self.ids.push(face);
                self.faces.push(gather.face(face));
            }
        }
        gather.finish(&mut self.corners);
        index
    }

    pub(crate) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    #[inline(always)]
    pub(crate) fn cluster(&self, index: u32) -> Cluster<'_> {
        let (at, end) = (self.starts[index as usize], self.starts[index as usize + 1]);
        let faces = at.first_face as usize..end.first_face as usize;
        Cluster {
            corners: &self.corners[at.first_packet as usize..end.first_packet as usize],
            faces: &self.faces[faces.clone()],
            ids: &self.ids[faces],
        }
    }
}

/// The number of faces below each node.
fn face_counts(bvh: &Bvh2) -> Vec<u32> {
    let mut order = vec![0u32];
    let mut next = 0;
    while let Some(&index) = order.get(next) {
        let node = &bvh.nodes[index as usize];
        if !node.is_leaf() {
            order.extend([node.first_index, node.first_index + 1]);
        }
        next += 1;
    }
    let mut counts = vec![0; bvh.nodes.len()];
    for &index in order.iter().rev() {
        let node = &bvh.nodes[index as usize];
        let first = node.first_index as usize;
        counts[index as usize] =
            if node.is_leaf() { node.prim_count } else { counts[first] + counts[first + 1] };
    }
    counts
}

/// Collects the corners of one group after another.
struct Gather<'m> {
    mesh: &'m TriMesh,
    /// By vertex of the mesh: the last group that has it, and its place there.
    known: Vec<(u32, u8)>,
    group: u32,
    positions: Vec<[f32; 3]>,
}

impl<'m> Gather<'m> {
    fn new(mesh: &'m TriMesh) -> Self {
        let known = vec![(u32::MAX, 0); mesh.positions().len()];
        Self { mesh, known, group: 0, positions: Vec::new() }
    }

    fn begin(&mut self, group: u32) {
        self.group = group;
        self.positions.clear();
    }

    fn face(&mut self, face: u32) -> [u8; 4] {
        let [a, b, c] = self.mesh.faces()[face as usize].map(|vertex| {
            let known = &mut self.known[vertex as usize];
            if known.0 != self.group {
                *known = (self.group, self.positions.len() as u8);
                self.positions.push(self.mesh.positions()[vertex as usize].to_array());
            }
            known.1
        });
        [a, b, c, 0]
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
    fn every_face_is_in_one_group_inside_its_box() {
        let mesh = s3d_synth::scenes::scan_like(5000, 3);
        let scene = Scene::new(&mesh);
        let clusters = scene.clusters();
        let mut met = vec![false; mesh.faces().len()];
        let mut groups = 0;
        for node in clusters.nodes() {
            let Content::Cluster(index) = node.content else { continue };
            groups += 1;
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
        assert!(groups < 5000 / 20, "groups of {} faces", 5000 / groups);
    }
}
