//! Learns the machines of each class, and the weights of the context.

use crate::area::CLASSES;
use crate::boxes::{iou, suppress};
use crate::context::{ContextWeights, Node};
use crate::error::Result;
use crate::features::{FEATURES, Variant, describe};
use crate::proposals::{NEGATIVE_IOU, POSITIVE_IOU, Prepared, Proposal};
use crate::svm::sparse::{SparseRow, SparseRows};
use crate::svm::{Linear, SvmOptions, train};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use s3d_dataset::Context;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};

/// The cost of a negative example. A positive one costs this times the number of negative ones for each, up
/// to a limit.
const COST: f64 = 0.01;
const MOST_WEIGHT: f64 = 8.0;
/// The most examples of a class that a space gives: positive and negative ones at first, and hard negative
/// ones in each round.
const POSITIVES: usize = 40;
const FIRST_NEGATIVES: usize = 10;
const HARD_NEGATIVES: usize = 15;
/// The number of rounds that add hard negatives.
const ROUNDS: usize = 2;
/// A negative example is hard if it scores above this.
const MARGIN: f64 = -1.0;
/// Boxes of a class that overlap by a larger IoU than this are one element: the best stays.
const SAME_ELEMENT: f64 = 0.25;
/// The most boxes of a class and a space that the context looks at.
const NODES: usize = 40;

/// The machines of one variant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machines {
    /// The features that they are given.
    pub variant: Variant,
    /// The machine of each class; `None` for a class without an example.
    pub classes: Vec<Option<Linear>>,
    /// The weights of the terms between boxes.
    pub context: ContextWeights,
}

/// Examples of a class besides the true boxes.
#[derive(Clone, Debug)]
struct Pool {
    rows: SparseRows,
    positive: Vec<bool>,
    /// The space of each row.
    space: Vec<usize>,
}

/// The source of all examples.
struct Source<'a> {
    spaces: &'a [Prepared<'a>],
    /// The proposals of each space, and how much each overlaps an element of its class.
    proposals: &'a [Vec<(Proposal, f64)>],
    /// The features of the proposals, made once for all variants and rounds.
    described: Vec<SparseRows>,
    /// The features of all true boxes, and the class and the space of each.
    truth: SparseRows,
    class_of_truth: Vec<usize>,
    space_of_truth: Vec<usize>,
    seed: u64,
}

/// Returns the largest IoU of a proposal with an element of its class.
pub fn overlap(prepared: &Prepared<'_>, p: &Proposal) -> f64 {
    prepared.truth(p.class).map(|b| iou(b, &p.bbox)).fold(0.0, f64::max)
}

/// Returns the features of boxes of a space, a row each.
fn describe_all<'b>(prepared: &Prepared<'_>, boxes: impl Iterator<Item = &'b Aabb>) -> SparseRows {
    let mut rows = SparseRows::new(FEATURES);
    boxes.for_each(|b| rows.push(&describe(&prepared.space.index, prepared.space.frame.extent, b)));
    rows
}

/// Learns the machines of `variants` from spaces and their proposals. Each class learns on a thread of its
/// own.
///
/// # Errors
/// [`Error::Dataset`](crate::Error::Dataset) if the call is cancelled.
pub fn learn(
    spaces: &[Prepared<'_>],
    proposals: &[Vec<(Proposal, f64)>],
    variants: &[Variant],
    seed: u64,
    ctx: &Context,
) -> Result<Vec<Machines>> {
    let source = Source::new(spaces, proposals, seed);
    let first: Vec<Pool> = (0..CLASSES.len())
        .into_par_iter()
        .map(|class| source.first_pool(class))
        .collect();

    let progress = ctx.progress("learning", "machines", (variants.len() * (ROUNDS + 3)) as u64);
    let mut learnt = Vec::new();
    for &variant in variants {
        let mut pools = first.clone();
        let mut classes = source.train(&pools, variant, |_| true);
        progress.add(1);
        for _ in 0..ROUNDS {
            ctx.check()?;
            source.add_hard(&mut pools, &classes);
            classes = source.train(&pools, variant, |_| true);
            progress.add(1);
        }

        // The context learns from scores of spaces that a machine has not seen, such as it will be used on.
        let mut scored = Vec::new();
        for half in 0..2 {
            ctx.check()?;
            let machines = source.train(&pools, variant, |space| space % 2 != half);
            let of_half = (0..spaces.len()).into_par_iter().filter(|space| space % 2 == half);
            scored.extend(of_half.map(|space| source.nodes(space, &machines)).collect::<Vec<_>>());
            progress.add(1);
        }

        learnt.push(Machines { variant, classes, context: ContextWeights::train(&scored, seed) });
    }
    Ok(learnt)
}

impl<'a> Source<'a> {
    /// Describes the true boxes and the proposals of all spaces.
    fn new(spaces: &'a [Prepared<'a>], proposals: &'a [Vec<(Proposal, f64)>], seed: u64) -> Self {
        let (truths, described): (Vec<SparseRows>, Vec<SparseRows>) = spaces
            .par_iter()
            .zip(proposals)
            .map(|(s, proposals)| {
                let truth = describe_all(s, s.space.elements.iter().map(|e| &e.bbox));
                (truth, describe_all(s, proposals.iter().map(|(p, _)| &p.bbox)))
            })
            .unzip();
        let mut truth = SparseRows::new(FEATURES);
        truths.iter().for_each(|rows| truth.append(rows));

        let elements = || {
            spaces
                .iter()
                .enumerate()
                .flat_map(|(i, s)| s.space.elements.iter().map(move |e| (i, e)))
        };
        Self {
            spaces,
            proposals,
            described,
            truth,
            class_of_truth: elements().map(|(_, e)| e.class).collect(),
            space_of_truth: elements().map(|(i, _)| i).collect(),
            seed,
        }
    }

    /// Returns the proposals that overlap an element, and some random ones that overlap none.
    fn first_pool(&self, class: usize) -> Pool {
        let mut pool = Pool { rows: SparseRows::new(FEATURES), positive: Vec::new(), space: Vec::new() };
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed.wrapping_mul(31).wrapping_add(class as u64));
        for (space, proposals) in self.proposals.iter().enumerate() {
            let of_class = |i: &usize| proposals[*i].0.class == class;
            let those = |which: &dyn Fn(f64) -> bool| -> Vec<usize> {
                (0..proposals.len())
                    .filter(of_class)
                    .filter(|i| which(proposals[*i].1))
                    .collect()
            };

            let mut negatives = those(&|overlap| overlap < NEGATIVE_IOU);
            negatives.shuffle(&mut rng);
            negatives.truncate(FIRST_NEGATIVES);
            let mut all = those(&|overlap| overlap >= POSITIVE_IOU);
            all.truncate(POSITIVES);
            all.append(&mut negatives);

            pool.rows
                .append(&self.described[space].select(all.iter().copied(), &[]));
            pool.positive
                .extend(all.iter().map(|i| proposals[*i].1 >= POSITIVE_IOU));
            pool.space.resize(pool.positive.len(), space);
        }
        pool
    }

    /// Trains the machine of each class on the examples of the spaces that `from` accepts.
    fn train(
        &self,
        pools: &[Pool],
        variant: Variant,
        from: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Option<Linear>> {
        let without = variant.without();
        let classes = pools.par_iter().enumerate().map(|(class, pool)| {
            let truths = (0..self.truth.len()).filter(|&i| from(self.space_of_truth[i]));
            let pooled = (0..pool.rows.len()).filter(|&i| from(pool.space[i]));
            let mut rows = self.truth.select(truths.clone(), &without);
            rows.append(&pool.rows.select(pooled.clone(), &without));
            let of_truth = truths.map(|i| self.class_of_truth[i] == class);
            let positive: Vec<bool> = of_truth.chain(pooled.map(|i| pool.positive[i])).collect();
            let count = positive.iter().filter(|p| **p).count();
            if count == 0 {
                return None;
            }

            let weight = ((positive.len() - count) as f64 / count as f64).clamp(1.0, MOST_WEIGHT);
            let costs: Vec<f64> = positive.iter().map(|p| if *p { COST * weight } else { COST }).collect();
            let seed = self.seed.wrapping_mul(101).wrapping_add(class as u64);
            let options = SvmOptions { max_passes: 60, seed, ..SvmOptions::default() };
            Some(train(&rows, &positive, &costs, &options))
        });
        classes.collect()
    }

    /// Adds the negative proposals of each space that score highest above the margin.
    fn add_hard(&self, pools: &mut [Pool], machines: &[Option<Linear>]) {
        let hard: Vec<Vec<(usize, SparseRows)>> = (0..self.spaces.len())
            .into_par_iter()
            .map(|space| {
                let proposals = &self.proposals[space];
                let rows = &self.described[space];
                let mut found = Vec::new();
                for (class, machine) in machines.iter().enumerate() {
                    let Some(machine) = machine else { continue };
                    let mut scores: Vec<(f64, usize)> = (0..rows.len())
                        .filter(|i| proposals[*i].0.class == class && proposals[*i].1 < NEGATIVE_IOU)
                        .map(|i| (machine.score(rows.row(i)), i))
                        .filter(|(score, _)| *score > MARGIN)
                        .collect();
                    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                    scores.truncate(HARD_NEGATIVES);
                    found.push((class, rows.select(scores.into_iter().map(|(_, i)| i), &[])));
                }
                found
            })
            .collect();

        for (space, found) in hard.into_iter().enumerate() {
            for (class, rows) in found {
                let pool = &mut pools[class];
                pool.positive.resize(pool.positive.len() + rows.len(), false);
                pool.space.resize(pool.space.len() + rows.len(), space);
                pool.rows.append(&rows);
            }
        }
    }

    /// Returns the scored boxes of a space, and which of them are elements. An element belongs to the highest
    /// box of its class that overlaps it.
    fn nodes(&self, space: usize, machines: &[Option<Linear>]) -> (Vec<Node>, Vec<bool>) {
        let prepared = &self.spaces[space];
        let proposals: Vec<Proposal> = self.proposals[space].iter().map(|(p, _)| *p).collect();
        let scores: Vec<f64> = proposals
            .iter()
            .enumerate()
            .map(|(i, p)| score_of(machines, p, self.described[space].row(i)))
            .collect();
        let nodes = elements(&proposals, &scores);

        let mut taken = vec![false; prepared.space.elements.len()];
        let answers = nodes.iter().map(|n| {
            let elements = prepared.space.elements.iter().enumerate();
            let best = elements
                .filter(|(_, e)| e.class == n.class)
                .map(|(i, e)| (iou(&e.bbox, &n.bbox), i))
                .reduce(|best, next| if next.0 > best.0 { next } else { best });
            match best {
                Some((overlap, i)) if overlap > POSITIVE_IOU && !taken[i] => {
                    taken[i] = true;
                    true
                }
                _ => false,
            }
        });
        let answers = answers.collect();
        (nodes, answers)
    }
}

/// Returns the scores of proposals: by machine, then by proposal. A class without a machine scores −∞.
pub fn score(
    prepared: &Prepared<'_>,
    proposals: &[Proposal],
    machines: &[&[Option<Linear>]],
) -> Vec<Vec<f64>> {
    let rows = describe_all(prepared, proposals.iter().map(|p| &p.bbox));
    machines
        .iter()
        .map(|machines| {
            proposals
                .iter()
                .enumerate()
                .map(|(i, p)| score_of(machines, p, rows.row(i)))
                .collect()
        })
        .collect()
}

fn score_of(machines: &[Option<Linear>], p: &Proposal, row: SparseRow<'_>) -> f64 {
    machines[p.class]
        .as_ref()
        .map_or(f64::NEG_INFINITY, |machine| machine.score(row))
}

/// Returns the scored proposals that non-maximum suppression keeps: class by class, the highest score first.
pub fn elements(proposals: &[Proposal], scores: &[f64]) -> Vec<Node> {
    let mut nodes = Vec::new();
    for class in 0..CLASSES.len() {
        let of_class: Vec<usize> = (0..proposals.len())
            .filter(|&i| proposals[i].class == class && scores[i].is_finite())
            .collect();
        let boxes: Vec<_> = of_class.iter().map(|&i| proposals[i].bbox).collect();
        let scores: Vec<f64> = of_class.iter().map(|&i| scores[i]).collect();
        let stay = suppress(&boxes, &scores, SAME_ELEMENT).into_iter().take(NODES);
        nodes.extend(stay.map(|i| Node { class, score: scores[i], bbox: boxes[i] }));
    }
    nodes
}

/// Draws a score between 0 and 1 for each of `count` boxes.
pub fn random_scores(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| rng.next_u64() as f64 / u64::MAX as f64).collect()
}
