//! More of a thing.

use super::Review;
use crate::workbench::Patch;

/// Patches that differ more from a thing are not like it: see
/// [`Descriptor::difference`](super::descriptor::Descriptor::difference).
const ALIKE: f64 = 2.5;

impl Review<'_> {
    /// Returns patches without a label that are like an instance, disjoint, the most similar first.
    ///
    /// A node of the tree is like it if nothing in it was labelled, and it has about the same area, extents,
    /// height above the floor, colour, and share of level surface.
    pub fn similar_patches(&self, instance: u32) -> Vec<Patch> {
        let of_face = self.state.instance_of_face();
        let faces = self.state.faces_of(instance);
        if faces.is_empty() {
            return Vec::new();
        }
        let thing = self.surroundings.sums(self.mesh, faces.iter());
        let thing = self.surroundings.descriptor(&thing);

        let open_m2 = self.open_areas();
        let tree = &self.segments.tree;
        let mut alike: Vec<(f64, u32)> = (0..tree.node_count())
            .filter(|node| self.is_open(*node, &open_m2))
            .map(|node| {
                let other = self.surroundings.descriptor(&self.surroundings.of_node[node as usize]);
                (thing.difference(&other), node)
            })
            .filter(|(difference, _)| *difference <= ALIKE)
            .collect();
        alike.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));

        let mut is_taken = vec![false; tree.leaf_count() as usize];
        let mut patches = Vec::new();
        for (_, node) in alike {
            let segments = tree.segments_of(node);
            if segments.iter().any(|segment| is_taken[*segment as usize]) {
                continue;
            }
            segments.iter().for_each(|segment| is_taken[*segment as usize] = true);
            let open = self.surroundings.open_faces(self.segments, node, of_face);
            patches.extend(open.first().map(|face| Patch { face: *face, node }));
        }
        patches
    }
}
