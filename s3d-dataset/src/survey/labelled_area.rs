//! An area with labelled faces and known scan locations.

use crate::survey::annotated::Annotated;
use crate::survey::room_names::RoomNames;
use crate::survey::surface_seen::SurfaceSeen;
use s3d_geom::Aabb;
use s3d_io::camera::ScanLocation;
use s3d_label::Room;
use serde::{Deserialize, Serialize};

/// Everything an export needs from an area's annotations once it is labelled.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct LabelledArea {
    /// Its number, from 1.
    pub(crate) area: u32,
    pub(crate) annotated: Annotated,
    /// The rooms in the order of their names, each with the names of its instances.
    pub(crate) names: Vec<RoomNames>,
    /// The scan locations, listed or placed.
    #[serde(with = "locations_as_data")]
    pub(crate) locations: Vec<ScanLocation>,
    /// The room of each location. Empty in an area without labels.
    pub(crate) location_rooms: Vec<Option<Room>>,
    /// The surface that placed locations see. `None` for listed ones.
    pub(crate) surface_seen: Option<SurfaceSeen>,
    /// The bounding box of the mesh.
    pub(crate) mesh_box: Aabb,
    /// The area of the mesh's faces, in m².
    pub(crate) mesh_area_m2: f64,
    /// The number of faces in the mesh's file that the mesh lacks.
    pub(crate) faces_left_out: usize,
    /// What the user should look at, a sentence each.
    pub(crate) warnings: Vec<String>,
}

/// Scan locations as data: a tuple for each.
mod locations_as_data {
    use s3d_geom::Pose;
    use s3d_io::camera::ScanLocation;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(
        locations: &[ScanLocation],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(locations.iter().map(|l| (&l.uuid, l.pose, l.line)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<ScanLocation>, D::Error> {
        let locations = Vec::<(String, Pose, u64)>::deserialize(deserializer)?;
        Ok(locations
            .into_iter()
            .map(|(uuid, pose, line)| ScanLocation { uuid, pose, line })
            .collect())
    }
}
