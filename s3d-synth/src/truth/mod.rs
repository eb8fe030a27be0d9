//! How well a mesh agrees with the scene that was scanned.
//!
//! [`Truth`] holds samples of the surface of a scene, and which of them the devices saw from their
//! [`View`]s. [`Truth::score`] compares a mesh with it. Distances are from samples of one surface to the
//! faces of the other, both ways. Precision, recall and F-score are defined by Knapitsch, Park, Zhou and
//! Koltun 2017 ("Tanks and Temples: benchmarking large-scale scene reconstruction"), normal consistency by
//! Mescheder et al. 2019 ("Occupancy networks"). What no device saw does not count against a mesh that lacks
//! it.
//!
//! ```
//! use s3d_synth::Building;
//! use s3d_synth::device::{LaserScanner, ScanTarget};
//! use s3d_synth::truth::{Truth, TruthOptions, View};
//!
//! let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
//! let target = ScanTarget::new(&scene);
//! let views = scene.locations.iter().map(|l| View::of_laser(l, &LaserScanner::default()));
//! let options = TruthOptions { samples_per_m2: 10.0, ..TruthOptions::default() };
//! let truth = Truth::new(&target, &views.collect::<Vec<_>>(), &options)?;
//!
//! // The scene agrees with itself, the backs of its furniture included.
//! let scores = truth.score(&scene.mesh);
//! assert!(scores.at.iter().all(|at| at.f_score > 0.999));
//! assert!(scores.seen_share < 0.95 && scores.closed_sight < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod labels;
mod scores;
mod view;

pub use labels::LabelScores;
pub use scores::{DistanceScores, MeshScores, NormalScores, ScoresAt};
pub use view::{Field, View};

use crate::device::ScanTarget;
use crate::rays::RayTree;
use crate::{AnnotatedScene, RangeError};
use rayon::prelude::*;
use s3d_geom::glam::Vec3;
use s3d_geom::{Density, NO_INDEX, Nearest, NearestFaces, PointCloud, SurfaceSampler, TriMesh};
use scores::{f_score, share_below};
use std::fmt;

/// How a mesh is compared with the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthOptions {
    /// Samples a square metre of both surfaces: 0.1 to 1e6. They say how exact the shares are, not the
    /// distances.
    pub samples_per_m2: f64,
    /// The distances at which precision and recall are told, metres, above 0.
    pub distances_m: Vec<f32>,
    /// A line of sight must be free up to where it is this far from the plane of its surface, metres: 0.001
    /// to 1.
    pub margin_m: f32,
    /// The seed of the samples.
    pub seed: u64,
}

impl Default for TruthOptions {
    fn default() -> Self {
        Self { samples_per_m2: 1000.0, distances_m: vec![0.01, 0.02], margin_m: 0.05, seed: 1 }
    }
}

/// Samples of the surface of a scene, and from where each was seen.
pub struct Truth<'s> {
    scene: &'s AnnotatedScene,
    mesh: &'s TriMesh,
    nearest: NearestFaces<'s>,
    samples: PointCloud,
    /// The place from which a sample was seen. There is none for samples that were not seen.
    seen_from: Vec<Option<Vec3>>,
    options: TruthOptions,
}

impl fmt::Debug for Truth<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Truth")
            .field("samples", &self.samples.len())
            .field("options", &self.options)
            .finish()
    }
}

/// The end of a line of sight from its sample, metres, so that the sample's own surface does not block it.
const SLACK_M: f32 = 0.002;

/// The number of samples that one task looks at.
const CHUNK: usize = 1024;

/// Normals are compared where the surfaces are this near, metres.
const NEAR_M: f32 = 0.05;

impl<'s> Truth<'s> {
    /// Draws samples and finds out which of them the devices saw. Panes of windows count as not seen.
    ///
    /// # Errors
    /// [`RangeError`] for an option out of its range.
    pub fn new(target: &ScanTarget<'s>, views: &[View], options: &TruthOptions) -> Result<Self, RangeError> {
        RangeError::check(options.samples_per_m2, [0.1, 1e6], || "samples a square metre".to_owned())?;
        RangeError::check(options.margin_m, [0.001, 1.0], || "the end of lines of sight".to_owned())?;
        for distance_m in &options.distances_m {
            RangeError::check(*distance_m, [1e-6, 1e3], || "a distance of scores".to_owned())?;
        }

        let mesh = &target.scene().mesh;
        let samples = sampled(mesh, options);
        let mut seen_from = vec![None; samples.len()];
        seen_from
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, seen_from)| {
                let mut hiders = vec![NO_INDEX; views.len()];
                for (i, seen_from) in (chunk * CHUNK..).zip(seen_from) {
                    let (place, face) = (samples.positions[i], samples.faces[i]);
                    if target.is_glass(face) {
                        continue;
                    }
                    let normal = mesh.normal(face);
                    let mut views = views.iter().zip(&mut hiders);
                    let sees = |view: &View, hider: &mut u32| {
                        view.may_see(place, normal)
                            && is_free(target.tree(), view.origin, place, SLACK_M, hider)
                    };
                    *seen_from = views.find_map(|(view, hider)| sees(view, hider).then_some(view.origin));
                }
            });

        let nearest = NearestFaces::new(mesh);
        Ok(Self { scene: target.scene(), mesh, nearest, samples, seen_from, options: options.clone() })
    }

    /// Returns the samples of the truth: positions in world metres, colours, and faces of the scene.
    pub fn samples(&self) -> &PointCloud {
        &self.samples
    }

    /// Tells for each sample whether a device saw it.
    pub fn seen(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        self.seen_from.iter().map(Option::is_some)
    }

    /// Returns the distance of each sample of the truth to a mesh, metres. With [`Truth::samples`] and
    /// [`Truth::seen`] they tell what became of an instance, such as the legs of a table.
    pub fn distances(&self, mesh: &TriMesh) -> Vec<f32> {
        let mut found = Vec::new();
        NearestFaces::new(mesh).nearest_many(&self.samples.positions, &mut found);
        found.into_iter().map(|n| n.distance_m).collect()
    }

    /// Compares a mesh with the truth. Its faces should have their fronts on the side that was seen.
    pub fn score(&self, mesh: &TriMesh) -> MeshScores {
        let drawn = sampled(mesh, &self.options);
        let mut to_truth = Vec::new();
        self.nearest.nearest_many(&drawn.positions, &mut to_truth);

        let seen = || self.seen().enumerate().filter_map(|(i, seen)| seen.then_some(i));
        let places: Vec<Vec3> = seen().map(|i| self.samples.positions[i]).collect();
        let faces: Vec<u32> = seen().map(|i| self.samples.faces[i]).collect();
        let mut to_mesh = Vec::new();
        NearestFaces::new(mesh).nearest_many(&places, &mut to_mesh);

        let accuracy = sorted_distances(&to_truth);
        let completeness = sorted_distances(&to_mesh);
        let at = |distance_m: &f32| {
            let precision = share_below(&accuracy, *distance_m);
            let recall = share_below(&completeness, *distance_m);
            ScoresAt { distance_m: *distance_m, precision, recall, f_score: f_score(precision, recall) }
        };

        let of_mesh = cosines((mesh, &drawn.faces), self.mesh, &to_truth);
        let of_truth = cosines((self.mesh, &faces), mesh, &to_mesh);
        MeshScores {
            at: self.options.distances_m.iter().map(at).collect(),
            accuracy: DistanceScores::new(&accuracy),
            completeness: DistanceScores::new(&completeness),
            normals: NormalScores::new(&of_mesh, &of_truth),
            closed_sight: self.closed_sight(mesh),
            seen_share: places.len() as f64 / self.samples.len().max(1) as f64,
            samples: [drawn.len(), places.len()],
        }
    }

    /// Returns the share of lines of sight that the mesh blocks before they come near their surface.
    fn closed_sight(&self, mesh: &TriMesh) -> f64 {
        let tree = RayTree::new(mesh);
        let margin_m = self.options.margin_m;
        let samples: Vec<(Vec3, Vec3, f32)> = (self.seen_from.iter().zip(&self.samples.positions))
            .zip(&self.samples.faces)
            .filter_map(|((from, place), face)| {
                let way = (*from)? - *place;
                let away_m = way.dot(self.mesh.normal(*face));
                // What is left out at the end, along the line.
                let end_m = way.length() * margin_m / away_m;
                (away_m > margin_m).then_some(((*from)?, *place, end_m))
            })
            .collect();

        let counts = samples.par_chunks(CHUNK).map(|samples| {
            let mut hider = NO_INDEX;
            let is_closed = |sample: &&(Vec3, Vec3, f32)| {
                let (from, place, end_m) = **sample;
                !is_free(&tree, from, place, end_m, &mut hider)
            };
            samples.iter().filter(is_closed).count()
        });
        counts.sum::<usize>() as f64 / samples.len().max(1) as f64
    }
}

/// Whether nothing is between `from` and a place, up to `end_m` before it.
fn is_free(tree: &RayTree, from: Vec3, place: Vec3, end_m: f32, hider: &mut u32) -> bool {
    let way = place - from;
    tree.is_free(from, way, 1.0 - end_m / way.length(), hider)
}

fn sampled(mesh: &TriMesh, options: &TruthOptions) -> PointCloud {
    let sampler = SurfaceSampler::new(mesh, Density::PerM2(options.samples_per_m2), options.seed);
    let mut cloud = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut cloud);
    cloud
}

fn sorted_distances(found: &[Nearest]) -> Vec<f32> {
    let mut distances: Vec<f32> = found.iter().map(|n| n.distance_m).collect();
    distances.sort_unstable_by(f32::total_cmp);
    distances
}

/// Returns the cosines between the normals of samples and of the nearest faces, where these are near.
fn cosines((mesh, faces): (&TriMesh, &[u32]), other: &TriMesh, found: &[Nearest]) -> Vec<f32> {
    let near = faces.iter().zip(found).filter(|(_, n)| n.distance_m <= NEAR_M);
    near.map(|(face, n)| mesh.normal(*face).dot(other.normal(n.face)))
        .collect()
}

#[cfg(test)]
mod tests;
