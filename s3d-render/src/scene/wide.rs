//! A tree whose nodes have eight children, for many rays. Source: Wald, Benthin and Boulos 2008, "Getting rid
//! of packets".

use super::tree::{Content, FaceTree, MOST_FACES, Node};
use s3d_geom::TriMesh;
use s3d_simd::prefetch;

/// The children of a node.
pub(crate) const WIDE: usize = 8;
/// The faces of a block, which holds a leaf.
pub(crate) const BLOCK: usize = MOST_FACES;
/// No child, and no face.
pub(crate) const NONE: u32 = u32::MAX;
/// The bit of a child that is a block of faces.
pub(crate) const IS_BLOCK: u32 = 1 << 31;

/// The boxes of the children of a node, by axis.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct WideNode {
    pub(crate) min: [[f32; WIDE]; 3],
    pub(crate) max: [[f32; WIDE]; 3],
    pub(crate) children: [u32; WIDE],
}

/// The corners of some faces: corner, axis, face.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Block {
    pub(crate) corners: [[[f32; BLOCK]; 3]; 3],
    pub(crate) faces: [u32; BLOCK],
}

/// A tree whose nodes have eight children.
#[derive(Debug)]
pub(crate) struct WideTree {
    pub(crate) nodes: Vec<WideNode>,
    pub(crate) blocks: Vec<Block>,
}

impl WideTree {
    pub(crate) fn new(mesh: &TriMesh, tree: &FaceTree) -> Self {
        let mut wide = Self { nodes: Vec::new(), blocks: Vec::new() };
        wide.nodes.push(WideNode::empty());
        let mut open = vec![(0, vec![0])];
        while let Some((at, mut members)) = open.pop() {
            // The largest box is replaced by its two, as long as there is room.
            while members.len() < WIDE {
                let inner = (0..members.len()).filter(|i| is_inner(&tree.nodes[members[*i] as usize]));
                let largest = inner.max_by(|i, j| {
                    let area = |i: usize| area(&tree.nodes[members[i] as usize]);
                    area(*i).total_cmp(&area(*j))
                });
                let Some(largest) = largest else { break };
                if let Content::Children(first) = tree.nodes[members[largest] as usize].content {
                    members[largest] = first;
                    members.push(first + 1);
                }
            }

            for (slot, member) in members.into_iter().enumerate() {
                let node = &tree.nodes[member as usize];
                let child = match node.content {
                    Content::Children(first) => {
                        wide.nodes.push(WideNode::empty());
                        let child = wide.nodes.len() - 1;
                        open.push((child, vec![first, first + 1]));
                        child as u32
                    }
                    Content::Leaf { first, count } => {
                        let faces = &tree.faces[first as usize..first as usize + count as usize];
                        wide.blocks.push(Block::new(mesh, faces));
                        IS_BLOCK | (wide.blocks.len() - 1) as u32
                    }
                };
                wide.nodes[at].set(slot, node, child);
            }
        }
        wide
    }

    /// Asks for a child's memory before it is needed.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: u32) {
        if child & IS_BLOCK == 0 {
            let node = &self.nodes[child as usize];
            node.min.iter().step_by(2).for_each(prefetch);
            node.max.iter().step_by(2).for_each(prefetch);
        } else {
            let block = &self.blocks[(child & !IS_BLOCK) as usize];
            block.corners.iter().for_each(prefetch);
        }
    }
}

fn is_inner(node: &Node) -> bool {
    matches!(node.content, Content::Children(_))
}

fn area(node: &Node) -> f32 {
    let side = node.max() - node.min();
    side.x * side.y + side.y * side.z + side.z * side.x
}

impl WideNode {
    fn empty() -> Self {
        Self { min: [[f32::INFINITY; WIDE]; 3], max: [[f32::NEG_INFINITY; WIDE]; 3], children: [NONE; WIDE] }
    }

    fn set(&mut self, slot: usize, node: &Node, child: u32) {
        for axis in 0..3 {
            self.min[axis][slot] = node.min[axis];
            self.max[axis][slot] = node.max[axis];
        }
        self.children[slot] = child;
    }
}

impl Block {
    fn new(mesh: &TriMesh, faces: &[u32]) -> Self {
        // Lanes without a face keep zeros, and are told by their number.
        let mut block = Self { corners: [[[0.0; BLOCK]; 3]; 3], faces: [NONE; BLOCK] };
        for (lane, face) in faces.iter().enumerate() {
            block.faces[lane] = *face;
            for (corner, p) in mesh.triangle(*face).into_iter().enumerate() {
                for (axis, k) in p.to_array().into_iter().enumerate() {
                    block.corners[corner][axis][lane] = k;
                }
            }
        }
        block
    }
}
