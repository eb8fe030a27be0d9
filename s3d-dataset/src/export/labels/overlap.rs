//! Rooms that overlap. This is nearly always a mistake: an instance in another room's folder, or a room given
//! twice.

use crate::survey::annotated::SurveyedRoom;

/// Overlaps are reported above this share of the smaller room. Neighbours share a wall.
const MUCH: f64 = 0.2;

/// Returns a sentence for each pair of rooms of which one lies largely in the other.
pub(crate) fn overlap_doubts(rooms: &[SurveyedRoom]) -> Vec<String> {
    let mut doubts = Vec::new();
    for (i, a) in rooms.iter().enumerate() {
        for b in rooms.iter().skip(i + 1) {
            let (small, large) = if a.columns.len() <= b.columns.len() {
                (a, b)
            } else {
                (b, a)
            };

            let share = small.columns.share_in(&large.columns);
            if share > MUCH {
                doubts.push(format!(
                    "rooms {} and {} overlap: {:.0} % of the floor of {} is in {} too; a face there is of \
                     the room with the most points on it",
                    a.room,
                    b.room,
                    100.0 * share,
                    small.room,
                    large.room
                ));
            }
        }
    }
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::survey::columns::Columns;
    use glam::{Vec3, vec3};
    use s3d_geom::{Aabb, FootprintBuilder, FootprintOptions};

    /// A room of `w` × `d` × 2.5 m with a corner at `at`.
    fn room(name: &str, at: Vec3, w: f32, d: f32) -> SurveyedRoom {
        surveyed(name, slab(at, w, d).chain(slab(at + 2.5 * Vec3::Z, w, d)))
    }

    /// Points of a level surface of `w` × `d` m with a corner at `at`.
    fn slab(at: Vec3, w: f32, d: f32) -> impl Iterator<Item = Vec3> {
        let steps = || (0..=60u8).map(|i| f32::from(i) / 60.0);
        steps().flat_map(move |x| steps().map(move |y| at + vec3(w * x, d * y, 0.0)))
    }

    fn surveyed(name: &str, points: impl Iterator<Item = Vec3>) -> SurveyedRoom {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        let mut bbox = Aabb::EMPTY;
        for point in points {
            builder.add(point);
            bbox = bbox.union(Aabb { min: point, max: point });
        }
        SurveyedRoom {
            room: name.parse().unwrap(),
            points: 7442,
            footprint: builder.finish(),
            bbox,
            wall_direction_deg: 0,
            columns: Columns::of(&builder),
        }
    }

    /// Returns the doubts about an office of 6 × 4 m and another room.
    fn doubts(other: SurveyedRoom) -> Vec<String> {
        overlap_doubts(&[room("office_1", Vec3::ZERO, 6.0, 4.0), other])
    }

    #[test]
    fn rooms_in_one_another_are_told_and_neighbours_are_not() {
        // A wall in common, the floor above, far away.
        assert!(doubts(room("office_2", vec3(5.9, 0.0, 0.0), 3.0, 3.0)).is_empty());
        assert!(doubts(room("office_2", vec3(0.0, 0.0, 2.6), 6.0, 4.0)).is_empty());
        assert!(doubts(room("office_2", vec3(50.0, 0.0, 0.0), 6.0, 4.0)).is_empty());

        let found = doubts(room("lobby_2", vec3(3.0, 1.0, 0.1), 5.0, 2.0));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].contains("office_1 and lobby_2 overlap: 5") || found[0].contains("overlap: 6"),
            "{found:?}"
        );
        assert!(found[0].contains("% of the floor of lobby_2 is in office_1 too"), "{found:?}");

        let twice = doubts(room("office_7", Vec3::ZERO, 6.0, 4.0));
        assert!(twice[0].contains("overlap: 100 %"), "{twice:?}");
    }

    #[test]
    fn stairs_that_join_two_storeys_are_no_overlap() {
        // A hallway above the office; its stairs go down through a corner of the office.
        let above = vec3(0.0, 0.0, 2.8);
        let upper = slab(above, 6.0, 4.0).chain(slab(above + 2.5 * Vec3::Z, 6.0, 4.0));
        let hallway = surveyed("hallway_1", upper.chain(slab(Vec3::ZERO, 1.0, 3.0)));
        assert!(hallway.bbox.min.z == 0.0 && hallway.bbox.max.z > 5.0);
        assert!(doubts(hallway).is_empty());
    }
}
