//! The scores of a mesh.

/// How well a mesh agrees with the truth. Shares are from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshScores {
    /// Precision, recall and F-score at each distance that was asked for.
    pub at: Vec<ScoresAt>,
    /// Distances of the mesh to the truth, all of it.
    pub accuracy: DistanceScores,
    /// Distances of the truth that was seen to the mesh.
    pub completeness: DistanceScores,
    /// How the normals agree.
    pub normals: NormalScores,
    /// Falsely closed space: the share of lines of sight, from devices to what they saw, that the mesh blocks
    /// before they come near their surface. Closed doors, ghosts and people who walked by do this.
    pub closed_sight: f64,
    /// The share of the truth that a device saw.
    pub seen_share: f64,
    /// The numbers of samples: of the mesh, and of the truth that was seen.
    pub samples: [usize; 2],
}

/// Shares of samples within a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoresAt {
    /// The distance, metres.
    pub distance_m: f32,
    /// The share of the mesh that is nearer to the truth than that.
    pub precision: f64,
    /// The share of the seen truth that is nearer to the mesh than that.
    pub recall: f64,
    /// The harmonic mean of both; 0 if both are 0.
    pub f_score: f64,
}

/// Distances of samples, metres. NaN without samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceScores {
    /// The mean.
    pub mean_m: f64,
    /// The root of the mean square.
    pub rms_m: f64,
    /// Half of the samples are nearer.
    pub median_m: f64,
    /// 95 % of the samples are nearer.
    pub p95_m: f64,
}

/// How normals agree where the surfaces are within 5 cm of each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalScores {
    /// The absolute cosine between the normals of a sample and of the nearest place of the other surface: the
    /// mean over samples, and then over both ways. NaN without samples.
    pub consistency: f64,
    /// The share of the mesh whose front is on the wrong side: the cosine is below −0.5.
    pub flipped: f64,
}

impl DistanceScores {
    /// Measures distances in ascending order.
    pub(super) fn new(sorted: &[f32]) -> Self {
        let n = sorted.len();
        let mean = |of: fn(f64) -> f64| sorted.iter().map(|d| of(f64::from(*d))).sum::<f64>() / n as f64;
        let at = |share: f64| {
            let rank = (share * n as f64) as usize;
            sorted
                .get(rank.min(n.saturating_sub(1)))
                .map_or(f64::NAN, |d| f64::from(*d))
        };
        Self { mean_m: mean(|d| d), rms_m: mean(|d| d * d).sqrt(), median_m: at(0.5), p95_m: at(0.95) }
    }
}

impl NormalScores {
    pub(super) fn new(of_mesh: &[f32], of_truth: &[f32]) -> Self {
        let mean =
            |cosines: &[f32]| cosines.iter().map(|c| f64::from(c.abs())).sum::<f64>() / cosines.len() as f64;
        let flipped = of_mesh.iter().filter(|c| **c < -0.5).count();
        Self {
            consistency: 0.5 * (mean(of_mesh) + mean(of_truth)),
            flipped: flipped as f64 / of_mesh.len().max(1) as f64,
        }
    }
}

/// Returns the share of ascending distances below `distance_m`; 0 without any.
pub(super) fn share_below(sorted: &[f32], distance_m: f32) -> f64 {
    sorted.partition_point(|d| *d < distance_m) as f64 / sorted.len().max(1) as f64
}

pub(super) fn f_score(precision: f64, recall: f64) -> f64 {
    let sum = precision + recall;
    if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 }
}
