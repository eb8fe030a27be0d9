//! What to label next.

use super::Review;
use super::descriptor::Descriptor;
use super::viewpoint::{numbers, view_of};
use serde::Serialize;
use std::cmp::Reverse;

/// Nodes up to this cost of a merge are taken for one thing.
const ONE_THING: f32 = 0.3;

/// Things that differ more than this are not of one kind: see [`Descriptor::difference`].
const SAME_KIND: f64 = 4.0;

/// A patch without a label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// A face of the patch that is seen from `from`.
    pub face: u32,
    /// The node of the tree. The patch is its faces without a label.
    pub node: u32,
    /// The area of the patch, m².
    pub area_m2: f64,
    /// The middle of the face, world metres.
    pub at: [f64; 3],
    /// A place from which the patch is seen, world metres.
    pub from: [f64; 3],
    /// What it may be; `None` if nothing that was labelled is like it.
    pub guess: Option<Guess>,
}

/// What a patch may be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Guess {
    /// The class of the most similar instance.
    pub class: String,
    /// The number of this instance.
    pub instance: u32,
    /// Its name, such as `chair_3`.
    pub like: String,
}

impl Review<'_> {
    /// Returns the largest patch without a label, leaving out those that have one of the segments in
    /// `skipped`; `None` if nothing is left.
    ///
    /// A patch is the faces without a label in a node of the tree that may be one thing: one whose cost is
    /// small, and in which nothing was labelled. Where something was labelled, and where joining costs more,
    /// the parts of a node are taken instead, down to single segments. So a chair is one doubt and not
    /// twenty, and what is left of a segment after a cut is one too.
    pub fn next_doubt(&self, skipped: &[u32]) -> Option<Doubt> {
        let open_m2 = self.open_areas();
        let mut candidates: Vec<(u32, f64)> = self
            .open_things(&open_m2)
            .into_iter()
            .map(|node| (node, open_m2[node as usize]))
            .collect();
        candidates.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));

        let tree = &self.segments.tree;
        let is_skipped = |node: u32| tree.segments_of(node).iter().any(|segment| skipped.contains(segment));
        let (node, area_m2) = candidates.into_iter().find(|(node, _)| !is_skipped(*node))?;

        let of_face = self.state.instance_of_face();
        let faces = self.surroundings.open_faces(self.segments, node, of_face);
        let view = view_of(self.mesh, self.surroundings, &faces);
        let guess = self.guess(&self.surroundings.descriptor(&self.surroundings.of_node[node as usize]));
        Some(Doubt { face: view.face, node, area_m2, at: numbers(view.at), from: numbers(view.from), guess })
    }

    /// Returns the area without a label of each node, m².
    pub(super) fn open_areas(&self) -> Vec<f64> {
        let tree = &self.segments.tree;
        let mut open_m2 = vec![0.0; tree.node_count() as usize];
        for (face, &instance) in (0u32..).zip(self.state.instance_of_face()) {
            if instance == 0 {
                open_m2[self.segments.segment_of_face[face as usize] as usize] += self.mesh.area(face);
            }
        }
        for node in tree.leaf_count()..tree.node_count() {
            let children = tree.children(node).unwrap_or_default();
            open_m2[node as usize] = children.iter().map(|child| open_m2[*child as usize]).sum();
        }
        open_m2
    }

    /// Returns disjoint nodes that together have all faces without a label, each as large as one thing.
    fn open_things(&self, open_m2: &[f64]) -> Vec<u32> {
        let tree = &self.segments.tree;
        let mut things = Vec::new();
        let mut rest: Vec<u32> =
            (0..tree.node_count()).filter(|node| tree.parent(*node).is_none()).collect();
        while let Some(node) = rest.pop() {
            let open = open_m2[node as usize];
            if open <= 0.0 {
                continue;
            }
            let is_open = self.is_open(node, open_m2);
            match tree.children(node) {
                Some(children) if !is_open || tree.cost(node) > ONE_THING => rest.extend(children),
                _ => things.push(node),
            }
        }
        things
    }

    /// Whether nothing was labelled in a node, but for crumbs.
    pub(super) fn is_open(&self, node: u32, open_m2: &[f64]) -> bool {
        open_m2[node as usize] > 0.98 * self.surroundings.of_node[node as usize].area_m2
    }

    /// Returns what a thing may be: like the most similar instance.
    fn guess(&self, thing: &Descriptor) -> Option<Guess> {
        let instances = self.surroundings.of_instances(self.mesh, self.state.instance_of_face());
        let (_, instance) = instances
            .iter()
            .map(|(number, sums)| (thing.difference(&self.surroundings.descriptor(sums)), *number))
            .filter(|(difference, _)| *difference <= SAME_KIND)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(Reverse(a.1).cmp(&Reverse(b.1))))?;
        let class = self.state.instances().get(&instance)?.clone();
        let like = self.state.instance_names().remove(&instance)?;
        Some(Guess { class, instance, like })
    }
}
