//! The direction of the walls of rooms.

use crate::{Class, LabelId, LabelTable, Room};
use s3d_geom::glam::Vec3;
use s3d_geom::{TriMesh, dominant_wall_direction_deg};
use std::collections::BTreeMap;

/// Returns the dominant horizontal direction of the walls of each room, in whole degrees in [0, 90) from +X
/// towards +Y (see [`dominant_wall_direction_deg`]). `mesh` is the mesh of one area.
///
/// Walls are the faces whose class counts as wall ([`Class::s3dis`]). If a room has no direction from walls,
/// all its other faces are taken. If none of these is upright, the direction is 0. A room without a labelled
/// face is not in the result.
///
/// # Panics
/// If `label_of_face` does not have one label per face.
///
/// ```
/// use s3d_geom::{TriMesh, glam::{Vec3, vec3}};
/// use s3d_label::{LabelId, LabelTable, wall_directions_deg};
///
/// let wall = "wall_1_office_1_1".parse()?;
/// let table = LabelTable::from_labels([wall])?;
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, vec3(2.0, 2.0, 0.0), Vec3::Z], vec![[0, 1, 2]])?;
/// assert_eq!(wall_directions_deg(&mesh, &table, &[LabelId(1)])[&wall.room], 45);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn wall_directions_deg(
    mesh: &TriMesh,
    table: &LabelTable,
    label_of_face: &[LabelId],
) -> BTreeMap<Room, u32> {
    assert_eq!(label_of_face.len(), mesh.faces().len(), "not one label per face");

    let mut rooms: BTreeMap<Room, Faces> = BTreeMap::new();
    for (face, label) in (0u32..).zip(label_of_face) {
        if let Some(label) = table.get(*label) {
            let room = rooms.entry(label.room).or_default();
            let faces = if label.class.s3dis() == Class::WALL {
                &mut room.walls
            } else {
                &mut room.others
            };
            faces.push((mesh.normal(face), mesh.area(face)));
        }
    }
    rooms
        .into_iter()
        .map(|(room, faces)| (room, faces.direction_deg()))
        .collect()
}

/// The normals and areas of the faces of a room.
#[derive(Default)]
struct Faces {
    walls: Vec<(Vec3, f64)>,
    others: Vec<(Vec3, f64)>,
}

impl Faces {
    fn direction_deg(self) -> u32 {
        dominant_wall_direction_deg(self.walls.into_iter())
            .or_else(|| dominant_wall_direction_deg(self.others.into_iter()))
            .map_or(0, |deg| deg.round() as u32 % 90)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::Quat;

    #[test]
    fn walls_count_before_other_faces_and_these_before_none() {
        let names = ["floor_1_lobby_1_1", "table_1_office_1_1", "table_2_office_2_1", "wall_1_office_1_1"];
        let table = LabelTable::from_labels(names.map(|name| name.parse().unwrap())).unwrap();
        // Upright squares that run along 30° (two), 70° and 70°, and a flat one.
        let upright = |deg: f32| Quat::from_rotation_z(deg.to_radians()) * Quat::from_rotation_x(1.570_796_4);
        let turns = [upright(30.0), upright(70.0), upright(70.0), Quat::IDENTITY];
        let square = [Vec3::ZERO, Vec3::X, Vec3::ONE.with_z(0.0), Vec3::Y];
        let positions = turns
            .iter()
            .flat_map(|turn| square.map(|corner| *turn * corner))
            .collect();
        let faces = (0..4u32).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|face| face.map(|v| 4 * i + v)));
        let mesh = TriMesh::from_faces(positions, faces.collect()).unwrap();
        let of = |names: [&str; 4]| {
            let ids = names.map(|name| table.id_of(&name.parse().unwrap()).unwrap());
            let label_of_face: Vec<LabelId> = ids.iter().flat_map(|id| [*id; 2]).collect();
            wall_directions_deg(&mesh, &table, &label_of_face)
        };
        let [lobby, office_1, office_2] =
            ["lobby_1", "office_1", "office_2"].map(|name| name.parse::<Room>().unwrap());
        let [floor, table_1, table_2, wall] = names;
        assert_eq!(of([wall, table_1, table_2, floor]), [(office_1, 30), (office_2, 70), (lobby, 0)].into());
        let null = vec![LabelId::NULL; mesh.faces().len()];
        assert!(wall_directions_deg(&mesh, &table, &null).is_empty());
    }
}
