//! Where an area is looked at from.

use crate::error::Result;
use crate::options::placing::{Placing, SHARE};
use glam::{DAffine3, DVec3};
use s3d_io::camera::ScanLocation;
use s3d_io::scene::{CameraSource, SceneFile};
use s3d_label::Room;
use std::path::PathBuf;

/// Where an area is looked at from.
pub(crate) enum Cameras {
    /// Listed scan locations, in the order of their list, each with its room if the list tells it.
    Listed(Vec<ScanLocation>, Vec<Option<Room>>),
    /// Places that are chosen once the rooms are known.
    Placed(Placing),
}

impl Cameras {
    /// Returns these locations, or, if there are none, places by free space.
    pub(super) fn listed_or_placed(locations: Vec<ScanLocation>, rooms: Vec<Option<Room>>) -> Self {
        if locations.is_empty() {
            return Self::Placed(Placing::Seeing(SHARE));
        }
        Self::Listed(locations, rooms)
    }

    /// Returns the scan locations of a scene file, or how to place them, with the file that says so. Listed
    /// locations are moved by the mesh's offset. `asked` goes before the scene file. Returns `None` if
    /// neither says anything.
    pub(super) fn of_scene(
        scene: &SceneFile,
        asked: Option<Placing>,
        offset_m: DVec3,
    ) -> Result<Option<(Self, PathBuf)>> {
        let placed = |placing| Some((Self::Placed(placing), scene.path.clone()));
        Ok(match (asked, &scene.cameras) {
            (Some(placing), _) => placed(placing),
            (None, Some(CameraSource::Placed { distance_m })) => placed(Placing::Apart(*distance_m)),
            (None, Some(CameraSource::Listed { path, world_from_file })) => {
                let moved = DAffine3::from_translation(-offset_m) * *world_from_file;
                let world_from_file = if offset_m == DVec3::ZERO {
                    world_from_file
                } else {
                    &moved
                };
                let locations = s3d_io::camera::read_scan_locations(path, world_from_file)?;
                let rooms = vec![None; locations.len()];
                Some((Self::Listed(locations, rooms), path.clone()))
            }
            (None, None) => None,
        })
    }

    /// The locations that are known before the area is labelled.
    pub(crate) fn listed(&self) -> &[ScanLocation] {
        match self {
            Self::Listed(locations, _) => locations,
            Self::Placed(_) => &[],
        }
    }

    /// The distance between placed locations, metres, if they are placed by it.
    pub(crate) fn distance_m(&self) -> Option<f64> {
        if let Self::Placed(Placing::Apart(distance_m)) = self {
            Some(*distance_m)
        } else {
            None
        }
    }

    /// The share of the surface that placed locations are to see, if they are placed by it.
    pub(crate) fn share(&self) -> Option<f64> {
        if let Self::Placed(Placing::Seeing(share)) = self {
            Some(*share)
        } else {
            None
        }
    }

    /// The number of listed locations, or about how many are placed on `floor_m2` of floor. Locations that
    /// keep a distance take about 0.7 times its square each. Locations that see a share take about 15 m²
    /// each.
    pub(crate) fn count_on(&self, floor_m2: f64) -> f64 {
        match self {
            Self::Listed(locations, _) => locations.len() as f64,
            Self::Placed(Placing::Apart(distance_m)) => floor_m2 / (0.7 * distance_m.powi(2)),
            Self::Placed(Placing::Seeing(_)) => (floor_m2 / 15.0).max(1.0),
        }
    }
}
