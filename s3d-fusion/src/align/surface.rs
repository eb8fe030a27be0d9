//! A surface as points with normals, evenly spread.

use super::AlignError;
use super::normals::Neighbours;
use crate::register::{ScanPoints, cell};
use rayon::prelude::*;
use s3d_geom::glam::{DQuat, DVec3, Vec3};
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};

/// The edge of the cubes of which each has a point, metres, unless there would be too many.
const CELL_M: f64 = 0.06;
/// About so many points are kept at most.
const MOST_POINTS: f64 = 400_000.0;
/// Surfaces that are small, since their unit is unknown, have about so many.
const FEW_POINTS: f64 = 5_000.0;
/// The fewest points that are a surface: a quarter of a square metre.
const LEAST_POINTS: usize = 100;
/// Normals are found in this many cubes around a point.
const RADIUS_CELLS: f64 = 1.7;
/// So many points are drawn on a mesh for each cube.
const DRAWN: f64 = 3.0;

/// The surface of a mesh or a cloud: evenly spread points with normals.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePoints {
    /// Positions relative to `middle`, and unit normals.
    pub(super) points: ScanPoints,
    /// The place that positions are relative to.
    pub(super) middle: DVec3,
    /// The distance between neighbours, metres.
    pub(super) cell_m: f64,
    /// Whether normals look to the side that was seen. Otherwise they may look to either.
    pub(super) has_sides: bool,
}

impl SurfacePoints {
    /// Draws points on a mesh in metres, Z-up, whose faces look to where they were seen from.
    ///
    /// # Errors
    /// [`AlignError::Thin`] if the surface is too small.
    pub fn of_mesh(mesh: &TriMesh) -> Result<Self, AlignError> {
        let area_m2 = mesh.total_area();
        let cell_m = CELL_M
            .min((area_m2 / FEW_POINTS).sqrt())
            .max((area_m2 / MOST_POINTS).sqrt());
        let sampler = SurfaceSampler::new(mesh, Density::PerM2(DRAWN / (cell_m * cell_m)), 0);
        let mut cloud = PointCloud::default();
        sampler.sample(0..sampler.len(), &mut cloud);
        let sides: Vec<Vec3> = cloud.faces.iter().map(|face| mesh.normal(*face)).collect();
        Self::of_points(&cloud.positions, &sides)
    }

    /// Thins a cloud in metres, Z-up, and finds its normals. `sides` is empty, or has a direction for each
    /// point from which it was seen, of any length. Points that are not finite are left out.
    ///
    /// # Errors
    /// [`AlignError::Thin`] if there are too few points or none has others around it.
    pub fn of_points(positions: &[Vec3], sides: &[Vec3]) -> Result<Self, AlignError> {
        let has_sides = sides.len() == positions.len() && !positions.is_empty();
        let finite = |i: &usize| positions[*i].is_finite() && (!has_sides || sides[*i].is_finite());
        let kept: Vec<usize> = (0..positions.len()).filter(finite).collect();
        let sum: DVec3 = kept.iter().map(|i| positions[*i].as_dvec3()).sum();
        let middle = (sum / kept.len().max(1) as f64).round();
        let near: Vec<Vec3> = kept
            .iter()
            .map(|i| (positions[*i].as_dvec3() - middle).as_vec3())
            .collect();
        let sides: Vec<Vec3> = if has_sides {
            kept.iter().map(|i| sides[*i].normalize_or(Vec3::Z)).collect()
        } else {
            Vec::new()
        };

        let cell_m = wide_enough(&near);
        // Dense clouds are thinned first, so that time follows from the surface.
        let (dense, dense_sides) = thinned(&near, &sides, 0.5 * cell_m);
        let (places, place_sides) = thinned(&dense, &dense_sides, cell_m);
        let neighbours = Neighbours::new(&dense, &dense_sides, RADIUS_CELLS * cell_m);
        let found: Vec<Option<(DVec3, DVec3)>> = places
            .par_iter()
            .enumerate()
            .map(|(i, p)| {
                let side = place_sides.get(i).map(|side| side.as_dvec3());
                neighbours.surface(p.as_dvec3(), side)
            })
            .collect();

        let mut points = ScanPoints::default();
        for (place, normal) in found.into_iter().flatten() {
            points.positions.push(place.as_vec3());
            points.normals.push(normal.as_vec3().normalize());
        }
        if points.positions.len() < LEAST_POINTS {
            return Err(AlignError::Thin { points: kept.len(), surface: points.positions.len() });
        }
        Ok(Self { points, middle, cell_m, has_sides })
    }

    /// The area that was found, square metres.
    pub fn area_m2(&self) -> f64 {
        self.points.positions.len() as f64 * self.cell_m * self.cell_m
    }

    /// How far it reaches from its middle on the average, metres.
    pub(super) fn size_m(&self) -> f64 {
        let squares: f64 = self
            .points
            .positions
            .iter()
            .map(|p| p.as_dvec3().length_squared())
            .sum();
        (squares / self.points.positions.len().max(1) as f64).sqrt()
    }

    /// The same surface turned and grown about its middle.
    pub(super) fn turned(&self, turn: DQuat, scale: f64) -> Self {
        let positions = self.points.positions.iter();
        let normals = self.points.normals.iter();
        let points = ScanPoints {
            positions: positions.map(|p| (turn * (scale * p.as_dvec3())).as_vec3()).collect(),
            normals: normals.map(|n| (turn * n.as_dvec3()).as_vec3().normalize()).collect(),
        };
        Self { points, cell_m: scale * self.cell_m, ..*self }
    }

    /// The same surface with a point per cube of the edge `cell_m`.
    pub(super) fn coarse(&self, cell_m: f64) -> ScanPoints {
        ScanPoints::sampled(&self.points.positions, &self.points.normals, cell_m)
    }
}

/// The edge of cubes that leaves neither too many nor too few points of a cloud.
fn wide_enough(positions: &[Vec3]) -> f64 {
    let filled = |cell_m: f64| {
        let mut cubes: Vec<[i32; 3]> = positions.par_iter().map(|p| cell(*p, cell_m)).collect();
        cubes.par_sort_unstable();
        cubes.dedup();
        cubes.len() as f64
    };
    let mut cell_m = CELL_M;
    let mut count = filled(cell_m);
    while count > MOST_POINTS {
        cell_m *= (count / MOST_POINTS).sqrt().max(1.1);
        count = filled(cell_m);
    }
    // A cube of a thin cloud needs some points all the same.
    let few = FEW_POINTS.min(positions.len() as f64 / DRAWN);
    if count < few {
        cell_m * (count.max(1.0) / few).sqrt()
    } else {
        cell_m
    }
}

/// Thins points to the mean of each cube; those of a cube that look to different sides stay apart.
fn thinned(positions: &[Vec3], sides: &[Vec3], cell_m: f64) -> (Vec<Vec3>, Vec<Vec3>) {
    let all = positions.par_iter().enumerate();
    let mut keys: Vec<([i32; 3], u32)> = all.map(|(i, p)| (cell(*p, cell_m), i as u32)).collect();
    keys.par_sort_unstable();
    let (mut places, mut place_sides) = (Vec::new(), Vec::new());
    for group in keys.chunk_by(|a, b| a.0 == b.0) {
        let mut left: Vec<usize> = group.iter().map(|(_, i)| *i as usize).collect();
        while let Some(&first) = left.first() {
            let looks = |i: &usize| sides.is_empty() || sides[*i].dot(sides[first]) > 0.3;
            let (same, others): (Vec<usize>, Vec<usize>) = left.iter().partition(|i| looks(i));
            let sum: DVec3 = same.iter().map(|i| positions[*i].as_dvec3()).sum();
            places.push((sum / same.len() as f64).as_vec3());
            if !sides.is_empty() {
                let sum: Vec3 = same.iter().map(|i| sides[*i]).sum();
                place_sides.push(sum.normalize_or(sides[first]));
            }
            left = others;
        }
    }
    (places, place_sides)
}
