//! Bounding volume hierarchies: of the faces of a block, and of several trees under one root.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use s3d_geom::TriMesh;
use std::time::Duration;

/// A box, and what is in it.
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
    /// `count` entries of a list, from `first` on.
    Leaf { first: u32, count: u8 },
}

impl Node {
    fn new(aabb: &Aabb, content: Content) -> Self {
        Self { min: aabb.min.to_array(), max: aabb.max.to_array(), content }
    }

    pub(crate) fn min(&self) -> Vec3 {
        self.min.into()
    }

    pub(crate) fn max(&self) -> Vec3 {
        self.max.into()
    }

    /// The same node where lists of nodes and of entries begin elsewhere.
    fn moved(mut self, nodes: u32, entries: u32) -> Self {
        match &mut self.content {
            Content::Children(first) => *first += nodes,
            Content::Leaf { first, .. } => *first += entries,
        }
        self
    }
}

/// A tree over faces. Its boxes are exact unions of `f32` corners; every test against them allows for its own
/// rounding.
#[derive(Debug)]
pub(crate) struct FaceTree {
    /// The root is the first.
    pub(crate) nodes: Vec<Node>,
    /// Indices in the mesh: the entries of the leaves.
    pub(crate) faces: Vec<u32>,
}

impl FaceTree {
    /// Builds a tree over some faces, at least one.
    pub(crate) fn new(mesh: &TriMesh, faces: &[u32]) -> Self {
        let boxes: Vec<Aabb> = faces
            .iter()
            .map(|&face| Aabb::from_points(&mesh.triangle(face).map(Into::into)))
            .collect();
        // Small leaves: a face costs more than a box here.
        let bvh = build(&boxes, 4);
        let node = |node: &obvhs::bvh2::node::Bvh2Node| {
            let first = node.first_index;
            let count = node.prim_count as u8;
            let content = if count > 0 {
                Content::Leaf { first, count }
            } else {
                Content::Children(first)
            };
            Node::new(node.aabb(), content)
        };
        Self {
            nodes: bvh.nodes.iter().map(node).collect(),
            faces: bvh.primitive_indices.iter().map(|&k| faces[k as usize]).collect(),
        }
    }

    /// Those of all blocks as one.
    pub(crate) fn join(top: &Top, parts: Vec<Self>) -> Self {
        let nodes: Vec<_> = parts.iter().map(|part| (&part.nodes[..], part.faces.len())).collect();
        Self { nodes: top.join(&nodes), faces: parts.iter().flat_map(|part| &part.faces).copied().collect() }
    }
}

/// A tree over boxes, at least one, with at most so many in a leaf.
fn build(boxes: &[Aabb], max_prims_per_leaf: u32) -> Bvh2 {
    let params = BvhBuildParams { max_prims_per_leaf, ..BvhBuildParams::fast_build() };
    build_bvh2(boxes, params, &mut Duration::default())
}

/// What lies above the trees of several blocks.
pub(crate) struct Top(Bvh2);

impl Top {
    pub(crate) fn new(roots: impl Iterator<Item = Node>) -> Self {
        let boxes: Vec<Aabb> = roots
            .map(|root| Aabb::new(root.min().into(), root.max().into()))
            .collect();
        Self(build(&boxes, 1))
    }

    /// One tree of those of all blocks, in their order: the nodes of each, and how many entries its leaves
    /// have together. The lists of entries follow each other, too.
    pub(crate) fn join(&self, parts: &[(&[Node], usize)]) -> Vec<Node> {
        let top = &self.0;
        let (mut nodes_before, mut entries_before) = (top.nodes.len(), 0);
        let starts: Vec<(u32, u32)> = parts
            .iter()
            .map(|(nodes, entries)| {
                // A block's root takes the place of the leaf above it; the second of its nodes comes first.
                let start = (nodes_before as u32 - 1, entries_before as u32);
                (nodes_before, entries_before) = (nodes_before + nodes.len() - 1, entries_before + entries);
                start
            })
            .collect();
        let mut joined = Vec::with_capacity(nodes_before);
        joined.extend(top.nodes.iter().map(|node| {
            if !node.is_leaf() {
                return Node::new(node.aabb(), Content::Children(node.first_index));
            }
            let block = top.primitive_indices[node.first_index as usize] as usize;
            parts[block].0[0].moved(starts[block].0, starts[block].1)
        }));
        for ((nodes, _), start) in parts.iter().zip(starts) {
            joined.extend(nodes[1..].iter().map(|node| node.moved(start.0, start.1)));
        }
        joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_face_is_in_one_leaf_inside_all_boxes_above_it() {
        // In one block, and in several.
        for faces in [2000, 40_000] {
            let mesh = s3d_synth::scenes::scan_like(faces, 3);
            let scene = Scene::new(&mesh);
            let FaceTree { nodes, faces } = scene.tree();
            let mut met = vec![false; mesh.faces().len()];
            let mut stack = vec![(0, Vec3::NEG_INFINITY, Vec3::INFINITY)];
            let mut visited = 0;
            while let Some((node, min, max)) = stack.pop() {
                let node = &nodes[node as usize];
                visited += 1;
                assert!(min.cmple(node.min()).all() && node.max().cmple(max).all());
                match node.content {
                    Content::Children(first) => {
                        stack.extend([first, first + 1].map(|child| (child, node.min(), node.max())));
                    }
                    Content::Leaf { first, count } => {
                        for &face in &faces[first as usize..][..count as usize] {
                            assert!(!std::mem::replace(&mut met[face as usize], true));
                            for p in mesh.triangle(face) {
                                assert!(node.min().cmple(p).all() && p.cmple(node.max()).all());
                            }
                        }
                    }
                }
            }
            assert!(met.iter().all(|&m| m) && visited == nodes.len());
        }
    }
}
