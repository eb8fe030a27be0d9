//! The free height above level surfaces: how high rooms are, and how many storeys a building has.

use glam::DVec3;
use rayon::prelude::*;
use s3d_geom::{Density, PointCloud, SurfaceSampler};
use s3d_render::{Scene, cast_ray};
use std::fmt;

/// The cosine of 18°. A surface tilted less is level.
const LEVEL: f32 = 0.95;

/// The number of points from which rays look up.
const POINTS: u64 = 20_000;

/// The height that a standing person needs, metres.
const STANDING_M: f64 = 1.8;

/// Floors that are nearer than this in height belong to one storey, metres.
const STOREY_M: f64 = 1.5;

/// A floor is no storey if it is smaller than this, m², or has a smaller share of the largest floor.
const SMALL_M2: f64 = 3.0;
const SMALL_SHARE: f64 = 0.1;

/// Uniform samples of a mesh's level surfaces that face up, with the free height above each.
pub(crate) struct Headroom {
    /// For each sample its height, the free height above it (infinite under the sky), and whether that ends
    /// at an underside.
    samples: Vec<(f64, f64, bool)>,
    /// The area that each sample stands for, in the mesh's unit squared.
    m2: f64,
}

impl Headroom {
    /// Samples a mesh in any unit. `up` points up.
    pub(crate) fn of(scene: &Scene<'_>, up: DVec3) -> Self {
        let mesh = scene.mesh();
        let mut faces: Vec<u32> = (0..mesh.faces().len() as u32).collect();
        faces.retain(|face| mesh.normal(*face).dot(up.as_vec3()) > LEVEL);
        let area: f64 = faces.iter().map(|face| mesh.area(*face)).sum();
        if faces.is_empty() {
            return Self { samples: Vec::new(), m2: 0.0 };
        }

        let mut cloud = PointCloud::default();
        SurfaceSampler::over_faces(mesh, faces, Density::Total(POINTS), 0).sample(0..POINTS, &mut cloud);

        let above = 1e-5 * f64::from(mesh.aabb().size().max_element());
        let samples: Vec<_> = cloud
            .positions
            .par_iter()
            .map(|point| {
                let from = point.as_dvec3() + up * above;
                let hit = cast_ray(scene, from, up);
                let ends_below = hit.is_some_and(|hit| mesh.normal(hit.face).dot(up.as_vec3()) < -LEVEL);
                (from.dot(up), hit.map_or(f64::INFINITY, |hit| hit.t), ends_below)
            })
            .collect();
        Self { m2: area / samples.len().max(1) as f64, samples }
    }

    /// Returns the height of ceilings above floors, in the unit of the mesh. Returns `None` without a
    /// ceiling. Most of what lies beneath ceilings is floor, and everything else is higher, so three quarters
    /// of the samples have less free height.
    pub(crate) fn of_rooms(&self) -> Option<f64> {
        let mut free: Vec<f64> = self.samples.iter().filter(|s| s.2).map(|s| s.1).collect();
        free.sort_by(f64::total_cmp);
        free.get(free.len() * 3 / 4).copied()
    }

    /// Returns the storeys of a mesh in metres, from the lowest.
    pub(crate) fn storeys(&self) -> Vec<Storey> {
        let standing = || self.samples.iter().filter(|s| s.1 >= STANDING_M);

        // Where ceilings were captured, a surface under the sky is a roof.
        let covered = 4 * standing().filter(|s| s.2).count() >= standing().count();
        let mut heights: Vec<(f64, f64)> =
            standing().filter(|s| s.2 || !covered).map(|s| (s.0, s.1)).collect();
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));

        let mut storeys: Vec<Storey> = Vec::new();
        while let Some(storey) = self.largest_floor(&heights) {
            let largest = storeys.first().map_or(storey.floor_m2, |first| first.floor_m2);
            if storey.floor_m2 < SMALL_M2.max(SMALL_SHARE * largest) {
                break;
            }
            heights.retain(|(z, _)| (z - storey.z_m).abs() >= STOREY_M);
            storeys.push(storey);
        }

        storeys.sort_by(|a, b| a.z_m.total_cmp(&b.z_m));
        storeys
    }

    /// Returns the largest surface within 20 cm of height. `heights` are sorted by height.
    fn largest_floor(&self, heights: &[(f64, f64)]) -> Option<Storey> {
        let end = |start: usize| {
            let top = heights.get(start).map_or(0.0, |(z, _)| z + 0.2);
            heights.partition_point(|(z, _)| *z <= top)
        };
        let start = (0..heights.len()).max_by_key(|start| (end(*start) - start, usize::MAX - start))?;
        let floor = heights.get(start..end(start))?;
        let mut free: Vec<f64> = floor.iter().map(|(_, free)| *free).collect();
        free.sort_by(f64::total_cmp);
        let middle = free.get(free.len() / 2).copied();
        Some(Storey {
            z_m: floor.get(floor.len() / 2)?.0,
            floor_m2: floor.len() as f64 * self.m2,
            height_m: middle.filter(|height| height.is_finite()),
        })
    }
}

/// A storey of a building: floors at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Storey {
    /// The height of its floor, world metres.
    pub z_m: f64,
    /// The area of its floor where a person can stand, about, in m².
    pub floor_m2: f64,
    /// The height from its floor to its ceiling, metres. `None` under the sky.
    pub height_m: Option<f64>,
}

impl fmt::Display for Storey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A floor at −1 mm is shown at 0.
        let z_m = (100.0 * self.z_m).round() / 100.0 + 0.0;
        write!(f, "{:.0} m² at z = {z_m:.2} m", self.floor_m2)?;
        self.height_m.map_or(Ok(()), |height| write!(f, ", {height:.2} m high"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_synth::Building;

    fn storeys(building: Building) -> Vec<Storey> {
        let mesh = building.build().unwrap().mesh;
        Headroom::of(&Scene::new(&mesh), DVec3::Z).storeys()
    }

    #[test]
    fn storeys_are_floors_and_neither_tables_nor_shelves() {
        let demo = storeys(Building::demo());
        assert!(demo.len() == 1 && demo[0].z_m.abs() < 0.05, "{demo:?}");
        assert!((80.0..140.0).contains(&demo[0].floor_m2), "{demo:?}");
        let house = storeys(Building::two_storeys());
        assert_eq!(house.len(), 2, "{house:?}");
        assert!(house[0].z_m.abs() < 0.05 && (2.4..3.5).contains(&house[1].z_m), "{house:?}");
        assert!(
            house
                .iter()
                .all(|storey| (2.2..3.5).contains(&storey.height_m.unwrap())),
            "{house:?}"
        );
        assert!(house[0].to_string().contains(" m² at z = 0.00 m, 2."), "{}", house[0]);
    }
}
