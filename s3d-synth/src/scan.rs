//! The points that a scanner would have measured on a scene, instance by instance.

use crate::sight::Sight;
use crate::{AnnotatedScene, RangeError, SightOptions};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use s3d_geom::{Density, PointCloud, SurfaceSampler};
use std::fmt;
use std::sync::Arc;

/// How a scene is scanned. The `Default` is the scan of the demo: 3,000 points a square metre, about as many
/// as S3DIS has.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// Points a square metre of every instance: at most 1e6.
    pub points_per_m2: f64,
    /// The greatest distance of points from the surface, metres: up to 0.1.
    pub noise_m: f32,
    /// The seed of all randomness.
    pub seed: u64,
    /// The number of the area in files.
    pub area: u32,
    /// Measures only what the scan locations see, and as densely as they see it. The noise then lies along
    /// the rays and grows with their length. `None` measures everything alike.
    pub sight: Option<SightOptions>,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self { points_per_m2: 3000.0, noise_m: 0.003, seed: 20170203, area: 1, sight: None }
    }
}

/// The points of a scene's instances. Yields the index of an instance and its points: rooms in the order of
/// their names, and the instances of a room in their own order. See [`AnnotatedScene::scan`].
#[derive(Clone)]
pub struct Scan<'a> {
    scene: &'a AnnotatedScene,
    options: ScanOptions,
    faces_of: Vec<Vec<u32>>,
    /// The instances that are still to come. The last one is next.
    rest: Vec<usize>,
    noise: ChaCha8Rng,
    sight: Option<Arc<Sight>>,
}

impl fmt::Debug for Scan<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scan")
            .field("options", &self.options)
            .field("rest", &self.rest)
            .finish()
    }
}

impl AnnotatedScene {
    /// Scans every instance. Points are drawn uniformly, with their colours and faces, and moved off the
    /// surface by a uniform noise. World metres. An instance gets at least one point. With
    /// [`ScanOptions::sight`], an instance that no location sees gets none.
    ///
    /// ```
    /// use s3d_synth::{Building, ScanOptions};
    ///
    /// let scene = Building { texture_scale: 0.1, ..Building::demo() }.build()?;
    /// let options = ScanOptions { points_per_m2: 10.0, ..ScanOptions::default() };
    /// for (instance, points) in scene.scan(&options)? {
    ///     assert!(points.faces.iter().all(|&f| scene.instance_of_face[f as usize] as usize == instance));
    /// }
    /// assert_eq!(scene.scan(&options)?.count(), scene.instances.len());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`RangeError`] for a number that is out of its range.
    pub fn scan(&self, options: &ScanOptions) -> Result<Scan<'_>, RangeError> {
        RangeError::check(options.points_per_m2, [0.0, 1e6], || "points a square metre".to_owned())?;
        RangeError::check(options.noise_m, [0.0, 0.1], || "the noise of points".to_owned())?;
        options.sight.as_ref().map_or(Ok(()), SightOptions::check)?;

        let sight = options.sight.as_ref().map(|sight| Arc::new(Sight::new(self, sight)));

        let mut faces_of = vec![Vec::new(); self.instances.len()];
        for (face, &instance) in (0..).zip(&self.instance_of_face) {
            if let Some(faces) = faces_of.get_mut(instance as usize) {
                faces.push(face);
            }
        }

        let names: Vec<String> = self.instances.iter().map(|i| i.room.to_string()).collect();
        let mut rest: Vec<usize> = (0..self.instances.len()).collect();
        rest.sort_by(|&a, &b| names[a].cmp(&names[b]).then(a.cmp(&b)).reverse());

        let noise = ChaCha8Rng::seed_from_u64(options.seed);
        Ok(Scan { scene: self, options: options.clone(), faces_of, rest, noise, sight })
    }
}

impl Iterator for Scan<'_> {
    type Item = (usize, PointCloud);

    fn next(&mut self) -> Option<Self::Item> {
        let instance = self.rest.pop()?;
        let mesh = &self.scene.mesh;
        let faces = std::mem::take(&mut self.faces_of[instance]);
        let seed = self.options.seed.wrapping_add(instance as u64);

        let sampler = |density| SurfaceSampler::over_faces(mesh, faces.clone(), density, seed);
        let mut points = sampler(Density::PerM2(self.options.points_per_m2));
        if points.is_empty() {
            points = sampler(Density::Total(1));
        }

        let mut cloud = PointCloud::default();
        points.sample(0..points.len(), &mut cloud);
        let noise_m = self.options.noise_m;
        if let Some(sight) = self.sight.clone() {
            cloud = self.measured(&sight, &cloud, &faces, seed);
        } else if noise_m > 0.0 {
            for (position, face) in cloud.positions.iter_mut().zip(&cloud.faces) {
                *position += mesh.normal(*face) * self.noise.random_range(-noise_m..noise_m);
            }
        }
        Some((instance, cloud))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.rest.len(), Some(self.rest.len()))
    }
}

/// The number of points that one task measures.
const CHUNK: usize = 2048;

impl Scan<'_> {
    /// Returns the points that come back, moved along their rays by the noise. An instance keeps at least one
    /// point if any of it is seen.
    fn measured(&self, sight: &Sight, drawn: &PointCloud, faces: &[u32], seed: u64) -> PointCloud {
        let mesh = &self.scene.mesh;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(1);
        let chances: Vec<[f32; 2]> = drawn.faces.iter().map(|_| [rng.random(), rng.random()]).collect();

        let mut at = vec![None; drawn.len()];
        at.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, at)| {
            let mut memory = sight.memory();
            for (i, at) in (chunk * CHUNK..).zip(at) {
                let (p, face, [chance, noise]) = (drawn.positions[i], drawn.faces[i], chances[i]);
                *at = sight
                    .measures((p, face), mesh.normal(face), chance, &mut memory)
                    .map(|location| {
                        let ray = p - location;
                        // Half of the noise close by, all of it at 5 m.
                        let noise_m = self.options.noise_m * (0.5 + 0.1 * ray.length());
                        p + ray.normalize() * (2.0 * noise - 1.0) * noise_m
                    });
            }
        });

        let mut cloud = PointCloud::default();
        for (i, p) in (0..).zip(at) {
            if let Some(p) = p {
                cloud.positions.push(p);
                cloud.colors.push(drawn.colors[i]);
                cloud.faces.push(drawn.faces[i]);
            }
        }

        let mut memory = sight.memory();
        let mut seen = faces
            .iter()
            .filter_map(|&f| Some((sight.seen_place(mesh, f, &mut memory)?, f)));
        if cloud.is_empty()
            && let Some((p, face)) = seen.next()
        {
            cloud.positions.push(p);
            cloud.colors.push(drawn.colors.first().copied().unwrap_or_default());
            cloud.faces.push(face);
        }
        cloud
    }
}

impl ExactSizeIterator for Scan<'_> {}
