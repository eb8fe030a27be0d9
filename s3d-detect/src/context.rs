//! Context: which of the scored boxes of a space are elements, together.
//!
//! A conditional random field over boxes that are on or off: each box that is on counts its class's weight
//! times its score and a constant, and each pair of boxes that are on the weight of its two classes and of
//! where the second lies from the first. Weights by structured max margin with the number of wrong boxes as
//! loss, by averaged subgradient steps (Ratliff, Bagnell and Zinkevich, 2007); inference adds the box that
//! gains most until none gains. Both are as Desai, Ramanan and Fowlkes did in images ("Discriminative models
//! for multi-class object layout", ICCV 2009); the paper's own terms are not public.

use crate::area::CLASSES;
use crate::boxes::iou;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};

/// Where the second of two boxes lies from the first.
const RELATIONS: usize = 8;
const COUNT: usize = CLASSES.len();
const PAIRS: usize = COUNT * (COUNT + 1) / 2;
/// Pairs farther apart than this, in metres, have no term.
const NEAR_M: f32 = 2.0;
/// The weights' length costs this.
const REGULARISER: f64 = 1e-3;
const EPOCHS: u32 = 40;

/// A box that may be an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The place of its class in [`CLASSES`].
    pub class: usize,
    /// The score of its class's machine.
    pub score: f64,
    /// The box, in metres.
    pub bbox: Aabb,
}

/// The weights of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Context {
    /// By class: of the score, and the constant.
    pub unary: Vec<[f64; 2]>,
    /// By pair of classes (the lower first) and relation.
    pub pairwise: Vec<f64>,
}

/// A pair's entry of [`Context::pairwise`], if it has a term.
fn term(a: &Node, b: &Node) -> Option<usize> {
    let (a, b) = if a.class <= b.class { (a, b) } else { (b, a) };
    let gap = (b.bbox.min - a.bbox.max).max(a.bbox.min - b.bbox.max);
    let apart = gap.max(glam::Vec3::ZERO).length();
    if apart > NEAR_M {
        return None;
    }
    let overlap = iou(&a.bbox, &b.bbox);
    let beside = gap.x.max(gap.y);
    let relation = if overlap > 0.25 {
        0
    } else if overlap > 0.0 {
        1
    } else if beside < 0.0 && gap.z >= 0.0 {
        // One above the other; of two of a class it does not matter which.
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
    };
    let pair = b.class * (b.class + 1) / 2 + a.class;
    Some(pair * RELATIONS + relation)
}

/// The terms of a space's boxes: by box, the others that it has a term with.
struct Graph<'a> {
    nodes: &'a [Node],
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

impl Default for Context {
    /// That of scores alone: a box is on if its score is positive.
    fn default() -> Self {
        Self { unary: vec![[1.0, 0.0]; COUNT], pairwise: vec![0.0; PAIRS * RELATIONS] }
    }
}

impl Context {
    fn unary_of(&self, n: &Node) -> f64 {
        let [weight, constant] = self.unary[n.class];
        weight * n.score + constant
    }

    /// Switches boxes on, that with the largest gain first (ties: the first), until none gains. Gives which
    /// are on, and what each gains or would gain, given the others that are on: its score in context.
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

    /// What a set of boxes counts.
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

    /// Learns from spaces: their boxes, and which of them are elements.
    ///
    /// # Panics
    /// If a space has another number of boxes than of answers.
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
                let ((nodes, truth), graph) = (&spaces[s], &graphs[s]);
                assert_eq!(nodes.len(), truth.len(), "an answer a box");
                // The worst answer by value and loss: a box that is wrongly on or off counts 1.
                let (on, _) = now.infer_with(graph, |i| if truth[i] { -1.0 } else { 1.0 });
                step += 1.0;
                let rate = 0.1 / (1.0 + REGULARISER * step) / (nodes.len().max(1) as f64).sqrt();
                now.each(|w| *w *= 1.0 - rate * REGULARISER);
                now.add(graph, truth, rate);
                now.add(graph, &on, -rate);
                let share = 1.0 / step;
                mean.approach(&now, share);
            }
        }
        if step == 0.0 { now } else { mean }
    }

    fn each(&mut self, mut change: impl FnMut(&mut f64)) {
        self.unary.iter_mut().flatten().for_each(&mut change);
        self.pairwise.iter_mut().for_each(&mut change);
    }

    /// Adds what a set of boxes has of each weight, times a factor.
    fn add(&mut self, graph: &Graph<'_>, on: &[bool], factor: f64) {
        for i in (0..on.len()).filter(|&i| on[i]) {
            let node = &graph.nodes[i];
            self.unary[node.class][0] += factor * node.score;
            self.unary[node.class][1] += factor;
            for &(j, term) in graph.near[i].iter().filter(|(j, _)| *j < i && on[*j]) {
                debug_assert!(j < i);
                self.pairwise[term] += factor;
            }
        }
    }

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

    /// The best of all sets.
    fn exact(context: &Context, nodes: &[Node]) -> (Vec<bool>, f64) {
        let sets = (0..1u32 << nodes.len()).map(|set| (0..nodes.len()).map(|i| set >> i & 1 == 1).collect());
        sets.map(|on: Vec<bool>| (on.clone(), context.value(nodes, &on)))
            .reduce(|best, next| if next.1 > best.1 { next } else { best })
            .unwrap()
    }

    /// Small graphs with random weights, for a seed.
    fn random_case(seed: u64) -> (Context, Vec<Node>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut context = Context::default();
        context
            .pairwise
            .iter_mut()
            .for_each(|w| *w = rng.random_range(-0.6..0.3));
        let nodes = (0..9).map(|_| {
            let (class, score) = (rng.random_range(0..COUNT), rng.random_range(-1.0..1.5));
            node(class, score, rng.random_range(0.0..4.0), rng.random_range(0.0..1.5))
        });
        (context, nodes.collect())
    }

    #[test]
    fn greedy_inference_is_near_the_best_of_all_sets() {
        let (mut same, mut share) = (0, 0.0);
        for seed in 0..100 {
            let (context, nodes) = random_case(seed);
            let (on, gains) = context.infer(&nodes);
            let (best, most) = exact(&context, &nodes);
            let value = context.value(&nodes, &on);
            assert!(value <= most + 1e-9 && value >= 0.0);
            same += u32::from(on == best);
            share += if most > 0.0 { value / most } else { 1.0 };
            // A gain is what the value changes by.
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
            let context = Context::default();
            assert_eq!(context.infer(&nodes).0, exact(&context, &nodes).0);
        }
    }

    #[test]
    fn what_goes_together_is_learnt() {
        // Chairs of one score are elements beside a table, and none elsewhere.
        let spaces: Vec<(Vec<Node>, Vec<bool>)> = (0..40)
            .map(|i| {
                let far = if i % 2 == 0 { 1.0 } else { 20.0 };
                let nodes = vec![node(7, 1.0, 0.0, 0.0), node(8, 0.0, far, 0.0), node(8, -1.0, 40.0, 0.0)];
                (nodes, vec![true, i % 2 == 0, false])
            })
            .collect();
        let context = Context::train(&spaces, 5);
        for (nodes, truth) in &spaces {
            assert_eq!(&context.infer(nodes).0, truth);
        }
        assert_eq!(Context::train(&spaces, 5), context);
        assert_eq!(Context::train(&[], 5), Context::default());
    }
}
