//! Bounding volume hierarchies over the faces of a block, and over several trees.

use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use s3d_geom::TriMesh;
use std::time::Duration;

/// A box and its content.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) min: [f32; 3],
    pub(crate) max: [f32; 3],
    pub(crate) content: Content,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Content {
    /// The index of the first child; the second child follows it.
    Children(u32),
    /// The `count` entries of a list from index `first` on.
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

    /// Returns the same node for lists of nodes and entries that begin elsewhere.
    fn moved(mut self, nodes: u32, entries: u32) -> Self {
        match &mut self.content {
            Content::Children(first) => *first += nodes,
            Content::Leaf { first, .. } => *first += entries,
        }
        self
    }
}

/// The most faces of a leaf: few, since testing a face costs more than testing a box.
pub(crate) const MOST_FACES: usize = 4;

/// A tree over faces. The boxes are exact unions of `f32` corners; every test against them allows for its own
/// rounding.
#[derive(Debug)]
pub(crate) struct FaceTree {
    /// The root comes first.
    pub(crate) nodes: Vec<Node>,
    /// The entries of the leaves: indices of faces in the mesh.
    pub(crate) faces: Vec<u32>,
}

impl FaceTree {
    /// Builds a tree over some faces; there must be at least one.
    pub(crate) fn new(mesh: &TriMesh, faces: &[u32]) -> Self {
        let boxes: Vec<Aabb> = faces
            .iter()
            .map(|&face| Aabb::from_points(&mesh.triangle(face).map(Into::into)))
            .collect();

        let bvh = build(&boxes, MOST_FACES as u32);

        Self {
            nodes: bvh
                .nodes
                .iter()
                .map(|node| {
                    let first = node.first_index;
                    let count = node.prim_count as u8;
                    let content = if count > 0 {
                        Content::Leaf { first, count }
                    } else {
                        Content::Children(first)
                    };
                    Node::new(node.aabb(), content)
                })
                .collect(),
            faces: bvh.primitive_indices.iter().map(|&k| faces[k as usize]).collect(),
        }
    }

    /// Joins the trees of all blocks.
    pub(crate) fn join(top: &Top, parts: Vec<Self>) -> Self {
        let nodes: Vec<_> = parts.iter().map(|part| (&part.nodes[..], part.faces.len())).collect();
        Self { nodes: top.join(&nodes), faces: parts.iter().flat_map(|part| &part.faces).copied().collect() }
    }
}

/// Builds a tree over at least one box, with at most `max_prims_per_leaf` boxes in a leaf.
fn build(boxes: &[Aabb], max_prims_per_leaf: u32) -> Bvh2 {
    let params = BvhBuildParams { max_prims_per_leaf, ..BvhBuildParams::fast_build() };
    build_bvh2(boxes, params, &mut Duration::default())
}

/// The tree above the trees of several blocks.
pub(crate) struct Top(Bvh2);

impl Top {
    pub(crate) fn new(roots: impl Iterator<Item = Node>) -> Self {
        let boxes: Vec<Aabb> = roots
            .map(|root| Aabb::new(root.min().into(), root.max().into()))
            .collect();
        Self(build(&boxes, 1))
    }

    /// Joins the trees of all blocks, given in their order as the nodes of each tree and the number of its
    /// entries. The lists of entries are expected to follow each other in the same order.
    pub(crate) fn join(&self, parts: &[(&[Node], usize)]) -> Vec<Node> {
        let top = &self.0;
        let mut nodes_before = top.nodes.len();
        let mut entries_before = 0;
        let starts: Vec<(u32, u32)> = parts
            .iter()
            .map(|(nodes, entries)| {
                // A block's root takes the place of the leaf above it, so only its other nodes are appended.
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
    use crate::cast_ray;
    use crate::scene::Scene;
    use glam::{DVec3, vec3};

    #[test]
    fn every_face_is_in_one_leaf_inside_all_boxes_above_it() {
        // One block, then several.
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

    #[test]
    fn a_deep_tree_is_searched() {
        // Each triangle is a fifth larger than the one before: boxes of neighbours grow, and nest.
        let size = |k: i32| 1.2_f32.powi(k);
        let corners = |k: i32| [[1.0, 0.0], [1.2, 0.0], [1.0, 0.2]].map(|[x, y]| vec3(x, y, 0.0) * size(k));
        let faces = (0..400).map(|k| [0, 1, 2].map(|corner| 3 * k + corner));
        let positions = (-200..200).flat_map(corners).collect();
        let mesh = TriMesh::from_faces(positions, faces.collect()).unwrap();
        let scene = Scene::new(&mesh);

        let nodes = &scene.tree().nodes;
        let mut deepest = 0;
        let mut stack = vec![(0, 0)];
        while let Some((node, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            if let Content::Children(first) = nodes[node as usize].content {
                stack.extend([(first, depth + 1), (first + 1, depth + 1)]);
            }
        }
        assert!(deepest >= 96, "{deepest}");
        for k in -200..200 {
            let above = (vec3(1.05, 0.05, 1.0) * size(k)).as_dvec3();
            let hit = cast_ray(&scene, above, -DVec3::Z).unwrap();
            assert_eq!(hit.face, (k + 200) as u32);
        }
    }
}
