//! The boundary scores of Depth Pro's script.

/// The least and the greatest ratio of depths at a boundary, and the number of ratios from one to the other.
const LIMITS: [f64; 2] = [1.05, 1.25];
const STEPS: usize = 10;
/// The least depth, in metres.
const NEAREST: f64 = 1e-6;

/// The boundary scores of one image, each from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeScores {
    /// The harmonic mean of precision and recall, precision and recall, each as the mean over limits, in
    /// which a limit counts its ratio.
    pub values: [f64; 3],
    /// Whether the truth has boundaries in all four directions at every limit. Otherwise even the truth
    /// itself has scores below 1.
    pub is_complete: bool,
}

/// Returns the scores of Depth Pro. `truth` and `prediction` are rows of `width` pixels, in any unit. A truth
/// of 0 or less is missing; neighbours of which one is missing are left out.
///
/// The boundary of a pixel and its neighbour is where one is farther than the other by more than a limit.
/// There are 10 limits, from 1.05 to 1.25, and four directions: to the nearer pixel at the right, left,
/// below, above. A boundary is right if both sides have it at the same place in the same direction. Precision
/// and recall are means over directions, 0 for a direction without boundaries.
///
/// Source: Depth Pro, `src/depth_pro/eval/boundary_metrics.py`, `SI_boundary_F1`, which knows no missing
/// pixels.
///
/// # Panics
/// If the slices have different lengths, or `width` is 0.
pub fn depth_edges(truth: &[f64], prediction: &[f64], width: usize) -> EdgeScores {
    assert_eq!(truth.len(), prediction.len(), "a prediction a pixel");
    let step = (LIMITS[1] - LIMITS[0]) / (STEPS - 1) as f64;
    let mut limits: [f64; STEPS] = std::array::from_fn(|at| at as f64 * step + LIMITS[0]);
    limits[STEPS - 1] = LIMITS[1];

    let inverse = |at: usize| {
        let there = truth[at] > 0.0;
        [truth[at], prediction[at]].map(|depth| if there { 1.0 / depth.max(NEAREST) } else { f64::NAN })
    };
    let mut counts = [[Counts::default(); STEPS]; 4];
    for at in 0..truth.len() {
        let here = inverse(at);
        let right = (at % width + 1 < width).then_some(at + 1);
        let below = Some(at + width).filter(|below| *below < truth.len());
        for (direction, neighbour) in [right, below].into_iter().enumerate() {
            let Some(there) = neighbour.map(inverse) else { continue };
            let ratios = [[there[0] / here[0], there[1] / here[1]], [here[0] / there[0], here[1] / there[1]]];
            for (side, [truth, prediction]) in ratios.into_iter().enumerate() {
                if truth > LIMITS[0] || prediction > LIMITS[0] {
                    let of_direction = &mut counts[2 * direction + side];
                    for (counts, limit) in of_direction.iter_mut().zip(limits) {
                        counts.add(truth > limit, prediction > limit);
                    }
                }
            }
        }
    }

    let mut values = [0.0; 3];
    let all: f64 = limits.iter().sum();
    for (at, limit) in limits.iter().enumerate() {
        let of = |share: fn(&Counts) -> f64| 0.25 * counts.iter().map(|c| share(&c[at])).sum::<f64>();
        let [precision, recall] = [of(|c| share(c.both, c.predicted)), of(|c| share(c.both, c.truth))];
        let sum = precision + recall;
        let f1 = if sum > 0.0 {
            2.0 * (recall * precision) / sum
        } else {
            0.0
        };
        for (value, score) in values.iter_mut().zip([f1, precision, recall]) {
            *value += score * (limit / all);
        }
    }
    let is_complete = counts.iter().flatten().all(|counts| counts.truth > 0);
    EdgeScores { values, is_complete }
}

/// Boundaries in one direction at one limit.
#[derive(Clone, Copy, Default)]
struct Counts {
    truth: u64,
    predicted: u64,
    both: u64,
}

impl Counts {
    fn add(&mut self, truth: bool, predicted: bool) {
        self.truth += u64::from(truth);
        self.predicted += u64::from(predicted);
        self.both += u64::from(truth && predicted);
    }
}

fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}
