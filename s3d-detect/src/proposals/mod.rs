//! Proposes boxes that may hold an element.
//!
//! Windows of learnt sizes slide over a space in steps of 0.1 m. A linear machine for each size scores all of
//! them from [summed volumes](crate::surfel::volume), and the best are [fitted](fit) to their points.
//!
//! The paper has the sizes and the step. The score and the fit are ours: without a score, the features of
//! millions of windows would be needed in each space.

pub mod fit;
pub mod sizes;
pub mod windows;

use crate::area::CLASSES;
use crate::boxes::{iou, suppress};
use crate::error::Result;
use crate::spaces::space::Space;
use crate::surfel::volume::Volumes;
use crate::svm::sparse::SparseRows;
use crate::svm::{Linear, SvmOptions, train};
use fit::{Fit, learn};
use glam::{Vec3, ivec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use s3d_dataset::Context;
use s3d_geom::Aabb;
use serde::{Deserialize, Serialize};
use sizes::cluster_sizes;
use windows::{WINDOW_FEATURES, Window, best_windows, reach, window_cells, window_features};

/// A space that is ready to be searched.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    /// The space.
    pub space: &'a Space,
    /// Its summed volumes.
    pub volumes: Volumes,
}

impl<'a> Prepared<'a> {
    /// Prepares a space.
    pub fn new(space: &'a Space) -> Self {
        Self { space, volumes: Volumes::new(space.index.surfels(), space.frame.extent) }
    }

    /// Returns the true boxes of a class.
    pub fn truth(&self, class: usize) -> impl Iterator<Item = &Aabb> {
        self.space
            .elements
            .iter()
            .filter(move |e| e.class == class)
            .map(|e| &e.bbox)
    }
}

/// A box that may hold an element of a class, in the frame of the space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// The index of the class in [`CLASSES`].
    pub class: usize,
    /// The fitted box.
    pub bbox: Aabb,
    /// The score of the window.
    pub score: f32,
}

/// Windows of one size for a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowSize {
    /// The index of the class in [`CLASSES`].
    pub class: usize,
    /// The size of its elements, in metres.
    pub size_m: [f32; 3],
    /// The least and the greatest height of the bottom of windows above the floor, in metres.
    pub bottom_m: [f32; 2],
    /// How windows become boxes, by axis.
    pub fits: [Fit; 3],
    /// Scores the features of a window.
    pub machine: Linear,
}

/// Proposes boxes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Proposer {
    /// The sizes of windows, by class.
    pub sizes: Vec<WindowSize>,
}

/// The most windows of a size that a space keeps.
const BEST_OF_SIZE: usize = 60;
/// The most proposals of a class in a space.
const BEST_OF_CLASS: usize = 150;
/// The best stays of windows that overlap by a larger IoU than this.
const SAME_WINDOW: f64 = 0.7;
/// The best stays of fitted boxes that overlap by a larger IoU than this.
const SAME_BOX: f64 = 0.8;
/// The number of windows that are drawn at random as negative examples of a size.
const NEGATIVES: usize = 3000;
/// The number of spaces that are searched for hard negative examples: windows that score high and hold
/// nothing.
const SEARCHED: usize = 12;
/// The most hard negative examples of a space.
const HARD: usize = 30;
/// The most boxes that a fit is learnt from.
const FITTED: usize = 40;
/// A box is a negative example of a class if its IoU with all elements of the class is smaller than this.
pub const NEGATIVE_IOU: f64 = 0.3;
/// A box is a positive example of a class if its IoU with an element of the class is larger than this.
pub const POSITIVE_IOU: f64 = 0.5;
/// The bottoms of windows may lie this far below and above the bottoms of the training boxes, in metres.
const BOTTOM_SLACK_M: f32 = 0.2;

impl Proposer {
    /// Learns sizes, fits and scores from annotated spaces, on all threads of the current rayon pool.
    ///
    /// # Errors
    /// [`Error::Dataset`](crate::Error::Dataset) if the call is cancelled.
    pub fn train(spaces: &[Prepared<'_>], seed: u64, ctx: &Context) -> Result<Self> {
        let mut sizes = Vec::new();
        for class in 0..CLASSES.len() {
            let boxes: Vec<(usize, Aabb)> = spaces
                .iter()
                .enumerate()
                .flat_map(|(i, s)| s.truth(class).map(move |b| (i, *b)))
                .collect();
            let all: Vec<Vec3> = boxes.iter().map(|(_, b)| b.size()).collect();
            let (centers, of) = cluster_sizes(&all, seed ^ class as u64);
            for (cluster, size) in centers.into_iter().enumerate() {
                let members = boxes.iter().zip(&of).filter(|(_, o)| **o == cluster).map(|(b, _)| *b);
                sizes.push((class, size, members.collect::<Vec<_>>()));
            }
        }

        let progress = ctx.progress("learning", "window sizes", sizes.len() as u64);
        let learnt = sizes.par_iter().enumerate().map(|(number, (class, size, members))| {
            ctx.check()?;
            let seed = seed.wrapping_mul(1009).wrapping_add(number as u64);
            let learnt = learn_size(spaces, *class, *size, members, seed);
            progress.add(1);
            Ok(learnt)
        });
        Ok(Self { sizes: learnt.collect::<Result<_>>()? })
    }

    /// Returns the proposals of a space: at most 150 for each class, the highest score first.
    pub fn propose(&self, prepared: &Prepared<'_>) -> Vec<Proposal> {
        let mut out = Vec::new();
        for class in 0..CLASSES.len() {
            let mut windows: Vec<(Window, f32, &WindowSize)> = Vec::new();
            for size in self.sizes.iter().filter(|s| s.class == class) {
                let cells = window_cells(Vec3::from(size.size_m), &prepared.volumes);
                let best = best_windows(&prepared.volumes, &size.machine, cells, size.bottom_m, BEST_OF_SIZE);
                windows.extend(best.into_iter().map(|(w, score)| (w, score, size)));
            }

            let boxes: Vec<Aabb> = windows.iter().map(|(w, _, _)| w.bbox()).collect();
            let scores: Vec<f64> = windows.iter().map(|(_, s, _)| f64::from(*s)).collect();
            let kept = suppress(&boxes, &scores, SAME_WINDOW)
                .into_iter()
                .take(2 * BEST_OF_CLASS);
            let fitted = kept.filter_map(|i| {
                let (_, score, size) = windows[i];
                let bbox = fit::fit(&prepared.space.index, &boxes[i], Vec3::from(size.size_m), size.fits)?;
                Some(Proposal { class, bbox, score })
            });
            let fitted: Vec<Proposal> = fitted.collect();

            let boxes: Vec<Aabb> = fitted.iter().map(|p| p.bbox).collect();
            let scores: Vec<f64> = fitted.iter().map(|p| f64::from(p.score)).collect();
            let stay = suppress(&boxes, &scores, SAME_BOX);
            out.extend(stay.into_iter().take(BEST_OF_CLASS).map(|i| fitted[i]));
        }
        out
    }
}

/// Learns the windows of one size from the boxes of its cluster. `members` has the space and the box of each.
fn learn_size(
    spaces: &[Prepared<'_>],
    class: usize,
    size: Vec3,
    members: &[(usize, Aabb)],
    seed: u64,
) -> WindowSize {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let bottoms = members.iter().map(|(_, b)| b.min.z);
    let bottom_m = [
        bottoms.clone().fold(f32::INFINITY, f32::min) - BOTTOM_SLACK_M,
        bottoms.fold(f32::NEG_INFINITY, f32::max) + BOTTOM_SLACK_M,
    ];

    let mut rows = SparseRows::new(WINDOW_FEATURES);
    let mut positive = Vec::new();
    let mut examples = Vec::new();
    for (i, bbox) in members {
        let prepared = &spaces[*i];
        let window = Window::around(bbox, window_cells(size, &prepared.volumes), &prepared.volumes);
        rows.push(&window_features(&prepared.volumes, &window));
        positive.push(true);
        examples.push((&prepared.space.index, window.bbox(), *bbox));
    }

    for _ in 0..NEGATIVES {
        let prepared = &spaces[rng.random_range(0..spaces.len())];
        let cells = window_cells(size, &prepared.volumes);
        let [least, most] = reach(&prepared.volumes, cells);
        let pick = |axis: usize, rng: &mut ChaCha8Rng| rng.random_range(least[axis]..=most[axis]);
        let corner = ivec3(pick(0, &mut rng), pick(1, &mut rng), pick(2, &mut rng));
        let window = Window { corner, cells };
        if is_negative(prepared, class, &window) {
            rows.push(&window_features(&prepared.volumes, &window));
            positive.push(false);
        }
    }

    let mut machine = train_windows(&rows, &positive, seed);
    for _ in 0..SEARCHED.min(spaces.len()) {
        let prepared = &spaces[rng.random_range(0..spaces.len())];
        let cells = window_cells(size, &prepared.volumes);
        for (window, _) in best_windows(&prepared.volumes, &machine, cells, bottom_m, HARD) {
            if is_negative(prepared, class, &window) {
                rows.push(&window_features(&prepared.volumes, &window));
                positive.push(false);
            }
        }
    }
    machine = train_windows(&rows, &positive, seed);

    let step = examples.len().div_ceil(FITTED).max(1);
    let some: Vec<_> = examples.into_iter().step_by(step).collect();
    WindowSize { class, size_m: size.to_array(), bottom_m, fits: learn(&some, size), machine }
}

/// Whether a window holds no element of a class.
fn is_negative(prepared: &Prepared<'_>, class: usize, window: &Window) -> bool {
    prepared
        .truth(class)
        .all(|b| iou(&loosened(b), &window.bbox()) < NEGATIVE_IOU)
}

/// Grows a box to the thickness of a window.
fn loosened(b: &Aabb) -> Aabb {
    let grow = (Vec3::splat(0.2) - b.size()).max(Vec3::ZERO) * 0.5;
    Aabb { min: b.min - grow, max: b.max + grow }
}

fn train_windows(rows: &SparseRows, positive: &[bool], seed: u64) -> Linear {
    let count = positive.iter().filter(|p| **p).count().max(1);
    // Positive and negative examples weigh alike.
    let weight = (positive.len() - count) as f64 / count as f64;
    let costs: Vec<f64> = positive
        .iter()
        .map(|p| if *p { 0.1 * weight.max(1.0) } else { 0.1 })
        .collect();
    train(rows, positive, &costs, &SvmOptions { max_passes: 60, seed, ..SvmOptions::default() })
}
