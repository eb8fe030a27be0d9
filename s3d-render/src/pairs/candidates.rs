//! Places from which images were taken, and the surface that they see.

use crate::hits::NO_FACE;
use crate::raster::visibility::Caster;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use s3d_geom::{Camera, Pose};
use std::collections::{BTreeSet, HashMap};

/// The side of a cell in metres. Places that see no cell next to a point are not asked whether they see it.
const CELL_M: f64 = 0.5;

/// The width of the panorama by which a place tells what it sees. Its rays are 0.3 m apart at 9 m, less than
/// the cells around a point are wide.
const PANORAMA: u32 = 192;

/// A place with its images.
pub(super) struct Place {
    pub(super) location: DVec3,
    /// The images that were taken there, sorted.
    pub(super) images: Vec<u32>,
}

/// The places of images, by the surface that they see.
pub(super) struct Places {
    places: Vec<Place>,
    /// The places that see a point of a cell, sorted.
    of_cell: HashMap<[i64; 3], Vec<u32>>,
}

impl Places {
    /// Gathers the places of cameras. What a place sees is seen in all directions, whatever its images show.
    pub(super) fn new(scene: &Scene<'_>, cameras: &[Camera]) -> Self {
        let mut places: Vec<Place> = Vec::new();
        let mut at: HashMap<[u64; 3], usize> = HashMap::new();
        for (image, camera) in cameras.iter().enumerate() {
            let location = camera.pose.location;
            let place = *at.entry(location.to_array().map(f64::to_bits)).or_insert(places.len());
            if place == places.len() {
                places.push(Place { location, images: Vec::new() });
            }
            places[place].images.push(image as u32);
        }

        let seen: Vec<BTreeSet<[i64; 3]>> = places
            .par_iter()
            .map_init(|| Caster::new(scene), |caster, place| cells_in_sight(caster, place.location))
            .collect();
        let mut of_cell: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (place, cells) in seen.into_iter().enumerate() {
            for cell in cells {
                of_cell.entry(cell).or_default().push(place as u32);
            }
        }
        Self { places, of_cell }
    }

    /// Returns the places that see surface in the cells of some points, or in cells next to them.
    pub(super) fn near(&self, points: impl Iterator<Item = DVec3>) -> impl Iterator<Item = &Place> {
        let cells: BTreeSet<[i64; 3]> = points.map(cell).collect();
        let around: BTreeSet<[i64; 3]> = cells
            .into_iter()
            .flat_map(|[x, y, z]| (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]))
            .collect();
        let places = around
            .iter()
            .filter_map(|cell| self.of_cell.get(cell))
            .flatten()
            .copied();
        let places: BTreeSet<u32> = places.collect();
        places.into_iter().map(|place| &self.places[place as usize])
    }
}

/// Returns the cells of the surface that is seen from a place.
fn cells_in_sight(caster: &mut Caster<'_, '_>, location: DVec3) -> BTreeSet<[i64; 3]> {
    let camera = Camera::equirectangular(Pose::level(location, 0.0), PANORAMA);
    let hits = caster.cast(&camera);
    let rays = camera.rays();
    let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    let seen = pixels.filter(|(x, y)| hits.face.at(*x, *y) != NO_FACE);
    seen.map(|(x, y)| cell(location + rays.at(x, y) * f64::from(hits.depth.at(x, y))))
        .collect()
}

/// Returns the cell of a point.
fn cell(point: DVec3) -> [i64; 3] {
    (point / CELL_M).floor().to_array().map(|step| step as i64)
}
