//! Rays with an origin each are added to the grid.

use super::images::chance;
use super::walk::{blocks_along, voxels_along};
use super::{Scale, Tile};
use crate::grid::block::Block;
use crate::grid::{Grid, Place, SIDE, key, place_of};
use crate::{FusionError, SensorNoise};
use rayon::prelude::*;
use s3d_geom::glam::{DMat3, DVec3, Vec3};
use std::collections::BTreeMap;

/// Rays that are being added.
pub(super) struct AddingRays<'a> {
    pub(super) origins: &'a [Vec3],
    pub(super) points: &'a [Vec3],
    pub(super) colors: &'a [[u8; 3]],
    pub(super) noise: SensorNoise,
    pub(super) scale: Scale,
    pub(super) tile: Option<Tile>,
    pub(super) number: u32,
}

/// A ray with the plane of its hit.
#[derive(Clone, Copy, Debug)]
struct Shot {
    hit: DVec3,
    /// The unit direction, and the distance of the hit.
    along: DVec3,
    range: f64,
    normal: DVec3,
    sigma_m: f32,
    weight: f32,
    color: Option<[u8; 3]>,
}

/// Rays whose blocks are listed at a time.
const BATCH: usize = 1 << 16;
/// The side of the cubes whose points have one normal, in cells.
const NORMAL_CELLS: f64 = 1.5;

impl AddingRays<'_> {
    pub(super) fn add_to(&self, grid: &mut Grid) -> Result<(), FusionError> {
        let rays = self.rays()?;
        let normals = Normals::of(&rays, NORMAL_CELLS * self.scale.cell);
        let shots: Vec<Shot> = rays.par_iter().map(|ray| self.shot(ray, &normals)).collect();

        for batch in shots.chunks(BATCH) {
            let found: Vec<Vec<u64>> = batch.par_chunks(1 << 12).map(|shots| self.touched(shots)).collect();
            let mut found = found.concat();
            found.par_sort_unstable();
            found.dedup();
            found.into_iter().for_each(|block| {
                grid.block_at(place_of(block));
            });
        }
        shots.chunks(BATCH).for_each(|batch| self.update(grid, batch));
        Ok(())
    }

    /// Returns the rays that hit something: origin, hit, and their number.
    fn rays(&self) -> Result<Vec<[DVec3; 2]>, FusionError> {
        self.origins
            .iter()
            .zip(self.points)
            .map(|(origin, point)| {
                let ray = [origin.as_dvec3(), point.as_dvec3()];
                let far = ray.iter().find(|p| p.is_finite() && self.scale.block_of(**p).is_none());
                match far {
                    Some(point) => Err(FusionError::TooFar { point: *point, cell_m: self.scale.cell }),
                    None => Ok(ray),
                }
            })
            .collect()
    }

    fn shot(&self, ray: &[DVec3; 2], normals: &Normals) -> Shot {
        let [origin, hit] = *ray;
        let range = origin.distance(hit);
        let along = (hit - origin) / range;
        let normal = normals.at(ray).map_or(-along, |n| if n.dot(along) > 0.0 { -n } else { n });
        let sigma_m = self.noise.sigma_m(range as f32);
        let cosine = -normal.dot(along) as f32;
        let relative = 0.001 / sigma_m;
        Shot { hit, along, range, normal, sigma_m, weight: relative * relative * cosine, color: None }
    }
}
