//! Context: decides about all scored boxes of a space together which of them are elements.
//!
//! The model is a conditional random field over boxes that are on or off. A box that is on adds its score,
//! times the weight of its class, and a constant. A pair of boxes that are on adds a weight, which depends on
//! the two classes and on where the second box lies from the first.
//!
//! The weights are learnt by structured max margin, with the number of wrong boxes as loss, in averaged
//! subgradient steps (Ratliff, Bagnell and Zinkevich, 2007). Inference switches on the box that gains most,
//! until none gains. Desai, Ramanan and Fowlkes did both in images ("Discriminative models for multi-class
//! object layout", ICCV 2009); the terms of the paper are not public.

use crate::area::CLASSES;
use crate::boxes::iou;
use glam::Vec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};

/// The number of relations between two boxes: see [`relation`].
const RELATIONS: usize = 8;
const COUNT: usize = CLASSES.len();
const PAIRS: usize = COUNT * (COUNT + 1) / 2;
/// Pairs farther apart than this, in metres, have no term.
const NEAR_M: f32 = 2.0;
/// The cost of the squared length of the weights.
const REGULARISER: f64 = 1e-3;
const EPOCHS: u32 = 40;

/// A box that may be an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The index of its class in [`CLASSES`].
    pub class: usize,
    /// The score of its class's machine.
    pub score: f64,
    /// The box, in metres.
    pub bbox: Aabb,
}

/// The weights of the field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContextWeights {
    /// For each class the weight of its score, and its constant.
    pub unary: Vec<[f64; 2]>,
    /// The weight of each pair of classes (the lower first) and relation.
    pub pairwise: Vec<f64>,
}

/// Returns the index of a pair's weight in [`ContextWeights::pairwise`]; `None` if the two are too far apart.
fn term(a: &Node, b: &Node) -> Option<usize> {
    let (a, b) = if a.class <= b.class { (a, b) } else { (b, a) };
    let gap = (b.bbox.min - a.bbox.max).max(a.bbox.min - b.bbox.max);
    let apart = gap.max(Vec3::ZERO).length();
    if apart > NEAR_M {
        return None;
    }

    let pair = b.class * (b.class + 1) / 2 + a.class;
    Some(pair * RELATIONS + relation(a, b, gap, apart))
}

/// Returns where `b` lies from `a`: they overlap much or a little, one is above the other, or they are
/// `apart` by one of four distances. `gap` is their distance along each axis, negative where they overlap;
/// all in metres.
fn relation(a: &Node, b: &Node, gap: Vec3, apart: f32) -> usize {
    let overlap = iou(&a.bbox, &b.bbox);
    let beside = gap.x.max(gap.y);
    if overlap > 0.25 {
        0
    } else if overlap > 0.0 {
        1
    } else if beside < 0.0 && gap.z >= 0.0 {
        // One above the other. Which one does not matter if both have the same class.
        if b.bbox.min.z >= a.bbox.max.z || a.class == b.class {
            2
        } else {
            3
        }
    } else if apart < 0.15 {
        4
    } else if apart < 0.5 {
        5
    } else if apart < 1.0 {
        6
    } else {
        7
    }
}

/// The boxes of a space, and the pairs of them that have a term.
struct Graph<'a> {
    nodes: &'a [Node],
    /// For each box, its neighbours and the index of the pair's weight.
    near: Vec<Vec<(usize, usize)>>,
}

impl<'a> Graph<'a> {
    fn new(nodes: &'a [Node]) -> Self {
        let near = (0..nodes.len())
            .map(|i| {
                let others = (0..nodes.len()).filter(|&j| j != i);
                others
                    .filter_map(|j| term(&nodes[i], &nodes[j]).map(|t| (j, t)))
                    .collect()
            })
            .collect();
        Self { nodes, near }
    }
}

impl Default for ContextWeights {
    /// Scores alone count: a box is on if its score is positive.
    fn default() -> Self {
        Self { unary: vec![[1.0, 0.0]; COUNT], pairwise: vec![0.0; PAIRS * RELATIONS] }
    }
}

impl ContextWeights {
    fn unary_of(&self, n: &Node) -> f64 {
        let [weight, constant] = self.unary[n.class];
        weight * n.score + constant
    }

    /// Switches boxes on until none gains, the largest gain first; the first box wins a tie. Returns which
    /// boxes are on, and the gain of each, given the others that are on: its score in context.
    pub fn infer(&self, nodes: &[Node]) -> (Vec<bool>, Vec<f64>) {
        let graph = Graph::new(nodes);
        self.infer_with(&graph, |_| 0.0)
    }

    fn infer_with(&self, graph: &Graph<'_>, more: impl Fn(usize) -> f64) -> (Vec<bool>, Vec<f64>) {
        let mut gains: Vec<f64> = graph
            .nodes
            .iter()
            .enumerate()
            .map(|(i, n)| self.unary_of(n) + more(i))
            .collect();

        let mut on = vec![false; gains.len()];
        loop {
            let off = (0..gains.len()).filter(|&i| !on[i]);
            let best = off.reduce(|best, i| if gains[i] > gains[best] { i } else { best });
            match best {
                Some(i) if gains[i] > 0.0 => {
                    on[i] = true;
                    graph.near[i]
                        .iter()
                        .for_each(|&(j, term)| gains[j] += self.pairwise[term]);
                }
                _ => break,
            }
        }
        (on, gains)
    }

    /// Returns the value of a set of boxes: the sum of all its terms.
    pub fn value(&self, nodes: &[Node], on: &[bool]) -> f64 {
        let graph = Graph::new(nodes);
        let mut value = 0.0;
        for i in (0..nodes.len()).filter(|&i| on[i]) {
            value += self.unary_of(&nodes[i]);
            let pairs = graph.near[i].iter().filter(|(j, _)| *j < i && on[*j]);
            value += pairs.map(|&(_, term)| self.pairwise[term]).sum::<f64>();
        }
        value
    }

    /// Learns from the boxes of some spaces, and from which of them are elements.
    ///
    /// # Panics
    /// If a space has not an answer for each box.
    pub fn train(spaces: &[(Vec<Node>, Vec<bool>)], seed: u64) -> Self {
        let graphs: Vec<Graph<'_>> = spaces.iter().map(|(nodes, _)| Graph::new(nodes)).collect();
        let mut now = Self::default();
        let mut mean = Self { unary: vec![[0.0; 2]; COUNT], pairwise: vec![0.0; PAIRS * RELATIONS] };
        let mut order: Vec<usize> = (0..spaces.len()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);

        let mut step = 0.0;
        for _ in 0..EPOCHS {
            order.shuffle(&mut rng);
            for &s in &order {
                let (nodes, truth) = &spaces[s];
                let graph = &graphs[s];
                assert_eq!(nodes.len(), truth.len(), "an answer a box");

                // The worst answer by value and loss: the loss is 1 for each box that is wrongly on or off.
                let (on, _) = now.infer_with(graph, |i| if truth[i] { -1.0 } else { 1.0 });

                step += 1.0;
                let rate = 0.1 / (1.0 + REGULARISER * step) / (nodes.len().max(1) as f64).sqrt();
                now.each(|w| *w *= 1.0 - rate * REGULARISER);
                now.add(graph, truth, rate);
                now.add(graph, &on, -rate);
                mean.approach(&now, 1.0 / step);
            }
        }

        if step == 0.0 { now } else { mean }
    }

    fn each(&mut self, mut change: impl FnMut(&mut f64)) {
        self.unary.iter_mut().flatten().for_each(&mut change);
        self.pairwise.iter_mut().for_each(&mut change);
    }

    /// Adds to each weight a factor times how often a set of boxes uses it.
    fn add(&mut self, graph: &Graph<'_>, on: &[bool], factor: f64) {
        for i in (0..on.len()).filter(|&i| on[i]) {
            let node = &graph.nodes[i];
            self.unary[node.class][0] += factor * node.score;
            self.unary[node.class][1] += factor;
            for &(_, term) in graph.near[i].iter().filter(|(j, _)| *j < i && on[*j]) {
                self.pairwise[term] += factor;
            }
        }
    }

    /// Moves each weight by a share of the way to another's.
    fn approach(&mut self, other: &Self, share: f64) {
        let theirs: Vec<f64> = other.unary.iter().flatten().chain(&other.pairwise).copied().collect();
        let mut theirs = theirs.into_iter();
        self.each(|w| *w += share * (theirs.next().unwrap_or(*w) - *w));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use rand::RngExt;

    fn node(class: usize, score: f64, x: f32, z: f32) -> Node {
        Node { class, score, bbox: Aabb { min: vec3(x, 0.0, z), max: vec3(x + 0.8, 0.8, z + 0.8) } }
    }

    /// Returns the best of all sets of boxes, and its value.
    fn exact(context: &ContextWeights, nodes: &[Node]) -> (Vec<bool>, f64) {
        let sets = (0..1u32 << nodes.len()).map(|set| (0..nodes.len()).map(|i| set >> i & 1 == 1).collect());
        sets.map(|on: Vec<bool>| (on.clone(), context.value(nodes, &on)))
            .reduce(|best, next| if next.1 > best.1 { next } else { best })
            .unwrap()
    }

    /// Makes a small graph with random weights.
    fn random_case(seed: u64) -> (ContextWeights, Vec<Node>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut context = ContextWeights::default();
        context
            .pairwise
            .iter_mut()
            .for_each(|w| *w = rng.random_range(-0.6..0.3));
        let nodes = (0..9).map(|_| {
            let class = rng.random_range(0..COUNT);
            let score = rng.random_range(-1.0..1.5);
            node(class, score, rng.random_range(0.0..4.0), rng.random_range(0.0..1.5))
        });
        (context, nodes.collect())
    }

    #[test]
    fn greedy_inference_is_near_the_best_of_all_sets() {
        let mut same = 0;
        let mut share = 0.0;
        for seed in 0..100 {
            let (context, nodes) = random_case(seed);
            let (on, gains) = context.infer(&nodes);
            let (best, most) = exact(&context, &nodes);
            let value = context.value(&nodes, &on);
            assert!(value <= most + 1e-9 && value >= 0.0);
            same += u32::from(on == best);
            share += if most > 0.0 { value / most } else { 1.0 };

            // A gain is the change of the value.
            for (i, gain) in gains.iter().enumerate() {
                let set = |state| {
                    (0..nodes.len())
                        .map(|j| if i == j { state } else { on[j] })
                        .collect::<Vec<_>>()
                };
                let change = context.value(&nodes, &set(true)) - context.value(&nodes, &set(false));
                assert!((change - gain).abs() < 1e-9);
            }
        }
        assert!(same >= 80 && share > 98.0, "{same} the same, {share} % of the value");
    }

    #[test]
    fn without_pairs_greedy_inference_is_exact() {
        for seed in 0..20 {
            let (_, nodes) = random_case(seed);
            let context = ContextWeights::default();
            assert_eq!(context.infer(&nodes).0, exact(&context, &nodes).0);
        }
    }

    #[test]
    fn training_learns_what_goes_together() {
        // Chairs of the same score are elements beside a table, and nowhere else.
        let spaces: Vec<(Vec<Node>, Vec<bool>)> = (0..40)
            .map(|i| {
                let far = if i % 2 == 0 { 1.0 } else { 20.0 };
                let nodes = vec![node(7, 1.0, 0.0, 0.0), node(8, 0.0, far, 0.0), node(8, -1.0, 40.0, 0.0)];
                (nodes, vec![true, i % 2 == 0, false])
            })
            .collect();
        let context = ContextWeights::train(&spaces, 5);
        for (nodes, truth) in &spaces {
            assert_eq!(&context.infer(nodes).0, truth);
        }
        assert_eq!(ContextWeights::train(&spaces, 5), context);
        assert_eq!(ContextWeights::train(&[], 5), ContextWeights::default());
    }
}
